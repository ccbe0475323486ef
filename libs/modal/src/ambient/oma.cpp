// Stochastic subspace identification with uncertainties.
#include "whirl/modal/oma.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "responses.hpp"
#include "spectral_evidence.hpp"
#include "subspace.hpp"
#include "tones.hpp"
#include "usable_record.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

// First-order changes of a pole, rad/s, by the blocks' own Hankel matrices: with the left vector l and the right one r
// in the coordinates of the Hankel matrix, that of the discrete eigenvalue is l^T (dH2 - lambda dH1) r.
VectorXcd changes_of(const SubspacePole& pole, const MatrixXd& u, const MatrixXd& right,
                     const std::vector<MatrixXd>& blocks, Index l, double dt) {
  const Index rows = u.rows() - l;
  const auto o1 = u.topLeftCorner(rows, pole.order);
  const VectorXcd solved =
      MatrixXd(o1.transpose() * o1).llt().solve(MatrixXd(MatrixXd::Identity(pole.order, pole.order))) * pole.left;
  const VectorXcd left = o1 * solved, column = right.leftCols(pole.order) * pole.right;
  VectorXcd changes(static_cast<Index>(blocks.size()));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const VectorXcd x = blocks[b] * column;
    const Complex change = (left.transpose() * (x.tail(rows) - pole.discrete * x.head(rows))).value();
    changes[static_cast<Index>(b)] = change / (pole.discrete * dt);  // s = ln(lambda)/dt
  }
  return changes;
}

struct Found {
  std::vector<OperationalMode> modes;
  std::size_t orders = 0;  // of the models looked at
  Index rank = 0;
};

// Modes inside `band` of the records `y`, whose channels are of like size.
Found subspace_modes(const MatrixXd& y, double dt, SubspaceBand band, const SubspaceSizes& sizes,
                     const OmaOptions& options) {
  const Index l = y.cols();
  std::vector<Index> all(static_cast<std::size_t>(l));
  std::iota(all.begin(), all.end(), Index{0});
  const auto matrix_of = [&](const std::vector<MatrixXd>& r) { return hankel(r, sizes.rows + 1, sizes.rows, 0, l); };
  const std::vector<MatrixXd> r = correlations(y, all, 2 * sizes.rows + 1);
  const MatrixXd h = matrix_of(r);
  MatrixXd weighted = h, weight = MatrixXd::Identity(h.cols(), h.cols());
  if (options.method == SubspaceMethod::data) {
    weight = past_weight(r, sizes.rows);
    weighted = h * weight;
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> squares(MatrixXd(weighted * weighted.transpose()));
  Found found;
  found.rank = std::min<Index>(sizes.max_order, h.cols());
  const MatrixXd u = squares.eigenvectors().rowwise().reverse().leftCols(found.rank);
  // H W V = U S: with the columns of U S the right side is W V = W (H W)^T U / S, and everything scales by 1/S.
  const VectorXd singular2 = squares.eigenvalues().reverse().head(found.rank).cwiseMax(1e-300);
  const MatrixXd right = weight * (weighted.transpose() * u) * singular2.cwiseInverse().asDiagonal();
  std::vector<SubspacePole> poles;
  std::vector<int> orders;
  for (int order = 2; order <= found.rank; order += 2) {
    orders.push_back(order);
    append_poles(u.topLeftCorner(u.rows() - l, order), u.bottomLeftCorner(u.rows() - l, order),
                 u.topLeftCorner(l, order), dt, band, options.max_damping, poles);
  }
  found.orders = orders.size();
  const std::vector<SubspaceCluster> clusters = cluster_poles(poles, orders, options);
  if (clusters.empty()) return found;
  const Index part = y.rows() / options.blocks;
  std::vector<MatrixXd> blocks;
  for (int b = 0; b < options.blocks; ++b)
    blocks.push_back(matrix_of(correlations(y.middleRows(b * part, part), all, 2 * sizes.rows + 1)));
  for (const SubspaceCluster& cluster : clusters) {
    VectorXcd changes = VectorXcd::Zero(options.blocks);
    for (const SubspacePole* pole : cluster.members) changes += changes_of(*pole, u, right, blocks, l, dt);
    found.modes.push_back(mode_of(cluster, changes / static_cast<double>(cluster.members.size())));
  }
  return found;
}

// Modes so slow that the block rows hold less than half a period: looked for with many more rows, where there are many.
void append_slow_modes(const MatrixXd& y, double dt, SubspaceBand band, Index rows, const OmaOptions& options,
                       Found& found) {
  const Index more = most_block_rows(y.cols());
  const double half_period = 0.5 / (dt * static_cast<double>(rows));
  band.high = std::min(band.high, half_period);
  if (options.block_rows > 0 || more < 2 * rows || 2 * more + 2 > y.rows() / 20 || !(band.low < band.high)) return;
  const Found slow = subspace_modes(y, dt, band, subspace_sizes(options, y.cols(), more, y.rows()), options);
  std::erase_if(found.modes, [&](const OperationalMode& mode) { return mode.frequency.value < band.high; });
  for (OperationalMode mode : slow.modes) {
    mode.orders = static_cast<int>(std::lround(static_cast<double>(mode.orders) * static_cast<double>(found.orders) /
                                               static_cast<double>(slow.orders)));
    found.modes.push_back(std::move(mode));
  }
}

}  // namespace

OperationalModes identify_operational(const Recording& given, const OmaOptions& options) {
  given.check();
  OperationalModes result;
  const Recording recording = usable_record(given, result.summary);
  MatrixXd y = responses_of(recording, result);
  const double dt = recording.dt;
  const SubspaceBand band = subspace_band(options, dt);
  const Index l = y.cols();
  take_off_tones(recording, options, band, y, result.tones);
  const Index rows = block_rows(options, l, y);
  const SubspaceSizes sizes = subspace_sizes(options, l, rows, y.rows());

  const VectorXd scale = y.colwise().norm().transpose() / std::sqrt(static_cast<double>(y.rows()));
  y = (y * scale.cwiseInverse().asDiagonal()).eval();
  Found found = subspace_modes(y, dt, band, sizes, options);
  append_slow_modes(y, dt, band, rows, options, found);

  const double duration = dt * static_cast<double>(y.rows());
  for (OperationalMode& mode : found.modes) {
    const double kurtosis = band_kurtosis(y, dt, mode.frequency.value, tone_width(mode, duration));
    take_mode(std::move(mode), kurtosis, scale, options, result);
  }
  std::vector<Index> all(static_cast<std::size_t>(l));
  std::iota(all.begin(), all.end(), Index{0});
  const std::string dropped = drop_chance_modes({{&y, dt, scale, all}}, found.orders, result);
  conclude(result);
  result.summary.trust =
      fmt::format("{} from {:.4g} s, {}, orders 2 to {}; the excitation is taken as white",
                  counted(result.modes.size(), "mode"), duration, counted(l, "channel"), found.rank) +
      dropped;
  return result;
}

}  // namespace whirl::modal
