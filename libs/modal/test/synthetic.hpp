#pragma once
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/modal_model.hpp"

namespace whirl::testing {

/// A class of structures with known modes, and their noisy frequency responses.
struct SyntheticOptions {
  int modes = 35;
  int doublets = 6;             ///< pairs among them
  double doublet_gap = 0.005;   ///< relative
  double low = 5, high = 1000;  ///< Hz
  double line = 0.0625;         ///< Hz
  int responses = 6, references = 2;
  double noise = 0.01;
  bool proportional = false;  ///< noise sd per line is noise |H(f)|; else noise rms|H|
  double damping_low = 0.002, damping_high = 0.02;
  FrfKind kind = FrfKind::accelerance;
  unsigned seed = 1;
};

struct Synthetic {
  std::vector<std::complex<double>> poles;  ///< inside the band, ascending
  FrequencyResponse frf;
  std::vector<Eigen::VectorXcd> clean;  ///< noise-free value per channel
  double noise_ratio = 0;               ///< norm(noise) / norm(frf)
};

/// Real mode shapes, a rigid-body term and modes above the band.
inline Synthetic make_synthetic(const SyntheticOptions& options) {
  using Complex = std::complex<double>;
  constexpr double pi = std::numbers::pi;
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const int sites = options.modes - options.doublets;
  const double first = std::max(options.low + 3, 0.012 * options.high), last = 0.985 * options.high;
  std::vector<double> frequencies;
  for (int i = 0; i < sites; ++i) {
    frequencies.push_back(first + (last - first) * (i + 0.15 + 0.7 * uniform(random)) / sites);
  }
  // Doublets at evenly spread sites, not the lowest ones.
  for (int d = 0; d < options.doublets; ++d) {
    frequencies.push_back(frequencies[static_cast<std::size_t>((d + 1) * sites / (options.doublets + 1))] *
                          (1 + options.doublet_gap));
  }
  std::sort(frequencies.begin(), frequencies.end());
  const int inside = options.modes;
  for (double f : {1.06, 1.17, 1.31, 1.48, 1.7}) frequencies.push_back(f * options.high);
  Synthetic result;
  std::vector<Complex> poles;
  for (double f : frequencies) {
    const double zeta = options.damping_low * std::pow(options.damping_high / options.damping_low, uniform(random));
    poles.push_back(2 * pi * f * Complex(-zeta, std::sqrt(1 - zeta * zeta)));
  }
  result.poles.assign(poles.begin(), poles.begin() + inside);
  std::vector<std::vector<double>> shapes;
  const int points = options.responses + options.references;
  for (std::size_t k = 0; k <= poles.size(); ++k) {  // the last one is the rigid body
    shapes.emplace_back();
    // Sensors and hammer are not put on the nodes of a mode by choice: factors between 0.3 and 1 of either sign.
    for (int i = 0; i < points; ++i)
      shapes.back().push_back((uniform(random) < 0.5 ? -1 : 1) * (0.3 + 0.7 * uniform(random)));
  }
  const auto lines = static_cast<Eigen::Index>(std::floor((options.high - options.low) / options.line + 1e-9)) + 1;
  result.frf.frequency = Eigen::VectorXd::LinSpaced(lines, 0, static_cast<double>(lines - 1)) * options.line;
  result.frf.frequency.array() += options.low;
  result.frf.kind = options.kind;
  double noise2 = 0, size2 = 0;
  for (int r = 0; r < options.references; ++r) {
    for (int o = 0; o < options.responses; ++o) {
      FrfChannel channel;
      channel.response = "p" + std::to_string(o);
      channel.reference = "h" + std::to_string(r);
      channel.value.resize(lines);
      for (Eigen::Index i = 0; i < lines; ++i) {
        const Complex s(0, 2 * pi * result.frf.frequency[i]);
        Complex h = shapes[poles.size()][static_cast<std::size_t>(o)] *
                    shapes[poles.size()][static_cast<std::size_t>(options.responses + r)] / (s * s);
        for (std::size_t k = 0; k < poles.size(); ++k) {
          const double phi =
              shapes[k][static_cast<std::size_t>(o)] * shapes[k][static_cast<std::size_t>(options.responses + r)];
          h += phi / ((s - poles[k]) * (s - std::conj(poles[k])));
        }
        channel.value[i] = h * std::pow(s, static_cast<int>(options.kind));
      }
      result.clean.push_back(channel.value);
      const double rms = channel.value.norm() / std::sqrt(static_cast<double>(lines));
      for (Eigen::Index i = 0; i < lines; ++i) {
        const double sd = options.noise * (options.proportional ? std::abs(channel.value[i]) : rms) / std::sqrt(2.0);
        const Complex e(sd * normal(random), sd * normal(random));
        channel.value[i] += e;
        noise2 += std::norm(e);
        size2 += std::norm(channel.value[i]);
      }
      result.frf.channels.push_back(std::move(channel));
    }
  }
  result.noise_ratio = std::sqrt(noise2 / size2);
  return result;
}

/// How a fit compares with the truth, modes matched one to one (nearest first).
struct ModeScore {
  int frequency = 0;    ///< modes with frequency within 0.1 %
  int both = 0;         ///< of these, damping within 5 %
  int poles = 0;        ///< reported inside the band
  int extra = 0;        ///< reported poles without a true mode
  int sharp_extra = 0;  ///< of these, those that claim a frequency within 0.1 % and damping within 5 % (one sd)
  int covered_frequency = 0, covered_damping = 0;               ///< matched modes whose 95 % interval holds the truth
  double median_frequency_error = 0, median_damping_error = 0;  ///< relative
};

inline ModeScore score(const std::vector<std::complex<double>>& truth, const ModalModel& model) {
  struct Pair {
    double distance;
    std::size_t t, m;
  };
  std::vector<Pair> pairs;
  const auto frequency = [](std::complex<double> p) { return std::abs(p) / (2 * std::numbers::pi); };
  const auto damping = [](std::complex<double> p) { return -p.real() / std::abs(p); };
  for (std::size_t t = 0; t < truth.size(); ++t) {
    for (std::size_t m = 0; m < model.modes.size(); ++m) {
      const double df = std::abs(model.modes[m].frequency.value / frequency(truth[t]) - 1);
      if (df < 0.001) pairs.push_back({df, t, m});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.distance < b.distance; });
  std::vector<bool> used_t(truth.size()), used_m(model.modes.size());
  ModeScore result;
  std::vector<double> df, dz;
  for (const auto& pair : pairs) {
    if (used_t[pair.t] || used_m[pair.m]) continue;
    used_t[pair.t] = used_m[pair.m] = true;
    const Mode& mode = model.modes[pair.m];
    ++result.frequency;
    const double error = std::abs(mode.damping.value / damping(truth[pair.t]) - 1);
    result.both += error < 0.05;
    df.push_back(pair.distance);
    dz.push_back(error);
    result.covered_frequency += mode.frequency.covers(frequency(truth[pair.t]));
    result.covered_damping += mode.damping.covers(damping(truth[pair.t]));
  }
  for (std::size_t m = 0; m < model.modes.size(); ++m) {
    const Mode& mode = model.modes[m];
    if (mode.frequency.value > model.band_high || mode.frequency.value < model.band_low) continue;
    ++result.poles;
    if (used_m[m]) continue;
    ++result.extra;
    result.sharp_extra +=
        mode.frequency.sd < 1e-3 * mode.frequency.value && mode.damping.sd < 0.05 * mode.damping.value;
  }
  const auto median = [](std::vector<double> v) {
    if (v.empty()) return NAN;
    std::sort(v.begin(), v.end());
    return static_cast<float>(v[v.size() / 2]);
  };
  result.median_frequency_error = median(df);
  result.median_damping_error = median(dz);
  return result;
}

}  // namespace whirl::testing
