#include "whirl/records/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "channel.hpp"
#include "whirl/core/error.hpp"

namespace whirl::records {
namespace {

bool is_motion(Quantity q) {
  switch (q) {
    case Quantity::displacement:
    case Quantity::velocity:
    case Quantity::acceleration:
    case Quantity::voltage:
    case Quantity::strain:
    case Quantity::dimensionless:
      return true;
    default:
      return false;
  }
}

detail::ChannelCheck begin(const Channel& channel, const Recording& r) {
  detail::ChannelCheck c;
  c.name = channel.name;
  c.displacement = channel.quantity != Quantity::velocity && channel.quantity != Quantity::acceleration;
  c.dt = r.dt;
  c.t0 = r.t0;
  c.samples = channel.samples;
  detail::find_gaps(c);
  c.measure();
  return c;
}

}  // namespace

std::string_view to_string(FindingKind kind) {
  switch (kind) {
    case FindingKind::gap:
      return "gap";
    case FindingKind::dropout:
      return "dropout";
    case FindingKind::frozen:
      return "frozen";
    case FindingKind::clipping:
      return "clipped";
    case FindingKind::spikes:
      return "spikes";
    case FindingKind::splice:
      return "spliced";
    case FindingKind::hum:
      return "hum";
    case FindingKind::drift:
      return "drift";
    case FindingKind::whirl_sense:
      return "whirl against the angle";
    case FindingKind::angle_unit:
      return "unit of the angle";
    case FindingKind::size:
      return "implausible size";
    case FindingKind::jitter:
      return "jitter";
    case FindingKind::undersampled:
      return "too few samples a turn";
  }
  return "";
}

std::string_view to_string(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::mask:
      return "mask";
    case Severity::model:
      return "model";
    case Severity::refuse:
      return "refuse";
  }
  return "";
}

std::string Finding::text() const {
  std::string out(to_string(kind));
  if (!channel.empty()) out = fmt::format("channel {}: {}", channel, out);
  switch (kind) {
    case FindingKind::gap:
    case FindingKind::dropout:
    case FindingKind::frozen:
    case FindingKind::clipping:
    case FindingKind::spikes:
      out += fmt::format(", {} sample{} from {:.4g} to {:.4g} s", samples, samples == 1 ? "" : "s", begin, end);
      break;
    case FindingKind::splice:
      out += fmt::format(" at {:.5g} s", begin);
      if (samples > 1) out += fmt::format(" and {} more time{}", samples - 1, samples == 2 ? "" : "s");
      break;
    case FindingKind::hum:
      out += fmt::format(" of {:.2f} Hz, amplitude (peak) {:.3g}", frequency, size);
      break;
    case FindingKind::drift:
      out += fmt::format(" by {:.3g} over the record", size);
      break;
    case FindingKind::undersampled:
      out += fmt::format(", {:.2g} at the highest speed", size);
      break;
    case FindingKind::size:
      out += fmt::format(" {:.3g}", size);
      break;
    default:
      break;
  }
  return out + ": " + advice;
}

bool RecordReport::refused() const {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.severity == Severity::refuse; });
}
const ChannelMask* RecordReport::mask(std::string_view channel) const {
  for (const ChannelMask& m : masks) {
    if (m.channel == channel) return &m;
  }
  return nullptr;
}
const Finding* RecordReport::find(FindingKind kind, std::string_view channel) const {
  for (const Finding& f : findings) {
    if (f.kind == kind && (channel.empty() || f.channel == channel)) return &f;
  }
  return nullptr;
}

RecordReport check(const Recording& r, const CheckOptions& options) {
  require_range("dt", r.dt, std::numeric_limits<double>::min(), std::numeric_limits<double>::max(), "s");
  for (const Channel& c : r.channels) {
    if (c.samples.size() != r.size()) {
      throw Error(fmt::format("{}: channel '{}' has {} samples, '{}' has {}", r.source, c.name, c.samples.size(),
                              r.channels.front().name, r.size()));
    }
  }
  RecordReport report;
  if (r.size() == 0) return report;
  const Channel* angle = r.find(options.angle);
  if (angle != nullptr && (angle->quantity != Quantity::angle || !angle->samples.allFinite())) angle = nullptr;
  const auto shows = [&](const std::string& name) {
    const Channel* c = r.find(name);
    return c != nullptr && c->quantity == Quantity::displacement;
  };
  const bool both = r.has(options.x) && r.has(options.y);
  const bool rotor = angle != nullptr && (both || shows(options.x) || shows(options.y)) && r.size() > 64;
  double lowest = 0, highest = 0;  // turning speed, Hz
  if (angle != nullptr && r.size() > 64) {
    lowest = std::numeric_limits<double>::infinity();
    const Eigen::Index part = std::max<Eigen::Index>(2, r.size() / 32);
    for (Eigen::Index first = 0; first + part <= r.size(); first += part) {
      double turned = 0;
      for (Eigen::Index i = first + 1; i < first + part; ++i) {
        turned += std::remainder(angle->samples[i] - angle->samples[i - 1], 2 * std::numbers::pi);
      }
      const double hz = std::abs(turned) / (2 * std::numbers::pi * r.dt * static_cast<double>(part - 1));
      lowest = std::min(lowest, hz);
      highest = std::max(highest, hz);
    }
  }
  std::vector<detail::ChannelCheck> checked;
  for (const Channel& channel : r.channels) {
    detail::ChannelCheck c = begin(channel, r);
    const bool pulses = channel.quantity != Quantity::displacement && detail::is_pulse_train(c.samples, r.dt);
    if (is_motion(channel.quantity) && c.spread > 0 && !pulses && !detail::is_held(c.samples)) {
      // An input may be pulses of one height, a motion not.
      if (channel.quantity == Quantity::displacement || channel.quantity == Quantity::velocity ||
          channel.quantity == Quantity::acceleration) {
        detail::find_out_of_reach(c);
        c.measure();
      }
      detail::find_flat(c);
      c.measure();
      detail::find_spikes(c);
      c.measure();
      if (channel.quantity == Quantity::displacement) {
        detail::find_lines(c, options.mains, lowest, highest);
        if (rotor) {
          detail::find_drift(c, angle->samples);
          detail::find_jitter(c);
        }
      }
    }
    checked.push_back(std::move(c));
  }
  for (detail::ChannelCheck& c : checked) {
    report.findings.insert(report.findings.end(), c.findings.begin(), c.findings.end());
    if (!c.usable.all()) report.masks.push_back({c.name, c.usable});
  }
  if (rotor) {
    const auto of = [&](const std::string& name) -> const detail::ChannelCheck* {
      const auto at = std::find_if(checked.begin(), checked.end(), [&](const auto& c) { return c.name == name; });
      return at == checked.end() ? nullptr : &*at;
    };
    const std::size_t before = report.findings.size();
    detail::check_rotor(of(options.x), of(options.y), angle->samples, options.angle, report);
    bool unit = false;
    for (std::size_t k = before; k < report.findings.size(); ++k) {
      unit |= report.findings[k].kind == FindingKind::angle_unit;
    }
    if (!unit) detail::find_splice(angle->samples, options.angle, r.t0, r.dt, report);
  }
  return report;
}

}  // namespace whirl::records
