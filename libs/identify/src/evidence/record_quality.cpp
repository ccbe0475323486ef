#include "evidence/record_quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rules/rules.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification::detail {
namespace {

/// Finite samples of one channel of all records, in one column.
struct Signal {
  std::string name;
  Eigen::VectorXd samples;  // NaN kept
  double count = 0;         // finite ones
  double mean = 0, spread = 0, largest = 0;
};

Signal gather(const std::vector<Recording>& records, const std::string& name) {
  Signal s{name, {}, 0, 0, 0, 0};
  Eigen::Index n = 0;
  for (const Recording& r : records) n += r[name].size();
  s.samples.resize(n);
  n = 0;
  for (const Recording& r : records) {
    s.samples.segment(n, r[name].size()) = r[name];
    n += r[name].size();
  }
  for (const double v : s.samples) {
    if (!std::isfinite(v)) continue;
    s.mean += v;
    s.count += 1;
    s.largest = std::max(s.largest, std::abs(v));
  }
  s.mean /= std::max(1.0, s.count);
  // Divided by the largest value first: squares of 1e-300 vanish.
  for (const double v : s.samples) {
    if (std::isfinite(v) && s.largest > 0) s.spread += std::pow((v - s.mean) / s.largest, 2);
  }
  s.spread = s.largest * std::sqrt(s.spread / std::max(1.0, s.count));
  return s;
}

double correlation(const Signal& a, const Signal& b) {
  double sum = 0, count = 0;
  for (Eigen::Index i = 0; i < a.samples.size(); ++i) {
    const double u = (a.samples[i] - a.mean) / a.spread, v = (b.samples[i] - b.mean) / b.spread;
    if (!std::isfinite(u) || !std::isfinite(v)) continue;
    sum += u * v;
    count += 1;
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

void require_equal_steps(const std::vector<Recording>& records) {
  if (records.empty()) throw Error("no record to identify from");
  for (const Recording& r : records) {
    if (std::abs(r.dt - records.front().dt) > 1e-9 * r.dt) {
      throw Error(fmt::format("{}: sample time {:g} s, {:g} s in the first record: must be equal", r.source, r.dt,
                              records.front().dt));
    }
  }
}

void check_signals(const std::vector<Recording>& records, const std::vector<std::string>& states,
                   const std::vector<std::string>& inputs, bool discrete, Summary& summary) {
  constexpr double kSmall = 1e-30, kLarge = 1e30;
  std::vector<Signal> signals;
  for (const auto* names : {&states, &inputs}) {
    for (const std::string& name : *names) {
      const bool state = names == &states;
      Signal s = gather(records, name);
      if (s.count == 0) {
        summary.fail(fmt::format("channel {} has no finite sample", name));
      } else if (s.largest == 0) {
        summary.fail(fmt::format("channel {} is zero throughout", name));
      } else if (s.largest < kSmall || s.largest > kLarge) {
        summary.fail(
            fmt::format("channel {} has values of size {:.1e}: its powers leave the range of numbers; use a unit in "
                        "which they lie between {:g} and {:g}",
                        name, s.largest, kSmall, kLarge));
      } else if (s.spread <= 1e-12 * s.largest) {
        summary.fail(
            state
                ? fmt::format("channel {} is constant: it shows no motion", name)
                : fmt::format("input {} is constant: its effect cannot be distinguished from the constant term", name));
      } else {
        // White noise has the same rms after differencing, a sampled motion far less.
        if (state && !discrete) {
          double energy = 0, samples = 0;
          for (const Recording& r : records) {
            const Eigen::VectorXd& v = r[name];
            if (v.size() < 16 || !v.allFinite()) continue;
            energy += static_cast<double>(v.size()) * std::pow(signal::noise_sd(v), 2);
            samples += static_cast<double>(v.size());
          }
          const double noise = samples > 0 ? std::sqrt(energy / samples) : 0;
          if (s.spread * s.spread < rules::kMostlyNoise * noise * noise) {
            summary.fail(fmt::format("channel {} is mostly noise: rms {:.3g}, noise {:.3g}", name, s.spread, noise));
          }
        }
        signals.push_back(std::move(s));
      }
    }
  }
  for (std::size_t i = 0; i < signals.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (signals[i].samples.size() != signals[j].samples.size()) continue;
      if (1 - std::abs(correlation(signals[i], signals[j])) < 1e-9) {
        summary.fail(
            fmt::format("channels {} and {} carry the same signal: leave one out", signals[j].name, signals[i].name));
      }
    }
  }
}

}  // namespace whirl::identification::detail
