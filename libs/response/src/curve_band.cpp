#include "whirl/response/curve_band.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;

/// A point of the curve with the plane across it, in coefficients and speed scaled by their size.
struct Station {
  PeriodicSolution solution;
  Eigen::VectorXd scale;   ///< of coefficients and speed
  Eigen::VectorXd normal;  ///< of the plane
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
};

Eigen::VectorXd unknowns(const PeriodicSolution& s) {
  Eigen::VectorXd y(s.coefficients.size() + 1);
  y << s.coefficients.reshaped(), s.omega;
  return y;
}

void set_unknowns(PeriodicSolution& s, const Eigen::VectorXd& y) {
  s.coefficients = y.head(y.size() - 1).reshaped(s.coefficients.rows(), s.coefficients.cols());
  s.omega = y[y.size() - 1];
}

PeriodicSolution widened(const PeriodicSolution& s, Index rows) {
  PeriodicSolution wide = s;
  wide.coefficients = Eigen::MatrixXd::Zero(rows, s.coefficients.cols());
  wide.coefficients.topRows(s.coefficients.rows()) = s.coefficients;
  return wide;
}

/// Derivatives of the balance by the scaled unknowns, with the plane as the last row.
Eigen::MatrixXd matrix_of(const Station& at, const Balance& b) {
  const Index n = b.residual.size();
  Eigen::MatrixXd matrix(n + 1, n + 1);
  matrix.topLeftCorner(n, n) = b.jacobian * at.scale.head(n).asDiagonal();
  matrix.topRightCorner(n, 1) = b.by_parameter * at.scale[n];
  matrix.row(n) = at.normal.transpose();
  return matrix;
}

/// The plane across the line from `before` to `after`; both null: the plane of constant speed.
Station station(const PeriodicSystem& system, const PeriodicSolution& s, const PeriodicSolution* before,
                const PeriodicSolution* after, double range) {
  const Index n = s.coefficients.size(), m = s.coefficients.rows();
  Station at;
  at.solution = s;
  at.scale.resize(n + 1);
  const Eigen::VectorXd norms = s.coefficients.colwise().norm();
  const double largest = norms.maxCoeff();
  for (Index i = 0; i < norms.size(); ++i)
    at.scale.segment(i * m, m).setConstant(largest > 0 ? std::max(norms[i], 1e-3 * largest) : 1);
  at.scale[n] = range;
  at.normal = Eigen::VectorXd::Unit(n + 1, n);
  if (before != nullptr && after != nullptr)
    at.normal = ((unknowns(widened(*after, m)) - unknowns(widened(*before, m))).array() / at.scale.array()).matrix();
  at.normal.normalize();
  at.lu.compute(matrix_of(at, balance(system, s, Parameter::speed)));
  return at;
}

/// The answer of `system` in the plane of a station, to a thousandth of its distance: steps with the station's own
/// matrix while they shrink fast, then Newton's. `by`: the way that the station before moved, a first guess; then that
/// of this one. False where no answer is found nearby.
bool moved(const PeriodicSystem& system, const Station& at, Eigen::VectorXd& by, PeriodicSolution& s) {
  constexpr double kFast = 0.05, kSmall = 1e-3;
  s = at.solution;
  const Eigen::VectorXd start = unknowns(s);
  if (by.size() != start.size()) by.setZero(start.size());
  Eigen::VectorXd right(start.size()), step;
  double last = std::numeric_limits<double>::infinity();
  bool newton = false;
  for (int k = 0; k < 12; ++k) {
    set_unknowns(s, start + by);
    const double off = at.normal.dot((by.array() / at.scale.array()).matrix());
    if (newton) {
      const Balance b = balance(system, s, Parameter::speed);
      right << b.residual, off;
      step = matrix_of(at, b).partialPivLu().solve(right);
    } else {
      right << balance_residual(system, s), off;
      step = at.lu.solve(right);
    }
    const double size = step.norm();
    if (!std::isfinite(size) || (newton && size > 0.5)) return false;
    if (!newton && size > std::min(0.5, kFast * last)) {
      newton = true;  // the step is not taken
      continue;
    }
    by -= (step.array() * at.scale.array()).matrix();
    const double distance = (by.array() / at.scale.array()).matrix().norm();
    last = size;
    // A step of Newton squares the error, one with the station's matrix leaves the part of it by which steps shrink.
    if (size < 1e-9 || size < (newton ? 0.03 : kSmall) * distance) {
      set_unknowns(s, start + by);
      return true;
    }
  }
  return false;
}

