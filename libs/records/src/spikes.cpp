#include <algorithm>
#include <array>
#include <cmath>

#include "channel.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::records::detail {
namespace {

constexpr Eigen::Index kReach = 7;  // samples to either side of a candidate
constexpr Eigen::Index kWindow = 2 * kReach + 1;
constexpr int kDegree = 4;
constexpr int kMost = 4;  // outliers in one window

double sixth_difference(const Eigen::VectorXd& v, Eigen::Index i) {  // centred on i
  return (v[i - 3] + v[i + 3]) - 6 * (v[i - 2] + v[i + 2]) + 15 * (v[i - 1] + v[i + 1]) - 20 * v[i];
}

/// Removes the sample farthest from the curve through the others, again and again, until the rest is ordinary.
/// Empty when the window holds no few outliers on an ordinary curve.
std::vector<Eigen::Index> outliers(const Eigen::VectorXd& v, const Mask& usable, Eigen::Index centre, double floor) {
  const Eigen::Index first = std::clamp<Eigen::Index>(centre - kReach, 0, v.size() - kWindow);
  std::vector<Eigen::Index> kept, removed;
  for (Eigen::Index i = first; i < first + kWindow; ++i) {
    if (usable[i]) kept.push_back(i);
  }
  std::vector<double> distance;
  while (static_cast<int>(kept.size()) > kDegree + 4) {
    // Leave-one-out: the sample whose removal leaves the smallest residual.
    const auto count = static_cast<Eigen::Index>(kept.size());
    Eigen::MatrixXd a(count, kDegree + 1);
    Eigen::VectorXd b(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const Eigen::Index i = kept[static_cast<std::size_t>(k)];
      const double s = static_cast<double>(i - centre) / kReach;
      a.row(k) << 1, s, s * s, s * s * s, s * s * s * s;
      b[k] = v[i];
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(a);
    const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(count, kDegree + 1);
    const Eigen::VectorXd residual = b - q * (q.transpose() * b);
    const double freedom = static_cast<double>(count - kDegree - 1);
    Eigen::Index worst = 0;
    double largest = 0, deleted = 0;
    for (Eigen::Index k = 0; k < count; ++k) {
      const double free = std::max(1e-6, 1 - q.row(k).squaredNorm());
      if (const double gain = residual[k] * residual[k] / free; gain > largest) {
        largest = gain;
        worst = k;
        deleted = std::abs(residual[k]) / free;
      }
    }
    const double rest = std::sqrt(std::max(0.0, residual.squaredNorm() - largest) / (freedom - 1));
    const double scale = std::sqrt(std::max(1e-6, 1 - q.row(worst).squaredNorm()));
    const double deviation = deleted * scale;  // studentised when divided by the noise
    // With several outliers the rest is not ordinary yet; the sample must stand out from the noise at least.
    if (deviation < 7 * floor) return rest <= 3 * floor ? removed : std::vector<Eigen::Index>{};
    if (rest <= 3 * floor && deviation < 7 * std::max(rest, floor)) return removed;
    if (static_cast<int>(removed.size()) == kMost) return {};
    removed.push_back(kept[static_cast<std::size_t>(worst)]);
    kept.erase(kept.begin() + worst);
  }
  return {};
}

}  // namespace

void find_spikes(ChannelCheck& c) {
  const Eigen::Index n = c.samples.size();
  if (n < 4 * kWindow || !(c.spread > 0)) return;
  // Local level of the sixth differences: the curve may bend sharply in one part of the record only.
  constexpr Eigen::Index kBlock = 100;
  const Eigen::Index blocks = (n + kBlock - 1) / kBlock;
  std::vector<double> level(static_cast<std::size_t>(blocks));
  for (Eigen::Index b = 0; b < blocks; ++b) {
    std::vector<double> part;
    for (Eigen::Index i = std::max<Eigen::Index>(3, (b - 1) * kBlock); i < std::min(n - 3, (b + 2) * kBlock); ++i) {
      part.push_back(std::abs(sixth_difference(c.samples, i)));
    }
    level[static_cast<std::size_t>(b)] = median(std::move(part)) / 0.6745 / std::sqrt(924.0);
  }
  Mask spike = Mask::Constant(n, false);
  for (Eigen::Index i = 3; i < n - 3; ++i) {
    const double floor =
        std::max({c.noise, level[static_cast<std::size_t>(i / kBlock)], 0.5 * c.quantum, 1e-4 * c.spread});
    if (std::abs(sixth_difference(c.samples, i)) < 6 * 30.4 * floor) continue;
    std::vector<Eigen::Index> found = outliers(c.samples, c.usable, i, floor);
    std::sort(found.begin(), found.end());
    // Three in a row are a corner of the curve (a blow, a splice), not spikes.
    bool corner = false;
    for (std::size_t k = 2; k < found.size(); ++k) corner |= found[k] == found[k - 2] + 2;
    if (corner) continue;
    for (const Eigen::Index k : found) spike[k] = true;
  }
  Eigen::Index count = 0, first = -1, last = 0;
  double largest = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!spike[i]) continue;
    if (first < 0) first = i;
    last = i;
    ++count;
    c.usable[i] = false;
  }
  if (count == 0) return;
  const Eigen::VectorXd before = c.samples;
  c.bridge();
  for (Eigen::Index i = 0; i < n; ++i) {
    if (spike[i]) largest = std::max(largest, std::abs(before[i] - c.samples[i]));
  }
  Finding f{.kind = FindingKind::spikes, .severity = Severity::mask, .samples = count, .size = largest};
  f.advice = "single samples off the curve are left out; look for loose contacts or lost bits";
  c.report(std::move(f), first, last);
}

}  // namespace whirl::records::detail
