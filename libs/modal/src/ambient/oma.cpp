// Stochastic subspace identification with uncertainties.
#include "whirl/modal/oma.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "responses.hpp"
#include "tones.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/modal/checks.hpp"
#include "whirl/modal/poles.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
constexpr double kPi = std::numbers::pi;

// R_i = mean of y_{k+i} y_k^T for i = 0..lags.
std::vector<MatrixXd> correlations(const MatrixXd& y, Index lags) {
  const Index n = y.rows(), l = y.cols(), m = signal::fast_fft_length(n + lags + 1);
  std::vector<VectorXcd> spectra;
  for (Index c = 0; c < l; ++c) {
    VectorXd padded = VectorXd::Zero(m);
    padded.head(n) = y.col(c).array() - y.col(c).mean();
    spectra.push_back(signal::real_fft(padded));
  }
  std::vector<MatrixXd> r(static_cast<std::size_t>(lags + 1), MatrixXd(l, l));
  for (Index a = 0; a < l; ++a) {
    for (Index b = 0; b < l; ++b) {
      VectorXcd full(m);
      const VectorXcd half =
          spectra[static_cast<std::size_t>(a)].cwiseProduct(spectra[static_cast<std::size_t>(b)].conjugate());
      full.head(half.size()) = half;
      for (Index k = half.size(); k < m; ++k) full[k] = std::conj(half[m - k]);
      const VectorXcd lag = signal::inverse_fft(full);
      for (Index i = 0; i <= lags; ++i)
        r[static_cast<std::size_t>(i)](a, b) = lag[i].real() / static_cast<double>(n - i);
    }
  }
  return r;
}

// Block rows i, columns j: R_{i + j + 1}.
MatrixXd hankel(const std::vector<MatrixXd>& r, Index rows, Index columns) {
  const Index l = r.front().rows();
  MatrixXd h(rows * l, columns * l);
  for (Index i = 0; i < rows; ++i) {
    for (Index j = 0; j < columns; ++j) h.block(i * l, j * l, l, l) = r[static_cast<std::size_t>(i + j + 1)];
  }
  return h;
}

struct Pole {
  int order = 0;
  Complex pole;
  VectorXcd shape;
  VectorXcd left, right;  // the change of the discrete eigenvalue is left^T (dH2 - lambda dH1) right
  Complex discrete;
  double frequency() const { return std::abs(pole) / (2 * kPi); }
  double damping() const { return -pole.real() / std::abs(pole); }
};

struct Cluster {
  std::vector<const Pole*> members;
  std::set<int> orders;
};

// Poles that come back over the orders at one place and with one shape.
std::vector<Cluster> cluster_poles(const std::vector<Pole>& poles, const std::vector<int>& orders,
                                   const OmaOptions& options) {
  std::vector<Cluster> clusters;
  for (auto order = orders.rbegin(); order != orders.rend(); ++order) {
    for (const Pole& pole : poles) {
      if (pole.order != *order) continue;
      Cluster* nearest = nullptr;
      double best = 1;
      for (Cluster& cluster : clusters) {
        if (cluster.orders.contains(pole.order)) continue;
        const Pole& last = *cluster.members.back();
        const double shape = 1 - mac(last.shape, pole.shape);
        const double distance = std::hypot((pole.frequency() / last.frequency() - 1) / 0.006,
                                           std::log(pole.damping() / last.damping()) / 0.9, shape / 0.25);
        if (distance < best) {
          best = distance;
          nearest = &cluster;
        }
      }
      if (nearest == nullptr) nearest = &clusters.emplace_back();
      nearest->members.push_back(&pole);
      nearest->orders.insert(pole.order);
    }
  }
  // Poles of one mode that were shared out between two clusters: the smaller one leaves.
  std::sort(clusters.begin(), clusters.end(),
            [](const auto& a, const auto& b) { return a.orders.size() > b.orders.size(); });
  for (std::size_t b = clusters.size(); b-- > 1;) {
    const Pole& small = *clusters[b].members[clusters[b].members.size() / 2];
    for (std::size_t a = 0; a < b; ++a) {
      const Pole& large = *clusters[a].members[clusters[a].members.size() / 2];
      if (std::abs(small.frequency() / large.frequency() - 1) > 0.006 || mac(small.shape, large.shape) < 0.6) continue;
      clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(b));
      break;
    }
  }
  const double needed = options.presence * static_cast<double>(orders.size());
  std::erase_if(clusters, [&](const Cluster& c) { return static_cast<double>(c.orders.size()) < needed; });
  return clusters;
}

