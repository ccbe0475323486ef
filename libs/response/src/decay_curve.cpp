#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "usable.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/least_squares.hpp"
#include "whirl/response/decay.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kHarmonics = 3;
constexpr double kLost = 12;  ///< amplitude over its own standard deviation below which a window tells nothing

/// offset + sum_h e^{-h (delta t + mu t^2 / 2)} (a_h cos h phi + b_h sin h phi), phi = omega t + kappa t^2 / 2.
struct Window {
  VectorXd p = VectorXd::Zero(4 + 1 + 2 * kHarmonics);  ///< omega, kappa, delta, mu, offset, a1, b1, a2, b2, ...

  double amplitude() const { return std::hypot(p[5], p[6]); }
};

struct WindowFit {
  const VectorXd& x;
  double dt;
  const Eigen::ArrayX<bool>& usable;

  void linearise(const Window& w, SquareSum& sum) const {
    const Index n = x.size(), m = w.p.size();
    MatrixXd jacobian(n, m);
    VectorXd residual(n);
    const double middle = 0.5 * static_cast<double>(n - 1) * dt;
    for (Index i = 0; i < n; ++i) {
      const double t = static_cast<double>(i) * dt - middle;
      const double phi = w.p[0] * t + 0.5 * w.p[1] * t * t, fall = w.p[2] * t + 0.5 * w.p[3] * t * t;
      double value = w.p[4], by_phi = 0, by_fall = 0;
      jacobian(i, 4) = 1;
      for (int h = 1; h <= kHarmonics; ++h) {
        const double e = std::exp(-h * fall), c = e * std::cos(h * phi), s = e * std::sin(h * phi);
        const double a = w.p[3 + 2 * h], b = w.p[4 + 2 * h], here = a * c + b * s;
        jacobian(i, 3 + 2 * h) = c;
        jacobian(i, 4 + 2 * h) = s;
        value += here;
        by_phi += h * (b * c - a * s);
        by_fall -= h * here;
      }
      jacobian(i, 0) = by_phi * t;
      jacobian(i, 1) = by_phi * 0.5 * t * t;
      jacobian(i, 2) = by_fall * t;
      jacobian(i, 3) = by_fall * 0.5 * t * t;
      residual[i] = x[i] - value;
      if (usable[i]) continue;
      residual[i] = 0;
      jacobian.row(i).setZero();
    }
    sum.cost = residual.squaredNorm();
    sum.normal = jacobian.transpose() * jacobian;
    sum.gradient = jacobian.transpose() * residual;
  }
  void last(const Window& w, SquareSum& sum) const { linearise(w, sum); }
  static Window moved(const Window& w, const VectorXd& step) { return {w.p + step}; }
  static bool small(const SquareSum& sum, const VectorXd&, double decrease) { return decrease < 1e-9 * sum.cost; }
};

/// Angular frequency of the largest line above the first two, refined by a parabola.
double dominant(const VectorXd& x, double dt) {
  const VectorXd centred = x.array() - x.mean();
  const VectorXd power = signal::real_fft(centred).cwiseAbs2();
  if (power.size() < 8) throw Error("decay: the record is too short");
  Index k = 0;
  power.segment(2, power.size() - 3).maxCoeff(&k);
  k += 2;
  const double left = power[k - 1], here = power[k], right = power[k + 1];
  const double shift = 0.5 * (left - right) / (left - 2 * here + right);
  return 2 * std::numbers::pi * (static_cast<double>(k) + (std::isfinite(shift) ? shift : 0)) /
         (static_cast<double>(x.size()) * dt);
}

/// Where the amplitude begins to fall for good: from the end of the record backwards it rises, until a driven part (or
/// the record's begin) where it rises no more.
double fall_begins(const VectorXd& x, double dt, double omega) {
  const auto block = std::max<Index>(4, std::lround(2 * 2 * std::numbers::pi / omega / dt));
  std::vector<double> rms;
  for (Index i = 0; i + block <= x.size(); i += block) {
    const auto part = x.segment(i, block).array();
    rms.push_back(std::sqrt((part - part.mean()).square().mean()));
  }
  constexpr double kRise = 1.02, kHigh = 0.3;
  constexpr int kFlat = 8;  // blocks
  const double top = *std::max_element(rms.begin(), rms.end());
  double peak = 0;
  std::size_t at = 0;
  int flat = 0;
  for (std::size_t i = rms.size(); i-- > 0;) {
    if (rms[i] > kRise * peak) {
      peak = rms[i];
      at = i;
      flat = 0;
    } else if (++flat > kFlat && peak > kHigh * top) {
      break;
    }
  }
  return static_cast<double>(block) * dt * static_cast<double>(at == 0 ? 0 : at + 1);
}

}  // namespace

