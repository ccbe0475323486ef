#include <fmt/ranges.h>

#include <filesystem>

#include "command.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/deploy/cortex_m4f.hpp"
#include "whirl/deploy/fmu.hpp"
#include "whirl/deploy/languages.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/hash.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/output.hpp"
#include "whirl/shaft/control/control_json.hpp"

namespace whirl::app {
namespace {

struct ExportOptions {
  std::string form, file, out, prefix, type, target;
  bool single = false;
  int fmi = 2;
  double inner_step_ms = 1, mass_kg = 0;
};

deploy::FmuOptions fmu_options(const ExportOptions& o, const deploy::CodeOptions& code, bool controller) {
  deploy::FmuOptions f;
  f.code = code;
  f.version = o.fmi;
  const std::string type = o.type.empty() ? (controller ? "cs" : "both") : o.type;
  f.co_simulation = type != "me";
  f.model_exchange = type != "cs";
  f.inner_step = 1e-3 * o.inner_step_ms;
  f.all_platforms = true;
  return f;
}

template <class T>
std::vector<std::string> write(const Session& session, const ExportOptions& o, const T& value,
                               const deploy::CodeOptions& code) {
  const std::filesystem::path folder = o.out;
  std::vector<std::string> written;
  if (o.form == "fmu") {
    session.check_output(folder / (code.prefix + ".fmu"));
    const deploy::FmuOptions f = fmu_options(o, code, !std::is_same_v<T, IdentifiedModel>);
    // What is refused leaves no folder.
    const std::vector<deploy::SourceFile> files = deploy::fmu_files(value, f);
    io::make_folder(folder);
    written.push_back((folder / (code.prefix + ".fmu")).string());
    session.say(fmt::format("binaries for {}", fmt::join(deploy::pack_fmu(files, f, written.front()), ", ")));
    return written;
  }
  const std::vector<deploy::SourceFile> files = deploy::source_files(value, o.form, code);
  for (const deploy::SourceFile& f : files) session.check_output(folder / f.name, "text");
  for (const std::filesystem::path& path : io::write_files(folder, files)) written.push_back(path.string());
  return written;
}

/// Cost of a step on the target, printed; null without --target.
io::Json target_cost(const Session& session, const ExportOptions& o, const ControllerDesign& design) {
  if (o.target.empty()) return {};
  if (o.form != "c") throw Error("--target belongs to the form c, not " + o.form);
  const deploy::StepCost c = deploy::cortex_m4f_cost(design);
  const double ratio = static_cast<double>(c.worst) / static_cast<double>(c.mean);
  session.say(fmt::format(
      "{}: {} instructions a step, worst {} ({:.2f} times the mean); stack {} bytes, flash {} bytes with the "
      "mathematical functions, state {} bytes",
      o.target, c.mean, c.worst, ratio, c.stack, c.flash, c.state));
  return io::Json::object()
      .set("name", o.target)
      .set("mean", static_cast<double>(c.mean))
      .set("worst", static_cast<double>(c.worst))
      .set("stack", static_cast<double>(c.stack))
      .set("flash", static_cast<double>(c.flash))
      .set("state", static_cast<double>(c.state));
}

void require_no_target(const ExportOptions& o) {
  if (!o.target.empty()) throw Error("--target counts the steps of a controller; this is a model");
}

IdentifiedModel model_to_export(const io::Json& document, const ExportOptions& o, Summary& summary) {
  require_no_target(o);
  auto model = io::from_json<IdentifiedModel>(document, o.file);
  if (o.mass_kg > 0) {
    if (!model.rotor) throw Error(o.file + ": --mass-kg belongs to a rotor; this model has no rotor parameters");
    model.rotor->gain = 1 / o.mass_kg;
  }
  take_parts(identification::Consumer::export_model, model, summary, o.file);
  return model;
}

shaft::RotorController rotor_controller(const ExportOptions& o) {
  if (o.mass_kg > 0) throw Error("--mass-kg belongs to a model; this is a controller");
  if (!o.target.empty() || o.single) throw Error("--target and --float belong to a controller of `whirl design`");
  return shaft::load_rotor_controller(o.file);
}

/// What to do with the files, in one line.
std::string next_step(const ExportOptions& o, const deploy::CodeOptions& code, bool rotor_controller) {
  if (o.form == "c" && rotor_controller) return "";
  if (o.form == "c") return fmt::format("self-test: make -C {} check", o.out);
  if (o.form == "fmu") return "import the .fmu in any tool of FMI " + std::to_string(o.fmi) + ".0";
  if (o.form == "sfunction") return fmt::format("build in MATLAB: mex {0}_sfun.c {0}.c", code.prefix);
  if (o.form == "python")
    return fmt::format("python3 -c 'import sys; sys.path.insert(0, \"{}\"); import {}'", o.out, code.prefix);
  return "";
}

}  // namespace

void add_export(CommandLine& app, Session& session) {
  auto o = std::make_shared<ExportOptions>();
  CommandLine* sub = add_command(
      app, session, "export", "A controller or model as C99, FMU or for other tools",
      "Forms:\n"
      "  c          one .c/.h pair in C99: no allocation, no input or output, no globals; all numbers adjustable in a "
      "struct;\n"
      "             a self-test with golden vectors, CMakeLists.txt and Makefile\n"
      "  fmu        Functional Mock-up Unit with sources and a binary for Linux on x86-64 (needs the C compiler "
      "`cc`), and for\n"
      "             Windows (x86_64-w64-mingw32-gcc) and aarch64 (aarch64-linux-gnu-gcc) where these are installed:\n"
      "             a controller for co-simulation, a model also for model exchange with sgn() as state events\n"
      "  python     model: rates(t, state, inputs, p); controller: the C99 source called through ctypes\n"
      "  matlab     model: a MATLAB/Octave function for ode45; controller: the C99 source with a MEX function\n"
      "  sfunction  the C99 source with a Simulink S-function (level 2, C)\n"
      "  modelica   a model\n"
      "  latex      equations and numbers\n"
      "Input: controller.json of `whirl design`, or of `whirl rotor control` (c, fmu), or model.json of `whirl "
      "identify`. A model identified as a rotor has "
      "inputs beta\n"
      "(rad), omega (rad/s), alpha (rad/s^2), ux, uy (N) and the displacement x, y (m) as outputs; give --mass-kg so "
      "that forces\n"
      "act. Every other model is exported with the equations as found. SI units everywhere; see docs/export.md.\n\n"
      "Example: whirl export c controller.json --out drive --prefix drive && make -C drive check",
      [o, &session] {
        deploy::CodeOptions code;
        code.prefix = o->prefix.empty() ? deploy::prefix_of(o->file) : o->prefix;
        code.single_precision = o->single || !o->target.empty();
        code.origin = io::input_record(o->file);
        if (o->out.empty()) o->out = code.prefix + "_" + o->form;
        const io::Json document = io::load_json(o->file);
        const io::Json* schema = document.find("schema");
        const std::string* name = schema == nullptr ? nullptr : schema->get<std::string>();
        const bool of_rotor = name != nullptr && name->starts_with("whirl.rotor_controller/");
        std::vector<std::string> written;
        io::Json target;
        Summary summary;
        if (name != nullptr && name->starts_with("whirl.controller/")) {
          if (o->mass_kg > 0) throw Error("--mass-kg belongs to a model; the gain of a controller is in its file");
          const auto design = io::from_json<ControllerDesign>(document, o->file);
          target = target_cost(session, *o, design);
          written = write(session, *o, design, code);
        } else if (of_rotor) {
          written = write(session, *o, rotor_controller(*o), code);
        } else {
          const IdentifiedModel model = model_to_export(document, *o, summary);
          written = write(session, *o, model, code);
        }
        io::Json files = io::Json::array();
        for (const std::string& path : written) session.say(path), files.push(path);
        if (const std::string next = next_step(*o, code, of_rotor); !next.empty()) session.say(next);
        io::Json result =
            io::Json::object().set("form", o->form).set("prefix", code.prefix).set("files", std::move(files));
        if (!o->target.empty()) result.set("target", std::move(target));
        result.set("summary", to_json(summary));
        session.result(std::move(result));
        session.finish(summary);
      });
  sub->add_option("FORM", o->form, "c, fmu, python, matlab, sfunction, modelica or latex")
      ->required()
      ->one_of({"c", "fmu", "python", "matlab", "sfunction", "modelica", "latex"});
  sub->add_option("FILE", o->file, "controller.json or model.json")->input()->required();
  sub->add_option("--out", o->out, "folder to write into; default PREFIX_FORM")->output_folder();
  sub->add_option("--prefix", o->prefix,
                  "of every file, type and function, and name of the FMU; default: from the file's name");
  sub->add_flag("--float", o->single, "single precision");
  sub->add_option(
         "--target", o->target,
         "form c of a controller, single precision: compiles it for this processor, runs it in an emulator and "
         "prints instructions of a step (mean, worst), stack and flash (gcc-arm-none-eabi, qemu-system-arm)")
      ->one_of({"cortex-m4f"});
  sub->add_option("--fmi", o->fmi, "version of the FMI standard, 2 or 3")->one_of_numbers({2, 3})->show_default();
  sub->add_option("--type", o->type, "of an FMU: cs (co-simulation), me (model exchange) or both; default all there is")
      ->one_of({"cs", "me", "both"});
  sub->add_option("--inner-step-ms", o->inner_step_ms, "integration step of a model FMU in co-simulation (1)")
      ->range(1e-3, 1e3);
  sub->add_option("--mass-kg", o->mass_kg, "mass of the disk, for a model without input gain")->positive();
}

}  // namespace whirl::app
