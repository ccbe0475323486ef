// The 1X vector at steady speed, eight turns each: what wanders beyond the noise beside it.
#include <algorithm>
#include <cmath>

#include "findings/channel_study.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"

namespace whirl::diagnosis::detail {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXd;
constexpr Index kVectorTurns = 8;
constexpr std::size_t kLeastVectors = 8;
constexpr double kSameSpeed = 0.015;                 // to either side of the median speed
constexpr double kSignificant = 1e-3;                // chance: 1X has skirts
constexpr double kNearLine = 0.25;                   // orders: a closer electric line beats with 1X over eight turns
constexpr double kLeastScatter = 3 * kRadPerDegree;  // a mass 3 degrees off leaves 5 % of the unbalance
// Orders beside 1X, clear of it and of half orders under a Hann window, the nearest first; pairs 1/8 apart overlap.
constexpr double kNoiseLines[] = {0.75, 1.25, 0.625, 1.375, 1.625, 0.375, 1.75, 0.25};
constexpr std::size_t kMostLines = 4;
constexpr double kBelowHalf = 0.5;  // orders: a whirl stands there

struct Vectors {
  std::vector<Complex> first;
  std::vector<double> noise, speed;  // squared magnitude beside 1X; rad/s
  std::size_t lines = 0;             // that the noise is the mean of
};

// A supply wanders over a block: what is left of it after the fit stands beside it and is no noise of 1X.
std::vector<double> noise_lines(const ChannelStudy& s) {
  std::vector<double> out;
  for (const double order : kNoiseLines) {
    const bool clear = std::ranges::none_of(s.electric, [&](const Line& l) {
      return std::ranges::any_of(
          s.blocks, [&](const LineBlock& b) { return std::abs(l.frequency / b.turning() - order) < kNearLine; });
    });
    if (clear && out.size() < kMostLines && (!s.whirl || order > kBelowHalf)) out.push_back(order);
  }
  if (out.empty()) out.assign(std::begin(kNoiseLines), std::begin(kNoiseLines) + kMostLines);
  return out;
}

// 1X and what stands beside it, of the samples without the electric lines and the other orders.
Vectors vectors_of(const ChannelStudy& s) {
  Vectors out;
  const std::vector<double> beside = noise_lines(s);
  out.lines = beside.size();
  const int per_turn = s.channel.per_turn;
  const Index n = kVectorTurns * per_turn;
  const VectorXd place = VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1)) * (kTwoPi / per_turn);
  const VectorXd weight = (1 - (place / static_cast<double>(kVectorTurns)).array().cos()) / static_cast<double>(n);
  const auto line = [&](const VectorXd& x, double order) {
    Complex sum = 0;
    for (Index i = 0; i < n; ++i) sum += 2 * weight[i] * x[i] * std::polar(1.0, -order * place[i]);
    return sum;
  };
  for (const LineBlock& b : s.blocks) {
    const VectorXd x = b.samples_with({1, 0});
    for (Index first = 0; first + n <= x.size(); first += n) {
      const VectorXd part = x.segment(first, n);
      out.first.push_back(line(part, 1));
      double noise = 0;
      for (const double order : beside) noise += std::norm(line(part, order)) / static_cast<double>(beside.size());
      out.noise.push_back(noise);
      out.speed.push_back(s.channel.speed(b.first_turn() + first / per_turn, kVectorTurns));
    }
  }
  return out;
}

}  // namespace

void find_phase_scatter(ChannelStudy& s) {
  if (!s.phase) {
    // An angle taken from the vibration holds the slow part of the wander: skirts are left.
    s.scatter = INFINITY;
    s.unjudged(VibrationCode::sidebands, UnjudgedReason::no_angle);
    return s.unjudged(VibrationCode::phase_scatter, UnjudgedReason::no_angle);
  }
  const auto beats = [&](const Line& l) {
    return std::ranges::any_of(s.blocks,
                               [&](const LineBlock& b) { return std::abs(l.frequency / b.turning() - 1) < kNearLine; });
  };
  if (std::ranges::any_of(s.electric, beats)) {
    // Without it the skirts of 1X are not told from sidebands close to it.
    s.scatter = INFINITY;
    s.unjudged(VibrationCode::sidebands, UnjudgedReason::line_beside_1x);
    return s.unjudged(VibrationCode::phase_scatter, UnjudgedReason::line_beside_1x);
  }
  const Vectors all = vectors_of(s);
  std::vector<double> sorted = all.speed;
  std::ranges::sort(sorted);
  const double middle = sorted.empty() ? 0 : sorted[sorted.size() / 2];
  std::vector<std::size_t> used;
  for (std::size_t k = 0; k < all.speed.size(); ++k)
    if (std::abs(all.speed[k] / middle - 1) < kSameSpeed) used.push_back(k);
  if (used.size() < kLeastVectors)
    return s.unjudged(VibrationCode::phase_scatter,
                      s.runs() ? UnjudgedReason::speed_changes : UnjudgedReason::too_few_turns);
  // Near a critical speed the vector follows the speed: that is no scatter.
  const auto n = static_cast<Index>(used.size());
  Eigen::MatrixXcd a(n, 2);
  Eigen::VectorXcd z(n);
  double noise = 0;
  for (Index k = 0; k < n; ++k) {
    const std::size_t at = used[static_cast<std::size_t>(k)];
    a.row(k) << 1.0, (all.speed[at] - middle) / middle;
    z[k] = all.first[at];
    noise += all.noise[at] / static_cast<double>(n);
  }
  const Eigen::VectorXcd smooth = a * a.colPivHouseholderQr().solve(z);
  double across = 0, size = 0;
  for (Index k = 0; k < n; ++k) {
    const Complex off = (z[k] - smooth[k]) * std::polar(1.0, -std::arg(smooth[k]));
    across += off.imag() * off.imag() / static_cast<double>(n - 2);
    size += std::norm(smooth[k]) / static_cast<double>(n);
  }
  if (!(noise > 0) || !(size > 0)) return;
  VibrationFinding f;
  f.code = VibrationCode::phase_scatter;
  f.order = 1;
  f.speed = middle;
  f.size = std::sqrt(std::max(0.0, across - 0.5 * noise) / size);
  // The lines beside 1X overlap by pairs: of four two are independent, two degrees of freedom each.
  const auto freedom = static_cast<double>(std::max<std::size_t>(2, all.lines)) * static_cast<double>(n);
  f.chance = fisher_f_tail(static_cast<double>(n - 2), freedom, across / (0.5 * noise));
  if (f.chance < kSignificant) s.scatter = f.size;
  f.low_speed = middle * (1 - kSameSpeed);
  f.high_speed = middle * (1 + kSameSpeed);
  f.causes = {Cause::rub, Cause::looseness, Cause::thermal};
  if (f.size >= kLeastScatter) s.add(std::move(f));
}

}  // namespace whirl::diagnosis::detail
