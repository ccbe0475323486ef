#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "channel.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::records::detail {
namespace {

using Complex = std::complex<double>;

/// Energy of z that turns along with `scale` times the angle, in windows of some turns.
/// One axis alone (both the same) turns both ways alike.
double synchronous(const ChannelCheck& x, const ChannelCheck& y, const Eigen::VectorXd& angle, double scale) {
  const double second = &x == &y ? 0 : 1;
  const Eigen::Index n = angle.size(), width = std::max<Eigen::Index>(64, n / 200);
  const double mx = x.samples.mean(), my = y.samples.mean();
  double energy = 0;
  for (Eigen::Index first = 0; first + width <= n; first += width) {
    Complex sum = 0;
    for (Eigen::Index i = first; i < first + width; ++i) {
      sum += Complex(x.samples[i] - mx, second * (y.samples[i] - my)) * std::polar(1.0, -scale * angle[i]);
    }
    energy += std::norm(sum) / static_cast<double>(width);
  }
  return energy / (static_cast<double>(n) * (x.spread * x.spread + second * y.spread * y.spread));
}

/// How many stretches of the faster half of a record turn with the angle, and how many against it. Each counts alike:
/// near the critical speed the free vibration is far larger than the motion that the rotation drives, and turns both
/// ways.
struct Turning {
  long with = 0, against = 0, stretches = 0;
};
Turning turning(const ChannelCheck& x, const ChannelCheck& y, const Eigen::VectorXd& angle) {
  const Eigen::Index n = angle.size(), width = std::max<Eigen::Index>(64, n / 200);
  const double mx = x.samples.mean(), my = y.samples.mean();
  std::vector<double> speeds;
  for (Eigen::Index first = 0; first + width <= n; first += width)
    speeds.push_back(std::abs(angle[first + width - 1] - angle[first]));
  const double middle = speeds.empty() ? 0 : median(speeds);
  Turning found;
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    // Within less than a turn the two senses look alike.
    if (speeds[k] < middle || speeds[k] < kTwoPi) continue;
    Complex with = 0, against = 0;
    double energy = 0;
    for (Eigen::Index i = static_cast<Eigen::Index>(k) * width; i < static_cast<Eigen::Index>(k + 1) * width; ++i) {
      const Complex z(x.samples[i] - mx, y.samples[i] - my), turn = std::polar(1.0, -angle[i]);
      with += z * turn;
      against += z * std::conj(turn);
      energy += std::norm(z);
    }
    ++found.stretches;
    // Noise alone stays far below a tenth of the energy in one line.
    const double floor = 0.1 * energy * static_cast<double>(width);
    found.with += std::norm(with) > floor && std::norm(with) > 4 * std::norm(against);
    found.against += std::norm(against) > floor && std::norm(against) > 4 * std::norm(with);
  }
  return found;
}

}  // namespace

namespace {

/// Samples a turn at the highest speed; single jumps do not count.
double samples_a_turn(const Eigen::VectorXd& angle) {
  // Readings over more than two turns are continuous: their steps are known beyond half a turn.
  const bool continuous = angle.maxCoeff() - angle.minCoeff() > 2 * kTwoPi;
  const Eigen::VectorXd a = continuous ? angle : signal::unwrapped(angle);
  std::vector<double> steps;
  for (Eigen::Index i = 1; i < a.size(); ++i) steps.push_back(std::abs(a[i] - a[i - 1]));
  const auto high = steps.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(steps.size()));
  std::nth_element(steps.begin(), high, steps.end());
  return *high > 0 ? kTwoPi / *high : INFINITY;
}

}  // namespace

