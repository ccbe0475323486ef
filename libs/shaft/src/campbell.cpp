#include <algorithm>
#include <cmath>

#include "mode_pairs.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace {

/// Likeness of two modes, 0 to 1 (modal assurance criterion).
double likeness(const Mode& a, const Mode& b) {
  const Complex product = a.x.dot(b.x) + a.y.dot(b.y) + a.body_x.dot(b.body_x) + a.body_y.dot(b.body_y);
  const auto square = [](const Mode& m) {
    return m.x.squaredNorm() + m.y.squaredNorm() + m.body_x.squaredNorm() + m.body_y.squaredNorm();
  };
  return std::norm(product) / (square(a) * square(b));
}

/// Places in `found` of the modes that continue `before`: taken by likeness, largest first; likeness counts less the
/// farther the frequency has moved.
std::vector<std::size_t> continued(const std::vector<Mode>& before, const std::vector<Mode>& found) {
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
  std::vector<std::size_t> result(n);
  for (const Pair& p : pairs) {
    if (old_used[p.old] || now_used[p.now] || p.old >= n) continue;
    old_used[p.old] = now_used[p.now] = true;
    result[p.old] = p.now;
  }
  return result;
}

/// The last pairs of one line of the diagram, newest first.
struct Line {
  std::vector<Eigenpair> last;
  std::vector<double> speed;

  void add(double at, Eigenpair pair) {
    // The factor of a shape is free: that of the pair before.
    if (!last.empty()) {
      const Complex turn = pair.shape.dot(last[0].shape);
      if (std::abs(turn) > 0) pair.shape *= turn / std::abs(turn);
    }
    last.insert(last.begin(), std::move(pair));
    speed.insert(speed.begin(), at);
    if (last.size() > 3) last.pop_back(), speed.pop_back();
  }
  /// The polynomial through the last pairs, at a speed (Lagrange).
  Eigenpair expected(double at) const {
    Eigenpair out{0, VectorXcd::Zero(last[0].shape.size())};
    for (std::size_t i = 0; i < last.size(); ++i) {
      double weight = 1;
      for (std::size_t j = 0; j < last.size(); ++j)
        if (j != i) weight *= (at - speed[j]) / (speed[i] - speed[j]);
      out.pole += weight * last[i].pole;
      out.shape += weight * last[i].shape;
    }
    return out;
  }
};

/// Newton's method on (p^2 M + p C + K) v = 0 from a pair that is nearly one (nonlinear inverse iteration; Mehrmann and
/// Voss, GAMM-Mitt. 27, 2004, sec. 3); false where it does not arrive in a few steps.
template <class Matrix>
bool refine(const Equations<Matrix>& e, Eigenpair& pair, MatrixXcd& dynamic, Eigen::PartialPivLU<MatrixXcd>& lu) {
  // The error squares in each step: a step of 1e-6 leaves 1e-12.
  constexpr double kStep = 1e-6;
  constexpr int kMost = 5;
  for (int k = 0; k < kMost; ++k) {
    const Complex p = pair.pole;
    dynamic.noalias() = (p * p) * e.mass + p * e.damping + e.stiffness;
    const VectorXcd right = (2.0 * p) * (e.mass * pair.shape) + e.damping * pair.shape;
    lu.compute(dynamic);
    VectorXcd next = lu.solve(right);
    const Complex along = pair.shape.dot(next) / pair.shape.squaredNorm();
    if (!std::isfinite(std::abs(along)) || !(std::abs(along) > 0)) return false;
    const Complex step = 1.0 / along;
    pair.pole = p - step;
    pair.shape = next / next.norm();
    if (std::abs(step) < kStep * std::abs(p)) return true;
  }
  return false;
}

/// The pairs of all lines at `speed` from those at the speeds before; false where one cannot be followed in certainty:
/// it changes much, does not oscillate, or meets another one.
template <class Matrix>
bool follow(const Equations<Matrix>& e, double speed, const std::vector<Line>& lines, std::vector<Eigenpair>& out) {
  constexpr double kAlike = 0.8, kOne = 1e-7;
  MatrixXcd dynamic;
  Eigen::PartialPivLU<MatrixXcd> lu(e.mass.rows());
  out.clear();
  for (const Line& line : lines) {
    if (line.last[0].shape.size() != e.mass.rows()) return false;
    Eigenpair pair = line.expected(speed);
    pair.shape /= pair.shape.norm();
    if (!refine(e, pair, dynamic, lu)) return false;
    const double like = std::norm(pair.shape.dot(line.last[0].shape)) / line.last[0].shape.squaredNorm();
    if (like < kAlike || pair.pole.imag() * line.last[0].pole.imag() <= 0) return false;
    for (const Eigenpair& other : out)
      if (std::abs(other.pole - pair.pole) < kOne * std::abs(pair.pole)) return false;
    out.push_back(std::move(pair));
  }
  return true;
}

bool follow(const System& s, double speed, const std::vector<Line>& lines, std::vector<Eigenpair>& out) {
  return s.isotropic(speed) ? follow(circular_equations(s, speed), speed, lines, out)
                            : follow(plane_equations(s, speed), speed, lines, out);
}

}  // namespace

std::vector<CampbellPoint> campbell(const System& system, const std::vector<double>& speeds, int count) {
  std::vector<CampbellPoint> points;
  std::vector<Line> lines;
  for (const double speed : speeds) {
    CampbellPoint point{speed, {}};
    std::vector<Eigenpair> pairs;
    const bool new_speed = lines.empty() || speed != lines[0].speed[0];
    if (!lines.empty() && new_speed && follow(system, speed, lines, pairs)) {
      for (std::size_t k = 0; k < lines.size(); ++k) {
        point.modes.push_back(mode_of(system, pairs[k]));
        lines[k].add(speed, std::move(pairs[k]));
      }
    } else {
      // A few more than asked for: lines that come from above are needed where they cross.
      pairs = pairs_at(system, speed, count + 4);
      for (const Eigenpair& p : pairs) point.modes.push_back(mode_of(system, p));
      std::vector<std::size_t> order(pairs.size());
      for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
      if (!points.empty()) order = continued(points.back().modes, point.modes);
      order.resize(std::min(order.size(), static_cast<std::size_t>(count)));
      std::vector<Mode> in_order;
      lines.assign(order.size(), {});
      for (std::size_t k = 0; k < order.size(); ++k) {
        in_order.push_back(std::move(point.modes[order[k]]));
        lines[k].add(speed, std::move(pairs[order[k]]));
      }
      point.modes = std::move(in_order);
    }
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace whirl::shaft
