#include "whirl/shaft/modes.hpp"

#include <algorithm>
#include <cmath>

#include "eigenpairs.hpp"

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

std::vector<Mode> modes(const System& s, double speed, int count) {
  std::vector<Mode> list;
  if (s.isotropic(speed)) {
    for (const Eigenpair& p : lowest_pairs(circular_equations(s, speed), count)) {
      // x + i y = v e^{p t}. Forward: X = v, Y = -i v. A pole below the real axis whirls backward: the conjugate has
      // X = conj(v), Y = i conj(v).
      const bool forward = p.pole.imag() > 0;
      const VectorXcd v = forward ? p.shape : VectorXcd(p.shape.conjugate());
      list.push_back(observed(s, forward ? p.pole : std::conj(p.pole), v, (forward ? -kI : kI) * v));
    }
    return list;
  }
  const Index n = s.size();
  for (const Eigenpair& p : lowest_pairs(plane_equations(s, speed), count))
    list.push_back(observed(s, p.pole, p.shape.head(n), p.shape.tail(n)));
  return list;
}

namespace {

/// Likeness of two shapes, 0 to 1 (modal assurance criterion).
double likeness(const Mode& a, const Mode& b) {
  const Complex product = a.x.dot(b.x) + a.y.dot(b.y) + a.body_x.dot(b.body_x) + a.body_y.dot(b.body_y);
  const auto square = [](const Mode& m) {
    return m.x.squaredNorm() + m.y.squaredNorm() + m.body_x.squaredNorm() + m.body_y.squaredNorm();
  };
  return std::norm(product) / (square(a) * square(b));
}

/// `found` in the order of `before`: pairs are taken by likeness, largest first; likeness counts less the farther the
/// frequency has moved.
std::vector<Mode> continued(const std::vector<Mode>& before, std::vector<Mode> found) {
  const std::size_t n = std::min(before.size(), found.size());
  struct Pair {
    double score;
    std::size_t old, now;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < before.size(); ++i)
    for (std::size_t j = 0; j < found.size(); ++j) {
      const double moved = std::log(std::abs(found[j].pole) / std::abs(before[i].pole));
      pairs.push_back({likeness(before[i], found[j]) - 2 * std::abs(moved), i, j});
    }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.score > b.score; });
  std::vector<bool> old_used(before.size()), now_used(found.size());
  std::vector<Mode> result(n);
  for (const Pair& p : pairs) {
    if (old_used[p.old] || now_used[p.now] || p.old >= n) continue;
    old_used[p.old] = now_used[p.now] = true;
    result[p.old] = std::move(found[p.now]);
  }
  return result;
}

}  // namespace

std::vector<CampbellPoint> campbell(const System& system, const std::vector<double>& speeds, int count) {
  std::vector<CampbellPoint> points;
  for (const double speed : speeds) {
    // A few more than asked for: lines that come from above are needed where they cross.
    std::vector<Mode> found = modes(system, speed, count + 4);
    if (!points.empty()) found = continued(points.back().modes, std::move(found));
    points.push_back({speed, std::move(found)});
  }
  for (CampbellPoint& p : points) p.modes.resize(std::min(p.modes.size(), static_cast<std::size_t>(count)));
  return points;
}

std::optional<Threshold> stability_threshold(const System& system, double from, double to, int count, int steps) {
  const auto worst = [&](double speed) {
    std::vector<Mode> found = modes(system, speed, count);
    return *std::max_element(found.begin(), found.end(),
                             [](const Mode& a, const Mode& b) { return a.pole.real() < b.pole.real(); });
  };
  // Growth below rounding does not count: an undamped rotor is not unstable.
  const auto unstable = [](const Mode& m) { return m.pole.real() > 1e-9 * std::abs(m.pole); };
  double low = from;
  for (int k = 0; k <= steps; ++k) {
    double high = from + (to - from) * k / steps;
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