void find_splice(const Eigen::VectorXd& angle, std::string_view name, double t0, double dt, RecordReport& report) {
  // As analysers take for the highest frequency shown: 1X lies above it.
  constexpr double kLeastSamples = 2.56;
  const Eigen::Index n = angle.size();
  if (n < 64 || !angle.allFinite()) return;
  if (const double samples = samples_a_turn(angle); samples < kLeastSamples) {
    // Below two the angle itself is read wrong where it wraps, and 1X is folded.
    Finding f{.kind = FindingKind::undersampled,
              .severity = samples < 2 ? Severity::refuse : Severity::note,
              .size = samples};
    f.channel = name;
    f.begin = t0;
    f.end = t0 + dt * static_cast<double>(n);
    f.advice = "the vibration once per turn needs 2.56 at least, ten are better; record faster or take the slower part";
    report.findings.push_back(std::move(f));
    return;
  }
  // Second differences of the unwrapped angle: noise, counts, and the jump of a splice (one step up and one back).
  const Eigen::VectorXd a = signal::unwrapped(angle);
  std::vector<double> second;
  for (Eigen::Index i = 1; i + 1 < n; ++i) second.push_back(std::abs(a[i + 1] - 2 * a[i] + a[i - 1]));
  std::vector<double> steps;
  for (Eigen::Index i = 1; i < n; ++i) steps.push_back(std::abs(a[i] - a[i - 1]));
  const double usual = median(second), step = median(steps);
  std::vector<double> sorted = second;
  const auto high = sorted.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(sorted.size()));
  std::nth_element(sorted.begin(), high, sorted.end());
  const double limit = std::max({12 * usual, 6 * *high, 0.02, 1e-9 * step});
  Eigen::Index jumps = 0, first = 0;
  double size = 0;
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    if (second[static_cast<std::size_t>(i - 1)] < limit) continue;
    if (jumps == 0 || i > first + 3) {
      ++jumps;
      if (jumps == 1) first = i;
      size = std::max(size, second[static_cast<std::size_t>(i - 1)]);
      i += 3;
    }
  }
  if (jumps == 0) return;
  Finding f{.kind = FindingKind::splice, .severity = Severity::refuse, .samples = jumps, .size = size};
  f.channel = name;
  f.begin = t0 + dt * static_cast<double>(first);
  f.end = f.begin + dt;
  f.advice = "the angle jumps: samples are lost or two runs are joined; cut the record there";
  report.findings.push_back(std::move(f));
}

void find_drift(ChannelCheck& c, const Eigen::VectorXd& angle) {
  // Means over whole turns, in 24 stretches; a straight line through them.
  const Eigen::Index n = c.samples.size(), stretches = 24, width = n / stretches;
  const Eigen::VectorXd a = signal::unwrapped(angle);
  std::vector<double> times, means;
  for (Eigen::Index k = 0; k < stretches; ++k) {
    Eigen::Index first = k * width, last = first + width;
    const double turns = std::floor(std::abs(a[last - 1] - a[first]) / kTwoPi);
    if (turns < 1) continue;
    while (last > first + 2 && std::abs(a[last - 1] - a[first]) > turns * kTwoPi) --last;
    double sum = 0, count = 0;
    for (Eigen::Index i = first; i < last; ++i) {
      if (!c.usable[i]) continue;
      sum += c.samples[i];
      ++count;
    }
    if (count < 0.8 * static_cast<double>(last - first)) continue;
    times.push_back(c.dt * 0.5 * static_cast<double>(first + last));
    means.push_back(sum / count);
  }
  const std::size_t m = means.size();
  if (m < 12) return;
  double t = 0, v = 0, tt = 0, tv = 0;
  for (std::size_t k = 0; k < m; ++k) {
    t += times[k] / static_cast<double>(m);
    v += means[k] / static_cast<double>(m);
  }
  for (std::size_t k = 0; k < m; ++k) {
    tt += (times[k] - t) * (times[k] - t);
    tv += (times[k] - t) * (means[k] - v);
  }
  const double slope = tv / tt;
  // The scatter about the line is not normal (passing the resonance moves the means): half of it by median.
  std::vector<double> rest;
  double squares = 0;
  for (std::size_t k = 0; k < m; ++k) {
    rest.push_back(means[k] - v - slope * (times[k] - t));
    squares += rest.back() * rest.back();
  }
  const double sd = std::sqrt(squares / static_cast<double>(m - 2));
  const double change = slope * c.dt * static_cast<double>(n);
  if (std::abs(slope) * std::sqrt(tt) < 8 * sd || std::abs(change) < 0.05 * c.spread) return;
  Finding f{.kind = FindingKind::drift, .severity = Severity::model, .size = change};
  f.advice = "a mean that moves is estimated beside the motion; let the sensor warm up";
  c.report(std::move(f), 0, n - 1);
}

