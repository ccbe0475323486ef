// What subspace identification of one record and of several have in common.
#include "subspace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tones.hpp"
#include "wandering_tones.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
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

// With a tacho the orders are known, however the speed wanders: those asked for, else those that the record shows.
void subtract_orders(const Recording& recording, int orders, double nyquist, MatrixXd& y, std::vector<Tone>& tones) {
  const Channel* angle = nullptr;
  for (const Channel& c : recording.channels) {
    if (c.quantity == Quantity::angle) angle = &c;
  }
  const bool turns = angle != nullptr && angle->samples.maxCoeff() > angle->samples.minCoeff();
  if (orders == 0) {
    if (turns)
      for (Tone& tone : take_off_shaft_orders(y, recording.dt, angle->samples, 0.9 * nyquist))
        tones.push_back(std::move(tone));
    return;
  }
  if (angle == nullptr)
    throw Error(
        fmt::format("{}: no channel with the rotor's angle (beta_rad), which orders are counted by", recording.source));
  if (!turns) throw Error(fmt::format("{}: the rotor does not turn", recording.source));
  for (int order = 1; order <= orders; ++order) {
    Tone tone = subtract_order(y, angle->samples, recording.dt, order);
    if (tone.frequency < nyquist) tones.push_back(std::move(tone));
  }
}

/// A tone taken for a mode: whose speed wanders a little has no single line, but its amplitude is steady all the same.
bool is_tone(const OperationalMode& mode, double kurtosis) {
  const bool steady = kurtosis < 2.0 && mode.damping.value < 0.003;
  return steady || (mode.damping.low <= 0 && mode.damping.value < 5e-4);
}

}  // namespace

double SubspacePole::frequency() const { return std::abs(pole) / (2 * kPi); }
double SubspacePole::damping() const { return -pole.real() / std::abs(pole); }

SubspaceBand subspace_band(const OmaOptions& options, double dt) {
  const double nyquist = 0.5 / dt;
  require_range("band_low", options.band_low, 0, nyquist, "Hz");
  require_range("band_high", options.band_high, 0, nyquist, "Hz");
  const SubspaceBand band{options.band_low > 0 ? options.band_low : 0.005 * nyquist,
                          options.band_high > 0 ? options.band_high : 0.9 * nyquist};
  if (!(band.low < band.high) || band.high > nyquist)
    throw Error::in_field("band", fmt::format("{:g} to {:g} Hz", band.low, band.high),
                          fmt::format("ascending, below {:g} Hz", nyquist));
  return band;
}

Index most_block_rows(Index references) { return std::clamp<Index>(360 / references, 20, 120); }

Index block_rows(const OmaOptions& options, Index references, const MatrixXd& y) {
  if (options.block_rows > 0) return options.block_rows;
  constexpr double kPeriods = 2;
  constexpr Index kLeast = 24, kColumns = 120;
  // cos(w dt), mean over the energy: from neighbouring samples.
  double sum = 0;
  for (Index c = 0; c < y.cols(); ++c) {
    const VectorXd centred = y.col(c).array() - y.col(c).mean();
    const Index n = centred.size() - 1;
    sum += centred.head(n).dot(centred.tail(n)) / std::max(1e-300, centred.squaredNorm());
  }
  const double cosine = std::clamp(sum / static_cast<double>(y.cols()), -1.0, 1 - 1e-12);
  const double wanted = kPeriods * 2 * kPi / std::acos(cosine);
  const Index most = most_block_rows(references);
  return std::clamp(static_cast<Index>(std::min(wanted, 1e6)), std::min(std::max(kLeast, kColumns / references), most),
                    most);
}

SubspaceSizes subspace_sizes(const OmaOptions& options, Index references, Index rows, Index samples) {
  require_range("max_order", options.max_order, 0, 1000);
  if (2 * rows + 2 > samples / 20)
    throw Error(fmt::format("the record is too short: {} samples, {} are needed for {} channels", samples,
                            20 * (2 * rows + 2), references));
  const int most = static_cast<int>(std::min<Index>(60, rows * references / 3));
  return {rows, options.max_order > 0 ? options.max_order : most};
}

