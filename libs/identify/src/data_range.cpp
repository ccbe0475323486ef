#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "evidence/model_verdict.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/records/check.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::identification {
namespace {

double middle(double a, double b, double c) { return std::max(std::min(a, b), std::min(std::max(a, b), c)); }

/// NaN readings do not count.
double amplitude_of(const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  const auto mean = [](const Eigen::VectorXd& v) {
    const Eigen::Array<bool, Eigen::Dynamic, 1> there = v.array().isFinite();
    return there.select(v.array(), 0.0).sum() / std::max<double>(1, static_cast<double>(there.count()));
  };
  Eigen::ArrayXd radius = ((x.array() - mean(x)).square() + (y.array() - mean(y)).square()).sqrt();
  radius = radius.isFinite().select(radius, 0.0).eval();
  double largest = 0;
  for (Eigen::Index i = 1; i + 1 < radius.size(); ++i)
    largest = std::max(largest, middle(radius[i - 1], radius[i], radius[i + 1]));
  return largest;
}

Eigen::Index block_of(const Recording& r) { return std::max<Eigen::Index>(1, r.size() / 50); }

/// Means over fiftieths of a record, so that an encoder's steps do not count; NaN where readings miss.
std::vector<double> speeds_of(const Recording& r) {
  std::vector<double> speeds;
  const Eigen::VectorXd& beta = r["beta"];
  const Eigen::Index block = block_of(r);
  for (Eigen::Index i = 0; i + block < beta.size(); i += block) {
    const Eigen::VectorXd turned = signal::unwrapped(beta.segment(i, block + 1));  // it may come back to 0 every turn
    speeds.push_back(std::abs(turned[block] - turned[0]) / (static_cast<double>(block) * r.dt));
  }
  return speeds;
}

/// A channel with NaN where the check of records finds no reading. What is cut off at its limit is one: at least so far
/// it went.
Eigen::VectorXd readings_of(const Recording& r, const records::RecordReport& report, const char* name) {
  Eigen::VectorXd v = r[name];
  const records::ChannelMask* mask = report.mask(name);
  if (mask == nullptr) return v;
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    const auto limit = [&](const records::Finding& f) {
      return f.kind == records::FindingKind::clipping && f.channel == name && f.size == v[i];
    };
    if (!mask->usable[i] && std::ranges::none_of(report.findings, limit)) v[i] = kNaN;
  }
  return v;
}

double amplitude_of(const Recording& r) {
  Recording motion;
  motion.dt = r.dt;
  for (const char* name : {"x", "y"}) motion.channels.push_back(r.at(name));
  const records::RecordReport report = records::check(motion);
  return amplitude_of(readings_of(r, report, "x"), readings_of(r, report, "y"));
}

}  // namespace

double detail::passing_rate(const std::vector<Recording>& records, double omega) {
  double fastest = 0;
  for (const Recording& r : records) {
    const std::vector<double> speeds = speeds_of(r);
    for (std::size_t i = 1; i < speeds.size(); ++i) {
      const double change = speeds[i] - speeds[i - 1];
      if ((speeds[i - 1] - omega) * (speeds[i] - omega) <= 0)
        fastest = std::max(fastest, std::abs(change) / (static_cast<double>(block_of(r)) * r.dt));
    }
  }
  return fastest;
}

std::string DataRange::beyond(double a, double from, double to) const {
  std::string text;
  if (a > amplitude) text = fmt::format("radii above {:.3g} mm peak (here up to {:.3g} mm)", 1e3 * amplitude, 1e3 * a);
  if (!holds(0, from) || !holds(0, to))
    text += fmt::format("{}speeds outside {:.0f} to {:.0f} rpm", text.empty() ? "" : " and ", low / kRadPerSecPerRpm,
                        high / kRadPerSecPerRpm);
  return text.empty() ? text : text + " are extrapolation: the records of the model went no further";
}

DataRange data_range(const std::vector<Recording>& records) {
  DataRange range{0, std::numeric_limits<double>::infinity(), 0};
  for (const Recording& r : records) {
    // Velocities and accelerations do not show how far it moved.
    const bool displacement = r.at("x").quantity != Quantity::velocity && r.at("x").quantity != Quantity::acceleration;
    const double largest = displacement ? amplitude_of(r) : std::numeric_limits<double>::infinity();
    range.amplitude = std::max(range.amplitude, largest);
    for (const double speed : speeds_of(r)) {
      if (!std::isfinite(speed)) continue;
      range.low = std::min(range.low, speed);
      range.high = std::max(range.high, speed);
    }
  }
  return range;
}

}  // namespace whirl::identification
