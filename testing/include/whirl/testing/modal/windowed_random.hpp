#pragma once
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "whirl/core/modal_model.hpp"

namespace whirl::testing {

/// A shaker test with random force, averaged as analysers do: blocks behind a Hann window that overlap by half.
struct RandomTestOptions {
  int modes = 6, responses = 4, references = 2;
  int lines = 800;                       ///< up to 0.78 of half the sample rate
  double width_low = 1, width_high = 5;  ///< half-power widths of the modes in lines
  double doublet = 0;                    ///< lines between the two modes that then stand for each one
  int blocks = 399;                      ///< averaged
  double noise = 0.002;                  ///< of the responses, rms
  bool hann = true;                      ///< else blocks that hold whole periods of a periodic random force, no window
  FrfKind kind = FrfKind::accelerance;
  unsigned seed = 1;
};

struct RandomTest {
  std::vector<double> frequency, damping;
  FrequencyResponse frf;
};

/// Time records: a long random force is passed through the structure, then cut, windowed and transformed block by
/// block; H1 of the averaged spectra.
inline RandomTest make_random_test(const RandomTestOptions& o) {
  using Complex = std::complex<double>;
  std::mt19937_64 random(60013ull * o.seed + 5);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const int block = 2048;
  const double df = 0.25, rate = df * block;
  RandomTest result;
  std::vector<std::vector<double>> shape;
  const double low = 40 * df, high = (o.lines - 40) * df;
  for (int k = 0; k < o.modes; ++k) {
    const double f = low + (high - low) * (k + 0.15 + 0.7 * uniform(random)) / o.modes;
    result.frequency.push_back(f);
    result.damping.push_back(df * o.width_low * std::pow(o.width_high / o.width_low, uniform(random)) / (2 * f));
    shape.emplace_back();
    for (int i = 0; i < o.responses + o.references; ++i)
      shape.back().push_back((uniform(random) < 0.5 ? -1 : 1) * (0.3 + 0.7 * uniform(random)));
  }
  for (int k = 0; o.doublet > 0 && k < o.modes; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double f = result.frequency[at] + o.doublet * df;
    result.damping.push_back(result.damping[at] * result.frequency[at] / f * (0.8 + 0.4 * uniform(random)));
    result.frequency.push_back(f);
    shape.emplace_back();
    for (int i = 0; i < o.responses + o.references; ++i)
      shape.back().push_back((uniform(random) < 0.5 ? -1 : 1) * (0.3 + 0.7 * uniform(random)));
  }
  const auto response = [&](double hz, std::size_t p, std::size_t r) {
    Complex h = 0;
    const double w = 2 * std::numbers::pi * hz;
    for (std::size_t k = 0; k < shape.size(); ++k) {
      const double w0 = 2 * std::numbers::pi * result.frequency[k];
      h += shape[k][p] * shape[k][static_cast<std::size_t>(o.responses) + r] /
           Complex(w0 * w0 - w * w, 2 * result.damping[k] * w0 * w);
    }
    for (int d = 0; d < static_cast<int>(o.kind); ++d) h *= Complex(0, w);
    return h;
  };
  const long samples = o.hann ? static_cast<long>(block / 2) * (o.blocks + 1) : block;
  Eigen::FFT<double> fft;
  result.frf.kind = o.kind;
  result.frf.frequency = Eigen::VectorXd::LinSpaced(o.lines, df, df * o.lines);
  for (int r = 0; r < o.references; ++r) {
    std::vector<double> force(static_cast<std::size_t>(samples));
    for (double& v : force) v = normal(random);
    std::vector<Complex> spectrum;
    fft.fwd(spectrum, force);
    for (int p = 0; p < o.responses; ++p) {
      std::vector<Complex> moved(spectrum.size());
      for (long i = 1; i < samples / 2; ++i) {
        const auto at = static_cast<std::size_t>(i);
        moved[at] = spectrum[at] * response(rate * static_cast<double>(i) / static_cast<double>(samples),
                                            static_cast<std::size_t>(p), static_cast<std::size_t>(r));
        moved[static_cast<std::size_t>(samples - i)] = std::conj(moved[at]);
      }
      std::vector<double> motion;
      fft.inv(motion, moved);
      double power = 0;
      for (const double v : motion) power += v * v;
      const double sd = o.noise * std::sqrt(power / static_cast<double>(samples));
      Eigen::VectorXcd cross = Eigen::VectorXcd::Zero(o.lines);
      Eigen::VectorXd own = Eigen::VectorXd::Zero(o.lines);
      std::vector<double> a(block), b(block);
      std::vector<Complex> fa, fb;
      for (int n = 0; n < o.blocks; ++n) {
        const std::size_t first = o.hann ? static_cast<std::size_t>(n) * block / 2 : 0;
        for (std::size_t i = 0; i < static_cast<std::size_t>(block); ++i) {
          const double x = 2 * std::numbers::pi * static_cast<double>(i) / block;
          const double window = o.hann ? 0.5 - 0.5 * std::cos(x) : 1;
          a[i] = window * force[first + i];
          b[i] = window * (motion[first + i] + sd * normal(random));
        }
        fft.fwd(fa, a);
        fft.fwd(fb, b);
        for (Eigen::Index i = 0; i < o.lines; ++i) {
          const auto at = static_cast<std::size_t>(i + 1);
          cross[i] += std::conj(fa[at]) * fb[at];
          own[i] += std::norm(fa[at]);
        }
      }
      result.frf.channels.push_back(
          {"p" + std::to_string(p), "h" + std::to_string(r), cross.cwiseQuotient(own.cast<Complex>()), {}, {}});
    }
  }
  return result;
}

}  // namespace whirl::testing
