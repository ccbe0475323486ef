#include "cross_spectra.hpp"

#include <algorithm>
#include <cmath>

namespace whirl::modal {
namespace {

std::complex<double> estimate(FrfEstimator estimator, double k, double ff, double aa, std::complex<double> af) {
  const std::complex<double> fa = std::conj(af);
  switch (estimator) {
    case FrfEstimator::h1:
      return af / ff;
    case FrfEstimator::h2:
      return aa / fa;
    case FrfEstimator::hv: {
      if (!std::isfinite(k)) return af / ff;
      const double difference = aa - k * ff;
      return (difference + std::sqrt(difference * difference + 4 * k * std::norm(af))) / (2.0 * fa);
    }
  }
  return 0;
}

}  // namespace

CrossSpectra sum(const std::vector<BlowSpectra>& spectra, Eigen::Index lines, std::size_t responses) {
  CrossSpectra sums{Eigen::VectorXd::Zero(lines),
                    std::vector<Eigen::VectorXd>(responses, Eigen::VectorXd::Zero(lines)),
                    std::vector<Eigen::VectorXcd>(responses, Eigen::VectorXcd::Zero(lines)),
                    {}};
  for (const BlowSpectra& blow : spectra) {
    sums.ff += blow.force.cwiseAbs2();
    for (std::size_t c = 0; c < responses; ++c) {
      sums.aa[c] += blow.responses[c].cwiseAbs2();
      sums.af[c] += blow.responses[c].cwiseProduct(blow.force.conjugate());
    }
  }
  return sums;
}

Eigen::Index usable_lines(const Eigen::VectorXd& ff, double drop_db) {
  if (drop_db <= 0 || ff.size() < 2) return ff.size();
  Eigen::Index peak = 0;
  const double limit = ff.tail(ff.size() - 1).maxCoeff(&peak) * std::pow(10.0, -drop_db / 10);
  ++peak;  // a rest of the offset at 0 Hz does not count
  for (Eigen::Index line = peak + 1; line < ff.size(); ++line) {
    if (ff[line] >= limit) continue;
    const Eigen::Index end = std::min(ff.size(), line + std::max<Eigen::Index>(3, line / 5));
    Eigen::Index next = line;
    while (next < end && ff[next] < limit) ++next;
    if (next == end) return line;
    line = next;
  }
  return ff.size();
}

Eigen::VectorXd noise_part(const std::vector<BlowSpectra>& spectra, std::size_t channel, const Eigen::VectorXd& ff,
                           const Eigen::VectorXcd& af) {
  constexpr Eigen::Index kWindow = 16;
  const Eigen::Index lines = ff.size();
  const auto blows = static_cast<double>(spectra.size());
  Eigen::VectorXd part = Eigen::VectorXd::Ones(lines);
  if (spectra.size() < 4 || lines < 2 * kWindow) return part;
  Eigen::VectorXd gain = Eigen::VectorXd::Zero(lines);  // of noise: exponential with mean 1
  for (Eigen::Index i = 1; i < lines; ++i) {
    if (!(ff[i] > 0)) continue;
    double mean = 0, left = 0, spread = 0;
    for (const BlowSpectra& blow : spectra) mean += std::norm(blow.force[1]) * std::norm(blow.force[i]) / ff[i];
    std::complex<double> product = 0;
    for (const BlowSpectra& blow : spectra) {
      const std::complex<double> d = (std::norm(blow.force[1]) - mean) * blow.force[i];
      const std::complex<double> rest = blow.responses[channel][i] - af[i] / ff[i] * blow.force[i];
      left += std::norm(rest);
      spread += std::norm(d);
      product += std::conj(d) * rest;
    }
    if (left > 0 && spread > 0)
      gain[i] = -(blows - 2) * std::log1p(-std::min(std::norm(product) / (spread * left), 1 - 1e-12));
  }
  // Six standard deviations of the sum over a window.
  const double certain = static_cast<double>(kWindow) + 6 * std::sqrt(static_cast<double>(kWindow));
  Eigen::Array<bool, Eigen::Dynamic, 1> depends = Eigen::Array<bool, Eigen::Dynamic, 1>::Constant(lines, false);
  for (Eigen::Index i = 0; i + kWindow <= lines; i += kWindow / 4) {
    if (gain.segment(i, kWindow).sum() > certain) depends.segment(i, kWindow).setConstant(true);
  }
  for (Eigen::Index i = 0; i < lines; ++i) {
    if (depends[i]) part[i] = std::exp(-gain[i] / (blows - 2)) * (blows - 1) / (blows - 2);
  }
  return part;
}

void estimate_channels(const CrossSpectra& sums, const FrfOptions& options, FrequencyResponse& result) {
  const auto count = static_cast<double>(result.averages);
  const Eigen::Index kept = result.frequency.size();
  for (std::size_t c = 0; c < result.channels.size(); ++c) {
    FrfChannel& channel = result.channels[c];
    channel.value.resize(kept);
    if (result.averages > 1) {
      channel.coherence.resize(kept);
      channel.variance.resize(kept);
    }
    for (Eigen::Index i = 0; i < kept; ++i) {
      const double ff = sums.ff[i] / count;
      const double aa = sums.aa[c][i] / count;
      const std::complex<double> af = sums.af[c][i] / count;
      const bool dead = ff <= 0 || std::norm(af) <= 0;
      channel.value[i] = dead ? 0 : estimate(options.estimator, options.noise_ratio, ff, aa, af);
      if (result.averages > 1) {
        const double coherence = dead ? 0 : std::min(1.0, std::norm(af) / (ff * aa));
        channel.coherence[i] = coherence;
        channel.variance[i] =
            sums.noise[c][i] * std::norm(channel.value[i]) * (1 - coherence) / (2 * count * std::max(coherence, 1e-12));
      }
    }
  }
}

}  // namespace whirl::modal
