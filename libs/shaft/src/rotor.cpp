#include "whirl/shaft/rotor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Matrix2d;

double Rotor::length() const {
  double sum = 0;
  for (const Section& s : sections) sum += s.length;
  return sum;
}

double Rotor::polar_inertia() const {
  double sum = 0;
  for (const Disc& d : discs) sum += d.polar;
  // Of a cone the fourth power of the diameter has the mean (a^4 + a^3 b + a^2 b^2 + a b^3 + b^4) / 5.
  const auto fourth = [](double a, double b) {
    return (a * a * a * a + a * a * a * b + a * a * b * b + a * b * b * b + b * b * b * b) / 5;
  };
  for (const Section& s : sections)
    sum += materials[s.material].density * s.length * kPi / 32 *
           (fourth(s.outer, s.outer_end) - fourth(s.inner, s.inner_end));
  return sum;
}

double Rotor::mass() const {
  double sum = 0;
  const auto cone = [](double a, double b) { return kPi / 12 * (a * a + a * b + b * b); };
  for (const Section& s : sections)
    sum += materials.at(s.material).density * s.length * (cone(s.outer, s.outer_end) - cone(s.inner, s.inner_end));
  for (const Disc& d : discs) sum += d.mass;
  return sum;
}

Disc cylinder(double density, double outer, double bore, double thickness) {
  Disc d;
  d.mass = density * kPi / 4 * (outer * outer - bore * bore) * thickness;
  d.polar = d.mass / 8 * (outer * outer + bore * bore);
  d.transverse = d.polar / 2 + d.mass / 12 * thickness * thickness;
  return d;
}

SupportLaw::Values SupportLaw::at(double speed) const {
  const auto read = [&](const std::vector<Matrix2d>& table) -> Matrix2d {
    if (table.empty()) return Matrix2d::Zero();
    if (table.size() == 1 || speed <= speeds.front()) return table.front();
    if (speed >= speeds.back()) return table.back();
    const auto above = static_cast<std::size_t>(std::upper_bound(speeds.begin(), speeds.end(), speed) - speeds.begin());
    const double part = (speed - speeds[above - 1]) / (speeds[above] - speeds[above - 1]);
    return (1 - part) * table[above - 1] + part * table[above];
  };
  return {read(stiffness), read(damping), read(mass)};
}

namespace {

constexpr double kHuge = std::numeric_limits<double>::max();

void check_sections(const Rotor& r) {
  if (r.sections.empty()) throw Error("the rotor has no section of shaft: at least one is needed");
  for (std::size_t k = 0; k < r.sections.size(); ++k) {
    const Section& s = r.sections[k];
    const auto field = [k](const char* name) { return fmt::format("section[{}].{}", k, name); };
    require_range(field("length"), s.length, 1e-9, kHuge, "m");
    for (const auto& [outer, inner] : {std::pair{s.outer, s.inner}, std::pair{s.outer_end, s.inner_end}}) {
      require_range(field("outer"), outer, 1e-9, kHuge, "m");
      if (!(inner >= 0 && inner < outer))
        throw Error::in_field(field("inner"), fmt::format("{:g} m", inner), "0 to below the outer diameter");
    }
    require_range(field("elements"), s.elements, 0, 1000);
    if (s.material >= r.materials.size()) throw Error::in_field(field("material"), "unknown", "one of the materials");
  }
  for (const Material& m : r.materials) {
    require_range("material.youngs_modulus", m.youngs_modulus, 1, kHuge, "Pa");
    require_range("material.shear_modulus", m.shear_modulus, m.youngs_modulus / 3, m.youngs_modulus / 2, "Pa");
    require_range("material.density", m.density, 0, kHuge, "kg/m^3");
    require_range("material.damping", m.damping, 0, kHuge, "s");
  }
  if (r.shear.model == ShearModel::number) require_range("shear coefficient", r.shear.coefficient, 1e-3, 1);
  require_range("elements", r.elements, 1, 1000);
}

void check_point(const Rotor& r, const std::string& field, const Point& p) {
  if (p.part == "ground") return;
  if (p.part == "shaft") {
    require_range(field, p.position, -1e-9, r.length() * (1 + 1e-9), "m");
    return;
  }
  std::string known = "shaft, ground";
  for (const Body& b : r.bodies) {
    if (b.name == p.part) return;
    known += ", " + b.name;
  }
  throw Error::in_field(field, p.part, known);
}

}  // namespace

void check(const Rotor& r) {
  check_sections(r);
  const auto on_shaft = [&](const char* field, double z) { check_point(r, field, {"shaft", z}); };
  for (const Disc& d : r.discs) {
    on_shaft("disc.position", d.position);
    require_range("disc.mass", d.mass, 0, kHuge, "kg");
    require_range("disc.transverse", d.transverse, 0, kHuge, "kg m^2");
    require_range("disc.polar", d.polar, 0, 2 * d.transverse * (1 + 1e-9), "kg m^2");
  }
  for (const Body& b : r.bodies) {
    if (b.name == "shaft" || b.name == "ground" || b.name.empty())
      throw Error::in_field("body.name", b.name, "a name other than shaft and ground");
    require_range("body.mass", b.mass, 1e-12, kHuge, "kg");
  }
  for (const Support& s : r.supports) {
    check_point(r, "support " + s.name, s.a);
    check_point(r, "support " + s.name, s.b);
    for (const auto* table : {&s.law.stiffness, &s.law.damping, &s.law.mass})
      if (table->size() > 1 && table->size() != s.law.speeds.size())
        throw Error::in_field("support " + s.name, fmt::format("{} values", table->size()),
                              fmt::format("one a speed, {}", s.law.speeds.size()));
    if (std::adjacent_find(s.law.speeds.begin(), s.law.speeds.end(), std::greater_equal<>()) != s.law.speeds.end())
      throw Error("support " + s.name + ": its speeds must ascend");
  }
  for (const JointDamping& j : r.joints) {
    on_shaft("joint.from", j.from);
    on_shaft("joint.to", j.to);
    require_range("joint.damping", j.coefficient, 0, kHuge, "N m s/rad");
  }
  for (const Unbalance& u : r.unbalances) {
    on_shaft("unbalance.position", u.position);
    on_shaft("unbalance.end", u.end);
    if (u.end < u.position) throw Error("an unbalance is spread from left to right: its end is before its position");
  }
  for (const Probe& p : r.probes) on_shaft("probe.position", p.position);
  for (const Actuator& a : r.actuators) {
    check_point(r, "actuator " + a.name, a.a);
    check_point(r, "actuator " + a.name, a.b);
    require_range("actuator " + a.name + ".force_limit", a.force_limit, 1e-12, kHuge, "N");
    require_range("actuator " + a.name + ".slew", a.slew, 0, kHuge, "N/s");
    require_range("actuator " + a.name + ".bias_stiffness", a.bias_stiffness, -kHuge, 0, "N/m");
    require_range("actuator " + a.name + ".bandwidth", a.bandwidth, 0, kHuge, "rad/s");
  }
  for (std::size_t k = 1; k < r.bow.size(); ++k)
    if (!(r.bow[k].position > r.bow[k - 1].position)) throw Error("the points of a bow must be from left to right");
  if (r.bow.size() == 1) throw Error("a bow needs two points or more");
}

}  // namespace whirl::shaft
