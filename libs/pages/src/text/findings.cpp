#include "whirl/pages/text/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/report/format.hpp"

namespace whirl::pages {
namespace {

using diagnosis::Cause;
using diagnosis::UnjudgedReason;
using diagnosis::VibrationCode;
using diagnosis::VibrationFinding;
constexpr double kSmallestChance = 1e-12;  // smaller ones say nothing more

std::string cause_words(Cause cause) {
  switch (cause) {
    case Cause::unbalance:
      return "unbalance";
    case Cause::bent_shaft:
      return "a bent shaft";
    case Cause::misalignment:
      return "misalignment";
    case Cause::unequal_stiffness:
      return "unequal stiffness of the shaft (keyways, a crack)";
    case Cause::oil_whirl:
      return "oil whirl";
    case Cause::oil_whip:
      return "oil whip";
    case Cause::looseness:
      return "looseness";
    case Cause::rub:
      return "a rub";
    case Cause::electric:
      return "an electric source (air gap, supply)";
    case Cause::pickup:
      return "electric pickup in the measuring chain";
    case Cause::free_vibration:
      return "the rotor's free vibration after the passage of its critical speed";
    case Cause::modulation:
      return "an amplitude or speed that changes periodically";
    case Cause::run_out:
      return "run-out of the surface under the probe";
    case Cause::thermal:
      return "a shaft that bends as it warms";
    case Cause::other_machine:
      return "another machine";
  }
  return "";
}

std::string meaning(const VibrationFinding& f) {
  std::string out;
  for (std::size_t k = 0; k < f.causes.size(); ++k)
    out += (k == 0 ? "" : k + 1 == f.causes.size() ? " or " : ", ") + cause_words(f.causes[k]);
  return out;
}

std::string rpm_words(double speed) { return fmt::format("{:.0f} rpm", speed / kRadPerSecPerRpm); }

std::string peak_words(const VibrationFinding& f) {
  return report::format_amplitude(f.size, AmplitudeKind::peak, f.quantity);
}

std::string order_list(const std::vector<double>& orders) {
  std::string out;
  for (const double order : orders) out += fmt::format("{}{:g}X", out.empty() ? "" : ", ", order);
  return out;
}

std::string ratio_words(const VibrationFinding& f) {
  if (!std::isfinite(f.ratio)) return "";
  if (f.ratio > 1) return fmt::format(", exceeds 1X: {:.3g} times 1X", f.ratio);
  return fmt::format(", {:.2g} of 1X", f.ratio);
}

// A line near the supply, or twice it: another grid, or another machine.
std::string off_supply_words(const VibrationFinding& f) {
  return fmt::format("a line at {:.2f} Hz {}, no order, {:.1f} % off {:g} Hz of a supply", f.frequency, peak_words(f),
                     100 * std::abs(f.frequency / f.nominal - 1), f.nominal);
}

// What was found, with its size.
std::string found_words(const VibrationFinding& f) {
  switch (f.code) {
    case VibrationCode::first_order:
      return "1X " + peak_words(f);
    case VibrationCode::second_order:
      return "2X " + peak_words(f) + ratio_words(f);
    case VibrationCode::harmonics:
      return fmt::format("harmonics {}, largest {:g}X {}{}", order_list(f.orders), f.order, peak_words(f),
                         ratio_words(f));
    case VibrationCode::half_orders:
      return fmt::format("half orders {}, largest {:g}X {}{}", order_list(f.orders), f.order, peak_words(f),
                         ratio_words(f));
    case VibrationCode::subsynchronous:
      return fmt::format("a line at {:.3f}X ({:.2f} Hz) {}{}", f.order, f.frequency, peak_words(f), ratio_words(f));
    case VibrationCode::line_frequency:
      if (f.off_supply) return off_supply_words(f);
      return fmt::format("line frequency {:.2f} Hz {}, no order", f.frequency, peak_words(f));
    case VibrationCode::twice_line_frequency:
      if (f.off_supply) return off_supply_words(f);
      return fmt::format("twice the line frequency {:.2f} Hz {}, no order", f.frequency, peak_words(f));
    case VibrationCode::sidebands:
      return fmt::format("sidebands {:.3g} Hz beside {:g}X {}{}", f.frequency, f.order, peak_words(f), ratio_words(f));
    case VibrationCode::phase_scatter:
      return fmt::format("phase of 1X wanders by {:.1f}° rms beyond the noise", f.size / kRadPerDegree);
    case VibrationCode::run_out:
      return fmt::format("run-out {}: 1X that is left towards standstill", peak_words(f));
  }
  return "";
}

std::string speed_words(const VibrationFinding& f) {
  if (!std::isfinite(f.speed)) return "";
  std::string out = " at " + rpm_words(f.speed);
  if (std::isfinite(f.low_speed) && f.high_speed > 1.05 * f.low_speed)
    out += fmt::format(" (seen from {:.0f} to {})", f.low_speed / kRadPerSecPerRpm, rpm_words(f.high_speed));
  return out;
}

std::string_view missing_words(const diagnosis::Unjudged& u) {
  switch (u.reason) {
    case UnjudgedReason::no_angle:
      return "no measured rotor angle: record a tacho";
    case UnjudgedReason::too_few_turns:
      return u.code ? "fewer than 64 turns at one speed: record longer" : "fewer than 33 turns: record longer";
    case UnjudgedReason::gaps:
      return "more than 2 % of the samples are missing";
    case UnjudgedReason::speed_changes:
      return "the speed changes: record at steady speed";
    case UnjudgedReason::line_beside_1x:
      return "an electric line beside 1X beats with it: record without the supply, or at another speed";
    case UnjudgedReason::no_slow_turns:
      return "needs a run from below 0.45 of the speed of the largest 1X";
    case UnjudgedReason::few_slow_turns:
      return "too few turns below 0.45 of the speed of the largest 1X: pass these speeds more slowly";
    case UnjudgedReason::half_or_first:
      return "without a tacho the lower of two lines an octave apart may be 0.5X or 1X: told by its size alone";
  }
  return "";
}

std::string_view code_words(VibrationCode code) {
  constexpr std::string_view names[] = {"1X",
                                        "2X",
                                        "harmonics",
                                        "half orders",
                                        "oil whirl",
                                        "line",
                                        "twice the line",
                                        "sidebands",
                                        "1X phase scatter",
                                        "run-out"};
  return names[static_cast<std::size_t>(code)];
}

io::Json finding_object(const VibrationFinding& f) {
  io::Json json = io::Json::object();
  json.set("code", std::string(diagnosis::to_string(f.code)));
  json.set("channel", f.channel);
  const bool angle = f.code == VibrationCode::phase_scatter;
  json.set("size", f.size);
  json.set("unit", angle ? std::string("rad") : std::string(si_unit(f.quantity)));
  json.set("kind", std::string(to_string(angle ? AmplitudeKind::rms : AmplitudeKind::peak)));
  json.set("chance", f.chance).set("order", f.order).set("frequency_hz", f.frequency);
  json.set("nominal_hz", f.nominal).set("off_supply", f.off_supply);
  json.set("orders", f.orders);
  json.set("speed", f.speed).set("low_speed", f.low_speed).set("high_speed", f.high_speed);
  json.set("ratio_to_1x", f.ratio);
  json.set("ambiguous", f.ambiguous).set("remarkable", f.remarkable);
  std::vector<std::string> causes;
  for (const Cause c : f.causes) causes.emplace_back(diagnosis::to_string(c));
  json.set("may_mean", causes);
  json.set("text", text(f));
  return json;
}

}  // namespace

std::string short_text(const VibrationFinding& f) {
  return fmt::format("{}{} (channel {})", found_words(f), f.ambiguous ? ", or an electric line" : "", f.channel);
}

std::string text(const VibrationFinding& f) {
  std::string out = fmt::format("channel {}: {}{}", f.channel, found_words(f), speed_words(f));
  if (f.ambiguous)
    out += ", not distinguished from an electric line of that frequency: record longer or at another speed";
  out += f.chance < kSmallestChance ? fmt::format("; chance under noise below {:.0e}", kSmallestChance)
                                    : fmt::format("; chance under noise {:.1e}", f.chance);
  return out + "; may mean " + meaning(f);
}

std::string text(const diagnosis::Unjudged& u) {
  return fmt::format("{}: {} not assessed: {}", u.channel.empty() ? "all channels" : "channel " + u.channel,
                     u.code ? std::string(code_words(*u.code)) : std::string("orders"), missing_words(u));
}

std::string next_step(const VibrationFinding& f) {
  if (f.ambiguous) return "record longer or at another speed: 2X and electric lines are not distinguished here";
  if (!f.causes.empty() && f.causes.front() == Cause::free_vibration)
    return "record at steady speed: free vibration after a passage dies out";
  switch (f.code) {
    case VibrationCode::first_order:
      return "balance (whirl balance) where 1X is too large";
    case VibrationCode::second_order:
      return "check the alignment, then the shaft for unequal stiffness";
    case VibrationCode::harmonics:
    case VibrationCode::half_orders:
      return "check bolts, bearing clearance and seals";
    case VibrationCode::subsynchronous:
      return "check bearing load, clearance and oil temperature before running faster";
    case VibrationCode::line_frequency:
    case VibrationCode::twice_line_frequency:
      return "switch the supply off and record the run-down: an electric line vanishes at once";
    case VibrationCode::sidebands:
      return "compare the distance of the sidebands with slip, belt and gear frequencies";
    case VibrationCode::phase_scatter:
      return "find why the phase wanders before balancing";
    case VibrationCode::run_out:
      return "take the slow-roll vector off (--slow-roll-rpm)";
  }
  return "";
}

std::vector<std::string> lines_of(const diagnosis::VibrationFindings& v) {
  std::vector<std::string> out;
  if (v.angle == diagnosis::AngleSource::vibration && !v.findings.empty())
    out.push_back(fmt::format("no rotor angle: {:.0f} rpm taken from the largest line that is not electric",
                              v.low_speed / kRadPerSecPerRpm));
  for (const VibrationFinding& f : v.findings) out.push_back(text(f));
  // Channels with the same gap share a line.
  for (std::size_t k = 0; k < v.unjudged.size(); ++k) {
    const auto alike = [&](const diagnosis::Unjudged& u) {
      return u.code == v.unjudged[k].code && u.reason == v.unjudged[k].reason;
    };
    const auto begin = v.unjudged.begin(), here = begin + static_cast<std::ptrdiff_t>(k);
    if (std::find_if(begin, here, alike) != here) continue;
    diagnosis::Unjudged together = *here;
    for (auto u = here + 1; u != v.unjudged.end(); ++u)
      if (alike(*u)) together.channel += ", " + u->channel;
    out.push_back(text(together));
  }
  return out;
}

std::string to_text(const diagnosis::VibrationFindings& v, const std::string& before) {
  std::string out;
  for (const std::string& line : lines_of(v)) out += before + line + "\n";
  return out;
}

io::Json to_json(const diagnosis::VibrationFindings& v) {
  constexpr const char* kAngles[] = {"none", "measured", "vibration"};
  io::Json json = io::Json::object();
  json.set("angle", kAngles[static_cast<std::size_t>(v.angle)]);
  json.set("low_speed", v.low_speed).set("high_speed", v.high_speed);
  io::Json findings = io::Json::array(), unjudged = io::Json::array();
  for (const VibrationFinding& f : v.findings) findings.push(finding_object(f));
  for (const diagnosis::Unjudged& u : v.unjudged) {
    io::Json one = io::Json::object();
    one.set("channel", u.channel);
    one.set("code", u.code ? io::Json(std::string(diagnosis::to_string(*u.code))) : io::Json());
    one.set("reason", std::string(diagnosis::to_string(u.reason)));
    unjudged.push(std::move(one));
  }
  return json.set("findings", std::move(findings)).set("not_judged", std::move(unjudged));
}

}  // namespace whirl::pages