/// Speed and amplitude along a curve, cubics between its points, in parts.
struct Line {
  std::vector<double> omega, amplitude;
  std::vector<bool> stable;  ///< of each part
};
constexpr std::size_t kParts = 8;

/// Slope of a parabola through three points, at the middle one.
double slope(double x0, double x1, double x2, double y0, double y1, double y2) {
  const double a = x1 - x0, b = x2 - x1;
  return ((y1 - y0) / a * b + (y2 - y1) / b * a) / (a + b);
}

std::vector<double> refined(const std::vector<double>& x, const std::vector<double>& y) {
  const std::size_t n = x.size();
  std::vector<double> slopes(n), out;
  for (std::size_t i = 0; i < n; ++i) {
    if (i == 0 || i + 1 == n) {
      const std::size_t a = i == 0 ? 0 : i - 1;
      slopes[i] = (y[a + 1] - y[a]) / (x[a + 1] - x[a]);
    } else {
      slopes[i] = slope(x[i - 1], x[i], x[i + 1], y[i - 1], y[i], y[i + 1]);
    }
  }
  out.push_back(y[0]);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double h = x[i + 1] - x[i];
    for (std::size_t p = 1; p <= kParts; ++p) {
      const double t = static_cast<double>(p) / kParts, u = 1 - t;
      out.push_back(p == kParts ? y[i + 1]
                                : u * u * (1 + 2 * t) * y[i] + t * t * (3 - 2 * t) * y[i + 1] +
                                      h * t * u * (u * slopes[i] - t * slopes[i + 1]));
    }
  }
  return out;
}

/// A piece with a stable end counts as stable: up to the fold it is, beyond it lies below.
Line line(const std::vector<double>& along, const std::vector<double>& omega, const std::vector<double>& amplitude,
          const std::vector<bool>& stable) {
  Line l{refined(along, omega), refined(along, amplitude), {}};
  const bool any = std::ranges::find(stable, true) != stable.end();
  for (std::size_t i = 0; i + 1 < stable.size(); ++i)
    l.stable.insert(l.stable.end(), kParts, !any || stable[i] || stable[i + 1]);
  return l;
}

/// Place and height of the top of the parabola through three points, the middle one the highest.
std::pair<double, double> top_of(const std::array<double, 3>& x, const std::array<double, 3>& y) {
  const double a = x[1] - x[0], b = x[2] - x[1], middle = slope(x[0], x[1], x[2], y[0], y[1], y[2]);
  const double bend = ((y[2] - y[1]) / b - (y[1] - y[0]) / a) / (a + b);  // half the second derivative
  if (!(bend < 0)) return {x[1], y[1]};
  return {x[1] - middle / (2 * bend), y[1] - middle * middle / (4 * bend)};
}

/// Between the points of a part too: the top of a narrow resonance need not be one of them.
double peak(const std::vector<Line>& lines) {
  double most = 0;
  for (const Line& l : lines) {
    for (std::size_t i = 0; i < l.stable.size(); ++i) {
      if (!l.stable[i]) continue;
      most = std::max({most, l.amplitude[i], l.amplitude[i + 1]});
      const bool inner = i > 0 && l.stable[i - 1];
      if (inner && l.amplitude[i] >= l.amplitude[i - 1] && l.amplitude[i] >= l.amplitude[i + 1])
        most = std::max(most, top_of({-1, 0, 1}, {l.amplitude[i - 1], l.amplitude[i], l.amplitude[i + 1]}).second);
    }
  }
  return most;
}

