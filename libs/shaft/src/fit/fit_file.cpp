#include "fit/fit_file.hpp"

#include <fmt/format.h>

namespace whirl::shaft {
namespace {

using io::Settings;
using Q = Quantity;

OverSpeed over_speed(const Settings& s, const char* key) {
  const std::string word = s.text(key, "constant", {"known", "constant", "linear", "table"});
  return word == "known"    ? OverSpeed::known
         : word == "linear" ? OverSpeed::linear
         : word == "table"  ? OverSpeed::table
                            : OverSpeed::constant;
}

double percent(const Settings& s, const char* key) { return 0.01 * s.number(key, Q::dimensionless, 0, 0, 50); }

}  // namespace

FitSetup read_fit_setup(const Settings& s, const Rotor& rotor) {
  FitSetup f;
  f.stiffness = over_speed(s, "fit.stiffness");
  f.damping = over_speed(s, "fit.damping");
  f.supports = s.texts("fit.supports", {});
  f.axes_alike = s.flag("fit.axes_alike", false);
  f.cross_coupling = s.flag("fit.cross_coupling", false);
  f.material_damping = s.flag("fit.material_damping", true);
  f.joint_damping = s.flag("fit.joint_damping", false);
  f.bow = s.flag("fit.bow", false);
  f.tolerance.youngs_modulus = percent(s, "fit.tolerance.youngs_modulus_percent");
  f.tolerance.diameter = percent(s, "fit.tolerance.diameter_percent");
  f.tolerance.disc_mass = percent(s, "fit.tolerance.disc_mass_percent");
  f.tolerance.probe_gain = percent(s, "fit.tolerance.probe_gain_percent");
  f.tolerance.disc_position = s.number("fit.tolerance.disc_position", Q::displacement, 0, 0, 0.1 * rotor.length());
  for (std::size_t k = 0; k < s.count("trial"); ++k) {
    const std::string at = fmt::format("trial[{}].", k);
    Trial t;
    t.run = s.text(at + "run", "");
    if (t.run.empty()) throw s.error(at + "run", "the name of the run's file, without its ending, is needed");
    t.position = s.require_number(at + "position", Q::displacement, 0, rotor.length() * (1 + 1e-9));
    t.size = s.require_number(at + "mass", Q::mass, 0) * s.require_number(at + "radius", Q::displacement, 0);
    t.angle = s.number(at + "angle", Q::angle, 0);
    f.trials.push_back(std::move(t));
  }
  return f;
}

}  // namespace whirl::shaft