// First-order changes of a pole, rad/s, by the blocks' own Hankel matrices.
VectorXcd changes_of(const Pole& pole, const std::vector<MatrixXd>& blocks, Index l, double dt) {
  VectorXcd changes(static_cast<Index>(blocks.size()));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Index rows = blocks[b].rows() - l;
    const VectorXcd x = blocks[b] * pole.right;
    const Complex change = (pole.left.transpose() * (x.tail(rows) - pole.discrete * x.head(rows))).value();
    changes[static_cast<Index>(b)] = change / (pole.discrete * dt);  // s = ln(lambda)/dt
  }
  return changes;
}

void append_poles(const MatrixXd& u, const MatrixXd& right, Index l, int order, double dt, double low, double high,
                  double max_damping, std::vector<Pole>& poles) {
  const Index rows = u.rows() - l;
  const MatrixXd o1 = u.topLeftCorner(rows, order), o2 = u.bottomLeftCorner(rows, order);
  const Eigen::LLT<MatrixXd> normal(o1.transpose() * o1);
  const MatrixXd a = normal.solve(o1.transpose() * o2);
  const Eigen::EigenSolver<MatrixXd> eigen(a);
  if (eigen.info() != Eigen::Success) return;
  const MatrixXcd v = eigen.eigenvectors();
  const MatrixXcd w = v.inverse();
  if (!w.allFinite()) return;
  for (Index i = 0; i < order; ++i) {
    const Complex lambda = eigen.eigenvalues()[i];
    if (!(lambda.imag() > 0) || std::abs(lambda) < 1e-6) continue;
    Pole pole;
    pole.order = order;
    pole.discrete = lambda;
    pole.pole = std::log(lambda) / dt;
    const double f = pole.frequency();
    if (!(pole.pole.real() < 0) || f < low || f > high || pole.damping() > max_damping) continue;
    pole.shape = u.topLeftCorner(l, order) * v.col(i);
    Index largest = 0;
    pole.shape.cwiseAbs().maxCoeff(&largest);
    pole.shape /= pole.shape[largest];
    pole.right = right.leftCols(order) * v.col(i);
    pole.left = o1 * normal.solve(w.row(i).transpose().eval()).eval();
    poles.push_back(std::move(pole));
  }
}

struct Sizes {
  Index rows;
  int max_order;
};

Sizes sizes_of(const OmaOptions& options, Index l, Index n) {
  Index rows = options.block_rows > 0 ? options.block_rows : std::clamp<Index>(360 / l, 20, 120);
  if (2 * rows + 2 > n / 20) throw Error(fmt::format("{} samples: too few for {} block rows", n, rows));
  const int most = static_cast<int>(std::min<Index>(60, rows * l / 3));
  return {rows, options.max_order > 0 ? options.max_order : most};
}

