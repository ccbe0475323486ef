#include "whirl/signal/angle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "angle_spline.hpp"
#include "tacho/tacho_marks.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::signal {
namespace {

using detail::SmoothCurve;
constexpr int kLearned = 3;        // times that the places of marks are taken from the fit
constexpr double kSmeared = 0.05;  // rad beyond the rotor's own step: a reading in the middle of a wrap

double bic(const SmoothCurve& c, Eigen::Index readings) {
  const double n = static_cast<double>(readings);
  const double rms = std::max(c.rms(), 1e-9);  // below: rounding of the readings
  return 2 * n * std::log(rms) + c.parameters() * std::log(n);
}

// `floor`: residual that the readings must have by their resolution; no finer curve is tried below it.
SmoothCurve choose_curve(const Eigen::VectorXd& t, const Eigen::VectorXd& y, const AngleFitOptions& options,
                         double floor) {
  if (options.intervals > 0) return SmoothCurve::spline(t, y, options.intervals);
  const Eigen::Index n = t.size();
  SmoothCurve best = SmoothCurve::polynomial(t, y, 2);
  double best_bic = bic(best, n);
  const auto consider = [&](SmoothCurve&& c) {
    if (const double b = bic(c, n); b < best_bic) {
      best_bic = b;
      best = std::move(c);
    }
  };
  const auto good = [&] { return best.rms() <= std::max(1.05 * floor, 1e-9); };
  for (int degree = 3; degree <= 5 && !good(); ++degree) consider(SmoothCurve::polynomial(t, y, degree));
  const double duration = t[n - 1] - t[0];
  for (int k = 2; !good() && duration / k >= options.shortest_interval && 3 * (k + 5) <= n; k *= 2) {
    consider(SmoothCurve::spline(t, y, k));
  }
  return best;
}

AngleFit evaluate(const SmoothCurve& curve, double dt, Eigen::Index samples) {
  AngleFit fit;
  const Eigen::Index size = 2 * samples - 1;
  fit.angle.dt = dt;
  fit.angle.beta.resize(size);
  fit.angle.omega.resize(size);
  fit.angle.alpha.resize(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const Eigen::Vector3d v = curve.at(0.5 * dt * static_cast<double>(i));
    fit.angle.beta[i] = v[0];
    fit.angle.omega[i] = v[1];
    fit.angle.alpha[i] = v[2];
  }
  fit.residual = curve.rms();
  fit.parameters = curve.parameters();
  return fit;
}

/// Moves the marks to where the curve sees them, the first one staying at 0, and the readings with them.
void learn_marks(const SmoothCurve& curve, const Eigen::VectorXd& t, Eigen::VectorXd& y, detail::MarkedPulses& p) {
  std::vector<std::vector<double>> off(p.pattern.marks.size());
  for (Eigen::Index k = 0; k < t.size(); ++k)
    off[p.mark[static_cast<std::size_t>(k)]].push_back(curve.at(t[k])[0] - y[k]);
  std::vector<double> move(off.size(), 0);
  for (std::size_t j = 0; j < off.size(); ++j) {
    if (off[j].empty()) continue;
    const auto middle = off[j].begin() + static_cast<std::ptrdiff_t>(off[j].size() / 2);
    std::nth_element(off[j].begin(), middle, off[j].end());
    move[j] = *middle;
  }
  for (std::size_t j = move.size(); j-- > 0;) {
    move[j] -= move[0];
    p.pattern.marks[j] += move[j] / kTwoPi;
  }
  for (Eigen::Index k = 0; k < t.size(); ++k) y[k] += move[p.mark[static_cast<std::size_t>(k)]];
}

/// Leaves out pulses far from the curve: disturbances near a mark.
void drop_far(const SmoothCurve& curve, Eigen::VectorXd& t, Eigen::VectorXd& y, detail::CountedPulses& p) {
  constexpr double kFarAway = 9;  // times the median distance, six deviations
  std::vector<double> off;
  for (Eigen::Index k = 0; k < t.size(); ++k) off.push_back(std::abs(curve.at(t[k])[0] - y[k]));
  std::vector<double> sorted = off;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  Eigen::Index kept = 0;
  for (Eigen::Index k = 0; k < t.size(); ++k) {
    if (off[static_cast<std::size_t>(k)] > kFarAway * *middle) continue;
    t[kept] = t[k];
    y[kept++] = y[k];
  }
  p.missing += t.size() - kept;
  p.extra += t.size() - kept;
  t.conservativeResize(kept);
  y.conservativeResize(kept);
}

// Smallest step of quantised readings; 0 when the steps are not its multiples.
double step_size(const Eigen::VectorXd& y) {
  constexpr double kZero = 1e-9;
  double step = 0;
  for (Eigen::Index i = 1; i < y.size(); ++i) {
    const double d = std::abs(y[i] - y[i - 1]);
    if (d > kZero && (step == 0 || d < step)) step = d;
  }
  if (step == 0) return 0;
  Eigen::Index multiples = 0;
  for (Eigen::Index i = 1; i < y.size(); ++i) {
    const double m = (y[i] - y[i - 1]) / step;
    multiples += std::abs(m - std::round(m)) < 1e-2;
  }
  if (100 * multiples < 99 * (y.size() - 1)) return 0;
  // A smooth sweep also has differences in multiples of one step; its third differences vanish, those of a counter do
  // not.
  double third = 0;
  for (Eigen::Index i = 3; i < y.size(); ++i) {
    const double d = y[i] - 3 * (y[i - 1] - y[i - 2]) - y[i - 3];
    third += d * d;
  }
  return third > 0.01 * step * step * static_cast<double>(y.size()) ? step : 0;
}

}  // namespace

