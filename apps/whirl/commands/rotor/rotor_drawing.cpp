#include "rotor_drawing.hpp"

#include <algorithm>
#include <cmath>

namespace whirl::app {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr int kShaft = 7, kDisc = 0, kSupport = 1, kBody = 2, kProbe = 3, kUnbalance = 4, kActuator = 5;

/// Outer radius of the shaft at a position.
double shaft_radius(const shaft::Rotor& rotor, double position) {
  double begin = 0;
  for (const shaft::Section& s : rotor.sections) {
    if (position <= begin + s.length || &s == &rotor.sections.back()) {
      const double part = std::clamp((position - begin) / s.length, 0.0, 1.0);
      return 0.5 * (s.outer + part * (s.outer_end - s.outer));
    }
    begin += s.length;
  }
  return 0;
}

void draw_shaft(report::Panel& panel, const shaft::Rotor& rotor) {
  double begin = 0;
  for (const shaft::Section& s : rotor.sections) {
    const Vector2d z(begin, begin + s.length), outer = 0.5 * Vector2d(s.outer, s.outer_end),
                                               inner = 0.5 * Vector2d(s.inner, s.inner_end);
    const std::string name = begin == 0 ? "shaft" : "";
    if (inner.maxCoeff() > 0) {
      panel.band(name, z, inner, outer, {.color = kShaft});
      panel.band("", z, -outer, -inner, {.color = kShaft});
    } else {
      panel.band(name, z, -outer, outer, {.color = kShaft});
    }
    begin += s.length;
  }
}

/// A disc is drawn as the cylinder on the shaft that has its mass and its moments of inertia.
double draw_disc(report::Panel& panel, const shaft::Disc& d, double bore, bool first) {
  const double outer = std::sqrt(std::max(2 * d.polar / d.mass - bore * bore, bore * bore));
  const double thick = std::sqrt(std::max(12 * (d.transverse - d.polar / 2) / d.mass, 1e-6 * outer * outer));
  const double middle = d.position + d.offset;
  const Vector2d z(middle - thick / 2, middle + thick / 2), low = Vector2d::Constant(bore),
                                                            high = Vector2d::Constant(outer);
  panel.band(first ? "disc" : "", z, low, high, {.color = kDisc});
  panel.band("", z, -high, -low, {.color = kDisc});
  panel.annotate(middle, outer, d.name, true);
  return outer;
}

}  // namespace

void draw_rotor(report::Figure& figure, const shaft::Rotor& rotor) {
  const double length = rotor.length();
  const report::Unit unit = report::engineering_unit(Quantity::displacement, length);
  report::Panel& panel = figure.panel("rotor to scale", {"position", unit}, {"radius", unit});
  draw_shaft(panel, rotor);
  double largest = 0;
  for (const shaft::Disc& d : rotor.discs)
    largest = std::max(largest, draw_disc(panel, d, shaft_radius(rotor, d.position), &d == &rotor.discs.front()));
  const auto points = [&panel](const std::string& name, const std::vector<double>& z, const std::vector<double>& r,
                               report::Style style) {
    const auto n = static_cast<Eigen::Index>(z.size());
    if (n > 0)
      panel.scatter(name, Eigen::Map<const VectorXd>(z.data(), n), Eigen::Map<const VectorXd>(r.data(), n), style);
  };
  std::vector<double> z, r;
  for (const shaft::Support& s : rotor.supports) {
    const shaft::Point& at = s.a.part == "shaft" ? s.a : s.b;
    z.push_back(at.position);
    r.push_back(at.part == "shaft" ? -shaft_radius(rotor, at.position) - 0.02 * length : -0.1 * length);
  }
  points("bearing, mount", z, r, {.color = kSupport, .mark = report::Mark::triangle});
  z.clear(), r.clear();
  for (const shaft::Body& b : rotor.bodies) z.push_back(b.position), r.push_back(-0.1 * length);
  points("body", z, r, {.color = kBody, .mark = report::Mark::square});
  z.clear(), r.clear();
  for (const shaft::Unbalance& u : rotor.unbalances)
    z.push_back(0.5 * (u.position + u.end)), r.push_back(0.5 * shaft_radius(rotor, u.position));
  points("unbalance", z, r, {.color = kUnbalance, .mark = report::Mark::circle});
  z.clear(), r.clear();
  for (const shaft::Probe& p : rotor.probes)
    z.push_back(p.position), r.push_back(shaft_radius(rotor, p.position) + 0.02 * length);
  points("probe", z, r, {.color = kProbe, .mark = report::Mark::cross});
  z.clear(), r.clear();
  for (const shaft::Actuator& a : rotor.actuators) {
    z.push_back(a.a.position);
    r.push_back(a.a.part == "shaft" ? shaft_radius(rotor, a.a.position) + 0.05 * length : 0.1 * length);
  }
  points("actuator", z, r, {.color = kActuator, .mark = report::Mark::diamond});
  panel.y.high = 1.25 * std::max(largest, 0.1 * length);
  panel.y.low = -panel.y.high;
  panel.equal_aspect = true;
  panel.height = 180;
}

}  // namespace whirl::app
