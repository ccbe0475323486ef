#include <fmt/format.h>

#include <algorithm>

#include "whirl/core/angles.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {
namespace {

using Eigen::Matrix2d;

class RotorText {
 public:
  explicit RotorText(const Rotor& rotor) : r_(rotor) {}

  std::string write() {
    header();
    for (const Material& m : r_.materials) {
      open("material");
      text("name", m.name);
      number("youngs_modulus_Pa", m.youngs_modulus);
      number("shear_modulus_Pa", m.shear_modulus);
      number("density_kg_m3", m.density);
      number("damping_time_s", m.damping);
    }
    for (const Section& s : r_.sections) {
      open("section");
      number("length_m", s.length);
      number("outer_m", s.outer);
      number("outer_end_m", s.outer_end);
      number("inner_m", s.inner);
      number("inner_end_m", s.inner_end);
      text("material", r_.materials[s.material].name);
      if (s.elements > 0) line("elements", fmt::format("{}", s.elements));
    }
    for (const Disc& d : r_.discs) {
      open("disc");
      text("name", d.name);
      number("position_m", d.position);
      number("mass_kg", d.mass);
      number("transverse_kgm2", d.transverse);
      number("polar_kgm2", d.polar);
      number("offset_m", d.offset);
    }
    for (const Body& b : r_.bodies) {
      open("body");
      text("name", b.name);
      number("position_m", b.position);
      number("mass_kg", b.mass);
      number("transverse_kgm2", b.transverse);
    }
    for (const Support& s : r_.supports) support(s);
    excitation();
    return std::move(out_);
  }

 private:
  void open(const char* table) { out_ += fmt::format("\n[[{}]]\n", table); }
  void line(const char* key, const std::string& value) { out_ += fmt::format("{} = {}\n", key, value); }
  void number(const char* key, double value) { line(key, fmt::format("{:.15g}", value)); }
  void text(const char* key, const std::string& value) { line(key, io::toml_quoted(value)); }

  void header() {
    out_ = "[rotor]\n";
    text("name", r_.name);
    if (r_.vertical) line("vertical", "true");
    if (!r_.not_trusted.empty()) text("not_trusted", r_.not_trusted);
    switch (r_.shear.model) {
      case ShearModel::number:
        number("shear_coefficient", r_.shear.coefficient);
        break;
      case ShearModel::none:
        text("shear", "none");
        break;
      case ShearModel::cowper:
        text("shear", "cowper");
        break;
      case ShearModel::hutchinson:
        text("shear", "hutchinson");
        break;
    }
    text("element", r_.element == ElementKind::usual ? "usual" : "internal-node");
    line("elements", fmt::format("{}", r_.elements));
    number("axial_force_N", r_.axial_force);
  }

  void coefficients(const char* name, const char* unit, const std::vector<Matrix2d>& table) {
    const auto entry = [&](const char* axes, int i, int j) {
      const bool none = std::ranges::all_of(table, [&](const Matrix2d& m) { return m(i, j) == 0; });
      if (table.empty() || (none && i != j)) return;
      std::string values;
      for (const Matrix2d& m : table) values += (values.empty() ? "" : ", ") + fmt::format("{:.15g}", m(i, j));
      line(fmt::format("{}_{}_{}", name, axes, unit).c_str(), table.size() > 1 ? "[" + values + "]" : values);
    };
    entry("x", 0, 0);
    entry("y", 1, 1);
    entry("xy", 0, 1);
    entry("yx", 1, 0);
  }

  void support(const Support& s) {
    const bool bearing = s.a.part == "shaft" && s.b.position == s.a.position;
    const bool mount = s.a.part != "shaft" && s.a.part != "ground" && s.b.part == "ground";
    open(bearing ? "bearing" : mount ? "mount" : "spring");
    text("name", s.name);
    if (bearing) {
      number("position_m", s.a.position);
      text("on", s.b.part);
    } else if (mount) {
      number("position_m", s.a.position);
      text("body", s.a.part);
    } else {
      text("from", s.a.part);
      number("from_position_m", s.a.position);
      text("to", s.b.part);
      number("to_position_m", s.b.position);
    }
    if (s.law.stiffness.size() > 1) {
      std::string speeds;
      for (const double v : s.law.speeds) speeds += (speeds.empty() ? "" : ", ") + fmt::format("{:.15g}", v);
      line("speed_rad_s", "[" + speeds + "]");
    }
    coefficients("stiffness", "N_m", s.law.stiffness);
    coefficients("damping", "Ns_m", s.law.damping);
    coefficients("mass", "kg", s.law.mass);
    if (s.tilt_stiffness != 0) number("tilt_stiffness_Nm_rad", s.tilt_stiffness);
    if (s.tilt_damping != 0) number("tilt_damping_Nms_rad", s.tilt_damping);
  }

  void excitation() {
    for (const JointDamping& j : r_.joints) {
      open("joint");
      number("from_m", j.from);
      number("to_m", j.to);
      number("damping_Nms_rad", j.coefficient);
    }
    for (const Unbalance& u : r_.unbalances) {
      open("unbalance");
      number("position_m", u.position);
      if (u.end > u.position) number("end_m", u.end);
      number("size_gmm", 1e6 * u.size);
      number("angle_deg", u.angle / kRadPerDegree);
    }
    for (const BowPoint& b : r_.bow) {
      open("bow");
      number("position_m", b.position);
      number("size_m", b.size);
      number("angle_deg", b.angle / kRadPerDegree);
    }
    for (const Probe& p : r_.probes) {
      open("probe");
      text("name", p.name);
      number("position_m", p.position);
      number("angle_deg", p.angle / kRadPerDegree);
      if (p.runout == 0) continue;
      number("runout_m", p.runout);
      number("runout_angle_deg", p.runout_angle / kRadPerDegree);
    }
    for (const Actuator& a : r_.actuators) {
      open("actuator");
      text("name", a.name);
      text("on", a.a.part);
      text("against", a.b.part);
      number("position_m", a.a.position);
      number("angle_deg", a.angle / kRadPerDegree);
      number("force_limit_N", a.force_limit);
      if (a.slew > 0) number("slew_N_s", a.slew);
      if (a.bias_stiffness != 0) number("bias_stiffness_N_m", a.bias_stiffness);
      if (a.bandwidth > 0) number("bandwidth_Hz", a.bandwidth / kTwoPi);
    }
  }

  const Rotor& r_;
  std::string out_;
};

}  // namespace

std::string rotor_text(const Rotor& rotor) { return RotorText(rotor).write(); }

}  // namespace whirl::shaft
