#include "whirl/deploy/fmu_plant.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <zip.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <pugixml.hpp>
#include <vector>

#include "fmi2.h"
#include "fmi3.h"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/output.hpp"
#include "whirl/io/temporary.hpp"

namespace whirl::deploy {
namespace {

void unpack(const std::filesystem::path& file, const std::filesystem::path& folder) {
  constexpr zip_uint64_t kLimit = 1u << 30;
  zip_t* const zip = zip_open(file.c_str(), ZIP_RDONLY, nullptr);
  if (zip == nullptr) throw Error::in_file(file.string(), 0, "no FMU: not a ZIP file, or it cannot be read");
  const struct Close {
    zip_t* zip;
    ~Close() { zip_discard(zip); }
  } close{zip};
  zip_uint64_t total = 0;
  for (zip_int64_t i = 0; i < zip_get_num_entries(zip, 0); ++i) {
    zip_stat_t info;
    const bool known = zip_stat_index(zip, static_cast<zip_uint64_t>(i), 0, &info) == 0;
    const std::filesystem::path name = known ? info.name : "";
    bool outside = !known || name.is_absolute();
    for (const auto& part : name) outside = outside || part == "..";
    total += known ? info.size : 0;
    if (outside || total > kLimit)
      throw Error::in_file(file.string(), 0, "no FMU: an entry leaves its folder, or more than 1 GiB");
    if (name.filename().empty()) continue;  // a folder
    io::make_folder((folder / name).parent_path());
    std::string bytes(info.size, '\0');
    zip_file_t* const entry = zip_fopen_index(zip, static_cast<zip_uint64_t>(i), 0);
    const bool read =
        entry != nullptr && zip_fread(entry, bytes.data(), bytes.size()) == static_cast<zip_int64_t>(bytes.size());
    if (entry != nullptr) zip_fclose(entry);
    if (!read) throw Error::in_file(file.string(), 0, fmt::format("entry {} is damaged", name.string()));
    io::write_text(folder / name, bytes);
  }
}

// The messages of an FMU are not shown: a refused step is reported by the loop.
void quiet2(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...) {}
void quiet3(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String) {}
const fmi2CallbackFunctions kCallbacks{quiet2, std::calloc, std::free, nullptr, nullptr};

/// Value references of an FMU's variables, by role.
class Variables {
 public:
  Variables(const pugi::xml_node& root, const std::filesystem::path& fmu, const FmuPlantOptions& options)
      : fmu_(fmu), names_(options.names) {
    for (const pugi::xml_node v : root.child("ModelVariables").children()) {
      reference_[v.attribute("name").value()] = v.attribute("valueReference").as_uint();
    }
    for (const auto& [role, name] : names_) {
      if (role != "x" && role != "y" && role != "ux" && role != "uy" && role != "beta" && role != "omega" &&
          role != "alpha") {
        throw Error::in_field("role", role, "one of x, y, ux, uy, beta, omega, alpha");
      }
    }
  }
  /// That named in the options, else one of the usual names; null when there is none.
  const unsigned* find(const std::string& role, std::initializer_list<const char*> usual) const {
    if (const auto given = names_.find(role); given != names_.end()) {
      const auto found = reference_.find(given->second);
      if (found == reference_.end()) throw refuse(fmt::format("no variable {} for {}", given->second, role));
      return &found->second;
    }
    for (const char* name : usual) {
      if (const auto found = reference_.find(name); found != reference_.end()) return &found->second;
    }
    return nullptr;
  }
  unsigned need(const std::string& role, std::initializer_list<const char*> usual) const {
    const unsigned* found = find(role, usual);
    if (found == nullptr) throw refuse(fmt::format("no variable for {}: name it, e.g. {}=rotor.{}", role, role, role));
    return *found;
  }

 private:
  Error refuse(const std::string& why) const { return Error::in_file(fmu_.string(), 0, why); }
  const std::filesystem::path& fmu_;
  const decltype(FmuPlantOptions::names)& names_;
  std::map<std::string, unsigned> reference_;
};

}  // namespace

struct FmuPlant::State {
  io::TemporaryFolder folder{"fmu"};
  void* library = nullptr;
  void* component = nullptr;
  bool three = false, failed = false;
  FmuPlantOptions options;
  rotor::AngleFunction angle{rotor::SpeedProfile{}};
  long tick = 0;
  unsigned x = 0, y = 0;
  std::vector<unsigned> inputs;  ///< ux, uy, then those of the angle that there are
  std::vector<double> values;    ///< of the inputs
  std::vector<int> angle_of;     ///< 0 beta, 1 omega, 2 alpha for inputs[2...]
  double reading[2] = {0, 0};
  std::vector<Command> late;  ///< commands on their way, the oldest at tick % size