/// Largest stable amplitude of the lines at each speed; NaN where none passes.
Eigen::VectorXd largest(const std::vector<Line>& lines, const Eigen::VectorXd& omega) {
  Eigen::VectorXd top = Eigen::VectorXd::Constant(omega.size(), std::numeric_limits<double>::quiet_NaN());
  const double first = omega[0], step = omega[1] - omega[0];
  for (const Line& l : lines) {
    for (std::size_t i = 0; i + 1 < l.omega.size(); ++i) {
      const double a = l.omega[i], b = l.omega[i + 1], low = std::min(a, b), high = std::max(a, b);
      if (!(high > low) || !l.stable[i]) continue;
      const auto from = std::max<Index>(0, static_cast<Index>(std::ceil((low - first) / step - 1e-9)));
      for (Index k = from; k < omega.size() && omega[k] <= high + 1e-9 * step; ++k) {
        const double part = std::clamp((omega[k] - a) / (b - a), 0.0, 1.0);
        const double value = l.amplitude[i] + part * (l.amplitude[i + 1] - l.amplitude[i]);
        if (!(value <= top[k])) top[k] = value;
      }
    }
  }
  return top;
}

std::vector<double> heights(const ResponseCurve& curve, const Amplitude& amplitude) {
  std::vector<double> values;
  for (const CurvePoint& p : curve.points) values.push_back(amplitude(p.solution));
  return values;
}

bool is_top(const std::vector<double>& height, std::size_t i) {
  return i > 0 && i + 1 < height.size() && height[i] > height[i - 1] && height[i] >= height[i + 1];
}

/// Far apart in coefficients, of their size, and in speed, of the range.
double apart(const PeriodicSolution& a, const PeriodicSolution& b, double range) {
  const double size = std::max(a.coefficients.norm(), b.coefficients.norm());
  return std::max(
      1e-12, std::hypot((b.coefficients - a.coefficients).norm() / (size > 0 ? size : 1), (b.omega - a.omega) / range));
}

/// The curve's own point of largest amplitude between those around `top`, itself where there is none larger; and
/// whether it lies beyond it.
std::pair<CurvePoint, bool> highest_point(const PeriodicSystem& system, const ResponseCurve& curve, std::size_t top,
                                          double range, const Amplitude& amplitude) {
  const Index rows =
      std::max({curve.points[top - 1].solution.coefficients.rows(), curve.points[top].solution.coefficients.rows(),
                curve.points[top + 1].solution.coefficients.rows()});
  std::array<PeriodicSolution, 3> near;
  std::array<double, 3> along{}, height{};
  for (std::size_t k = 0; k < 3; ++k) {
    near[k] = widened(curve.points[top + k - 1].solution, rows);
    along[k] = k == 0 ? 0 : along[k - 1] + apart(near[k - 1], near[k], range);
    height[k] = amplitude(near[k]);
  }
  CurvePoint best = curve.points[top];
  const double start = along[1];
  for (int round = 0; round < 6; ++round) {
    const double t = std::clamp(top_of(along, height).first, along[0], along[2]);
    if (std::abs(t - along[1]) < 1e-6 * (along[2] - along[0])) break;
    // A guess on the parabola through the three, corrected across the curve.
    const double a = t - along[0], b = t - along[1], c = t - along[2], ab = along[1] - along[0],
                 bc = along[2] - along[1], ac = along[2] - along[0];
    PeriodicSolution guess = near[1];
    set_unknowns(guess, b * c / (ab * ac) * unknowns(near[0]) - a * c / (ab * bc) * unknowns(near[1]) +
                            a * b / (ac * bc) * unknowns(near[2]));
    PeriodicSolution found;
    Eigen::VectorXd by;
    if (!moved(system, station(system, guess, &near[0], &near[2], range), by, found)) break;
    const double value = amplitude(found);
    const bool higher = value > height[1], before = t < along[1];
    if (higher) best.solution = found;
    const std::size_t out = before == higher ? 2 : 0;  // the end that the three leave behind
    if (higher) {
      along[out] = along[1], height[out] = height[1], near[out] = near[1];
      along[1] = t, height[1] = value, near[1] = found;
    } else {
      along[out] = t, height[out] = value, near[out] = found;
    }
  }
  return {best, along[1] > start};
}

