// Set-ups joined before the identification: one model of all of them (PreGER).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "pooled_estimate.hpp"
#include "responses.hpp"
#include "spectral_evidence.hpp"
#include "subspace.hpp"
#include "tones.hpp"
#include "usable_record.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

// One record: its references first (in one order for all set-ups), then the channels that are its own.
struct Setup {
  MatrixXd y;
  std::vector<std::string> own;
  VectorXd scale;  // of all its columns: what a unit of y stands for
  double kurtosis(double dt, const OperationalMode& mode) const {
    return band_kurtosis(y, dt, mode.frequency.value, tone_width(mode, dt * static_cast<double>(y.rows())));
  }
};

// Hankel matrices of one set-up, weighted on the right.
struct Hankels {
  MatrixXd reference, own;
};

// What the observability matrix of every model order follows from: O_ref = sum_j H_ref,j R_j with fixed right
// factors R_j; the states of set-up j as its references show them, Z_j = O_ref^+ H_ref,j; and its own channels in the
// same states, O_j = H_own,j Z_j^+ = H_own,j T^T (T T^T)^-1 P with T = O_ref^T H_ref,j, P = O_ref^T O_ref. The
// excitation of a set-up is in Z_j alone, so that neither its size nor its direction matters (Mevel, Basseville,
// Benveniste and Goursat, 2002; Doehler and Mevel, 2012).
struct Factors {
  MatrixXd reference, inner;             // O_ref, P
  std::vector<MatrixXd> across, states;  // H_own,j T^T and T T^T
};

Factors factors_of(const std::vector<Hankels>& h, const std::vector<MatrixXd>& right) {
  Factors f;
  f.reference = MatrixXd::Zero(h.front().reference.rows(), right.front().cols());
  for (std::size_t j = 0; j < h.size(); ++j) f.reference += h[j].reference * right[j];
  f.inner = f.reference.transpose() * f.reference;
  for (const Hankels& one : h) {
    const MatrixXd t = f.reference.transpose() * one.reference;
    f.across.push_back(one.own * t.transpose());
    f.states.push_back(t * t.transpose());
  }
  return f;
}

// Observability matrix up to the last block row (o1) and from the second (o2), all channels.
struct Observability {
  MatrixXd o1, o2, first;  // first: the rows of the first block, one per channel
};

Observability observability_of(const Factors& f, Index order, Index references) {
  std::vector<MatrixXd> parts{f.reference.leftCols(order)};
  std::vector<Index> widths{references};
  const Index blocks = f.reference.rows() / references;
  for (std::size_t j = 0; j < f.across.size(); ++j) {
    const Index width = f.across[j].rows() / blocks;
    if (width == 0) continue;
    MatrixXd states = f.states[j].topLeftCorner(order, order);
    states.diagonal().array() += 1e-12 * states.diagonal().maxCoeff();
    parts.push_back(f.across[j].leftCols(order) * states.llt().solve(f.inner.topLeftCorner(order, order)));
    widths.push_back(width);
  }
  Index channels = 0;
  for (const Index width : widths) channels += width;
  Observability o{MatrixXd(channels * (blocks - 1), order), MatrixXd(channels * (blocks - 1), order),
                  MatrixXd(channels, order)};
  Index row = 0, channel = 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Index rows = parts[p].rows() - widths[p];
    o.o1.middleRows(row, rows) = parts[p].topRows(rows);
    o.o2.middleRows(row, rows) = parts[p].bottomRows(rows);
    o.first.middleRows(channel, widths[p]) = parts[p].topRows(widths[p]);
    row += rows;
    channel += widths[p];
  }
  return o;
}

MatrixXd step_of(const Factors& f, Index order, Index references) {
  const Observability o = observability_of(f, order, references);
  return MatrixXd(o.o1.transpose() * o.o1).llt().solve(MatrixXd(o.o1.transpose() * o.o2));
}

std::vector<Hankels> moved(const std::vector<Hankels>& mean, const std::vector<Hankels>& block, double step) {
  std::vector<Hankels> h = mean;
  for (std::size_t j = 0; j < h.size(); ++j) {
    h[j].reference += step * (block[j].reference - mean[j].reference);
    h[j].own += step * (block[j].own - mean[j].own);
  }
  return h;
}

// Channels that every record has, in the order of the first.
std::vector<std::string> shared_channels(const std::vector<OperationalModes>& lists) {
  std::vector<std::string> shared;
  for (const std::string& name : lists.front().channels) {
    if (std::all_of(lists.begin(), lists.end(), [&](const OperationalModes& o) {
          return std::find(o.channels.begin(), o.channels.end(), name) != o.channels.end();
        }))
      shared.push_back(name);
  }
  return shared;
}

