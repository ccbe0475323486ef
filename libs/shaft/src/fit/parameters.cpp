#include "fit/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// Widths that only keep the equations regular where the records say nothing: a factor of 20 in a coefficient, ten
// times the coefficient in its change over speed.
constexpr double kVagueFactor = 3, kVaguePart = 10, kVague = 1e4;
constexpr double kEven = 0.57735026918962576;  // 1 / sqrt 3: standard deviation of an even distribution

class ParameterMaker {
 public:
  ParameterMaker(const Rotor& rotor, const FitSetup& setup, double lowest, double highest)
      : rotor_(rotor), setup_(setup) {
    set_.stiffness = setup.stiffness;
    set_.damping = setup.damping;
    set_.axes_alike = setup.axes_alike;
    set_.lowest = lowest;
    set_.highest = highest;
  }

  ParameterSet make() {
    check_names();
    for (std::size_t k = 0; k < rotor_.supports.size(); ++k) {
      const std::string& name = rotor_.supports[k].name;
      if (!setup_.supports.empty() && std::ranges::find(setup_.supports, name) == setup_.supports.end()) continue;
      add_coefficients(k, UnknownKind::stiffness, setup_.stiffness);
      add_coefficients(k, UnknownKind::damping, setup_.damping);
    }
    add_geometry();
    set_.structural = set_.size();
    add_linear();
    return std::move(set_);
  }

 private:
  void check_names() const {
    for (const std::string& name : setup_.supports) {
      if (std::ranges::find(rotor_.supports, name, &Support::name) != rotor_.supports.end()) continue;
      std::string known;
      for (const Support& s : rotor_.supports) known += (known.empty() ? "" : ", ") + s.name;
      throw Error::in_field("fit.supports", name, known);
    }
  }

  void add_coefficients(std::size_t k, UnknownKind kind, OverSpeed over) {
    if (over == OverSpeed::known) return;
    const SupportLaw& law = rotor_.supports[k].law;
    if (over == OverSpeed::table && law.speeds.size() < 2)
      throw Error("support " + rotor_.supports[k].name +
                  ": a table over speed is looked for, but the file gives it no speed_rpm = [...]");
    add_entry(k, kind, over, 0, 0, setup_.axes_alike ? "" : " x");
    if (!setup_.axes_alike) add_entry(k, kind, over, 1, 1, " y");
    if (!setup_.cross_coupling) return;
    add_entry(k, kind, over, 0, 1, " xy");
    add_entry(k, kind, over, 1, 0, " yx");
  }

  /// Where a search for a coefficient begins: the file's; without damping 2 % of what critical damping at the highest
  /// speed would be.
  double first_value(std::size_t k, UnknownKind kind, int axis, double speed) const {
    const SupportLaw::Values v = rotor_.supports[k].law.at(speed);
    if (v.stiffness(axis, axis) <= 0)
      throw Error(fmt::format("support {}: its stiffness is {:g} N/m: a fit needs a value to begin with, above 0",
                              rotor_.supports[k].name, v.stiffness(axis, axis)));
    if (kind == UnknownKind::stiffness) return v.stiffness(axis, axis);
    return v.damping(axis, axis) > 0 ? v.damping(axis, axis) : 0.02 * v.stiffness(axis, axis) / set_.highest;
  }