void find_jitter(ChannelCheck& c) {
  // Noise of the sixth difference in the fast and in the slow thirds of every stretch: white noise is the same in both.
  const Eigen::Index n = c.samples.size(), width = 300;
  if (n < 2 * width) return;
  std::vector<double> fast, slow;
  double gain = 0;
  for (Eigen::Index first = 3; first + width < n - 3; first += width) {
    std::vector<std::pair<double, double>> part;  // velocity, squared difference
    for (Eigen::Index i = first; i < first + width; ++i) {
      if (!c.usable.segment(i - 3, 7).all()) continue;
      const auto& v = c.samples;
      const double d = (v[i - 3] + v[i + 3]) - 6 * (v[i - 2] + v[i + 2]) + 15 * (v[i - 1] + v[i + 1]) - 20 * v[i];
      part.emplace_back(std::abs(v[i + 3] - v[i - 3]), d * d);
    }
    if (part.size() < 100) continue;
    std::sort(part.begin(), part.end());
    const std::size_t third = part.size() / 3;
    double low = 0, high = 0;
    for (std::size_t k = 0; k < third; ++k) {
      low += part[k].second;
      high += part[part.size() - 1 - k].second;
    }
    slow.push_back(low);
    fast.push_back(high);
    gain += std::log(std::max(high, 1e-300) / std::max(low, 1e-300));
  }
  if (fast.size() < 8) return;
  std::vector<double> ratios;
  for (std::size_t k = 0; k < fast.size(); ++k)
    ratios.push_back(std::log(std::max(fast[k], 1e-300) / std::max(slow[k], 1e-300)));
  const double mean = gain / static_cast<double>(ratios.size());
  double squares = 0;
  for (const double r : ratios) squares += (r - mean) * (r - mean);
  const double error = std::sqrt(squares / static_cast<double>(ratios.size() * (ratios.size() - 1)));
  if (mean < 0.3 || mean < 8 * error) return;
  Finding f{.kind = FindingKind::jitter, .severity = Severity::note, .size = mean};
  f.advice = "the noise grows with the velocity: sampling instants scatter; give the true time of each sample";
  c.report(std::move(f), 0, n - 1);
}

void check_rotor(const ChannelCheck* first, const ChannelCheck* second, const Eigen::VectorXd& angle,
                 std::string_view angle_name, RecordReport& report) {
  const bool one = first == nullptr || second == nullptr;
  const ChannelCheck &x = first != nullptr ? *first : *second, &y = second != nullptr ? *second : *first;
  const auto whole = [&](FindingKind kind, std::string_view channel, double size, std::string advice) {
    Finding f{.kind = kind, .severity = Severity::refuse, .size = size, .advice = std::move(advice)};
    f.channel = channel;
    f.begin = x.t0;
    f.end = x.time(x.samples.size() - 1);
    f.samples = x.samples.size();
    report.findings.push_back(std::move(f));
  };
  for (const ChannelCheck* c : {first, second}) {
    if (c == nullptr || !c->displacement) continue;
    const double peak = (c->samples.array() - c->samples.mean()).abs().maxCoeff();
    if (peak > 0.05)
      whole(FindingKind::size, c->name, peak, "no rotor moves that far: is the unit mm or um, not m (or um, not mm)?");
  }
  if (angle.allFinite() && angle.size() > 64 && x.spread > 0 && y.spread > 0) {
    const Eigen::VectorXd a = signal::unwrapped(angle);
    const double forward = synchronous(x, y, a, 1), backward = synchronous(x, y, a, -1);
    const double degrees = std::max(synchronous(x, y, angle, kTwoPi / 360), synchronous(x, y, angle, -kTwoPi / 360));
    const double turns = std::max(synchronous(x, y, angle, kTwoPi), synchronous(x, y, angle, -kTwoPi));
    if (std::max(degrees, turns) > 0.2 && std::max(degrees, turns) > 4 * std::max(forward, backward)) {
      whole(FindingKind::angle_unit, angle_name, degrees > turns ? 360.0 : 1.0,
            degrees > turns ? "the motion follows the angle read in degrees: state the unit of the angle as deg"
                            : "the motion follows the angle read in turns: multiply the angle by 2 pi");
    } else if (const Turning t = one ? Turning{} : turning(x, y, a);
               !one && ((backward > 0.2 && backward > 4 * forward) ||
                        (t.against >= 12 && 4 * t.against > t.stretches && t.against > 5 * t.with))) {
      whole(FindingKind::whirl_sense, "", backward / std::max(forward, 1e-12),
            "the rotation is against the angle: x and y are swapped, one of them has the wrong sign, or the angle "
            "counts backwards");
    }
    const double speed = std::abs(a[a.size() - 1] - a[0]) / (x.dt * static_cast<double>(a.size() - 1)) / kTwoPi;
    if (x.dt >= 0.1) {
      whole(FindingKind::size, "t", x.dt, "a rotor is not sampled that slowly: is the time in ms, not s?");
    } else if (speed > 5000) {
      whole(FindingKind::size, "t", speed, "no rotor turns that fast: is the time in s, not ms or us?");
    }
  }
}

}  // namespace whirl::records::detail
