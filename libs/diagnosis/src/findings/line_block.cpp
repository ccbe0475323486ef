#include "findings/line_block.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::diagnosis::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
constexpr Index kLeastTurns = 16;  // half orders stand eight lines apart
constexpr std::size_t kMostBlocks = 96;
constexpr double kClear = 3;     // lines of the spectrum within which a line under a Hann window leaks
constexpr double kNearby = 12;   // beyond it two lines under a Hann window share less than 1e-3
constexpr double kMirrored = 6;  // closer to an order the skirts of the order count
constexpr double kReach = 1.5;   // orders to either side in which the noise is looked for

}  // namespace

struct LineBlock::Near {
  std::vector<Line> lines;
  MatrixXd a, weighted;  // their columns; these under the window, a row each: packed fast for products
  Eigen::LDLT<MatrixXd> normal;
};

double AngularChannel::turn_start(Index turn) const {
  const Index at = turn * per_turn;
  if (at < time.size()) return time[at];
  return time[time.size() - 1] + (time[time.size() - 1] - time[time.size() - 2]);
}

double AngularChannel::speed(Index first, Index count) const {
  return kTwoPi * static_cast<double>(count) / (turn_start(first + count) - turn_start(first));
}

LineBlock::LineBlock(const AngularChannel& channel, Index first_turn, Index turns, const std::vector<Line>& lines)
    : channel_(&channel), first_(first_turn * channel.per_turn), turns_(turns), lines_(lines) {
  const Index n = turns * channel.per_turn;
  duration_ = channel.turn_start(first_turn + turns) - channel.turn_start(first_turn);
  speed_ = kTwoPi * static_cast<double>(turns) / duration_;
  slowest_ = fastest_ = speed_;
  for (Index k = 0; k < turns; k += std::max<Index>(1, turns / 8)) {
    const double here = channel.speed(first_turn + k, std::min(std::max<Index>(1, turns / 8), turns - k));
    slowest_ = std::min(slowest_, here);
    fastest_ = std::max(fastest_, here);
  }
  // A line above the band of the record has no column of its own.
  std::erase_if(lines_, [&](const Line& l) { return !judged(bin_of(l), l); });
  weight_ =
      0.5 -
      0.5 *
          (VectorXd::LinSpaced(n, 0.5, static_cast<double>(n) - 0.5) * (kTwoPi / static_cast<double>(n))).array().cos();
  const auto count = static_cast<Index>(lines_.size());
  MatrixXd a(n, 2 + 2 * count);
  a.col(0).setOnes();
  a.col(1) = VectorXd::LinSpaced(n, -1, 1);
  for (Index i = 0; i < count; ++i) a.middleCols(2 + 2 * i, 2) = columns(lines_[static_cast<std::size_t>(i)]);
  const VectorXd x = channel.samples.segment(first_, n);
  const MatrixXd weighted = weight_.asDiagonal() * a;
  normal_ = a.transpose() * weighted;
  spread_ = weighted.transpose() * weighted;
  inverse_ = normal_.ldlt().solve(MatrixXd::Identity(normal_.rows(), normal_.cols()));
  solution_ = inverse_ * (weighted.transpose() * x);
  residual_ = x - a * solution_;
  power_ = spectrum_of(residual_);
  taken_.assign(static_cast<std::size_t>(power_.size()), false);
  for (const Line& l : lines_) {
    const double bin = bin_of(l), smear = l.order > 0 ? 1 : fastest_ / slowest_;
    const auto from = static_cast<Index>(std::ceil(bin / smear - kClear + 1e-9));
    const auto to = static_cast<Index>(std::floor(bin * smear + kClear - 1e-9));
    for (Index k = std::max<Index>(0, from); k <= std::min(to, power_.size() - 1); ++k)
      taken_[static_cast<std::size_t>(k)] = true;
  }
}

double LineBlock::middle() const { return channel_->turn_start(first_ / channel_->per_turn) + 0.5 * duration_; }
double LineBlock::turning() const { return speed_ / kTwoPi; }
double LineBlock::bin_of(const Line& l) const {
  return static_cast<double>(turns_) * (l.order > 0 ? l.order : l.frequency / turning());
}

VectorXd LineBlock::spectrum_of(const VectorXd& residual) const {
  const VectorXd power = signal::real_fft(weight_.cwiseProduct(residual)).cwiseAbs2() / weight_.squaredNorm();
  const double highest = std::min(0.75 * static_cast<double>(power.size()),
                                  static_cast<double>(turns_) * kUsedBand * channel_->rate / turning());
  return power.head(std::max<Index>(1, static_cast<Index>(highest)));
}