  // Functions of the binary.
  decltype(fmi2OK) (*set2)(void*, const unsigned*, std::size_t, const double*) = nullptr;
  decltype(fmi2OK) (*get2)(void*, const unsigned*, std::size_t, double*) = nullptr;
  decltype(fmi2OK) (*step2)(void*, double, double, int) = nullptr;
  fmi3Status (*set3)(void*, const unsigned*, std::size_t, const double*, std::size_t) = nullptr;
  fmi3Status (*get3)(void*, const unsigned*, std::size_t, double*, std::size_t) = nullptr;
  fmi3Status (*step3)(void*, double, double, bool, bool*, bool*, bool*, double*) = nullptr;
  void (*free_instance)(void*) = nullptr;

  ~State() {
    if (component != nullptr) free_instance(component);
    if (library != nullptr) dlclose(library);
  }

  template <class Function>
  void load(Function*& to, const char* name) const {
    to = reinterpret_cast<Function*>(dlsym(library, name));
    if (to == nullptr) throw Error(fmt::format("the binary of the FMU has no function {}", name));
  }

  void set_angle() noexcept {
    const rotor::AngleState a = angle(options.sample_time * static_cast<double>(tick));
    const double parts[] = {a.beta, a.omega, a.alpha};
    for (std::size_t i = 0; i < angle_of.size(); ++i) values[i + 2] = parts[angle_of[i]];
  }
  bool set_inputs() noexcept {
    return three ? set3(component, inputs.data(), inputs.size(), values.data(), values.size()) <= fmi3Warning
                 : set2(component, inputs.data(), inputs.size(), values.data()) <= fmi2Warning;
  }
  /// Instance, initialization and the first inputs; false when the FMU refuses.
  bool start3(const char* token, const std::string& resources) {
    fmi3Instance (*instantiate)(fmi3String, fmi3String, fmi3String, bool, bool, bool, bool, const unsigned*,
                                std::size_t, void*, fmi3LogMessageCallback, fmi3IntermediateUpdateCallback);
    fmi3Status (*enter)(void*, bool, double, double, bool, double);
    fmi3Status (*leave)(void*);
    load(instantiate, "fmi3InstantiateCoSimulation"), load(enter, "fmi3EnterInitializationMode");
    load(leave, "fmi3ExitInitializationMode"), load(free_instance, "fmi3FreeInstance");
    load(set3, "fmi3SetFloat64"), load(get3, "fmi3GetFloat64"), load(step3, "fmi3DoStep");
    component = instantiate("plant", token, (resources + "/").c_str(), false, false, false, false, nullptr, 0, nullptr,
                            quiet3, nullptr);
    return component != nullptr && enter(component, false, 0, 0, false, 0) <= fmi3Warning && set_inputs() &&
           leave(component) <= fmi3Warning;
  }
  bool start2(const char* token, const std::string& resources) {
    fmi2Component (*instantiate)(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions*, int, int);
    fmi2Status (*setup)(void*, int, double, double, int, double);
    fmi2Status (*enter)(void*);
    fmi2Status (*leave)(void*);
    load(instantiate, "fmi2Instantiate"), load(setup, "fmi2SetupExperiment"),
        load(enter, "fmi2EnterInitializationMode");
    load(leave, "fmi2ExitInitializationMode"), load(free_instance, "fmi2FreeInstance");
    load(set2, "fmi2SetReal"), load(get2, "fmi2GetReal"), load(step2, "fmi2DoStep");
    component = instantiate("plant", fmi2CoSimulation, token, ("file://" + resources).c_str(), &kCallbacks, 0, 0);
    return component != nullptr && setup(component, 0, 0, 0, 0, 0) <= fmi2Warning && enter(component) <= fmi2Warning &&
           set_inputs() && leave(component) <= fmi2Warning;
  }
  void take_reading() noexcept {
    const unsigned references[] = {x, y};
    const bool ok = three ? get3(component, references, 2, reading, 2) <= fmi3Warning
                          : get2(component, references, 2, reading) <= fmi2Warning;
    failed = failed || !ok;
  }
};

FmuPlant::FmuPlant(const std::filesystem::path& fmu, const FmuPlantOptions& options)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  options.profile.check();
  require_range("sample_time", options.sample_time, 1e-6, 1, "s");
  require_range("delay_samples", options.delay_samples, 0, 1000);
  s.options = options;
  s.late.resize(static_cast<std::size_t>(options.delay_samples));
  s.angle = rotor::AngleFunction(options.profile);
  unpack(fmu, s.folder.path().string());
  const auto refuse = [&](const std::string& why) { return Error::in_file(fmu.string(), 0, why); };

