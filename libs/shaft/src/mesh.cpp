#include "mesh.hpp"

#include <algorithm>
#include <cmath>

namespace whirl::shaft {
namespace {

std::vector<double> named_stations(const Rotor& rotor) {
  std::vector<double> at;
  for (const Disc& d : rotor.discs) at.push_back(d.position);
  for (const Support& s : rotor.supports)
    for (const Point* p : {&s.a, &s.b})
      if (p->part == "shaft") at.push_back(p->position);
  for (const JointDamping& j : rotor.joints) at.insert(at.end(), {j.from, j.to});
  for (const Unbalance& u : rotor.unbalances) at.insert(at.end(), {u.position, u.end});
  for (const Probe& p : rotor.probes) at.push_back(p.position);
  for (const Actuator& a : rotor.actuators)
    for (const Point* p : {&a.a, &a.b})
      if (p->part == "shaft") at.push_back(p->position);
  return at;
}

/// Ends of the elements of a section from `left`: evenly, and where a station lies inside.
std::vector<double> section_nodes(double left, double length, int elements, const std::vector<double>& stations,
                                  double tolerance) {
  std::vector<double> at;
  if (elements > 0)
    for (int k = 0; k <= elements; ++k) at.push_back(left + length * k / elements);
  else
    at = {left, left + length};
  for (const double station : stations) {
    const auto same = [&](double x) { return std::abs(x - station) < tolerance; };
    if (station > left && station < left + length && std::none_of(at.begin(), at.end(), same)) at.push_back(station);
  }
  std::sort(at.begin(), at.end());
  return at;
}

}  // namespace

std::size_t Mesh::node(double position) const {
  const auto nearer = [position](double a, double b) { return std::abs(a - position) < std::abs(b - position); };
  return static_cast<std::size_t>(std::min_element(nodes.begin(), nodes.end(), nearer) - nodes.begin());
}

Mesh make_mesh(const Rotor& rotor, int refinement) {
  // Stations so near to each other are one: what lies between them bends by less than rounding hides of the rest, which
  // without shear strain grows with the third power.
  const double total = rotor.length(), tolerance = (rotor.shear.model == ShearModel::none ? 1e-4 : 1e-5) * total;
  const std::vector<double> stations = named_stations(rotor);
  Mesh mesh;
  mesh.nodes.push_back(0);
  double left = 0;
  for (const Section& section : rotor.sections) {
    const std::vector<double> ends = section_nodes(left, section.length, section.elements, stations, tolerance);
    for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
      const double span = ends[k + 1] - ends[k];
      int parts = refinement;
      if (section.elements == 0)
        parts *= std::max(1, static_cast<int>(std::ceil(span / total * rotor.elements - 1e-9)));
      for (int p = 0; p < parts; ++p) {
        const double a = ends[k] + span * p / parts, b = ends[k] + span * (p + 1) / parts;
        const auto between = [&](double from, double to, double z) {
          return from + (to - from) * (z - left) / section.length;
        };
        mesh.elements.push_back(
            {{b - a, between(section.outer, section.outer_end, a), between(section.outer, section.outer_end, b),
              between(section.inner, section.inner_end, a), between(section.inner, section.inner_end, b)},
             section.material});
        mesh.nodes.push_back(b);
      }
    }
    left += section.length;
  }
  return mesh;
}

}  // namespace whirl::shaft
