#include "channel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/signal/tacho.hpp"

namespace whirl::records::detail {

double median(std::vector<double> v) {
  if (v.empty()) return 0;
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

void ChannelCheck::report(Finding f, Eigen::Index first, Eigen::Index last) {
  f.channel = name;
  f.begin = time(first);
  f.end = time(last);
  if (f.samples == 0) f.samples = last - first + 1;
  if (f.severity == Severity::mask && f.kind != FindingKind::spikes && f.kind != FindingKind::clipping) {
    usable.segment(first, last - first + 1).setConstant(false);
  }
  findings.push_back(std::move(f));
}

void ChannelCheck::bridge() {
  const Eigen::Index n = samples.size();
  for (Eigen::Index i = 0; i < n;) {
    if (usable[i]) {
      ++i;
      continue;
    }
    Eigen::Index end = i;
    while (end < n && !usable[end]) ++end;
    const double left = i > 0 ? samples[i - 1] : (end < n ? samples[end] : 0.0);
    const double right = end < n ? samples[end] : left;
    const double width = static_cast<double>(end - i + 1);
    for (Eigen::Index k = i; k < end; ++k) samples[k] = left + (right - left) * static_cast<double>(k - i + 1) / width;
    i = end;
  }
}

void ChannelCheck::measure() {
  const Eigen::Index n = samples.size();
  double sum = 0, squares = 0, count = 0;
  quantum = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!usable[i]) continue;
    sum += samples[i];
    ++count;
    if (i > 0 && usable[i - 1] && samples[i] != samples[i - 1]) {
      quantum = std::min(quantum, std::abs(samples[i] - samples[i - 1]));
    }
  }
  const double mean = count > 0 ? sum / count : 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (usable[i]) squares += std::pow(samples[i] - mean, 2);
  }
  spread = count > 0 ? std::sqrt(squares / count) : 0;
  if (!std::isfinite(quantum)) quantum = 0;
  std::vector<double> sixth;
  Eigen::Index run = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    run = usable[i] ? run + 1 : 0;
    if (run < 7) continue;
    const auto s = samples.segment(i - 6, 7);
    sixth.push_back(std::abs((s[0] + s[6]) - 6 * (s[1] + s[5]) + 15 * (s[2] + s[4]) - 20 * s[3]));
  }
  noise = median(std::move(sixth)) / 0.6745 / std::sqrt(924.0);
}

bool is_held(const Eigen::VectorXd& v) {
  // Neighbours that are equal, the three longest stretches apart: those may be a frozen sensor.
  std::vector<Eigen::Index> runs;
  for (Eigen::Index i = 0; i < v.size();) {
    Eigen::Index end = i + 1;
    while (end < v.size() && v[end] == v[i]) ++end;
    if (end - i > 1) runs.push_back(end - i - 1);
    i = end;
  }
  std::sort(runs.begin(), runs.end(), std::greater<>());
  Eigen::Index equal = 0, rest = v.size();
  for (std::size_t k = 0; k < runs.size(); ++k) (k < 3 ? rest -= runs[k] : equal += runs[k]);
  return 10 * equal > 6 * rest;
}

bool is_pulse_train(const Eigen::VectorXd& v, double dt) {
  const double low = v.minCoeff(), range = v.maxCoeff() - low;
  const auto levels = ((v.array() - low - 0.5 * range).abs() > 0.35 * range).count();
  if (static_cast<double>(levels) < 0.97 * static_cast<double>(v.size())) return false;
  const std::vector<double> times = signal::pulse_times(v, dt);
  std::size_t even = 0;
  for (std::size_t k = 2; k < times.size(); ++k) {
    const double ratio = (times[k] - times[k - 1]) / (times[k - 1] - times[k - 2]);
    even += ratio > 0.75 && ratio < 1 / 0.75;
  }
  return times.size() >= 10 && static_cast<double>(even) > 0.8 * static_cast<double>(times.size() - 2);
}

void find_gaps(ChannelCheck& c) {
  const Eigen::Index n = c.samples.size();
  c.usable = Mask::Constant(n, true);
  Eigen::Index total = 0, first = -1, last = 0, stretches = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (std::isfinite(c.samples[i])) continue;
    c.usable[i] = false;
    if (first < 0) first = i;
    stretches += i == 0 || std::isfinite(c.samples[i - 1]);
    last = i;
    ++total;
  }
  if (total == 0) return;
  Finding f{.kind = FindingKind::gap, .severity = Severity::mask, .samples = total};
  f.size = static_cast<double>(stretches);
  f.advice = "samples are missing; they are left out";
  if (2 * total > n) {
    f.severity = Severity::refuse;
    f.advice = "more than half of the channel is missing: record it again";
  }
  f.channel = c.name;
  f.begin = c.time(first);
  f.end = c.time(last);
  c.findings.push_back(std::move(f));
  c.bridge();
}

}  // namespace whirl::records::detail
