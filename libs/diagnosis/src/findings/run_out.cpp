// Run-out: the 1X vector that is left towards standstill, where unbalance makes none.
#include <algorithm>
#include <cmath>

#include "findings/channel_study.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"

namespace whirl::diagnosis::detail {
namespace {

using Eigen::Index;
constexpr double kSlow = 0.45;      // of the speed of the largest 1X: Omega^2 and Omega^4 describe the unbalance there
constexpr double kLeastSpan = 1.5;  // fastest over slowest of these speeds
constexpr std::size_t kLeastSlow = 6;  // blocks
constexpr double kLeastRunOut = 0.03;  // of the unbalance's vector at the fastest of them: what Omega^6 would leave
// The vector of unbalance is e u / (1 - u (fastest / critical)^2) below a critical speed, u = (speed / fastest)^2: the
// term in u^2 is (fastest / critical)^2 of that in u, between 0 and kSlow^2 for every mode. Its prior has that middle
// and, for the phase of the damping as well, half that span as standard deviation.
constexpr double kSecondTerm = 0.5 * kSlow * kSlow, kSecondSpread = 0.5 * kSlow * kSlow;

}  // namespace

void find_run_out(ChannelStudy& s) {
  if (s.channel.quantity != Quantity::displacement) return;
  if (!s.phase) return s.unjudged(VibrationCode::run_out, UnjudgedReason::no_angle);
  double largest = 0, at = 0;
  std::vector<LineValue> first;
  for (const LineBlock& b : s.blocks) {
    first.push_back(b.fitted({1, 0}));
    if (first.back().share >= kLeastShare && first.back().amplitude() > largest)
      largest = first.back().amplitude(), at = b.speed();
  }
  std::vector<std::size_t> slow;
  double slowest = INFINITY, fastest = 0;
  for (std::size_t k = 0; k < first.size(); ++k) {
    if (s.blocks[k].speed() > kSlow * at || !(first[k].share >= kLeastShare)) continue;
    slow.push_back(k);
    slowest = std::min(slowest, s.blocks[k].speed());
    fastest = std::max(fastest, s.blocks[k].speed());
  }
  if (slow.size() < kLeastSlow || fastest < kLeastSpan * slowest) {
    const bool passed = s.result.low_speed * kLeastSpan < kSlow * at;
    return s.unjudged(VibrationCode::run_out, passed ? UnjudgedReason::few_slow_turns : UnjudgedReason::no_slow_turns);
  }
  const auto n = static_cast<Index>(slow.size());
  Eigen::MatrixXcd a(n, 3);
  Eigen::VectorXcd z(n);
  for (Index k = 0; k < n; ++k) {
    const std::size_t block = slow[static_cast<std::size_t>(k)];
    const double u = std::pow(s.blocks[block].speed() / fastest, 2);
    a.row(k) << 1.0, u, u * u;
    z[k] = first[block].vector;
  }
  // Without the second term first: its size and the scatter scale the prior of that term.
  const Eigen::MatrixXcd plain = a.leftCols(2);
  const Eigen::VectorXcd first_fit = plain.colPivHouseholderQr().solve(z);
  const double freedom = static_cast<double>(n - 2);
  const double scatter = (z - plain * first_fit).squaredNorm() / freedom;
  const double spread = kSecondSpread * std::abs(first_fit[1]);
  Eigen::MatrixXcd normal = a.adjoint() * a;
  Eigen::VectorXcd right = a.adjoint() * z;
  const double weight = spread > 0 ? scatter / (spread * spread) : 0;
  normal(2, 2) += weight;
  right[2] += weight * kSecondTerm * first_fit[1];
  const Eigen::MatrixXcd inverse = normal.ldlt().solve(Eigen::MatrixXcd::Identity(3, 3));
  const Eigen::VectorXcd fit = inverse * right;
  const double variance = (z - a * fit).squaredNorm() / freedom * inverse(0, 0).real();
  VibrationFinding f;
  f.code = VibrationCode::run_out;
  f.size = std::abs(fit[0]);
  f.order = 1;
  f.speed = slowest;
  f.chance = variance > 0 ? fisher_f_tail(2, 2 * freedom, f.size * f.size / variance) : 0;
  f.low_speed = slowest;
  f.high_speed = fastest;
  f.causes = {Cause::run_out, Cause::bent_shaft};
  if (f.size > kLeastRunOut * std::abs(fit[1] + fit[2])) s.add(std::move(f));
}

}  // namespace whirl::diagnosis::detail
