#include "command.hpp"
#include "plant_options.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/pages/margins_report.hpp"
#include "whirl/report/document.hpp"

namespace whirl::app {

void add_margins(CommandLine& app, Session& session) {
  struct Options {
    PlantOptions plant;
    std::string controller;
    std::filesystem::path out;
    tuning::MarginOptions margins;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "margins", "Gain, phase, delay and modulus margin of the loop at every speed",
      "Input: controller.json, and the model.json it was designed on with --stiffness or --mass-kg, --modes, "
      "--hardware as "
      "in\n"
      "`whirl design`. The controller's own step is linearised about its synchronous orbit, with the noise of the "
      "sensors; "
      "both\n"
      "axes are one complex loop, with forward and backward whirl. Modes whose sign is not known are taken both ways.\n"
      "Output: table per plant with the peak sensitivity and its zone of ISO 14839-3, and the further delay of the "
      "controller\nas delivered, supervision included, with what limits it; --out DIR writes margins.json "
      "and\n"
      "report.html (Nyquist diagram, sensitivity). Fails (exit code 1) where the loop is not stable, its peak "
      "sensitivity\nis above 4 (zones C and D), its gain or phase margin is below what that forces (1.33 times up, 0.8 "
      "down, 14.4\ndegrees), or its delay margin is below half a sample.\n\n"
      "Example: whirl margins controller.json model.json --mass-kg 1.5 --modes modes.json",
      [o, &session] {
        if (!o->out.empty()) {
          session.check_output(o->out / "margins.json", "whirl.margins");
          session.check_output(o->out / "report.html");
        }
        tuning::DesignOptions d;
        std::vector<std::filesystem::path> inputs{o->controller};
        const IdentifiedModel model = o->plant.load(d, inputs, identification::Consumer::margins);
        if (!model.rotor) throw Error(o->plant.model + ": the model has no rotor parameters");
        const ControllerDesign design = io::load<ControllerDesign>(o->controller);
        std::vector<tuning::MarginStudy> studies = tuning::margin_studies(design, model, d, o->margins);
        for (const tuning::MarginStudy& s : studies) session.say(report::to_text(pages::margins_table(s, design)));
        const std::optional<tuning::DeliveredDelay> delivered = tuning::delivered_delay(design, studies, model, d);
        if (delivered) session.say(pages::delivered_text(*delivered));
        const Provenance from = io::provenance(inputs, session.command_line, o->margins.seed);
        Summary summary;
        tuning::state_parts(identification::Consumer::margins, model, d.hardware, summary);
        for (const tuning::MarginStudy& s : studies) {
          if (std::optional<Finding> missed = tuning::margin_failure(s.speeds, design)) {
            if (!s.plant.empty()) missed->where = "with " + s.plant + ", " + missed->where;
            summary.add(*missed);
          }
        }
        io::Json json = pages::to_json(studies);
        if (delivered) json.set("delivered", pages::to_json(*delivered));
        json.set("summary", to_json(summary)).set("provenance", to_json(from));
        if (!o->out.empty()) {
          io::make_folder(o->out);
          session.write_together();
          io::save_json(o->out / "margins.json", json);
          report::write_html(pages::margins_report(studies, design, from), o->out / "report.html", true);
          session.say("report: " + (o->out / "report.html").string());
        }
        session.result(json);
        session.finish(summary);
      });
  sub->add_option("CONTROLLER", o->controller, "controller.json")->input()->required();
  sub->add_option("MODEL", o->plant.model, "model.json, a plant file (whirl.plant, docs/formats.md) or an FMU")
      ->input()
      ->required();
  o->plant.add_to(sub);
  sub->add_option("--speeds", o->margins.speeds, "from standstill to the top of the profile")->show_default();
  sub->add_option("--seed", o->margins.seed, "of sensor noise and excitation")->show_default();
  sub->add_option("--threads", o->margins.threads, "0: all cores; the result does not depend on it")
      ->range(0, 1024)
      ->show_default();
  sub->add_option("--out", o->out, "folder for margins.json and report.html")->output_folder();
}

}  // namespace whirl::app
