#include "whirl/deploy/fmu.hpp"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>

#include "fmu_builder.hpp"
#include "template.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/unit.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/run_program.hpp"
#include "whirl/io/temporary.hpp"
#include "written.hpp"

namespace whirl::deploy {

std::vector<SourceFile> fmu_files(const ControllerDesign& design, const FmuOptions& options) {
  FmuOptions o = options;
  require_fmu(o);
  if (!o.co_simulation)
    throw Error("a sampled controller is a co-simulation FMU: it has no continuous states to exchange");
  o.model_exchange = false;
  const ControllerCode code = controller_code(design, o.code);
  FmuBuilder b(control::law_info(design.law).title +
               " with the estimator: " + control::estimator_info(design.estimator).title);
  b.block("INPUT", 5);
  b.add(fmu_real("x", "m", "measured displacement of the disk", "input", "discrete", "0"));
  b.add(fmu_real("y", "m", "measured displacement of the disk", "input", "discrete", "0"));
  b.add(fmu_real("beta", "rad", "rotor angle", "input", "discrete", "0"));
  b.add(fmu_real("omega", "rad/s", "rotor speed", "input", "discrete", "0"));
  b.add(fmu_real("omega_dot", "rad/s^2", "rotor acceleration", "input", "discrete", "0"));
  b.block("OUTPUT", 10);
  const std::pair<const char*, const char*> outputs[] = {{"ux", "force to apply"},
                                                         {"uy", "force to apply"},
                                                         {"requested_ux", "force before the limit"},
                                                         {"requested_uy", "force before the limit"},
                                                         {"s_x", "sliding variable"},
                                                         {"s_y", "sliding variable"},
                                                         {"x_estimate", "displacement estimated"},
                                                         {"y_estimate", "displacement estimated"},
                                                         {"vx_estimate", "velocity estimated"},
                                                         {"vy_estimate", "velocity estimated"}};
  for (const auto& [name, meaning] : outputs) {
    const std::string_view n = name;
    const char* const unit = n.find('u') == 0 || n.starts_with("req") ? "N"
                             : n.starts_with("s_") || n[0] == 'v'     ? "m/s"
                                                                      : "m";
    FmuVariable v = fmu_real(name, unit, meaning, "output", "discrete", "");
    v.depends.emplace();  // the sample was taken when the step began
    b.add(std::move(v));
  }
  b.block("PARAMETER", code.parameters.size());
  TemplateSettings s;
  s.features = {"CONTROLLER"};
  s.slots["fixed"] = std::to_string(b.parameters(code.parameters, "sample_time"));
  s.slots["states"] = s.slots["indicators"] = "0U";
  const auto flag = [&](const char* name, const char* meaning, FmuVariable::Type type) {
    FmuVariable v{name, "", meaning, "output", "discrete", "", type};
    v.depends.emplace();
    b.add(std::move(v));
  };
  b.block("BOOLEAN", 3);
  b.add({"valid", "", "the displacement sample is not lost", "input", "discrete", "true", FmuVariable::Type::boolean});
  flag("saturated", "the force limit acted", FmuVariable::Type::boolean);
  flag("held", "the sample was lost or not plausible", FmuVariable::Type::boolean);
  const bool supervised = control::resolve_parameters(design).at("supervise") > 0;
  b.block("INTEGER", supervised ? 2 : 1);
  flag("status", "0 fine, 2 stale sensor, 4 supervision, 5 gap: the force is then 0", FmuVariable::Type::integer);
  if (supervised) {
    s.features.insert("SUPERVISION");
    flag("supervision",
         "sum of steps taken: 1 adaptation frozen, 2 feedforward replaced, 4 gain lowered, 8 feedback off, 16 force "
         "off, 32 trip; of reasons: 256 growth, 512 feedforward's phase, 1024 unbalance changed, 2048 saturation, 4096 "
         "sensor lost, 8192 worse than open",
         FmuVariable::Type::integer);
  }
  b.description.step = design.sample_time;
  b.description.variable_step = false;
  return finish_fmu(b, o, std::move(s), "fmu_controller.c", code.header, code.source);
}

std::vector<SourceFile> fmu_files(const IdentifiedModel& model, const FmuOptions& options) {
  require_fmu(options);
  require_range("inner_step", options.inner_step, 1e-7, 1, "s");
  const ModelSystem system = with_names_for(Language::fmi, model_system(model));
  if (system.discrete)
    throw Error("the model is a map from sample to sample: it has no continuous time for an FMU, export c instead");
  const ModelCode code = model_code(system, options.code);
  FmuBuilder b(system.title);
  TemplateSettings s;
  s.features = {"PLANT"};
  s.slots["along"] = along_lines(system, options.code);
  std::map<std::string, std::size_t, std::less<>> reference{{"t", 0}};  // of time, inputs, states
  b.block("INPUT", system.inputs.size());
  for (const SystemVariable& v : system.inputs) reference.emplace(v.name, reference.size());
  for (const SystemVariable& v : system.states) reference.emplace(v.name, reference.size());
  const auto depends_on = [&](const expr::Expr& e) {
    std::vector<std::size_t> out;
    for (const std::string& name : expr::variables(e)) {
      if (const auto found = reference.find(name); found != reference.end()) out.push_back(found->second);
    }
    std::sort(out.begin(), out.end());
    return out;
  };
  for (const SystemVariable& v : system.inputs) b.add(fmu_real(v.name, v.unit, v.meaning, "input", "continuous", "0"));
  b.block("STATE", system.states.size());
  std::vector<int> states;
  std::string& nominals = s.slots["nominals"];
  for (const SystemVariable& v : system.states) {
    FmuVariable state = fmu_real(v.name, v.unit, v.meaning, "local", "continuous", "0");
    state.nominal = v.nominal > 0 ? v.nominal : 1;
    nominals += (nominals.empty() ? "" : ", ") + expr::number_text(state.nominal, true);
    states.push_back(b.add(std::move(state)));
  }
  b.block("RATE", system.states.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    const SystemVariable& v = system.states[i];
    FmuVariable rate = fmu_real(fmt::format("der({})", v.name),
                                v.unit == "1" ? "1/s" : (expr::Unit::parse(v.unit) / expr::Unit::parse("s")).str(),
                                "derivative", "local", "continuous", "");
    rate.derivative_of = states[i];
    rate.depends = depends_on(system.rates[i]);
    b.add(rate);
  }
  b.block("OUTPUT", system.outputs.size());
  for (std::size_t i = 0; i < system.outputs.size(); ++i) {
    const SystemVariable& v = system.outputs[i];
    FmuVariable output = fmu_real(v.name, v.unit, v.meaning, "output", "continuous", "");
    output.nominal = v.nominal;
    output.depends = depends_on(system.output_terms[i]);
    b.add(std::move(output));
  }
  std::vector<CodeParameter> parameters = system.parameters;
  parameters.push_back({"inner_step", "s", "step of the integration in co-simulation", options.inner_step, 1e-7, 1});
  b.block("PARAMETER", parameters.size());
  s.slots["fixed"] = std::to_string(b.parameters(parameters, "inner_step"));
  s.slots["inner"] = expr::number_text(options.inner_step, true);
  s.slots["states"] = fmt::format("{}U", system.states.size());
  s.slots["indicators"] = fmt::format("{}U", system.events.size());
  if (!system.events.empty()) {
    s.features.insert("EVENTS");
    b.block("EVENT", system.events.size());
    for (std::size_t i = 0; i < system.events.size(); ++i) {
      FmuVariable v = fmu_real(fmt::format("event_{}", i + 1), "", "zero crossing of " + system.events[i].str(),
                               "local", "continuous", "");
      v.event = true;
      b.add(v);
    }
  }
  s.slots["aged"] = angle_lines(system);
  b.description.step = options.inner_step;
  b.description.directional = true;
  return finish_fmu(b, options, std::move(s), "fmu_plant.c", code.header, code.source);
}

namespace {

/// Symbols of the mathematical library as they were in 2002, so that the binary also loads where the system is old. The
/// newer ones differ in errno and wrapper only. Not for the sources: another compiler may know another library.
constexpr std::string_view kOldGlibc = R"(#include <features.h>
#if defined(__GLIBC__)
#if defined(__x86_64__)
#define OLD(name) __asm__(".symver " #name "," #name "@GLIBC_2.2.5");
#else
#define OLD(name) __asm__(".symver " #name "," #name "@GLIBC_2.17");
#endif
OLD(exp) OLD(exp2) OLD(log) OLD(log2) OLD(pow) OLD(hypot) OLD(fmod)
OLD(expf) OLD(exp2f) OLD(logf) OLD(log2f) OLD(powf) OLD(hypotf) OLD(fmodf)
#undef OLD
#endif
)";

/// A kind of machine that may load an FMU; this one first.
struct Platform {
  const char *in_fmi2, *in_fmi3, *compiler, *flags, *ending;
};
constexpr std::array<Platform, 3> kPlatforms{
    {{"linux64", "x86_64-linux", "cc", "-include ../old_glibc.h -fPIC -fvisibility=hidden", ".so"},
     // The time of the build stays out, so that the bytes are the same twice.
     {"win64", "x86_64-windows", "x86_64-w64-mingw32-gcc", "-static-libgcc -Wl,--no-insert-timestamp", ".dll"},
     {"aarch64-linux", "aarch64-linux", "aarch64-linux-gnu-gcc", "-include ../old_glibc.h -fPIC -fvisibility=hidden",
      ".so"}}};

/// The files as one ZIP, in memory.
std::string zipped(const std::vector<SourceFile>& files, const std::string& name) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* const memory = zip_source_buffer_create(nullptr, 0, 0, &error);
  zip_t* const zip = memory == nullptr ? nullptr : zip_open_from_source(memory, ZIP_TRUNCATE, &error);
  struct Free {
    zip_source_t* source;
    ~Free() { zip_source_free(source); }
  } const release{memory};
  const auto fail = [&](zip_t* open, const char* why) {
    const std::string text = fmt::format("{}: cannot be packed: {}", name, why);
    if (open != nullptr) zip_discard(open);
    throw Error(text);
  };
  if (zip == nullptr) fail(nullptr, zip_error_strerror(&error));
  zip_source_keep(memory);                      // zip_close gives its own hold away
  constexpr time_t kEpoch = 315532800 + 86400;  // 1980, the first year a ZIP file knows: the same bytes every time
  for (const SourceFile& f : files) {
    zip_source_t* const source = zip_source_buffer(zip, f.text.data(), f.text.size(), 0);
    const zip_int64_t index = source == nullptr ? -1 : zip_file_add(zip, f.name.c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
      zip_source_free(source);
      fail(zip, zip_strerror(zip));
    }
    zip_file_set_mtime(zip, static_cast<zip_uint64_t>(index), kEpoch, 0);
  }
  if (zip_close(zip) != 0) fail(zip, zip_strerror(zip));
  zip_stat_t size;
  zip_stat_init(&size);
  if (zip_source_stat(memory, &size) != 0 || zip_source_open(memory) != 0) fail(nullptr, "no memory");
  std::string bytes(size.size, '\0');
  const zip_int64_t got = zip_source_read(memory, bytes.data(), bytes.size());
  zip_source_close(memory);
  if (got != static_cast<zip_int64_t>(bytes.size())) fail(nullptr, "no memory");
  return bytes;
}

}  // namespace