  pugi::xml_document xml;
  if (!xml.load_file((s.folder.path().string() + "/modelDescription.xml").c_str()))
    throw refuse("no FMU: modelDescription.xml is missing or damaged");
  const pugi::xml_node root = xml.child("fmiModelDescription"), kind = root.child("CoSimulation");
  const std::string version = root.attribute("fmiVersion").value();
  if (version != "2.0" && !version.starts_with("3."))
    throw refuse(fmt::format("fmiVersion '{}': must be 2.0 or 3.0", version));
  s.three = version != "2.0";
  if (!kind) throw refuse("the FMU has no co-simulation");
  const Variables variables(root, fmu, options);
  s.x = variables.need("x", {"x_sensor", "x"});
  s.y = variables.need("y", {"y_sensor", "y"});
  s.inputs = {variables.need("ux", {"ux"}), variables.need("uy", {"uy"})};
  constexpr const char* kAngle[] = {"beta", "omega", "alpha"};
  for (int i = 0; i < 3; ++i) {
    if (const unsigned* found = variables.find(kAngle[i], {kAngle[i]})) {
      s.inputs.push_back(*found);
      s.angle_of.push_back(i);
    }
  }
  s.values.assign(s.inputs.size(), 0.0);

  const std::string id = kind.attribute("modelIdentifier").value();
  const std::string binary =
      fmt::format("{}/binaries/{}/{}.so", s.folder.path().string(), s.three ? "x86_64-linux" : "linux64", id);
  s.library = dlopen(binary.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (s.library == nullptr) throw refuse("no binary for Linux on x86-64 that can be loaded");
  const std::string resources = s.folder.path().string() + "/resources";
  const char* const token = root.attribute(s.three ? "instantiationToken" : "guid").value();
  s.set_angle();
  const bool ready = s.three ? s.start3(token, resources) : s.start2(token, resources);
  if (!ready) throw refuse("the FMU refused its initialization");
  s.take_reading();
  if (s.failed) throw refuse("the FMU gives no displacement");
}

FmuPlant::~FmuPlant() = default;

Measurement FmuPlant::read() const noexcept {
  const State& s = *state_;
  Measurement m;
  m.t = s.options.sample_time * static_cast<double>(s.tick);
  const rotor::AngleState a = s.angle(m.t);
  m.x = s.reading[0];
  m.y = s.reading[1];
  m.beta = a.beta;
  m.omega = a.omega;
  m.omega_dot = a.alpha;
  m.valid = !s.failed;
  return m;
}

void FmuPlant::write(const Command& command) noexcept {
  State& s = *state_;
  Command acting = command;
  if (!s.late.empty()) std::swap(acting, s.late[static_cast<std::size_t>(s.tick) % s.late.size()]);
  s.values[0] = acting.ux;
  s.values[1] = acting.uy;
}

void FmuPlant::advance() noexcept {
  State& s = *state_;
  const double h = s.options.sample_time, t = h * static_cast<double>(s.tick);
  s.set_angle();
  bool event = false, terminate = false, early = false;
  double last = 0;
  const bool ok = !s.failed && s.set_inputs() &&
                  (s.three ? s.step3(s.component, t, h, true, &event, &terminate, &early, &last) <= fmi3Warning
                           : s.step2(s.component, t, h, 1) <= fmi2Warning);
  s.failed = !ok || terminate || early;
  ++s.tick;
  if (!s.failed) s.take_reading();
}

bool FmuPlant::failed() const noexcept { return state_->failed; }
long FmuPlant::ticks() const noexcept {
  return std::lround(state_->options.profile.duration() / state_->options.sample_time);
}
int FmuPlant::version() const noexcept { return state_->three ? 3 : 2; }

}  // namespace whirl::deploy