// Responses less their tones. References get one scale for all set-ups but for the level of the excitation in each,
// so that their share of a shape is the same everywhere.
std::vector<Setup> read_setups(std::vector<Recording> records, const OmaOptions& options,
                               std::vector<std::string>& references, OperationalModes& result) {
  std::vector<OperationalModes> lists(records.size());
  std::vector<MatrixXd> responses;
  for (std::size_t j = 0; j < records.size(); ++j) {
    records[j].check();
    records[j] = usable_record(records[j], lists[j].summary);
    if (lists[j].summary.status == Status::unusable) result.summary.fail(lists[j].summary.reason);
    if (std::abs(records[j].dt / records.front().dt - 1) > 1e-6)
      throw Error(fmt::format("{}: {:g} Hz, where the first set-up has {:g} Hz: all must have one rate to be joined",
                              records[j].source, 1 / records[j].dt, 1 / records.front().dt));
    responses.push_back(responses_of(records[j], lists[j]));
    for (const std::string& warning : lists[j].summary.warnings)
      result.summary.warn(fmt::format("set-up {}: {}", j + 1, warning));
    if (records[j].at(lists[j].channels.front()).quantity !=
        records.front().at(lists.front().channels.front()).quantity)
      throw Error(fmt::format("{}: another quantity than the first set-up", records[j].source));
  }
  references = shared_channels(lists);
  if (references.empty())
    throw Error("no channel name is in every set-up: references are needed to join them (or --merge post)");
  std::vector<Setup> setups;
  const auto count = static_cast<Index>(references.size());
  VectorXd common = VectorXd::Zero(count);
  for (std::size_t j = 0; j < records.size(); ++j) {
    std::vector<Tone> tones;
    take_off_tones(records[j], options, subspace_band(options, records[j].dt), responses[j], tones);
    for (Tone& tone : tones) {
      if (std::none_of(result.tones.begin(), result.tones.end(),
                       [&](const Tone& t) { return std::abs(t.frequency - tone.frequency) < 0.002 * tone.frequency; }))
        result.tones.push_back({tone.frequency, {}, tone.kurtosis, tone.evidence});
    }
    Setup setup;
    std::vector<std::string> order = references;
    for (const std::string& name : lists[j].channels) {
      if (std::find(references.begin(), references.end(), name) != references.end()) continue;
      order.push_back(name);
      setup.own.push_back(name);
    }
    setup.y.resize(responses[j].rows(), static_cast<Index>(order.size()));
    for (std::size_t c = 0; c < order.size(); ++c) {
      const auto at = std::find(lists[j].channels.begin(), lists[j].channels.end(), order[c]);
      setup.y.col(static_cast<Index>(c)) = responses[j].col(at - lists[j].channels.begin());
    }
    setup.scale = setup.y.colwise().norm().transpose() / std::sqrt(static_cast<double>(setup.y.rows()));
    common += setup.scale.head(count).cwiseAbs2() / static_cast<double>(records.size());
    setups.push_back(std::move(setup));
  }
  common = common.cwiseSqrt();
  for (Setup& setup : setups) {
    const double level =
        std::sqrt(setup.scale.head(count).cwiseQuotient(common).squaredNorm() / static_cast<double>(count));
    setup.scale.head(count) = common;
    setup.scale.tail(setup.scale.size() - count) /= level;
    setup.y = (setup.y * (level * setup.scale).cwiseInverse().asDiagonal()).eval();
  }
  return setups;
}

Hankels hankels_of(const MatrixXd& y, Index references, Index rows, const MatrixXd& weight) {
  std::vector<Index> columns;
  for (Index c = 0; c < references; ++c) columns.push_back(c);
  const std::vector<MatrixXd> r = correlations(y, columns, 2 * rows + 1);
  return {hankel(r, rows + 1, rows, 0, references) * weight,
          hankel(r, rows + 1, rows, references, y.cols() - references) * weight};
}

MatrixXd weight_of(const MatrixXd& y, Index references, Index rows, SubspaceMethod method) {
  if (method == SubspaceMethod::covariance) return MatrixXd::Identity(rows * references, rows * references);
  std::vector<Index> columns;
  for (Index c = 0; c < references; ++c) columns.push_back(c);
  return past_weight(correlations(y.leftCols(references), columns, rows), rows);
}

// The pole as the references of one set-up alone show it, to first order, and by each block of that set-up:
// l^T (H2 - lambda H1) r with l the left vector over the rows of the references and H_ref,j r = O_ref v.
struct OwnPole {
  Complex change;  // rad/s, from the common pole
  VectorXcd blocks;
};

