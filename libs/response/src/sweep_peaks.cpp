#include "whirl/response/sweep_peaks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/core/error.hpp"

namespace whirl::response {
namespace {

/// Points of the curve and of the others, one after the other; a sweep never crosses from one to the next by counting.
class Sweeper {
 public:
  Sweeper(const ResponseCurve& curve, const std::vector<ResponseCurve>& others, const Amplitude& amplitude) {
    add(curve, amplitude, 0);
    for (std::size_t k = 0; k < others.size(); ++k) add(others[k], amplitude, static_cast<int>(k) + 1);
  }

  /// One sweep; `sign` +1 upwards. Begins at the smallest stable answer of the end from which it comes.
  double run(double sign, bool& jumps) const {
    const auto n = static_cast<long>(value_.size());
    double border = INFINITY;
    for (const double v : value_) border = std::min(border, sign * v);
    long at = -1;
    for (long j = 0; j < n; ++j)
      if (stable(j) && sign * value(j) - border <= 1e-9 * std::abs(border) && (at < 0 || height(j) < height(at)))
        at = j;
    if (at < 0) return std::numeric_limits<double>::quiet_NaN();
    long step = joined(at, at + 1) && sign * (value(at + 1) - value(at)) > 0 ? 1 : -1;
    double peak = 0;
    for (long moves = 0; moves < 4 * n; ++moves) {
      if (stable(at)) peak = std::max(peak, height(at));
      const long next = at + step;
      const bool end = !joined(at, next);
      if (!end && sign * (value(next) - value(at)) > 0 && (stable(next) || !stable(at))) {
        at = next;
        continue;
      }
      if (end && at_border(at, sign)) break;
      // A fold, or the end of stability: over to another stable answer at this value.
      jumps = true;
      const long landing = land(at, sign, step);
      if (landing >= 0) {
        at = landing;
      } else {
        if (end || sign * (value(next) - value(at)) <= 0) break;  // nothing to land on
        at = next;
      }
    }
    return peak;
  }

 private:
  void add(const ResponseCurve& c, const Amplitude& amplitude, int id) {
    for (const CurvePoint& p : c.points) {
      value_.push_back(c.value(p));
      height_.push_back(amplitude(p.solution));
      stable_.push_back(p.stable);
      id_.push_back(id);
    }
  }
  double value(long i) const { return value_[static_cast<std::size_t>(i)]; }
  double height(long i) const { return height_[static_cast<std::size_t>(i)]; }
  bool stable(long i) const { return stable_[static_cast<std::size_t>(i)]; }
  bool joined(long i, long k) const {
    return k >= 0 && k < static_cast<long>(id_.size()) &&
           id_[static_cast<std::size_t>(i)] == id_[static_cast<std::size_t>(k)];
  }
  bool at_border(long i, double sign) const {
    double border = -INFINITY;
    for (const double v : value_) border = std::max(border, sign * v);
    return border - sign * value(i) <= 1e-9 * std::abs(border);
  }
  /// The highest stable answer at the same value, elsewhere; `step` then leads on in the direction of the sweep.
  long land(long at, double sign, long& step) const {
    long best = -1;
    for (long j = 0; j + 1 < static_cast<long>(value_.size()); ++j) {
      if (std::abs(j - at) <= 1 || !joined(j, j + 1) || !stable(j) || !stable(j + 1)) continue;
      if ((value(j) - value(at)) * (value(j + 1) - value(at)) > 0) continue;
      const bool rising = sign * (value(j + 1) - value(j)) > 0;
      const long ahead = rising ? j + 1 : j;
      if (best >= 0 && height(ahead) <= height(best)) continue;
      best = ahead;
      step = rising ? 1 : -1;
    }
    return best;
  }

  std::vector<double> value_, height_;
  std::vector<bool> stable_;
  std::vector<int> id_;
};

}  // namespace

SweepPeak sweep_peak(const ResponseCurve& curve, const Amplitude& amplitude, const std::vector<ResponseCurve>& others) {
  SweepPeak peak;
  if (curve.points.size() < 2) return peak;
  const Sweeper sweeper(curve, others, amplitude);
  peak.up = sweeper.run(1, peak.jumps);
  peak.down = sweeper.run(-1, peak.jumps);
  return peak;
}

PeakCurve peak_over_force(const PeriodicSystem& system, const Eigen::VectorXd& force, const CurveOptions& options,
                          const Amplitude& amplitude) {
  if (force.size() < 1) throw Error("peak over force: no force");
  PeakCurve out;
  out.force = force;
  out.up = out.down = out.largest = Eigen::VectorXd::Constant(force.size(), std::numeric_limits<double>::quiet_NaN());
  out.jump_from = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> ended;
  for (Eigen::Index k = 0; k < force.size(); ++k) {
    if (!(force[k] > 0)) throw Error::in_field("force", fmt::format("{:g}", force[k]), "positive");
    const ResponseCurve curve = response_curve(system, Parameter::speed, force[k], options);
    if (curve.points.size() < 2 ||
        std::abs(curve.value(curve.points.back()) - options.to) > 1e-9 * std::abs(options.to)) {
      ended.push_back(force[k]);
      continue;
    }
    const std::vector<ResponseCurve> others = other_branches(system, curve, force[k], options);
    const SweepPeak peak = sweep_peak(curve, amplitude, others);
    out.up[k] = peak.up;
    out.down[k] = peak.down;
    out.largest[k] = 0;
    for (const CurvePoint& p : curve.points) out.largest[k] = std::max(out.largest[k], amplitude(p.solution));
    if (peak.jumps && std::isnan(out.jump_from)) out.jump_from = force[k];
  }
  if (!ended.empty())
    out.summary.warn(
        fmt::format("for {} of {} sizes of the forcing, from {:.4g} to {:.4g}, the curve does not reach the end of the "
                    "range: no peak is given there",
                    ended.size(), force.size(), ended.front(), ended.back()));
  return out;
}

}  // namespace whirl::response
