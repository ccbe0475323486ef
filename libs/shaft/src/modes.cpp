#include "whirl/shaft/modes.hpp"

#include <algorithm>
#include <cmath>

#include "mode_pairs.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace {

constexpr Complex kI{0, 1};

/// x = X e^{i w t}: the orbit is a forward circle of radius |X + i Y| / 2 and a backward one of |X - i Y| / 2.
double whirl_direction(const VectorXcd& x, const VectorXcd& y) {
  const double forward = (x + kI * y).squaredNorm(), backward = (x - kI * y).squaredNorm();
  return forward + backward > 0 ? (forward - backward) / (forward + backward) : 0;
}

Mode observed(const System& s, Complex pole, const VectorXcd& qx, const VectorXcd& qy) {
  Mode m;
  m.pole = pole;
  m.x = s.deflection * qx;
  m.y = s.deflection * qy;
  m.body_x = s.bodies * qx;
  m.body_y = s.bodies * qy;
  VectorXcd all_x(m.x.size() + m.body_x.size()), all_y(all_x.size());
  all_x << m.x, m.body_x;
  all_y << m.y, m.body_y;
  m.direction = whirl_direction(all_x, all_y);
  Complex largest = 0;
  for (const VectorXcd* v : {&all_x, &all_y})
    for (const Complex z : *v)
      if (std::abs(z) > std::abs(largest)) largest = z;
  if (largest != 0.0)
    for (VectorXcd* v : {&m.x, &m.y, &m.body_x, &m.body_y}) *v /= largest;
  return m;
}

}  // namespace

std::vector<Eigenpair> pairs_at(const System& s, double speed, int count) {
  std::vector<Eigenpair> found = s.isotropic(speed) ? lowest_pairs(circular_equations(s, speed), count + s.free)
                                                    : lowest_pairs(plane_equations(s, speed), count + s.free);
  if (s.free == 0 || found.empty()) return found;
  const double bends = std::abs(found[std::min(found.size() - 1, static_cast<std::size_t>(s.free))].pole);
  std::erase_if(found, [&](const Eigenpair& p) { return std::abs(p.pole) < kRigid * bends; });
  if (found.size() > static_cast<std::size_t>(count)) found.resize(static_cast<std::size_t>(count));
  return found;
}

Mode mode_of(const System& s, const Eigenpair& p) {
  const Index n = s.size();
  if (p.shape.size() == 2 * n) return observed(s, p.pole, p.shape.head(n), p.shape.tail(n));
  // x + i y = v e^{p t}. Forward: X = v, Y = -i v. A pole below the real axis whirls backward: the conjugate has
  // X = conj(v), Y = i conj(v).
  const bool forward = p.pole.imag() > 0;
  const VectorXcd v = forward ? p.shape : VectorXcd(p.shape.conjugate());
  return observed(s, forward ? p.pole : std::conj(p.pole), v, (forward ? -kI : kI) * v);
}

std::vector<Mode> modes(const System& s, double speed, int count) {
  std::vector<Mode> list;
  for (const Eigenpair& p : pairs_at(s, speed, count)) list.push_back(mode_of(s, p));
  return list;
}

bool grows(const System& s, const Mode& m) {
  // Beside the poles at zero of free motions the others are less exact.
  const double rounding = s.free > 0 ? 1e-6 : 1e-9;
  return m.pole.real() > rounding * std::abs(m.pole);
}

std::optional<Threshold> stability_threshold(const System& system, double from, double to, int count, int steps) {
  const auto worst = [&](double speed) {
    std::vector<Mode> found = modes(system, speed, count);
    return *std::max_element(found.begin(), found.end(),
                             [](const Mode& a, const Mode& b) { return a.pole.real() < b.pole.real(); });
  };
  const auto unstable = [&](const Mode& m) { return grows(system, m); };
  double low = from;
  for (int k = 0; k <= steps; ++k) {
    double high = from + (to - from) * k / steps;
    if (!returns_to_place(system, high)) return Threshold{high, 0, 0};
    Mode m = worst(high);
    if (!unstable(m)) {
      low = high;
      continue;
    }
    for (int i = 0; k > 0 && i < 60 && high - low > 1e-10 * high; ++i) {
      const double middle = (low + high) / 2;
      const Mode at = worst(middle);
      if (unstable(at)) {
        high = middle;
        m = at;
      } else {
        low = middle;
      }
    }
    return Threshold{high, m.frequency(), m.direction};
  }
  return std::nullopt;
}

MeshCheck check_mesh(const Rotor& rotor, double speed, int count, double limit) {
  MeshCheck c;
  const auto frequencies = [&](int refinement) {
    std::vector<double> list;
    for (const Mode& m : modes(assemble(rotor, refinement), speed, count)) list.push_back(std::abs(m.pole));
    return list;
  };
  c.frequency = frequencies(1);
  c.refined = frequencies(2);
  const bool second = rotor.element == ElementKind::usual && rotor.shear.model != ShearModel::none;
  const double remainder = 1 - (second ? 1.0 / 4 : 1.0 / 16);
  for (std::size_t k = 0; k < std::min(c.frequency.size(), c.refined.size()); ++k) {
    c.error.push_back(std::abs(c.frequency[k] - c.refined[k]) / remainder / c.refined[k]);
    c.worst = std::max(c.worst, c.error.back());
  }
  c.coarse = c.worst > limit;
  return c;
}

}  // namespace whirl::shaft
