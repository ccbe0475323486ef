// `whirl design`: controller.json, whirl.plant and rig.toml. Oracles: a controller that can be made gives finite forces
// within its limit; a rig is written and read back unchanged, and in other units of the same quantities it is the same.
#include <cmath>
#include <string>

#include "harness.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/rig/fields.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/tuning/plant_file.hpp"

namespace {

using namespace whirl;

void controller(const io::Json& document) {
  const auto design = io::from_json<ControllerDesign>(document, "fuzz.json");
  control::Controller c = control::make_controller(design);
  for (int k = 0; k < 50; ++k) {
    Measurement m;
    m.valid = k % 7 != 3;
    m.t = 1e-3 * k;
    m.x = 1e-4 * std::cos(0.06 * k), m.y = 1e-4 * std::sin(0.06 * k);
    m.beta = 0.06 * k, m.omega = 60;
    const auto command = c.step(m);
    if (!command) break;
    const double limit = design.force_limit > 0 ? design.force_limit * (1 + 1e-9) : INFINITY;
    fuzz::require(std::abs(command->ux) <= limit && std::abs(command->uy) <= limit);
  }
}

void plant(const io::Json& document) {
  if (!tuning::is_plant(document)) return;
  const tuning::LinearPlant p = tuning::read_plant(document, "fuzz.json");
  fuzz::require(std::isfinite(p.rotor.k1) && std::isfinite(p.rotor.c) && p.rotor.gain > 0);
  for (const rig::RigMode& m : p.structure) fuzz::require(std::isfinite(m.frequency) && m.damping_ratio > 0);
}

rig::RigParameters rig_of(std::string_view text, const char* name) {
  rig::RigParameters parameters;
  const io::Settings settings = io::parse_settings(text, name);
  io::apply(settings, parameters);
  settings.finish();
  parameters.check();
  return parameters;
}

void rig_file(std::string_view bytes) {
  const std::string once = rig::rig_toml(rig_of(bytes, "fuzz.toml"));
  fuzz::require(rig::rig_toml(rig_of(once, "once")) == once);
  // Millimetres as micrometres: the key says so, and nothing else changes.
  std::string other;
  for (std::size_t from = 0; from < once.size();) {
    const std::size_t end = std::min(once.find('\n', from), once.size() - 1) + 1;
    const std::string line = once.substr(from, end - from);
    const std::size_t equals = line.find("_mm = ");
    from = end;
    other += equals == std::string::npos
                 ? line
                 : line.substr(0, equals) + "_um = " + line.substr(equals + 6, line.size() - equals - 7) + "e3\n";
  }
  if (other.find("e+") != std::string::npos || other.find("e-") != std::string::npos) return;
  const rig::RigParameters a = rig_of(once, "once"), b = rig_of(other, "once in um");
  fuzz::require(std::abs(a.laser.range - b.laser.range) <= 1e-12 * std::abs(a.laser.range));
  fuzz::require(std::abs(a.rotor.mass - b.rotor.mass) == 0);
}

}  // namespace

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    if (!bytes.starts_with("{")) return rig_file(bytes);
    const io::Json document = io::parse_json(bytes, "fuzz.json");
    only_errors([&] { controller(document); });
    only_errors([&] { plant(document); });
  });
}