std::vector<MatrixXd> correlations(const MatrixXd& y, const std::vector<Index>& references, Index lags) {
  const Index n = y.rows(), l = y.cols(), m = signal::fast_fft_length(n + lags + 1);
  std::vector<VectorXcd> spectra;
  for (Index c = 0; c < l; ++c) {
    VectorXd padded = VectorXd::Zero(m);
    padded.head(n) = y.col(c).array() - y.col(c).mean();
    spectra.push_back(signal::real_fft(padded));
  }
  const auto width = static_cast<Index>(references.size());
  std::vector<MatrixXd> r(static_cast<std::size_t>(lags + 1), MatrixXd(l, width));
  for (Index a = 0; a < l; ++a) {
    for (Index b = 0; b < width; ++b) {
      VectorXcd full(m);
      const VectorXcd half = spectra[static_cast<std::size_t>(a)].cwiseProduct(
          spectra[static_cast<std::size_t>(references[static_cast<std::size_t>(b)])].conjugate());
      full.head(half.size()) = half;
      for (Index k = half.size(); k < m; ++k) full[k] = std::conj(half[m - k]);
      const VectorXcd lag = signal::inverse_fft(full);
      for (Index i = 0; i <= lags; ++i)
        r[static_cast<std::size_t>(i)](a, b) = lag[i].real() / static_cast<double>(n - i);
    }
  }
  return r;
}

MatrixXd hankel(const std::vector<MatrixXd>& r, Index rows, Index columns, Index first, Index count) {
  const Index width = r.front().cols();
  MatrixXd h(rows * count, columns * width);
  for (Index i = 0; i < rows; ++i) {
    for (Index j = 0; j < columns; ++j)
      h.block(i * count, j * width, count, width) = r[static_cast<std::size_t>(i + j + 1)].middleRows(first, count);
  }
  return h;
}