OwnPole own_pole(const SubspacePole& pole, const Factors& f, const Hankels& mean,
                 const std::vector<const MatrixXd*>& blocks, Index references, double dt) {
  const Index rows = f.reference.rows() - references;
  const MatrixXd o1 = f.reference.topLeftCorner(rows, pole.order);
  const VectorXcd left =
      o1 *
      (MatrixXd(o1.transpose() * o1).llt().solve(MatrixXd(MatrixXd::Identity(pole.order, pole.order))) * pole.left);
  const MatrixXd t = f.reference.leftCols(pole.order).transpose() * mean.reference;
  MatrixXd states = t * t.transpose();
  states.diagonal().array() += 1e-12 * states.diagonal().maxCoeff();
  const VectorXcd column =
      t.transpose() * (states.llt().solve(f.inner.topLeftCorner(pole.order, pole.order)) * pole.right);
  const auto change = [&](const MatrixXd& h) -> Complex {
    const VectorXcd x = h * column;
    return (left.transpose() * (x.tail(rows) - pole.discrete * x.head(rows))).value() / (pole.discrete * dt);
  };
  OwnPole own{change(mean.reference), VectorXcd(static_cast<Index>(blocks.size()))};
  for (std::size_t b = 0; b < blocks.size(); ++b) own.blocks[static_cast<Index>(b)] = change(*blocks[b]);
  return own;
}

struct Changes {
  Index rank, references;
  int blocks;
  double step, dt;
};

// First-order changes of each cluster's pole (rad/s) by the blocks. Errors at neighbouring orders are alike: a few
// orders show them.
std::vector<std::vector<VectorXcd>> block_changes(const std::vector<SubspaceCluster>& clusters, const Factors& factors,
                                                  const std::vector<Factors>& shifted, const Changes& o) {
  std::vector<std::vector<VectorXcd>> changes(clusters.size());
  for (int order = static_cast<int>(o.rank) / 2 * 2; order > 2; order -= 6) {
    const MatrixXd a = step_of(factors, order, o.references);
    std::vector<MatrixXd> differences;
    for (const Factors& f : shifted) differences.push_back((step_of(f, order, o.references) - a) / o.step);
    for (std::size_t c = 0; c < clusters.size(); ++c) {
      for (const SubspacePole* pole : clusters[c].members) {
        if (pole->order != order) continue;
        VectorXcd one(o.blocks);
        for (std::size_t b = 0; b < differences.size(); ++b)
          one[static_cast<Index>(b)] =
              (pole->left.transpose() * differences[b] * pole->right).value() / (pole->discrete * o.dt);
        changes[c].push_back(std::move(one));
      }
    }
  }
  return changes;
}

// Set-ups whose references disagree on a pole (imaginary part, rad/s): the structure was not the same in all of them.
PooledEstimate between_setups(const SubspacePole& pole, const Factors& factors, const std::vector<Hankels>& mean,
                              const std::vector<std::vector<Hankels>>& blocks, Index references, double dt) {
  const auto n = static_cast<double>(blocks.size());
  std::vector<Estimate> shift;
  for (std::size_t j = 0; j < mean.size(); ++j) {
    std::vector<const MatrixXd*> own;
    for (const auto& block : blocks) own.push_back(&block[j].reference);
    const OwnPole one = own_pole(pole, factors, mean[j], own, references, dt);
    const double variance = (one.blocks.array() - one.blocks.mean()).imag().square().sum() / (n * (n - 1));
    shift.push_back(Estimate::from_sd(one.change.imag(), std::sqrt(variance)));
  }
  return pool(shift, static_cast<int>(blocks.size()));
}

double mean_kurtosis(const std::vector<Setup>& setups, double dt, const OperationalMode& mode) {
  double sum = 0;
  for (const Setup& setup : setups) sum += setup.kurtosis(dt, mode);
  return sum / static_cast<double>(setups.size());
}

// Rows of the shapes: those of the references, then each set-up's own.
std::vector<SeenBy> seen_by(const std::vector<Setup>& setups, Index count, double dt) {
  std::vector<SeenBy> seen;
  Index row = count;
  for (const Setup& setup : setups) {
    std::vector<Index> rows(static_cast<std::size_t>(setup.y.cols()));
    std::iota(rows.begin(), rows.begin() + count, Index{0});
    std::iota(rows.begin() + count, rows.end(), row);
    row += setup.y.cols() - count;
    seen.push_back({&setup.y, dt, setup.scale, rows});
  }
  return seen;
}

// The same for all set-ups.
SubspaceSizes sizes_of(const std::vector<Setup>& setups, const OmaOptions& options, Index references) {
  Index rows = 0;
  for (const Setup& setup : setups) rows = std::max(rows, block_rows(options, references, setup.y));
  SubspaceSizes sizes{};
  for (const Setup& setup : setups) sizes = subspace_sizes(options, references, rows, setup.y.rows());
  return sizes;
}

}  // namespace