// Mean over the orders, with the variance of that mean: the members' errors are those of one record.
OperationalMode mode_of(const Cluster& cluster, const std::vector<MatrixXd>& blocks, Index l, double dt) {
  const auto members = static_cast<double>(cluster.members.size());
  Complex p = 0;
  VectorXcd changes = VectorXcd::Zero(static_cast<Index>(blocks.size()));
  for (const Pole* pole : cluster.members) {
    p += pole->pole / members;
    changes += changes_of(*pole, blocks, l, dt) / members;
  }
  const auto n = static_cast<double>(blocks.size());
  Eigen::Matrix2d c = Eigen::Matrix2d::Zero();
  for (const Complex change : changes) {
    const Eigen::Vector2d d((change - changes.mean()).real(), (change - changes.mean()).imag());
    c += d * d.transpose() / (n * (n - 1));
  }
  const double re = p.real(), im = p.imag(), size = std::abs(p);
  const Eigen::Vector2d df(re / (2 * kPi * size), im / (2 * kPi * size));
  const Eigen::Vector2d dz(-im * im / std::pow(size, 3), re * im / std::pow(size, 3));
  // Few blocks: Student's t in place of the normal quantile (1.96 + 2.37/(n - 1) + 2.8/(n - 1)^2).
  const double quantile = 1.96 + 2.372 / (n - 1) + 2.822 / ((n - 1) * (n - 1));
  const auto estimate = [&](double value, double sd) {
    return Estimate{value, sd, value - quantile * sd, value + quantile * sd};
  };
  OperationalMode mode;
  mode.frequency = estimate(size / (2 * kPi), std::sqrt(df.dot(c * df)));
  mode.damping = estimate(-re / size, std::sqrt(dz.dot(c * dz)));
  mode.shape = cluster.members[cluster.members.size() / 2]->shape;
  mode.orders = static_cast<int>(cluster.orders.size());
  return mode;
}

// With a tacho the orders are known, however the speed wanders.
void subtract_orders(const Recording& recording, int orders, double nyquist, MatrixXd& y, std::vector<Tone>& tones) {
  const Channel* angle = nullptr;
  for (const Channel& c : recording.channels) {
    if (c.quantity == Quantity::angle) angle = &c;
  }
  if (angle == nullptr)
    throw Error(
        fmt::format("{}: no channel with the rotor's angle (beta_rad), which orders are counted by", recording.source));
  if (angle->samples.maxCoeff() == angle->samples.minCoeff())
    throw Error(fmt::format("{}: the rotor does not turn", recording.source));
  for (int order = 1; order <= orders; ++order) {
    Tone tone = subtract_order(y, angle->samples, recording.dt, order);
    if (tone.frequency < nyquist) tones.push_back(std::move(tone));
  }
}

/// Weight of SSI-data: the inverse square root of the past's own correlations.
MatrixXd weight_of(const std::vector<MatrixXd>& r, Index l, Index rows) {
  MatrixXd past(rows * l, rows * l);
  for (Index i = 0; i < rows; ++i) {
    for (Index j = 0; j < rows; ++j) {
      // Column block j of H holds y_{-j}: R_pp(i, j) = E y_{-i} y_{-j}^T.
      past.block(i * l, j * l, l, l) =
          j >= i ? r[static_cast<std::size_t>(j - i)] : MatrixXd(r[static_cast<std::size_t>(i - j)].transpose());
    }
  }
  past.diagonal().array() += 1e-9 * past.diagonal().mean();
  return past.llt().matrixU().solve(MatrixXd::Identity(past.cols(), past.cols()));
}

/// A tone taken for a mode: whose speed wanders a little has no single line, but its amplitude is steady all the same.
bool is_tone(const OperationalMode& mode, double kurtosis) {
  const bool steady = kurtosis < 2.0 && mode.damping.value < 0.003;
  return steady || (mode.damping.low <= 0 && mode.damping.value < 5e-4);
}

void conclude(OperationalModes& result) {
  std::sort(result.modes.begin(), result.modes.end(),
            [](const auto& a, const auto& b) { return a.frequency.value < b.frequency.value; });
  std::sort(result.tones.begin(), result.tones.end(),
            [](const auto& a, const auto& b) { return a.frequency < b.frequency; });
  for (const Tone& tone : result.tones)
    result.summary.warn(fmt::format("{:.5g} Hz is a tone, not a mode: {}", tone.frequency, tone.evidence));
  if (result.modes.empty()) result.summary.fail("no mode found");
}

}  // namespace