MatrixXd past_weight(const std::vector<MatrixXd>& r, Index rows) {
  const Index l = r.front().cols();
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

void append_poles(const MatrixXd& o1, const MatrixXd& o2, const MatrixXd& first, double dt, SubspaceBand band,
                  double max_damping, std::vector<SubspacePole>& poles) {
  const Index order = o1.cols();
  const MatrixXd a = MatrixXd(o1.transpose() * o1).llt().solve(MatrixXd(o1.transpose() * o2));
  const Eigen::EigenSolver<MatrixXd> eigen(a);
  if (eigen.info() != Eigen::Success) return;
  const MatrixXcd v = eigen.eigenvectors();
  const MatrixXcd w = v.inverse();
  if (!w.allFinite()) return;
  for (Index i = 0; i < order; ++i) {
    const Complex lambda = eigen.eigenvalues()[i];
    if (!(lambda.imag() > 0) || std::abs(lambda) < 1e-6) continue;
    SubspacePole pole;
    pole.order = static_cast<int>(order);
    pole.discrete = lambda;
    pole.pole = std::log(lambda) / dt;
    const double f = pole.frequency();
    if (!(pole.pole.real() < 0) || f < band.low || f > band.high || pole.damping() > max_damping) continue;
    pole.shape = first * v.col(i);
    Index largest = 0;
    pole.shape.cwiseAbs().maxCoeff(&largest);
    pole.shape /= pole.shape[largest];
    pole.right = v.col(i);
    pole.left = w.row(i).transpose();
    poles.push_back(std::move(pole));
  }
}

std::vector<SubspaceCluster> cluster_poles(const std::vector<SubspacePole>& poles, const std::vector<int>& orders,
                                           const OmaOptions& options) {
  std::vector<SubspaceCluster> clusters;
  for (auto order = orders.rbegin(); order != orders.rend(); ++order) {
    for (const SubspacePole& pole : poles) {
      if (pole.order != *order) continue;
      SubspaceCluster* nearest = nullptr;
      double best = 1;
      for (SubspaceCluster& cluster : clusters) {
        if (cluster.orders.contains(pole.order)) continue;
        const SubspacePole& last = *cluster.members.back();
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
  // Poles of one mode that were shared out between two clusters: the smaller one leaves, and what it has of orders that
  // the larger one lacks goes over. Two modes stand side by side in most orders; one mode whose shape changed does not.
  std::sort(clusters.begin(), clusters.end(),
            [](const auto& a, const auto& b) { return a.orders.size() > b.orders.size(); });
  for (std::size_t b = clusters.size(); b-- > 1;) {
    const SubspacePole& small = *clusters[b].members[clusters[b].members.size() / 2];
    for (std::size_t a = 0; a < b; ++a) {
      const SubspacePole& large = *clusters[a].members[clusters[a].members.size() / 2];
      if (std::abs(small.frequency() / large.frequency() - 1) > 0.006) continue;
      const auto both = std::count_if(clusters[b].orders.begin(), clusters[b].orders.end(),
                                      [&](int order) { return clusters[a].orders.contains(order); });
      const bool apart = 4 * both <= static_cast<std::ptrdiff_t>(clusters[b].orders.size());
      if (!apart && mac(small.shape, large.shape) < 0.6) continue;
      for (const SubspacePole* pole : clusters[b].members)
        if (apart && clusters[a].orders.insert(pole->order).second) clusters[a].members.push_back(pole);
      clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(b));
      break;
    }
  }
  const double needed = options.presence * static_cast<double>(orders.size());
  std::erase_if(clusters, [&](const SubspaceCluster& c) { return static_cast<double>(c.orders.size()) < needed; });
  return clusters;
}

OperationalMode mode_of(const SubspaceCluster& cluster, const VectorXcd& changes, double extra) {
  Complex p = 0;
  for (const SubspacePole* pole : cluster.members) p += pole->pole / static_cast<double>(cluster.members.size());
  const auto n = static_cast<double>(changes.size());
  Eigen::Matrix2d c = Eigen::Matrix2d::Zero();
  for (const Complex change : changes) {
    const Eigen::Vector2d d((change - changes.mean()).real(), (change - changes.mean()).imag());
    c += d * d.transpose() / (n * (n - 1));
  }
  c.diagonal().array() += extra;
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

void take_off_tones(const Recording& recording, const OmaOptions& options, SubspaceBand band, MatrixXd& y,
                    std::vector<Tone>& tones) {
  const double dt = recording.dt;
  if (options.orders > 0 || options.remove_harmonics) subtract_orders(recording, options.orders, 0.5 / dt, y, tones);
  if (options.remove_harmonics) {
    for (Tone& tone : take_off_wandering_tones(y, dt, band.low, band.high)) tones.push_back(std::move(tone));
  }
  const std::size_t measured = tones.size();
  if (options.remove_harmonics) {
    for (Tone& tone : find_tones(y, dt, band.low, band.high)) tones.push_back(std::move(tone));
  }
  for (const double f : options.tones) {
    const double nyquist = 0.5 / dt;
    if (!(f > 0) || !(f < nyquist))
      throw Error::in_field("tone", fmt::format("{:g} Hz", f),
                            fmt::format("above 0 and below {:g} Hz, half the sample rate", nyquist));
    tones.push_back({f, {}, 0, "stated"});
  }
  for (std::size_t i = measured; i < tones.size(); ++i) {
    Tone& tone = tones[i];
    tone.kurtosis = band_kurtosis(y, dt, tone.frequency, 5 / (dt * static_cast<double>(y.rows())));
    subtract_tone(y, dt, tone);
  }
  for (std::size_t i = measured, all = tones.size(); i < all && options.remove_harmonics; ++i)
    for (Tone& tone : take_off_multiples(y, dt, tones[i].frequency, band.low, band.high))
      tones.push_back(std::move(tone));
}

double tone_width(const OperationalMode& mode, double duration) {
  return std::max(2 / duration, 2 * mode.damping.value * mode.frequency.value);
}

void take_mode(OperationalMode mode, double kurtosis, const VectorXd& scale, const OmaOptions& options,
               OperationalModes& result) {
  if (is_tone(mode, kurtosis)) {
    result.tones.push_back(
        {mode.frequency.value, {}, kurtosis, "steady amplitude, damping not distinguishable from zero"});
    return;
  }
  // What is left of a tone that was taken off looks like a mode whose damping no block of the record agrees on.
  constexpr double kBeside = 0.01, kSpreadBeside = 0.4;  // the latter: a mode of 0.2 % over 400 s has some 0.15
  const bool beside = std::any_of(result.tones.begin(), result.tones.end(), [&](const Tone& tone) {
    return std::abs(tone.frequency / mode.frequency.value - 1) < kBeside;
  });
  const double spread = beside ? std::min(kSpreadBeside, options.largest_spread) : options.largest_spread;
  if (!(mode.damping.sd < spread * mode.damping.value) || !(mode.frequency.sd < 0.02 * mode.frequency.value)) {
    return;
  }
  mode.shape = mode.shape.cwiseProduct(scale.cast<Complex>());
  Index largest = 0;
  mode.shape.cwiseAbs().maxCoeff(&largest);
  mode.shape /= mode.shape[largest];
  result.modes.push_back(std::move(mode));
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

}  // namespace whirl::modal
