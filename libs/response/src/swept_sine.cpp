#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "usable.hpp"
#include "whirl/core/error.hpp"
#include "whirl/response/decay.hpp"
#include "whirl/signal/envelope.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kSweptHarmonics = 3;
constexpr double kRest = 0.05;       // of the amplitude that a window may leave over: more is a jump or no tone
constexpr double kForceRest = 0.15;  // of the force

/// Phase of the force, rising, from its analytic signal.
VectorXd phase_of(const Eigen::Ref<const VectorXd>& force) {
  const VectorXd centred = force.array() - force.mean();
  const Eigen::VectorXcd z = signal::analytic_signal(centred);
  VectorXd phase(z.size());
  phase[0] = std::arg(z[0]);
  for (Index i = 1; i < z.size(); ++i) phase[i] = phase[i - 1] + std::arg(z[i] * std::conj(z[i - 1]));
  return phase;
}

/// First harmonic in a window: value, slope and curvature at its middle, and what the fit leaves over (rms).
struct Tone {
  std::complex<double> value, slope, curvature;
  double rest = 0;
};

Tone tone(const Eigen::Ref<const VectorXd>& all, const VectorXd& t, const VectorXd& phase,
          const Eigen::ArrayX<bool>& usable) {
  VectorXd x = all;
  MatrixXd basis(x.size(), 7 + 2 * (kSweptHarmonics - 1));
  for (Index i = 0; i < x.size(); ++i) {
    if (!usable[i]) {  // a row of zeros weighs nothing
      basis.row(i).setZero();
      x[i] = 0;
      continue;
    }
    const double c = std::cos(phase[i]), s = std::sin(phase[i]);
    const double square = 0.5 * t[i] * t[i];
    basis.row(i).head(7) << c, s, t[i] * c, t[i] * s, square * c, square * s, 1;
    for (int h = 2; h <= kSweptHarmonics; ++h) {
      basis(i, 3 + 2 * h) = std::cos(h * phase[i]);
      basis(i, 4 + 2 * h) = std::sin(h * phase[i]);
    }
  }
  const VectorXd b = basis.colPivHouseholderQr().solve(x);
  return {{b[0], -b[1]},
          {b[2], -b[3]},
          {b[4], -b[5]},
          (x - basis * b).norm() / std::sqrt(static_cast<double>(usable.count()))};
}

}  // namespace

std::vector<SteadyPoint> swept_sine_points(const Eigen::Ref<const VectorXd>& force, const Eigen::Ref<const VectorXd>& x,
                                           double dt, const SweptSineOptions& o) {
  if (force.size() != x.size() || x.size() < 64)
    throw Error(fmt::format("swept sine: {} samples of the force, {} of the answer; at least 64 of both are needed",
                            force.size(), x.size()));
  if (!force.allFinite() || !x.allFinite())
    throw Error("swept sine: the record has gaps (samples that are not finite)");
  if (!(dt > 0)) throw Error::in_field("dt", fmt::format("{:g} s", dt), "> 0");
  require_range("periods", o.periods, 3, 1000);
  const Eigen::ArrayX<bool> force_counts = usable_or_all(o.force_usable, x.size(), "swept sine"),
                            counts = usable_or_all(o.usable, x.size(), "swept sine");
  const VectorXd phase = phase_of(bridged(force, force_counts));
  std::vector<SteadyPoint> points;
  std::vector<double> levels;
  int jumps = 0, weak = 0;
  // The ends of the analytic signal suffer.
  const Index end = x.size() - x.size() / 200;
  for (Index at = x.size() / 200; at < end;) {
    Index n = 0;
    while (at + n < end && phase[at + n] - phase[at] < 2 * std::numbers::pi * o.periods) ++n;
    if (at + n >= end) break;
    if (n < 6 * o.periods) {
      at += std::max<Index>(n, 1);
      ++weak;
      continue;
    }
    VectorXd t(n);
    for (Index i = 0; i < n; ++i) t[i] = (static_cast<double>(i) - 0.5 * static_cast<double>(n - 1)) * dt;
    MatrixXd quadratic(n, 3);
    quadratic << VectorXd::Ones(n), t, 0.5 * t.cwiseAbs2();
    const Eigen::Vector3d p = quadratic.colPivHouseholderQr().solve(phase.segment(at, n));
    const VectorXd smooth = quadratic * p;
    if (2 * force_counts.segment(at, n).count() < n || 2 * counts.segment(at, n).count() < n) {
      at += n;
      ++weak;
      continue;
    }
    const Tone f = tone(force.segment(at, n), t, smooth, force_counts.segment(at, n)),
               a = tone(x.segment(at, n), t, smooth, counts.segment(at, n));
    at += n;
    if (f.rest > kForceRest * std::abs(f.value) || !(std::abs(f.value) > 0)) {
      ++weak;
      continue;
    }
    if (a.rest > kRest * std::abs(a.value)) {
      ++jumps;
      continue;
    }
    // Slopes of the answer alone: what the force's own phase does is in the phase already.
    const std::complex<double> rate = a.slope / a.value;
    points.push_back({p[1], std::abs(f.value), std::abs(a.value), std::arg(a.value / f.value), rate.real(), rate.imag(),
                      p[2], a.curvature / a.value, 0});
    levels.push_back(std::abs(f.value));
  }
  if (points.size() < 8)
    throw Error(
        fmt::format("swept sine: {} windows of {:g} periods hold a steady tone, eight are needed ({} left out: no "
                    "sine in the force, or damaged; {}: jump or noise in the answer)",
                    points.size(), o.periods, weak, jumps));
  std::nth_element(levels.begin(), levels.begin() + static_cast<long>(levels.size() / 2), levels.end());
  for (SteadyPoint& point : points) point.level = levels[levels.size() / 2];
  return points;
}

}  // namespace whirl::response