/// A curve of the middle system, ready to be moved to drawn ones.
class Track {
 public:
  Track(const PeriodicSystem& system, const ResponseCurve& curve, double range, const Amplitude& amplitude)
      : amplitude_(amplitude) {
    std::vector<CurvePoint> p;  // every second point: cubics between them
    const std::vector<double> height = heights(curve, amplitude);
    for (std::size_t i = 0; i < curve.points.size(); ++i)
      if (i % 2 == 0 || i + 1 == curve.points.size() || is_top(height, i)) p.push_back(curve.points[i]);
    for (std::size_t i = 0; i < p.size(); ++i) {
      const bool inner = i > 0 && i + 1 < p.size();
      const PeriodicSolution& s = p[i].solution;
      stable_.push_back(p[i].stable);
      const PeriodicSolution* before = inner ? &p[i - 1].solution : nullptr;
      const PeriodicSolution* after = inner ? &p[i + 1].solution : nullptr;
      if (inner &&
          (before->coefficients.rows() > s.coefficients.rows() || after->coefficients.rows() > s.coefficients.rows())) {
        before = after = nullptr;  // the number of harmonics changes here
      }
      stations_.push_back(station(system, s, before, after, range));
      const double previous = along_.empty() ? 0 : along_.back();
      if (i == 0) {
        along_.push_back(0);
        continue;
      }
      const PeriodicSolution a =
          widened(p[i - 1].solution, std::max(s.coefficients.rows(), p[i - 1].solution.coefficients.rows()));
      const PeriodicSolution b = widened(s, a.coefficients.rows());
      along_.push_back(previous + apart(a, b, range));
    }
  }

  bool move(const PeriodicSystem& system, Line& out) const {
    std::vector<double> omega, amplitude;
    PeriodicSolution s;
    Eigen::VectorXd by;
    for (const Station& at : stations_) {
      if (!moved(system, at, by, s)) return false;
      omega.push_back(s.omega);
      amplitude.push_back(amplitude_(s));
    }
    out = line(along_, omega, amplitude, stable_);
    return true;
  }

 private:
  std::vector<Station> stations_;
  std::vector<double> along_;
  std::vector<bool> stable_;
  const Amplitude& amplitude_;
};

Line traced(const ResponseCurve& curve, const Amplitude& amplitude) {
  std::vector<double> along, omega, values;
  std::vector<bool> stable;
  for (const CurvePoint& p : curve.points) {
    stable.push_back(p.stable);
    along.push_back(static_cast<double>(along.size()));
    omega.push_back(p.solution.omega);
    values.push_back(amplitude(p.solution));
  }
  return line(along, omega, values, stable);
}

/// Those of the curves that are anywhere the highest: the others, as the lower branch beside an upper one, cost draws
/// and tell nothing.
std::vector<const ResponseCurve*> highest(const std::vector<ResponseCurve>& curves, const Eigen::VectorXd& omega,
                                          const Amplitude& amplitude) {
  std::vector<const ResponseCurve*> kept;
  std::vector<Line> lines;
  for (const ResponseCurve& curve : curves) {
    if (curve.points.size() < 2) continue;
    const Eigen::VectorXd own = largest({traced(curve, amplitude)}, omega), before = largest(lines, omega);
    const bool above = ((own.array() > before.array()) || (own.array().isFinite() && before.array().isNaN())).any();
    if (!kept.empty() && !above) continue;
    kept.push_back(&curve);
    lines.push_back(traced(curve, amplitude));
  }
  return kept;
}

