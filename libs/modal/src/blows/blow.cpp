// One blow of the hammer: where its pulse is, whether it was clipped, whether the hammer hit again.
#include "blow.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::modal {
namespace {

// Width at half height of the excursion around `peak` of a signal taken positive there, in samples.
Eigen::Index half_width(const Eigen::VectorXd& x, Eigen::Index peak) {
  Eigen::Index first = peak, last = peak;
  while (first > 0 && x[first - 1] > 0.5 * x[peak]) --first;
  while (last + 1 < x.size() && x[last + 1] > 0.5 * x[peak]) ++last;
  return last - first + 1;
}

double correlation(const Eigen::VectorXd& x, Eigen::Index a, Eigen::Index b, Eigen::Index half) {
  Eigen::VectorXd u(2 * half + 1);
  Eigen::VectorXd v(2 * half + 1);
  for (Eigen::Index i = -half; i <= half; ++i) {
    u[i + half] = a + i >= 0 && a + i < x.size() ? x[a + i] : 0;
    v[i + half] = b + i >= 0 && b + i < x.size() ? x[b + i] : 0;
  }
  u.array() -= u.mean();
  v.array() -= v.mean();
  const double norm = u.norm() * v.norm();
  return norm > 0 ? u.dot(v) / norm : 0;
}

}  // namespace

Pulse find_pulse(const Eigen::Ref<const Eigen::VectorXd>& force) {
  Pulse pulse;
  Eigen::VectorXd sorted = force;
  std::nth_element(sorted.data(), sorted.data() + sorted.size() / 2, sorted.data() + sorted.size());
  const double rest = sorted[sorted.size() / 2];
  (force.array() - rest).abs().maxCoeff(&pulse.peak);
  pulse.sign = force[pulse.peak] >= rest ? 1 : -1;
  const auto height = [&](Eigen::Index i) { return pulse.sign * (force[i] - rest); };
  pulse.first = pulse.last = pulse.peak;
  while (pulse.first > 0 && height(pulse.first - 1) > 0.1 * height(pulse.peak)) --pulse.first;
  while (pulse.last + 1 < force.size() && height(pulse.last + 1) > 0.1 * height(pulse.peak)) ++pulse.last;
  pulse.quiet = std::max<Eigen::Index>(0, pulse.first - std::max<Eigen::Index>(2, pulse.width() / 2));
  return pulse;
}

std::vector<Eigen::Index> force_spikes(const Eigen::Ref<const Eigen::VectorXd>& force) {
  const Eigen::Index n = force.size();
  if (n < 16 || !force.allFinite()) return {};
  const auto median_of = [](Eigen::VectorXd v) {
    std::nth_element(v.data(), v.data() + v.size() / 2, v.data() + v.size());
    return v[v.size() / 2];
  };
  const double rest = median_of(force);
  const Eigen::VectorXd height = (force.array() - rest).abs();
  const double noise = median_of(height) / 0.6745;
  const auto alone = [&](Eigen::Index i) { return height[i] > 4 * height[i - 1] && height[i] > 4 * height[i + 1]; };
  // The highest excursion of three samples or more above half its height.
  double pulse = 0;
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    if (height[i] > pulse && !alone(i) && std::min(height[i - 1], height[i + 1]) > 0.5 * height[i] &&
        height[i] >= std::max(height[i - 1], height[i + 1]))
      pulse = height[i];
  }
  std::vector<Eigen::Index> found;
  if (!(pulse > 20 * noise)) return found;
  for (Eigen::Index i = 1; i + 1 < n; ++i)
    if (alone(i) && height[i] > std::max(0.05 * pulse, 12 * noise)) found.push_back(i);
  return found;
}

bool is_overloaded(const Eigen::Ref<const Eigen::VectorXd>& x, double converter_range) {
  if (x.size() < 4) return false;
  if (converter_range > 0 && x.cwiseAbs().maxCoeff() >= 0.995 * converter_range) return true;
  // Smallest step between samples: the resolution of the converter, if it shows. A slow signal rests on one code at its
  // extreme without being clipped, but then enters it by about one code.
  double code = INFINITY;
  for (Eigen::Index i = 1; i < x.size(); ++i) {
    const double step = std::abs(x[i] - x[i - 1]);
    if (step > 0) code = std::min(code, step);
  }
  if (!std::isfinite(code)) return false;
  for (const double sign : {1.0, -1.0}) {
    Eigen::Index at = 0;
    const double extreme = (sign * x).maxCoeff(&at);
    if (extreme <= 0) continue;
    Eigen::Index last = at;
    while (last + 1 < x.size() && std::abs(sign * x[last + 1] - extreme) <= 1e-9 * extreme) ++last;
    const bool enters = at > 0 && extreme - sign * x[at - 1] > 3 * code;
    const bool leaves = last + 1 < x.size() && extreme - sign * x[last + 1] > 3 * code;
    if (last > at && (enters || at == 0) && (leaves || last + 1 == x.size())) return true;
  }
  return false;
}

BlowCheck check_blow(const Eigen::Ref<const Eigen::VectorXd>& force, double dt, double converter_range) {
  require_range("dt", dt, 1e-15, 1e6, "s");
  if (force.size() < 8) throw Error(fmt::format("force record of {} samples: must have at least 8", force.size()));
  const Pulse pulse = find_pulse(force);
  BlowCheck check;
  check.overload = is_overloaded(force.segment(pulse.first, pulse.width()), converter_range) ||
                   is_overloaded(force, converter_range);

  const double rest = pulse.quiet > 0 ? force.head(pulse.quiet).mean() : 0.0;
  const Eigen::VectorXd x = pulse.sign * (force.array() - rest);
  const double noise =
      pulse.quiet > 1 ? std::sqrt(x.head(pulse.quiet).squaredNorm() / static_cast<double>(pulse.quiet)) : 0.0;
  const double peak = x[pulse.peak];
  check.peak = pulse.sign * peak;
  check.time = dt * static_cast<double>(pulse.peak);
  check.pulse_width = dt * static_cast<double>(pulse.width());

  // Flat top behind a filter: three samples near the peak that differ by next to nothing.
  for (Eigen::Index i = pulse.first + 1; i + 1 <= pulse.last; ++i) {
    check.overload |=
        x[i] > 0.8 * peak && std::abs(x[i + 1] - x[i]) < 1e-6 * peak && std::abs(x[i] - x[i - 1]) < 1e-6 * peak;
  }

  const double threshold = std::max(0.03 * peak, 8 * noise);
  const Eigen::Index main_half_width = half_width(x, pulse.peak);
  const Eigen::Index half = std::max<Eigen::Index>(2, pulse.width());
  for (Eigen::Index i = pulse.last + 1 + pulse.width(); i < x.size(); ++i) {
    if (x[i] <= threshold) continue;
    Eigen::Index top = i;
    for (; i < x.size() && x[i] > threshold; ++i) {
      if (x[i] > x[top]) top = i;
    }
    if (2 * half_width(x, top) >= main_half_width && correlation(x, pulse.peak, top, half) > 0.6) {
      check.second_hits.push_back({dt * static_cast<double>(top - pulse.peak), x[top] / peak});
    }
  }
  return check;
}

}  // namespace whirl::modal
