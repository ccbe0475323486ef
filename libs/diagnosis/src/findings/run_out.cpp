// Run-out: the 1X vector that is left towards standstill, where unbalance makes none.
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>

#include "findings/channel_study.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::diagnosis::detail {
namespace {

using Eigen::Index;
constexpr double kSlow = 0.45;      // of the speed of the largest 1X: Omega^2 and Omega^4 describe the unbalance there
constexpr double kLeastSpan = 1.5;  // fastest over slowest of these speeds
constexpr std::size_t kLeastSlow = 6;  // blocks
constexpr double kLeastRunOut = 0.03;  // of the unbalance's vector at the fastest of them: what Omega^6 would leave

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
  if (slow.size() < kLeastSlow || fastest < kLeastSpan * slowest)
    return s.unjudged(VibrationCode::run_out, UnjudgedReason::no_slow_turns);
  const auto n = static_cast<Index>(slow.size());
  Eigen::MatrixXcd a(n, 3);
  Eigen::VectorXcd z(n);
  for (Index k = 0; k < n; ++k) {
    const std::size_t block = slow[static_cast<std::size_t>(k)];
    const double u = std::pow(s.blocks[block].speed() / fastest, 2);
    a.row(k) << 1.0, u, u * u;
    z[k] = first[block].vector;
  }
  const Eigen::MatrixXcd inverse = (a.adjoint() * a).ldlt().solve(Eigen::MatrixXcd::Identity(3, 3));
  const Eigen::VectorXcd fit = inverse * (a.adjoint() * z);
  const double freedom = static_cast<double>(n - 3);
  const double variance = (z - a * fit).squaredNorm() / freedom * inverse(0, 0).real();
  VibrationFinding f;
  f.code = VibrationCode::run_out;
  f.size = std::abs(fit[0]);
  f.order = 1;
  f.speed = slowest;
  const boost::math::fisher_f law(2, 2 * freedom);
  f.chance = variance > 0 ? boost::math::cdf(boost::math::complement(law, f.size * f.size / variance)) : 0;
  f.low_speed = slowest;
  f.high_speed = fastest;
  f.causes = {Cause::run_out, Cause::bent_shaft};
  if (f.size > kLeastRunOut * std::abs(fit[1] + fit[2])) s.add(std::move(f));
}

}  // namespace whirl::diagnosis::detail
