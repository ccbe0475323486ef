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

/// A test as a laboratory may hand it over: everything about it is drawn.
struct DrawnStructure {
  std::vector<double> frequency, damping;  ///< of the modes in the band: Hz; ratio (half the loss factor)
  double noise = 0;                        ///< of rms |H|, or of |H(f)| where proportional
  int outside = 0;                         ///< modes below and above the band
  FrequencyResponse frf;
};

/// 2 to 12 modes in a band of two to four octaves, damping 0.1 to 5 % (one decade within a structure at most), two to
/// six responses to one to three references, noise 0 to 5 %, up to eight modes outside the band, any kind, an
/// exponential window in one set of six. `structural`: k (1 + i eta) with eta = 2 zeta, else viscous. Sum of single
/// degrees of freedom k / (1 - (s/w0)^2 ...), mode by mode.
inline DrawnStructure draw_structure(bool structural, unsigned seed) {
  std::mt19937_64 random(7919ull * seed + (structural ? 104729 : 0));
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const auto between = [&](double a, double b) { return a + (b - a) * uniform(random); };
  const auto drawn_log = [&](double a, double b) { return a * std::pow(b / a, uniform(random)); };
  const auto whole = [&](int a, int b) { return a + static_cast<int>(uniform(random) * (b - a + 0.999)); };
  DrawnStructure result;
  const int modes = whole(2, 12), responses = whole(2, 6), references = whole(1, 3);
  const double low = drawn_log(2, 50), high = low * drawn_log(4, 16);
  const double damping = drawn_log(0.001, 0.016), spread = between(1, 3);
  result.noise = uniform(random) < 0.2 ? 0 : drawn_log(0.0003, 0.05);
  const bool proportional = uniform(random) < 0.3, windowed = uniform(random) < 1.0 / 6;
  result.outside = whole(0, 8);
  std::vector<double> f, z;
  const double inside = (high - low) / modes;
  for (int k = 0; k < modes; ++k) f.push_back(low + inside * (k + between(0.15, 0.85)));
  for (int k = 0; k < result.outside; ++k)
    f.push_back(k % 3 == 2 ? low * between(0.3, 0.93) : high * between(1.04, 2.5));
  double narrowest = INFINITY;
  for (std::size_t k = 0; k < f.size(); ++k) {
    z.push_back(damping * drawn_log(1, spread));
    if (k < static_cast<std::size_t>(modes)) narrowest = std::min(narrowest, 2 * z[k] * f[k]);
  }
  result.frequency.assign(f.begin(), f.begin() + modes);
  result.damping.assign(z.begin(), z.begin() + modes);
  const auto lines =
      static_cast<Eigen::Index>(std::clamp((high - low) / (narrowest / drawn_log(3, 12)), 400.0, 6000.0));
  FrequencyResponse& frf = result.frf;
  frf.kind = static_cast<FrfKind>(whole(0, 2));
  frf.frequency = Eigen::VectorXd::LinSpaced(lines, low, high);
  frf.window_decay = windowed ? 2 * std::numbers::pi * low * damping * drawn_log(0.3, 3) : 0;
  std::vector<std::vector<double>> shape(f.size());
  for (auto& s : shape) {
    for (int i = 0; i < responses + references; ++i) s.push_back(normal(random));
  }
  for (int r = 0; r < references; ++r) {
    for (int p = 0; p < responses; ++p) {
      FrfChannel channel{"p" + std::to_string(p), "h" + std::to_string(r), Eigen::VectorXcd::Zero(lines), {}, {}};
      for (Eigen::Index i = 0; i < lines; ++i) {
        const std::complex<double> s(frf.window_decay, 2 * std::numbers::pi * frf.frequency[i]);
        for (std::size_t k = 0; k < f.size(); ++k) {
          const double w0 = 2 * std::numbers::pi * f[k];
          const std::complex<double> lost = structural ? std::complex<double>(0, 2 * z[k]) : 2 * z[k] * s / w0;
          const double gain = shape[k][static_cast<std::size_t>(p)] * shape[k][static_cast<std::size_t>(responses + r)];
          channel.value[i] += gain / (w0 * w0 * (1.0 + lost) + s * s);
        }
        for (int d = 0; d < static_cast<int>(frf.kind); ++d) channel.value[i] *= s;
      }
      const double rms = channel.value.norm() / std::sqrt(static_cast<double>(lines));
      for (auto& h : channel.value) {
        const double size = result.noise * (proportional ? std::abs(h) : rms) / std::numbers::sqrt2;
        h += size * std::complex<double>(normal(random), normal(random));
      }
      frf.channels.push_back(std::move(channel));
    }
  }
  return result;
}

}  // namespace whirl::testing