  void add_entry(std::size_t k, UnknownKind kind, OverSpeed over, int row, int column, const char* axes) {
    const Support& support = rotor_.supports[k];
    Parameter p;
    p.kind = kind;
    p.index = k;
    p.row = row;
    p.column = column;
    p.unit = kind == UnknownKind::stiffness ? "N/m" : "N s/m";
    const std::string name =
        fmt::format("{}{} of {}", kind == UnknownKind::stiffness ? "stiffness" : "damping", axes, support.name);
    const int parts = over == OverSpeed::constant ? 1 : over == OverSpeed::linear ? 2 : static_cast<int>(law_speeds(k));
    for (p.part = 0; p.part < parts; ++p.part) {
      const double speed = over == OverSpeed::table ? support.law.speeds[static_cast<std::size_t>(p.part)]
                                                    : 0.5 * (set_.lowest + set_.highest);
      const double main = first_value(k, kind, row, speed);
      const SupportLaw::Values v = support.law.at(speed);
      const double file = (kind == UnknownKind::stiffness ? v.stiffness : v.damping)(row, column);
      p.name = name;
      p.logarithmic = row == column && p.part == 0 && over != OverSpeed::table;
      p.offset = 0;
      p.scale = p.logarithmic ? 1 : main;
      p.prior = p.logarithmic ? std::log(main) : row == column ? 1 : file / main;
      p.prior_sd = p.logarithmic ? kVagueFactor : kVaguePart;
      if (over == OverSpeed::linear && p.part == 1) {
        p.name += ", change over speed";
        p.prior = 0;
      }
      if (over == OverSpeed::table) p.name += fmt::format(" at {:.0f} rpm", speed * 30 / M_PI);
      set_.all.push_back(p);
    }
  }
  std::size_t law_speeds(std::size_t k) const { return rotor_.supports[k].law.speeds.size(); }

  void add(UnknownKind kind, std::size_t index, double offset, double scale, double prior, double sd, std::string name,
           std::string unit, int part = 0) {
    Parameter p;
    p.kind = kind;
    p.index = index;
    p.part = part;
    p.offset = offset;
    p.scale = scale;
    p.prior = prior;
    p.prior_sd = sd;
    p.name = std::move(name);
    p.unit = std::move(unit);
    set_.all.push_back(std::move(p));
  }

  void add_geometry() {
    const Tolerances& tolerance = setup_.tolerance;
    for (std::size_t k = 0; k < rotor_.materials.size(); ++k) {
      const Material& m = rotor_.materials[k];
      if (setup_.material_damping) {
        const double scale = std::max(m.damping, 1e-5);  // s: 1e-5 is 0.3 % of critical at 100 Hz
        add(UnknownKind::material_damping, k, 0, scale, m.damping / scale, kVaguePart, "damping of " + m.name, "s");
      }
      if (tolerance.youngs_modulus > 0)
        add(UnknownKind::youngs_modulus, k, m.youngs_modulus, m.youngs_modulus, 0, kEven * tolerance.youngs_modulus,
            "Young's modulus of " + m.name, "Pa");
    }
    for (std::size_t k = 0; setup_.joint_damping && k < rotor_.joints.size(); ++k) {
      const double scale = std::max(rotor_.joints[k].coefficient, 1e-3);  // N m s/rad
      add(UnknownKind::joint_damping, k, 0, scale, rotor_.joints[k].coefficient / scale, 1e2,
          fmt::format("damping of joint {}", k + 1), "N m s/rad");
    }
    for (std::size_t k = 0; tolerance.diameter > 0 && k < rotor_.sections.size(); ++k)
      add(UnknownKind::diameter, k, rotor_.sections[k].outer, rotor_.sections[k].outer, 0, kEven * tolerance.diameter,
          fmt::format("diameter of section {}", k + 1), "m");
    for (std::size_t k = 0; k < rotor_.discs.size(); ++k) {
      const Disc& d = rotor_.discs[k];
      const double mm = 1e-3;
      if (tolerance.disc_position > 0)
        add(UnknownKind::disc_position, k, d.position, mm, 0, kEven * tolerance.disc_position / mm,
            "position of " + d.name, "m");
      if (tolerance.disc_mass > 0)
        add(UnknownKind::disc_mass, k, d.mass, d.mass, 0, kEven * tolerance.disc_mass, "mass of " + d.name, "kg");
    }
  }

