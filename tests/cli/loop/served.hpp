// The rig as a process of its own, for tests of the loop over real wires.
#pragma once
#include <signal.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "../program.hpp"
#include "whirl/io/json.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/rig/parameters.hpp"
#include "whirl/testing/loop/await.hpp"

namespace whirl::testing {

// Three seconds through the resonance keep the tests short.
constexpr const char* kRig = "[profile]\nstart_rpm = 1200\nramp_s = 3\ndwell_end_s = 0.2\n";

/// What a designer knows of the default rig.
inline ControllerDesign pd_design() {
  const rig::RigParameters rig;
  ControllerDesign d;
  d.law = "pd";
  d.estimator = "lpf";
  d.model.k1 = rig.rotor.stiffness / rig.rotor.mass;
  d.model.c = rig.rotor.damping / rig.rotor.mass;
  d.model.gain = 1 / rig.rotor.mass;
  d.sample_time = 1 / rig.timing.rate;
  d.force_limit = rig.actuator.force_limit();
  d.feedforward = false;
  return d;
}

/// `whirl rig serve` in the background of a folder; its settings are there when this object is.
struct Served {
  Served(const Folder& f, const std::string& arguments) : folder(f) {
    std::filesystem::remove(folder / "io.toml");
    std::filesystem::remove(folder / "serve.json");
    const std::string command = "cd '" + (folder / "").string() + "' && { '" + program() +
                                "' rig serve --io io.toml --json " + arguments +
                                " >serve.part 2>serve.err & echo $! >serve.pid; wait $!; mv serve.part serve.json; } "
                                "</dev/null >/dev/null 2>&1 &";
    if (std::system(command.c_str()) != 0) std::abort();
    wait_for("io.toml");
  }
  ~Served() {
    if (!std::filesystem::exists(folder / "serve.json")) end();
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;
  /// Ends the rig before its profile is over; it still writes what happened.
  void end() const {
    ::kill(std::stoi(slurp(folder / "serve.pid")), SIGTERM);
    wait_for("serve.json");
  }
  /// Lets the loop wait long for a machine that does not run it: in lockstep the rig's time stands still meanwhile.
  void be_patient() const {
    std::string io = slurp(folder / "io.toml");
    const std::string key = "watchdog_ms = ";
    const std::size_t at = io.find(key);
    if (at == std::string::npos) throw std::runtime_error("io.toml without a watchdog");
    folder.write("io.toml", io.replace(at + key.size(), io.find('\n', at) - at - key.size(), "4000.0"));
  }
  void wait_for(const char* name) const {
    if (!await([&] { return std::filesystem::exists(folder / name); }))
      throw std::runtime_error(std::string(name) + " does not come: " + slurp(folder / "serve.err"));
  }
  io::Json result() const {
    wait_for("serve.json");
    return io::load_json(folder / "serve.json");
  }
  const Folder& folder;
};

}  // namespace whirl::testing