/// The curves of a system that is too far from the middle one.
std::vector<Line> traced(const PeriodicSystem& system, double force, CurveOptions options, bool others,
                         const Amplitude& amplitude) {
  options.longest_step *= 2;
  const ResponseCurve main = response_curve(system, Parameter::speed, force, options);
  std::vector<Line> lines;
  if (main.points.size() < 2) return lines;
  lines.push_back(traced(main, amplitude));
  if (others)
    for (const ResponseCurve& other : other_branches(system, main, force, options))
      if (other.points.size() > 1) lines.push_back(traced(other, amplitude));
  return lines;
}

double quantile(std::vector<double>& values, double q) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double at = q * static_cast<double>(values.size() - 1);
  const auto nth = values.begin() + static_cast<long>(at + 0.5);
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// Of what is finite in a column of draws.
std::pair<double, double> middle(const Eigen::MatrixXd& tops, Index column, Index draws) {
  std::vector<double> values;
  for (Index d = 0; d < draws; ++d)
    if (std::isfinite(tops(d, column))) values.push_back(tops(d, column));
  const double low = quantile(values, 0.025);
  return {low, quantile(values, 0.975)};
}

}  // namespace

void add_peaks(const PeriodicSystem& system, ResponseCurve& curve, double range, const Amplitude& amplitude) {
  const std::vector<double> height = heights(curve, amplitude);
  for (std::size_t i = curve.points.size(); i-- > 0;) {
    if (!is_top(height, i)) continue;
    auto [top, beyond] = highest_point(system, curve, i, range, amplitude);
    if (!(amplitude(top.solution) > height[i])) continue;
    const std::size_t at = beyond ? i + 1 : i;
    curve.points.insert(curve.points.begin() + static_cast<std::ptrdiff_t>(at), std::move(top));
    for (CurveEvent& e : curve.events) e.after += e.after >= at;
  }
}

CurveBand curve_band(const PeriodicSystem& system, const std::vector<ResponseCurve>& curves, double force,
                     const CurveOptions& options, const Amplitude& amplitude, const DrawSystem& draw, int draws,
                     int speeds) {
  require_range("draws", draws, 20, 1e6);
  require_range("speeds", speeds, 2, 1e5);
  CurveBand band;
  double from = std::numeric_limits<double>::infinity(), to = 0;
  for (const ResponseCurve& curve : curves) {
    if (curve.points.size() < 2) continue;
    for (const CurvePoint& p : curve.points) {
      from = std::min(from, p.solution.omega);
      to = std::max(to, p.solution.omega);
    }
  }
  if (!(to > from)) throw Error("a band needs a curve of two points at least");
  band.omega = Eigen::VectorXd::LinSpaced(speeds, from, to);
  std::vector<Track> tracks;
  for (const ResponseCurve* curve : highest(curves, band.omega, amplitude))
    tracks.emplace_back(system, *curve, std::abs(options.to - options.from), amplitude);
  Eigen::MatrixXd tops(draws, speeds + 1);
  for (int d = 0; d < draws; ++d) {
    const std::optional<PeriodicSystem> drawn = draw();
    std::vector<Line> lines(tracks.size());
    bool all = drawn.has_value();
    for (std::size_t k = 0; all && k < tracks.size(); ++k) all = tracks[k].move(*drawn, lines[k]);
    if (drawn && !all) lines = traced(*drawn, force, options, tracks.size() > 1, amplitude);
    const Eigen::VectorXd top = drawn && !lines.empty() ? largest(lines, band.omega) : Eigen::VectorXd();
    if (top.size() == 0 || !top.array().isFinite().any()) {
      ++band.lost;
      continue;
    }
    tops.row(band.draws++) << top.transpose(), peak(lines);
  }
  band.low.resize(speeds);
  band.high.resize(speeds);
  for (Index k = 0; k < speeds; ++k) std::tie(band.low[k], band.high[k]) = middle(tops, k, band.draws);
  std::tie(band.peak_low, band.peak_high) = middle(tops, speeds, band.draws);
  return band;
}

}  // namespace whirl::response