Eigen::MatrixX2d LineBlock::columns(const Line& l) const {
  // An order turns by the same angle from sample to sample: exact every so many, multiplied in between.
  constexpr Index kExact = 64;
  const Index n = weight_.size();
  const double angle = kTwoPi * l.order / channel_->per_turn;
  const std::complex<double> step = std::polar(1.0, angle);
  std::complex<double> turned;
  Eigen::MatrixX2d c(n, 2);
  for (Index i = 0; i < n; ++i) {
    if (!(l.order > 0))
      turned = std::polar(1.0, kTwoPi * l.frequency * channel_->time[first_ + i]);
    else
      turned = i % kExact == 0 ? std::polar(1.0, angle * static_cast<double>(first_ + i)) : turned * step;
    c(i, 0) = turned.real();
    c(i, 1) = -turned.imag();
  }
  return c;
}

bool LineBlock::judged(double bin, const Line& l) const {
  const double hertz = l.order > 0 ? l.order * turning() : l.frequency;
  return bin >= 2 && hertz < kUsedBand * channel_->rate &&
         bin < 0.375 * static_cast<double>(turns_) * channel_->per_turn;
}

double LineBlock::chance(double power, double bin, const VectorXd& spectrum) const {
  const auto wanted = static_cast<std::size_t>(std::clamp<Index>(turns_ / 8, 4, 24));
  const auto reach = static_cast<Index>(kReach * static_cast<double>(turns_));
  const auto side = [&](Index step) {
    std::vector<double> free;
    const auto start = static_cast<Index>(std::lround(bin + static_cast<double>(step) * kClear));
    for (Index k = start; std::abs(k - start) < reach && k >= 2 && k < spectrum.size() && free.size() < wanted;) {
      const bool taken = taken_[static_cast<std::size_t>(k)];
      if (!taken) free.push_back(spectrum[k]);
      k += taken ? step : 2 * step;  // neighbours under a Hann window are not independent
    }
    return free;
  };
  std::vector<double> left = side(-1), right = side(1);
  if (left.size() < 2 || right.size() < 2) {
    left.insert(left.end(), right.begin(), right.end());
    return left.size() < 4 ? 1 : exceedance(power, std::move(left));
  }
  return std::max(exceedance(power, std::move(left)), exceedance(power, std::move(right)));
}

double LineBlock::floor(double bin) const {
  double sum = 0, count = 0;
  for (const Index step : {-1, 1}) {
    auto k = static_cast<Index>(std::lround(bin + static_cast<double>(step) * kClear));
    for (int i = 0; i < 6 && k >= 2 && k < power_.size(); ++i, k += 2 * step) {
      sum += power_[k];
      ++count;
    }
  }
  return count > 0 ? sum / count : NAN;
}

Index LineBlock::column_of(const Line& l) const {
  const auto at = std::ranges::find(lines_, l);
  return at == lines_.end() ? -1 : 2 + 2 * (at - lines_.begin());
}

LineValue LineBlock::fitted(const Line& l) const {
  LineValue value;
  const double bin = bin_of(l);
  const Index at = column_of(l);
  if (at < 0) return value;
  value.vector = {solution_[at], solution_[at + 1]};
  const MatrixXd rows = inverse_.middleRows(at, 2);
  const double noise = (rows * spread_ * rows.transpose()).trace();
  value.power = std::norm(value.vector) / noise;
  value.share =
      std::min(1 / (inverse_(at, at) * normal_(at, at)), 1 / (inverse_(at + 1, at + 1) * normal_(at + 1, at + 1)));
  if (value.share >= kLeastShare) value.chance = chance(value.power, bin, power_);
  return value;
}

std::shared_ptr<const LineBlock::Near> LineBlock::near_to(const Line& l) const {
  const double bin = bin_of(l);
  std::vector<Line> lines;
  for (const Line& other : lines_) {
    const double smear = other.order > 0 && l.order > 0 ? 1 : fastest_ / slowest_;
    if (std::abs(bin_of(other) - bin) < kNearby + (smear - 1) * bin) lines.push_back(other);
  }
  if (near_ != nullptr && near_->lines == lines) return near_;
  const auto near = std::make_shared<Near>();
  near->a.resize(weight_.size(), static_cast<Index>(2 * lines.size()));
  for (std::size_t k = 0; k < lines.size(); ++k) near->a.middleCols(static_cast<Index>(2 * k), 2) = columns(lines[k]);
  const MatrixXd weighted = weight_.asDiagonal() * near->a;
  if (!lines.empty()) near->normal.compute(MatrixXd(near->a.transpose() * weighted));
  near->weighted = weighted.transpose();
  near->lines = std::move(lines);
  near_ = near;
  return near;
}