DecayCurve decay_curve(const Eigen::Ref<const VectorXd>& x, double dt, const DecayOptions& o) {
  if (!x.allFinite()) throw Error("decay: the record has gaps (samples that are not finite)");
  if (!(dt > 0)) throw Error::in_field("dt", fmt::format("{:g} s", dt), "> 0");
  require_range("periods", o.periods, 3, 1000);
  const double length = static_cast<double>(x.size()) * dt;
  for (const auto& [name, time] : {std::pair{"from", o.from}, {"to", o.to}})
    if (time >= 0) require_range(name, time, 0, length, "s");
  const Eigen::ArrayX<bool> usable = usable_or_all(o.usable, x.size(), "decay");
  const VectorXd whole = bridged(x, usable);
  double omega = dominant(whole, dt);
  DecayCurve curve;
  curve.from = o.from >= 0 ? o.from : fall_begins(whole, dt, omega);
  curve.to = o.to >= 0 ? o.to : length;
  const auto first = static_cast<Index>(curve.from / dt), end = static_cast<Index>(curve.to / dt);
  if (first >= end - 64) throw Error(fmt::format("decay: nothing falls between {:g} and {:g} s", curve.from, curve.to));
  omega = dominant(
      whole.segment(first, std::min<Index>(end - first, std::lround(40 * 2 * std::numbers::pi / omega / dt))), dt);
  Window window;
  window.p[0] = omega;
  double squares = 0, freedom = 0;
  Index at = first;
  while (true) {
    const auto n = std::lround(o.periods * 2 * std::numbers::pi / window.p[0] / dt);
    if (n < 4 * window.p.size() || at + n > end) break;
    const VectorXd part = whole.segment(at, n);
    const Eigen::ArrayX<bool> counts = usable.segment(at, n);
    const auto used = static_cast<double>(counts.count());
    if (2 * counts.count() < n || counts.count() < 3 * window.p.size()) {
      at += n;
      continue;
    }
    Window start;
    start.p.head(4) << window.p[0], 0, window.p[2], 0;
    start.p[4] = part.mean();
    WindowFit problem{part, dt, counts};
    SquareSum sum;
    // The linear unknowns first: one Gauss-Newton step from zero amplitude moves only them.
    problem.linearise(start, sum);
    const Index linear = start.p.size() - 4;
    start.p.tail(linear) +=
        MatrixXd(sum.normal.bottomRightCorner(linear, linear)).ldlt().solve(VectorXd(sum.gradient.tail(linear)));
    problem.linearise(start, sum);
    const DescentReport report = descend(problem, start, sum, 40);
    const double variance = sum.cost / (used - static_cast<double>(start.p.size()));
    const InverseInformation inverse = invert_information(sum.normal);
    const double a = start.amplitude();
    const bool good = report.end != Descent::singular && inverse.covariance.size() > 0 && start.p[0] > 0.5 * omega &&
                      start.p[0] < 2 * omega && a > kLost * std::sqrt(variance * 2 / used);
    if (!good) break;
    curve.points.push_back({(static_cast<double>(at) + 0.5 * static_cast<double>(n - 1)) * dt, a, start.p[0],
                            std::sqrt(variance * inverse.covariance(0, 0)), start.p[2],
                            std::sqrt(variance * inverse.covariance(2, 2)), static_cast<double>(n) * dt});
    squares += sum.cost;
    freedom += used - static_cast<double>(start.p.size());
    window = start;
    at += n;
  }
  if (curve.points.size() < 6)
    throw Error(
        fmt::format("decay: {} windows of {:g} periods hold a decaying tone, six are needed: a longer record, or "
                    "fewer periods",
                    curve.points.size(), o.periods));
  curve.to = static_cast<double>(at) * dt;
  curve.noise = std::sqrt(squares / freedom);
  return curve;
}

}  // namespace whirl::response