OperationalModes identify_joint(const std::vector<Recording>& records, const OmaOptions& options) {
  if (records.empty()) throw Error("no set-ups to join");
  OperationalModes result;
  std::vector<std::string> references;
  const std::vector<Setup> setups = read_setups(records, options, references, result);
  const double dt = records.front().dt;
  const SubspaceBand band = subspace_band(options, dt);
  const auto count = static_cast<Index>(references.size());
  const SubspaceSizes sizes = sizes_of(setups, options, count);

  std::vector<Hankels> mean;
  std::vector<std::vector<Hankels>> blocks(static_cast<std::size_t>(options.blocks));
  result.channels = references;
  VectorXd scale = setups.front().scale.head(count);
  for (const Setup& setup : setups) {
    const MatrixXd weight = weight_of(setup.y, count, sizes.rows, options.method);
    mean.push_back(hankels_of(setup.y, count, sizes.rows, weight));
    const Index part = setup.y.rows() / options.blocks;
    for (int b = 0; b < options.blocks; ++b)
      blocks[static_cast<std::size_t>(b)].push_back(
          hankels_of(setup.y.middleRows(b * part, part), count, sizes.rows, weight));
    result.channels.insert(result.channels.end(), setup.own.begin(), setup.own.end());
    const auto own = static_cast<Index>(setup.own.size());
    scale.conservativeResize(scale.size() + own);
    scale.tail(own) = setup.scale.tail(own);
  }
  MatrixXd squares = MatrixXd::Zero(mean.front().reference.rows(), mean.front().reference.rows());
  for (const Hankels& h : mean) squares += h.reference * h.reference.transpose();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(squares);
  const Index rank = std::min<Index>(sizes.max_order, sizes.rows * count);
  const MatrixXd u = eigen.eigenvectors().rowwise().reverse().leftCols(rank);
  const VectorXd singular2 = eigen.eigenvalues().reverse().head(rank).cwiseMax(1e-300);
  std::vector<MatrixXd> right;
  for (const Hankels& h : mean) right.push_back(h.reference.transpose() * u * singular2.cwiseInverse().asDiagonal());
  const Factors factors = factors_of(mean, right);
  const double step = 1 / static_cast<double>(options.blocks - 1);
  std::vector<Factors> shifted;
  for (const auto& block : blocks) shifted.push_back(factors_of(moved(mean, block, step), right));

  std::vector<SubspacePole> poles;
  std::vector<int> orders;
  for (int order = 2; order <= rank; order += 2) {
    orders.push_back(order);
    const Observability o = observability_of(factors, order, count);
    append_poles(o.o1, o.o2, o.first, dt, band, options.max_damping, poles);
  }
  const std::vector<SubspaceCluster> clusters = cluster_poles(poles, orders, options);
  const std::vector<std::vector<VectorXcd>> changes =
      block_changes(clusters, factors, shifted, {rank, count, options.blocks, step, dt});
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    if (changes[c].empty()) continue;
    const auto s = static_cast<double>(setups.size());
    VectorXcd total = VectorXcd::Zero(options.blocks);
    for (const VectorXcd& one : changes[c]) total += one / static_cast<double>(changes[c].size());
    const SubspacePole& middle = *clusters[c].members[clusters[c].members.size() / 2];
    const PooledEstimate pooled = between_setups(middle, factors, mean, blocks, count, dt);
    const double between = pooled.between * pooled.between;
    const bool differ = pooled.probability * static_cast<double>(clusters.size()) < 0.005;
    OperationalMode mode = mode_of(clusters[c], total, pooled.probability < 0.01 ? between / s : 0);
    const double kurtosis = mean_kurtosis(setups, dt, mode);
    const std::size_t before = result.modes.size();
    if (differ)
      result.summary.warn(
          fmt::format("mode at {:.5g} Hz: its frequency differs between the set-ups by {:.2g} % (sd), beyond their "
                      "errors; one model "
                      "of all of them does not hold there: merge the set-ups after the identification (--merge post)",
                      mode.frequency.value, 100 * std::sqrt(between) / (2 * std::numbers::pi * mode.frequency.value)));
    take_mode(std::move(mode), kurtosis, scale, options, result);
    if (differ && result.modes.size() == before) result.summary.warnings.pop_back();
  }
  const std::string dropped = drop_chance_modes(seen_by(setups, count, dt), orders.size(), result);
  conclude(result);
  result.summary.trust = fmt::format(
                             "{} modes from {} set-ups joined on {} references, {} channels, orders 2 to {}; the "
                             "excitation is taken as white",
                             result.modes.size(), setups.size(), count, result.channels.size(), rank) +
                         dropped;
  return result;
}

}  // namespace whirl::modal