LineValue LineBlock::added_alone(const Line& l, bool against_floor) const {
  LineValue value;
  const double bin = bin_of(l);
  if (!judged(bin, l)) return value;
  Eigen::MatrixX2d c = columns(l);
  const Eigen::Matrix2d alone = c.transpose() * weight_.asDiagonal() * c;
  const std::shared_ptr<const Near> near = near_to(l);
  if (near->a.cols() > 0) c -= near->a * near->normal.solve(near->weighted * c);
  const Eigen::MatrixX2d weighted = weight_.asDiagonal() * c;
  const Eigen::Matrix2d left = c.transpose() * weighted;
  value.share = std::min(left(0, 0) / alone(0, 0), left(1, 1) / alone(1, 1));
  if (!(value.share >= kLeastShare)) return value;
  const Eigen::Matrix2d inverse = left.inverse();
  const Eigen::Vector2d z = inverse * (weighted.transpose() * residual_);
  value.vector = {z[0], z[1]};
  value.power = z.squaredNorm() / (inverse * (weighted.transpose() * weighted) * inverse).trace();
  if (!against_floor) return value;
  // Of a line that smears over the angle the residual without it is the noise.
  const bool smears = l.order <= 0 && (fastest_ / slowest_ - 1) * bin > 0.5;
  value.chance = chance(value.power, bin, smears ? spectrum_of(residual_ - c * z) : power_);
  return value;
}

double LineBlock::mirror_chance(const Line& l, double power) const {
  // An order whose phase wanders has skirts on both sides: a line beside it stands above those of the other side.
  const double bin = bin_of(l), per_bin = turning() / static_cast<double>(turns_);
  double largest = 0;
  for (const Line& other : lines_) {
    const double apart = bin - bin_of(other);
    if (other.order <= 0 || std::abs(apart) > kMirrored) continue;
    std::vector<double> across;
    for (const double further : {0.0, 0.7, 1.4}) {
      const double at = bin_of(other) - apart - (apart > 0 ? further : -further);
      const LineValue value = added_alone({0, at * per_bin}, false);
      if (value.share >= kLeastShare) across.push_back(value.power);
    }
    if (across.size() < 2) return 1;
    largest = std::max(largest, exceedance(power, std::move(across)));
  }
  return largest;
}

LineValue LineBlock::added(const Line& l, bool skirts) const {
  LineValue value = added_alone(l, true);
  if (skirts && l.order <= 0 && value.chance < 0.05)
    value.chance = std::max(value.chance, mirror_chance(l, value.power));
  return value;
}

LineValue LineBlock::at_bin(Index bin) const {
  LineValue value;
  value.power = power_[bin];
  // A line between two bins stands in three, which hold 1.5 times its power.
  const double sum = power_.segment(bin - 1, std::min<Index>(3, power_.size() - bin + 1)).sum() / 1.5;
  value.vector = 2 * std::sqrt(sum * weight_.squaredNorm()) / weight_.sum();
  value.share = 1;
  value.chance = chance(value.power, static_cast<double>(bin), power_);
  return value;
}

VectorXd LineBlock::samples_with(const Line& kept) const {
  const Index at = column_of(kept);
  if (at < 0) return residual_;
  return residual_ + columns(kept) * solution_.segment(at, 2);
}

std::vector<LineBlock> blocks_of(const AngularChannel& channel, const std::vector<Line>& lines, Index most,
                                 double tolerance) {
  std::vector<std::pair<Index, Index>> places;
  const Index turns = channel.turns();
  for (Index first = 0; first + kLeastTurns <= turns;) {
    const double begin = channel.speed(first, kLeastTurns / 2);
    Index count = kLeastTurns;
    while (2 * count <= most && first + 2 * count <= turns &&
           std::abs(channel.speed(first + 2 * count - kLeastTurns / 2, kLeastTurns / 2) / begin - 1) < tolerance)
      count *= 2;
    places.emplace_back(first, count);
    first += count;
  }
  std::vector<LineBlock> out;
  const std::size_t used = std::min(places.size(), kMostBlocks);
  for (std::size_t k = 0; k < used; ++k) {
    const auto& [first, count] = places[k * places.size() / used];
    out.emplace_back(channel, first, count, lines);
  }
  return out;
}

}  // namespace whirl::diagnosis::detail
