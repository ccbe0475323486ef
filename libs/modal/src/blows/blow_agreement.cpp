// Two blows of one structure obey A_i F_j = A_j F_i on every line: compared without a division, so that lines which a
// hammer hardly excites count for little.
#include "blow_agreement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>

#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

// How the response of one blow relates to that of another.
struct Relation {
  double gain = 1;         ///< real, of the second over the first
  double correlation = 0;  ///< at no delay, -1 to 1
  double best = 0;         ///< largest magnitude over all delays, with its sign
  Index lag = 0;           ///< samples of that delay
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

Relation relate(const BlowSpectra& first, const BlowSpectra& second, std::size_t response, Index samples) {
  const VectorXcd a = first.responses[response].cwiseProduct(second.force);
  const VectorXcd b = second.responses[response].cwiseProduct(first.force);
  const double aa = a.squaredNorm(), bb = b.squaredNorm();
  if (!(aa > 0) || !(bb > 0)) return {0, 0, 0, 0};
  VectorXcd cross = VectorXcd::Zero(samples);
  cross.head(a.size()) = a.conjugate().cwiseProduct(b);
  const double zero = cross.sum().real() / std::sqrt(aa * bb);
  const VectorXd over_lags = signal::inverse_fft(cross).real() * static_cast<double>(samples) / std::sqrt(aa * bb);
  Index at = 0;
  over_lags.cwiseAbs().maxCoeff(&at);
  return {zero >= 0 ? std::sqrt(bb / aa) : -std::sqrt(bb / aa), zero, over_lags[at],
          at > samples / 2 ? at - samples : at};
}

bool agrees(const Relation& r) { return r.correlation > 0.5 && r.gain > 1 / 1.3 && r.gain < 1.3; }

std::string name_of(const Relation& r, double usual_correlation, double usual_gain, double dt) {
  // A delay moves the peak of the correlation by whole samples and leaves it as high as with the other blows.
  const double lost = 1 - std::abs(r.correlation), usual_loss = 1 - usual_correlation;
  if (std::abs(r.best) < 0.6 * usual_correlation && std::abs(r.best) < 0.8) {
    return fmt::format("incoherent with the others (correlation {:.2f}, theirs {:.2f})", std::abs(r.best),
                       usual_correlation);
  }
  if (r.lag != 0 && lost > 4 * usual_loss + 0.01 &&
      std::abs(r.best) > std::abs(r.correlation) + 0.5 * (lost - usual_loss)) {
    return fmt::format("{} by {:.4g} ms against the others{}", r.lag > 0 ? "late" : "early",
                       1e3 * dt * static_cast<double>(std::abs(r.lag)), r.best < 0 ? " and reversed" : "");
  }
  if (r.correlation < -0.5) return fmt::format("reversed in sign (gain {:.3g})", r.gain / usual_gain);
  if (r.correlation < 0.5 * usual_correlation) {
    return fmt::format("incoherent with the others (correlation {:.2f}, theirs {:.2f})", r.correlation,
                       usual_correlation);
  }
  const double gain = r.gain / usual_gain;
  if (gain > 1.3 || gain < 1 / 1.3) {
    const double g = 9.80665;
    const bool unit = std::abs(gain * g - 1) < 0.1 || std::abs(gain / g - 1) < 0.1;
    return fmt::format("{:.3g} times the others{}", gain, unit ? ": in g instead of m/s2, or the reverse" : "");
  }
  return {};
}

}  // namespace

std::vector<std::vector<BlowDisagreement>> judge_blows(const std::vector<BlowSpectra>& blows,
                                                       const std::vector<std::string>& names, double dt,
                                                       Index samples) {
  const std::size_t n = blows.size();
  std::vector<std::vector<BlowDisagreement>> result(n);
  if (n < 2) return result;
  for (std::size_t c = 0; c < names.size(); ++c) {
    std::vector<std::vector<Relation>> relation(n, std::vector<Relation>(n));
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const Relation r = relate(blows[j], blows[i], c, samples);
        relation[j][i] = r;
        relation[i][j] = {r.gain != 0 ? 1 / r.gain : 0, r.correlation, r.best, -r.lag};
      }
    }
    // The blow that most others agree with stands for them.
    std::size_t middle = 0;
    double most = -1;
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j) {
        if (j != i && agrees(relation[i][j])) sum += 1 + relation[i][j].correlation / static_cast<double>(n);
      }
      if (sum > most) {
        most = sum;
        middle = i;
      }
    }
    std::vector<double> correlations, gains{1};
    for (std::size_t j = 0; j < n; ++j) {
      if (j == middle || !agrees(relation[middle][j])) continue;
      correlations.push_back(relation[middle][j].correlation);
      gains.push_back(relation[middle][j].gain);
    }
    const std::size_t agreeing = correlations.size() + 1;
    if (n == 2) {
      const std::string finding = name_of(relation[0][1], 1, 1, dt);
      if (agreeing == 1 && !finding.empty()) {
        for (auto& list : result)
          list.push_back({fmt::format("{}: the two impacts disagree: {}", names[c], finding), false});
      }
      continue;
    }
    if (agreeing < 2) {
      for (auto& list : result) list.push_back({fmt::format("{}: no two impacts agree", names[c]), false});
      continue;
    }
    const double usual = median(correlations), gain = median(gains);
    for (std::size_t j = 0; j < n; ++j) {
      if (j == middle) continue;
      const std::string finding = name_of(relation[middle][j], usual, gain, dt);
      if (!finding.empty()) result[j].push_back({names[c] + " " + finding, 2 * agreeing > n});
    }
  }
  return result;
}

BlowGroups groups_of(const std::vector<BlowSpectra>& blows) {
  constexpr double kResembles = 0.8;
  const std::size_t n = blows.size();
  std::vector<std::size_t> with(n, 1);
  std::vector<bool> paired(n, false);
  // Smallest correlation over the responses; 0 where they do not agree.
  const auto likeness = [&](std::size_t i, std::size_t j) {
    double least = 1;
    for (std::size_t c = 0; c < blows[i].responses.size(); ++c) {
      const VectorXcd a = blows[i].responses[c].cwiseProduct(blows[j].force);
      const VectorXcd b = blows[j].responses[c].cwiseProduct(blows[i].force);
      const double aa = a.squaredNorm(), bb = b.squaredNorm();
      if (!(aa > 0) || !(bb > 0)) continue;  // a dead response tells nothing
      const Relation r{std::sqrt(bb / aa), a.dot(b).real() / std::sqrt(aa * bb), 0, 0};
      if (!agrees(r)) return 0.0;
      least = std::min(least, r.correlation);
    }
    return least;
  };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double like = likeness(i, j);
      if (like > 0) ++with[i], ++with[j];
      if (like > kResembles) paired[i] = paired[j] = true;
    }
  }
  BlowGroups out;
  for (std::size_t i = 0; i < n; ++i) {
    out.largest = std::max(out.largest, with[i]);
    out.all_paired = out.all_paired && paired[i];
  }
  return out;
}

}  // namespace whirl::modal
