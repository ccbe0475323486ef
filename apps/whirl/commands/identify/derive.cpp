#include "command.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/library_toml.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/lagrange/lagrange_file.hpp"
#include "whirl/lagrange/physical.hpp"
#include "whirl/pages/derivation.hpp"

namespace whirl::app {

void add_derive(CommandLine& app, Session& session) {
  struct Options {
    std::string file, out, model;
    bool latex = false;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "derive", "Equations of motion, candidate terms and ties from kinetic and potential energy",
      "Input: a TOML file with coordinates, kinetic and potential energy, Rayleigh function, forces, parameters with "
      "their SI\n"
      "units (and values where known), prescribed signals, symmetries (docs/formats.md, system.toml). x' is the rate "
      "of x:\n"
      "    coordinates = [\"x\"]\n"
      "    kinetic = \"m*x'^2/2\"\n"
      "    potential = \"k*x^2/2 + k3*x^4/4\"\n"
      "    parameters = {m = \"kg\", k = \"N/m\", k3 = \"N/m^3\"}\n"
      "Output: M q'' = h, the accelerations, and the unknowns of an identification, each with the terms that share "
      "it.\n"
      "--out writes these as a library for `whirl identify --library`. --model reads a model identified with it and "
      "gives the\n"
      "physical parameters back with 95 % intervals, and says which combinations a record cannot separate.\n\n"
      "Example: whirl derive rotor.toml --out library.toml\n"
      "         whirl identify rundown.csv --out model.json && whirl derive rotor.toml --model model.json",
      [o, &session] {
        const lagrange::LagrangeFile file = lagrange::read_lagrange_file(o->file);
        lagrange::LagrangeEquations eq;
        try {
          eq = lagrange::derive(file.problem);
        } catch (const Error& e) {
          throw Error::in_file(o->file, 0, e.what());
        }
        if (!o->out.empty()) {
          io::write_text(o->out,
                         io::to_toml(eq.library, {"Derived from " + std::filesystem::path(o->file).filename().string() +
                                                  (file.title.empty() ? "" : ": " + file.title)}));
        }
        session.say(o->latex ? pages::derivation_latex(eq) : pages::derivation_text(file, eq));
        io::Json document = pages::to_json(file, eq);
        std::vector<std::filesystem::path> inputs{o->file};
        Summary summary;
        if (!o->model.empty()) {
          const lagrange::UnknownEstimates unknowns =
              lagrange::unknown_estimates(io::load<IdentifiedModel>(o->model), eq.library);
          const lagrange::PhysicalParameters found =
              lagrange::physical_parameters(eq.library, unknowns, file.problem.parameters, file.report);
          session.say(pages::parameters_text(found));
          pages::add_parameters(document, found);
          inputs.emplace_back(o->model);
          summary = found.summary;
        }
        document.set("summary", to_json(summary));
        document.set("provenance", to_json(io::provenance(inputs, session.command_line)));
        session.result(document);
        session.finish(summary);
      });
  sub->add_option("FILE", o->file, "system (TOML)")->input()->required();
  sub->add_option("--out", o->out, "write the library as TOML")->output("settings");
  sub->add_option("--model", o->model, "identified model (JSON): give the physical parameters")->input();
  sub->add_flag("--latex", o->latex, "print the equations as LaTeX instead");
}

}  // namespace whirl::app
