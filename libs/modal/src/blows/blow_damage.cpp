#include "blow_damage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/counted.hpp"
#include "whirl/records/check.hpp"

namespace whirl::modal {
namespace {

bool spoils(records::FindingKind kind) {
  using enum records::FindingKind;
  return kind == frozen || kind == dropout || kind == gap;
}

std::string words(records::FindingKind kind) {
  return kind == records::FindingKind::dropout ? "reads 0" : "stands still";
}

// The cubic through two good neighbours on either side of [first, last].
double across(const Eigen::VectorXd& x, Eigen::Index first, Eigen::Index last, Eigen::Index at) {
  const Eigen::Index from[] = {first - 2, first - 1, last + 1, last + 2};
  double sum = 0;
  for (const Eigen::Index i : from) {
    double weight = 1;
    for (const Eigen::Index k : from)
      if (k != i) weight *= static_cast<double>(at - k) / static_cast<double>(i - k);
    sum += weight * x[i];
  }
  return sum;
}

// The cubic misses [first, last] by far more than it misses the samples about it: a signal near half the sampling rate
// is off every cubic, a spike alone is.
bool stands_out(const Eigen::VectorXd& x, Eigen::Index first, Eigen::Index last) {
  constexpr Eigen::Index kAbout = 24;
  constexpr double kFar = 4;
  double here = 0, about = 0;
  for (Eigen::Index i = first; i <= last; ++i) here = std::max(here, std::abs(x[i] - across(x, first, last, i)));
  const Eigen::Index from = std::max<Eigen::Index>(2, first - kAbout), to = std::min(x.size() - 3, last + kAbout);
  for (Eigen::Index i = from; i <= to; ++i)
    if (i < first - 2 || i > last + 2) about = std::max(about, std::abs(x[i] - across(x, i, i, i)));
  return here > kFar * about;
}

// Runs of one or two samples that the check has masked, with good ones about them and well away from the pulse.
Eigen::Index bridge(Eigen::VectorXd& x, const Eigen::ArrayX<bool>& usable, Eigen::Index offset, const Pulse& pulse) {
  Eigen::Index count = 0;
  const Eigen::Index n = x.size(), guard = std::max<Eigen::Index>(8, 2 * pulse.width());
  const auto good = [&](Eigen::Index i) { return i < 0 || i >= n || usable[offset + i]; };
  for (Eigen::Index i = 2; i + 2 < n; ++i) {
    if (good(i)) continue;
    Eigen::Index last = i;
    while (!good(last + 1)) ++last;
    const bool away = last < pulse.first - guard || i > pulse.last + guard;
    const bool single = last <= i + 1 && last + 2 < n && away && good(i - 1) && good(i - 2) && good(last + 2);
    if (single && stands_out(x, i, last)) {
      for (Eigen::Index k = i; k <= last; ++k) x[k] = across(x, i, last, k);
      count += last - i + 1;
    }
    i = last;
  }
  return count;
}

}  // namespace

std::vector<std::vector<std::string>> blow_damage(const std::vector<Recording>& recordings,
                                                  std::vector<Recording>& blows, const std::vector<Pulse>& pulses,
                                                  const std::vector<std::size_t>& owner,
                                                  const std::vector<std::string>& responses, bool repair,
                                                  std::vector<std::string>& spikes) {
  std::vector<std::vector<std::string>> result(blows.size());
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    Recording moving;
    moving.dt = recordings[r].dt;
    moving.t0 = recordings[r].t0;
    moving.source = recordings[r].source;
    for (const std::string& name : responses) {
      const Channel& c = recordings[r].at(name);
      moving.add(c.name, c.quantity, c.samples);
    }
    const records::RecordReport report = records::check(moving);
    for (std::size_t b = 0; b < blows.size(); ++b) {
      for (const std::string& name : responses) {
        const records::ChannelMask* mask = report.mask(name);
        if (owner[b] != r || mask == nullptr || report.find(records::FindingKind::spikes, name) == nullptr) continue;
        const auto offset = static_cast<Eigen::Index>(std::llround((blows[b].t0 - moving.t0) / moving.dt));
        Eigen::VectorXd samples = blows[b].at(name).samples;
        const Eigen::Index count = bridge(samples, mask->usable, offset, pulses[b]);
        if (count == 0) continue;
        for (Channel& channel : blows[b].channels)
          if (repair && channel.name == name) channel.samples = samples;
        spikes.push_back(fmt::format(
            "impact {} at {:.4g} s: {} sample{} of {} look{} like a spike{}: look for loose contacts", b + 1,
            blows[b].t0 + blows[b].dt * static_cast<double>(pulses[b].peak), count, count == 1 ? "" : "s", name,
            count == 1 ? "s" : "", repair ? "; bridged" : "; kept (--repair bridges them)"));
      }
    }
    for (const records::Finding& f : report.findings) {
      if (!spoils(f.kind)) continue;
      for (std::size_t b = 0; b < blows.size(); ++b) {
        const double end = blows[b].t0 + blows[b].dt * static_cast<double>(blows[b].size() - 1);
        if (owner[b] != r || f.end < blows[b].t0 || f.begin > end) continue;
        result[b].push_back(fmt::format("{} {} from {:.4g} to {:.4g} s while the structure moves ({})", f.channel,
                                        words(f.kind), std::max(f.begin, blows[b].t0), std::min(f.end, end),
                                        counted(f.samples, "sample")));
      }
    }
  }
  return result;
}

}  // namespace whirl::modal