  void add_linear() {
    const auto both = [&](UnknownKind kind, std::size_t k, double real, double scale, double sd,
                          const std::string& name, const char* unit) {
      add(kind, k, real, scale, 0, sd, name + " (cos)", unit, 0);
      add(kind, k, 0, scale, 0, sd, name + " (sin)", unit, 1);
    };
    set_.unbalance = set_.size();
    set_.stations = static_cast<Index>(rotor_.unbalances.size());
    const double um = 1e-6, size = um * rotor_.mass();
    for (std::size_t k = 0; k < rotor_.unbalances.size(); ++k)
      both(UnknownKind::unbalance, k, 0, size, kVague,
           fmt::format("unbalance at {:.4g} mm", 1e3 * rotor_.unbalances[k].position), "kg m");
    set_.bow = set_.size();
    set_.bows = setup_.bow ? static_cast<Index>(rotor_.bow.size()) : 0;
    for (Index k = 0; k < set_.bows; ++k)
      both(UnknownKind::bow, static_cast<std::size_t>(k), 0, um, kVague,
           fmt::format("bow at {:.4g} mm", 1e3 * rotor_.bow[static_cast<std::size_t>(k)].position), "m");
    set_.gain = set_.size();
    set_.probes = static_cast<Index>(rotor_.probes.size());
    const double gain_sd = setup_.tolerance.probe_gain > 0 ? kEven * setup_.tolerance.probe_gain : 1;
    for (std::size_t k = 0; k < rotor_.probes.size(); ++k)
      both(UnknownKind::gain, k, 1, 1, gain_sd, "gain of " + rotor_.probes[k].name, "");
    set_.runout = set_.size();
    for (std::size_t k = 0; k < rotor_.probes.size(); ++k)
      both(UnknownKind::runout, k, 0, um, kVague, "runout of " + rotor_.probes[k].name, "m");
  }

  const Rotor& rotor_;
  const FitSetup& setup_;
  ParameterSet set_;
};

/// The law of a support with the values found, at the speeds that its parts need.
SupportLaw law_with(const SupportLaw& drawn, const ParameterSet& set, const VectorXd& t, std::size_t support) {
  std::vector<double> speeds = drawn.speeds;
  bool over_speed = speeds.size() > 1;
  for (const OverSpeed over : {set.stiffness, set.damping})
    if (over == OverSpeed::linear) {
      speeds.push_back(set.lowest);
      speeds.push_back(set.highest);
      over_speed = true;
    }
  std::ranges::sort(speeds);
  speeds.erase(std::unique(speeds.begin(), speeds.end()), speeds.end());
  if (!over_speed) speeds = {0};
  SupportLaw law;
  for (const double speed : speeds) {
    SupportLaw::Values v = drawn.at(speed);
    // A coefficient that is looked for starts from none.
    for (Index k = 0; k < set.structural; ++k) {
      const Parameter& p = set.all[static_cast<std::size_t>(k)];
      if (p.index != support || (p.kind != UnknownKind::stiffness && p.kind != UnknownKind::damping)) continue;
      Eigen::Matrix2d& m = p.kind == UnknownKind::stiffness ? v.stiffness : v.damping;
      double& entry = m(p.row, p.column);
      if (p.part == 0) entry = 0;
      entry += p.value(t[k]) * set.shape(p, drawn, std::clamp(speed, set.lowest, set.highest));
      if (set.axes_alike && p.row == p.column) m(1, 1) = m(0, 0);
    }
    law.stiffness.push_back(v.stiffness);
    law.damping.push_back(v.damping);
    law.mass.push_back(v.mass);
  }
  if (over_speed) law.speeds = speeds;
  return law;
}

void apply_geometry(Rotor& r, const Rotor& drawn, const Parameter& p, double t, bool file) {
  const std::size_t k = p.index;
  switch (p.kind) {
    case UnknownKind::material_damping:
      r.materials[k].damping = p.value(t);
      break;
    case UnknownKind::joint_damping:
      r.joints[k].coefficient = p.value(t);
      break;
    case UnknownKind::youngs_modulus:
      r.materials[k].youngs_modulus = drawn.materials[k].youngs_modulus * (1 + t);
      r.materials[k].shear_modulus = drawn.materials[k].shear_modulus * (1 + t);
      break;
    case UnknownKind::diameter:
      r.sections[k].outer = drawn.sections[k].outer * (1 + t);
      r.sections[k].outer_end = drawn.sections[k].outer_end * (1 + t);
      break;
    case UnknownKind::disc_position:
      if (file) {
        r.discs[k].position = p.value(t);
        for (std::size_t u = 0; u < r.unbalances.size(); ++u)
          if (disc_at_hub(drawn, drawn.unbalances[u]) == k) r.unbalances[u].position = r.unbalances[u].end = p.value(t);
      } else {
        r.discs[k].moved = p.scale * t;
      }
      break;
    case UnknownKind::disc_mass:
      r.discs[k].mass = drawn.discs[k].mass * (1 + t);
      r.discs[k].transverse = drawn.discs[k].transverse * (1 + t);
      r.discs[k].polar = drawn.discs[k].polar * (1 + t);
      break;
    default:
      break;
  }
}

}  // namespace

