#include "whirl/tuning/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>

#include "whirl/tuning/loop_margins.hpp"

namespace whirl::tuning {

std::string Verdict::text() const {
  std::string out;
  for (const std::string& reason : reasons) out += (out.empty() ? "" : "; ") + reason;
  return out;
}

std::string margin_shortfall(const ControllerDesign& design, const VerdictLimits& limits) {
  LoopMargins m;
  m.gain_up = m.delay = std::numeric_limits<double>::infinity();
  m.phase = std::numbers::pi;
  const auto take = [&](const char* name, double& to, double unit = 1) {
    if (const auto at = design.margins.find(name); at != design.margins.end()) to = unit * at->second;
  };
  take("gain_margin", m.gain_up);
  take("gain_margin_down", m.gain_down);
  take("delay_margin_s", m.delay);
  take("phase_margin_deg", m.phase, std::numbers::pi / 180);
  take("peak_sensitivity", m.peak_sensitivity);
  m.stable = m.delay > 0;
  const std::optional<Finding> missed = missed_margin(m, design.sample_time, limits);
  return missed ? whirl::text(*missed) : std::string();
}

Verdict judge(const JudgedRun& r, const VerdictLimits& limits) {
  Verdict v;
  const auto fail = [&](std::string reason) { v.reasons.push_back(std::move(reason)); };
  if (r.trip != Fault::none) {
    fail(fmt::format("the loop tripped after {:.0f} % of the run: {}", 100 * r.survived, to_string(r.trip)));
  } else if (r.survived < 1) {
    fail(fmt::format("the motion diverged after {:.0f} % of the run", 100 * r.survived));
  }
  if (r.standing_rms > 0) {
    fail(
        fmt::format("limit cycle while turning: {:.3f} mm rms that does not turn with the rotor, {:.1f} s into the run",
                    1e3 * r.standing_rms, r.standing_time));
  }
  if (!(r.standstill_rms <= limits.standing_rms)) {
    fail(fmt::format("limit cycle or offset at standstill: {:.3f} mm rms", 1e3 * r.standstill_rms));
  }
  v.stable = v.reasons.empty();
  if (!r.margins.empty()) v.reasons.insert(v.reasons.begin(), "the margins of the design: " + r.margins);
  for (std::size_t i = 0; i < r.closed.segment.size(); ++i) {
    const double open = r.open.segment[i], closed = r.closed.segment[i];
    if (open > 0 && closed > std::max(limits.segment_ratio * open, open + limits.segment_floor)) {
      fail(fmt::format("segment {} is worse than without control: {:.3f} mm against {:.3f} mm (zero-to-peak)", i + 1,
                       1e3 * closed, 1e3 * open));
    }
  }
  if (r.nominal_excess) {
    const double nominal = r.smooth_variation + std::max(*r.nominal_excess, 0.0);
    if (r.total_variation > limits.variation * nominal) {
      fail(fmt::format("the force chatters: total variation {:.0f} N/s, {:.1f} times the nominal {:.0f} N/s",
                       r.total_variation, r.total_variation / nominal, nominal));
    }
  }
  if (r.saturated_turning > limits.saturated) {
    fail(
        fmt::format("the force is at its limit {:.1f} % of the time while the shaft turns", 100 * r.saturated_turning));
  }
  return v;
}

}  // namespace whirl::tuning