OperationalModes identify_operational(const Recording& recording, const OmaOptions& options) {
  recording.check();
  OperationalModes result;
  MatrixXd y = responses_of(recording, result);
  const double dt = recording.dt, nyquist = 0.5 / dt;
  const double low = options.band_low > 0 ? options.band_low : 0.005 * nyquist;
  const double high = options.band_high > 0 ? options.band_high : 0.9 * nyquist;
  if (!(low < high) || high > nyquist)
    throw Error::in_field("band", fmt::format("{:g} to {:g} Hz", low, high),
                          fmt::format("ascending, below {:g} Hz", nyquist));
  const Index l = y.cols();
  const Sizes sizes = sizes_of(options, l, y.rows());

  if (options.orders > 0) subtract_orders(recording, options.orders, nyquist, y, result.tones);
  const std::size_t measured = result.tones.size();
  if (options.remove_harmonics) {
    for (Tone& tone : find_tones(y, dt, low, high)) result.tones.push_back(std::move(tone));
  }
  for (const double f : options.tones) result.tones.push_back({f, {}, 0, "stated"});
  for (std::size_t i = measured; i < result.tones.size(); ++i) {
    Tone& tone = result.tones[i];
    tone.kurtosis = band_kurtosis(y, dt, tone.frequency, 5 / (dt * static_cast<double>(y.rows())));
    subtract_tone(y, dt, tone);
  }

  const VectorXd scale = y.colwise().norm().transpose() / std::sqrt(static_cast<double>(y.rows()));
  y = (y * scale.cwiseInverse().asDiagonal()).eval();
  const std::vector<MatrixXd> r = correlations(y, 2 * sizes.rows + 1);
  const MatrixXd h = hankel(r, sizes.rows + 1, sizes.rows);
  MatrixXd weighted = h, weight = MatrixXd::Identity(h.cols(), h.cols());
  if (options.method == SubspaceMethod::data) {
    weight = weight_of(r, l, sizes.rows);
    weighted = h * weight;
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> squares(weighted * weighted.transpose());
  const Index rank = std::min<Index>(sizes.max_order, h.cols());
  MatrixXd u = squares.eigenvectors().rowwise().reverse().leftCols(rank);
  // H W V = U S: with the columns of U S the right side is W V = W (H W)^T U / S, and everything scales by 1/S.
  const VectorXd singular2 = squares.eigenvalues().reverse().head(rank).cwiseMax(1e-300);
  const MatrixXd right = weight * (weighted.transpose() * u) * singular2.cwiseInverse().asDiagonal();
  std::vector<Pole> poles;
  std::vector<int> orders;
  for (int order = 2; order <= rank; order += 2) {
    orders.push_back(order);
    append_poles(u, right, l, order, dt, low, high, options.max_damping, poles);
  }
  const Index part = y.rows() / options.blocks;
  std::vector<MatrixXd> blocks;
  for (int b = 0; b < options.blocks; ++b)
    blocks.push_back(
        hankel(correlations(y.middleRows(b * part, part), 2 * sizes.rows + 1), sizes.rows + 1, sizes.rows));

  for (const Cluster& cluster : cluster_poles(poles, orders, options)) {
    OperationalMode mode = mode_of(cluster, blocks, l, dt);
    const double width =
        std::max(2 / (dt * static_cast<double>(y.rows())), 2 * mode.damping.value * mode.frequency.value);
    const double kurtosis = band_kurtosis(y, dt, mode.frequency.value, width);
    if (is_tone(mode, kurtosis)) {
      result.tones.push_back({mode.frequency.value, {}, kurtosis, "steady amplitude, damping not told from zero"});
      continue;
    }
    if (!(mode.damping.sd < options.largest_spread * mode.damping.value) ||
        !(mode.frequency.sd < 0.02 * mode.frequency.value)) {
      continue;
    }
    mode.shape = mode.shape.cwiseProduct(scale.cast<Complex>());
    Index largest = 0;
    mode.shape.cwiseAbs().maxCoeff(&largest);
    mode.shape /= mode.shape[largest];
    result.modes.push_back(std::move(mode));
  }
  conclude(result);
  result.summary.trust =
      fmt::format("{} modes from {:.4g} s, {} channels, orders 2 to {}; the excitation is taken as white",
                  result.modes.size(), dt * static_cast<double>(y.rows()), l, rank);
  return result;
}

}  // namespace whirl::modal