std::optional<std::size_t> disc_at_hub(const Rotor& rotor, const Unbalance& u) {
  const double near = 1e-7 * rotor.length();
  for (std::size_t k = 0; k < rotor.discs.size(); ++k)
    if (std::abs(rotor.discs[k].position - u.position) < near && u.end == u.position) return k;
  return std::nullopt;
}

VectorXd ParameterSet::start() const {
  VectorXd t(size());
  for (Index k = 0; k < size(); ++k) t[k] = all[static_cast<std::size_t>(k)].prior;
  return t;
}

std::complex<double> ParameterSet::complex_value(const VectorXd& t, Index place) const {
  const auto k = static_cast<std::size_t>(place);
  return {all[k].value(t[place]), all[k + 1].value(t[place + 1])};
}

double ParameterSet::shape(const Parameter& p, const SupportLaw& law, double speed) const {
  const OverSpeed over = p.kind == UnknownKind::stiffness ? stiffness : damping;
  if (over == OverSpeed::linear && p.part == 1)
    return (std::clamp(speed, lowest, highest) - 0.5 * (lowest + highest)) / (0.5 * (highest - lowest));
  if (over != OverSpeed::table) return 1;
  const auto k = static_cast<std::size_t>(p.part);
  const std::vector<double>& at = law.speeds;
  const double s = std::clamp(speed, at.front(), at.back());
  if (s <= at[k]) return k == 0 ? 1 : std::max(0.0, (s - at[k - 1]) / (at[k] - at[k - 1]));
  return k + 1 == at.size() ? 1 : std::max(0.0, (at[k + 1] - s) / (at[k + 1] - at[k]));
}

ParameterSet make_parameters(const Rotor& drawn, const FitSetup& setup, double lowest, double highest) {
  return ParameterMaker(drawn, setup, lowest, highest).make();
}

Rotor with_values(const Rotor& drawn, const ParameterSet& set, const VectorXd& t, bool file) {
  Rotor r = drawn;
  for (std::size_t k = 0; k < r.supports.size(); ++k) r.supports[k].law = law_with(drawn.supports[k].law, set, t, k);
  for (Index k = 0; k < set.structural; ++k) apply_geometry(r, drawn, set.all[static_cast<std::size_t>(k)], t[k], file);
  if (!file) return r;
  for (Material& m : r.materials) m.damping = std::max(0.0, m.damping);  // what a file may hold
  for (JointDamping& j : r.joints) j.coefficient = std::max(0.0, j.coefficient);
  for (Index k = 0; k < set.stations; ++k) {
    const std::complex<double> u = set.complex_value(t, set.unbalance + 2 * k);
    r.unbalances[static_cast<std::size_t>(k)].size = std::abs(u);
    r.unbalances[static_cast<std::size_t>(k)].angle = std::arg(u);
  }
  for (Index k = 0; k < set.probes; ++k) {
    const std::complex<double> runout = set.complex_value(t, set.runout + 2 * k);
    r.probes[static_cast<std::size_t>(k)].runout = std::abs(runout);
    r.probes[static_cast<std::size_t>(k)].runout_angle = std::arg(runout);
  }
  for (Index k = 0; k < set.bows; ++k) {
    const std::complex<double> b = set.complex_value(t, set.bow + 2 * k);
    r.bow[static_cast<std::size_t>(k)].size = std::abs(b);
    r.bow[static_cast<std::size_t>(k)].angle = std::arg(b);
  }
  return r;
}

}  // namespace whirl::shaft