Eigen::VectorXd unwrapped(const Eigen::Ref<const Eigen::VectorXd>& readings) {
  const Eigen::Index n = readings.size();
  Eigen::VectorXd out = readings;
  for (Eigen::Index i = 1; i < n; ++i) {
    out[i] = out[i - 1] + std::remainder(readings[i] - readings[i - 1], kTwoPi);
    if (i + 1 == n || std::abs(readings[i + 1] - readings[i - 1]) < 0.5 * kTwoPi) continue;
    // A wrap lies between the neighbours. On the way from one to the other this reading should be half of it.
    const double both = std::remainder(readings[i + 1] - readings[i - 1], kTwoPi);
    const double off = std::abs(std::remainder(readings[i] - readings[i - 1] - 0.5 * both, kTwoPi));
    if (off > std::abs(both) + kSmeared) {
      out[i] = out[i - 1] + 0.5 * both;
      out[i + 1] = out[i] + 0.5 * both;
      ++i;
    }
  }
  return out;
}

AngleFit angle_from_encoder(const Eigen::Ref<const Eigen::VectorXd>& readings, double dt,
                            const AngleFitOptions& options) {
  require_range("dt", dt, 1e-9, 1e3, "s");
  const Eigen::Index n = readings.size();
  if (n < 16) throw Error::in_field("angle readings", fmt::format("{}", n), "at least 16");
  if (!readings.allFinite()) throw Error("angle readings: contain values that are not finite");
  Eigen::VectorXd y = unwrapped(readings), t(n);
  for (Eigen::Index i = 0; i < n; ++i) t[i] = dt * static_cast<double>(i);
  const double resolution = step_size(y);
  y.array() += options.count_offset * resolution;
  const double floor = resolution > 0 ? resolution / std::sqrt(12.0) : noise_sd(y);
  AngleFit fit = evaluate(choose_curve(t, y, options, floor), dt, n);
  fit.resolution = resolution;
  if (resolution > 0 && fit.residual > resolution) {
    fit.summary.warn(
        fmt::format("angle: the smooth fit leaves {:.2g} rad rms, {:.1f} times the resolution: the speed varies "
                    "faster than {:g} s",
                    fit.residual, fit.residual / resolution, options.shortest_interval));
  }
  fit.summary.residual = fit.residual;
  return fit;
}

AngleFit angle_from_pulses(const std::vector<double>& times, double dt, Eigen::Index samples,
                           const AngleFitOptions& options, const TachoOptions& tacho, double quantum) {
  require_range("dt", dt, 1e-9, 1e3, "s");
  if (times.size() < 6) throw Error::in_field("pulses of the tacho", fmt::format("{}", times.size()), "at least 6");
  if (!std::is_sorted(times.begin(), times.end())) throw Error("pulses of the tacho: times are not ascending");
  detail::MarkedPulses marked = detail::mark_pulses(times, tacho, quantum);
  detail::CountedPulses& pulses = marked.pulses;
  const auto n = static_cast<Eigen::Index>(pulses.times.size());
  Eigen::VectorXd t = Eigen::Map<const Eigen::VectorXd>(pulses.times.data(), n);
  Eigen::VectorXd y = kTwoPi * Eigen::Map<const Eigen::VectorXd>(pulses.turns.data(), n);
  SmoothCurve curve = choose_curve(t, y, options, 0);
  for (int pass = 0; pass < kLearned && marked.pattern.marks.size() > 1; ++pass) {
    learn_marks(curve, t, y, marked);
    curve = choose_curve(t, y, options, 0);
  }
  if (marked.pattern.marks.size() > 1) {
    drop_far(curve, t, y, pulses);
    curve = choose_curve(t, y, options, 0);
  }
  AngleFit fit = evaluate(curve, dt, samples);
  fit.missing = pulses.missing;
  fit.extra = pulses.extra;
  fit.pattern = std::move(marked.pattern);
  fit.summary.residual = fit.residual;
  if (fit.missing + fit.extra > 0)
    fit.summary.warn(fmt::format("pulses of the tacho: {} missing, {} extra repaired", fit.missing, fit.extra));
  return fit;
}

AngleSignal angle_from_profile(double beta0, double omega0, double alpha, double dt, Eigen::Index samples) {
  require_range("dt", dt, 1e-9, 1e3, "s");
  require_range("samples", static_cast<double>(samples), 1, 1e10);
  const Eigen::ArrayXd t =
      0.5 * dt * Eigen::ArrayXd::LinSpaced(2 * samples - 1, 0, static_cast<double>(2 * samples - 2));
  return {dt, beta0 + omega0 * t + 0.5 * alpha * t.square(), omega0 + alpha * t,
          Eigen::VectorXd::Constant(2 * samples - 1, alpha)};
}

}  // namespace whirl::signal