std::vector<std::string> pack_fmu(const std::vector<SourceFile>& files, const FmuOptions& options,
                                  const std::filesystem::path& path) {
  const std::string& id = options.code.prefix;
  io::ByteSink sink(path);  // a place that cannot be written is told before the compiler starts
  const io::TemporaryFolder temporary("fmu");
  const std::string folder = temporary.path().string();
  io::write_files(folder, files);
  io::write_text(temporary.path() / "old_glibc.h", kOldGlibc);
  std::vector<SourceFile> all = files;
  std::vector<std::string> platforms;
  for (const Platform& p : kPlatforms) {
    const bool ours = &p == kPlatforms.data();
    if (!ours &&
        (!options.all_platforms || io::run_program({"sh", "-c", fmt::format("command -v {}", p.compiler)}) != 0))
      continue;
    const std::string name = std::string(options.version == 2 ? p.in_fmi2 : p.in_fmi3), binary = id + p.ending;
    const std::string command =
        fmt::format("cd '{}/sources' && {} {} -std=c99 -O2 -shared -o '../{}' {}.c {}_fmu.c -lm 2>../cc.log", folder,
                    p.compiler, p.flags, binary, id, id);
    if (io::run_program({"sh", "-c", command}) != 0) {
      std::ifstream log(std::filesystem::path(folder) / "cc.log");
      std::string first;
      std::getline(log, first);
      throw Error(fmt::format("the C compiler '{}', which builds the binary of an FMU, did not succeed: {}", p.compiler,
                              first));
    }
    all.push_back({fmt::format("binaries/{}/{}", name, binary), io::read_text(temporary.path() / binary)});
    platforms.push_back(name);
  }
  sink.write(zipped(all, path.string()));
  sink.close();
  return platforms;
}

}  // namespace whirl::deploy
