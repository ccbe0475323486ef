#include <algorithm>
#include <array>
#include <cmath>

#include "fit/sweep.hpp"
#include "whirl/core/angles.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

using Complex = std::complex<double>;
constexpr int kGrid = kGridPerTurn;
constexpr double kOrderSamples = 64;  // a turn, of `signal::order_vectors`: its sums begin at the turn's first sample

/// The angle of a run as the modes feel it, at the points of its grid.
struct Path {
  VectorXd step, speed;        ///< between points: s, rad/s
  VectorXd point_speed, rate;  ///< at points: rad/s, rad/s^2

  explicit Path(const OrderRun& run) {
    const Index n = run.time.size();
    step = run.time.tail(n - 1) - run.time.head(n - 1);
    speed = kTwoPi / kGrid * step.cwiseInverse();
    point_speed.resize(n);
    rate.resize(n);
    for (Index i = 0; i < n; ++i) {
      // Over a whole turn: the angle of an encoder is rough from sample to sample.
      const Index a = std::max<Index>(0, i - kGrid / 2), b = std::min(n - 1, i + kGrid / 2);
      const Index before = std::max<Index>(0, a - kGrid / 2), after = std::min(n - 1, b + kGrid / 2);
      const auto mean = [&](Index from, Index to) {
        return kTwoPi / kGrid * static_cast<double>(to - from) / (run.time[to] - run.time[from]);
      };
      const auto middle = [&](Index from, Index to) { return 0.5 * (run.time[to] + run.time[from]); };
      const double apart = middle(i, after) - middle(before, i);
      rate[i] = after > i && i > before && apart > 0 ? (mean(i, after) - mean(before, i)) / apart : 0;
    }
    // The ends, where one side is missing.
    for (Index i = 0; i < kGrid; ++i) {
      rate[i] = rate[kGrid];
      rate[n - 1 - i] = rate[n - 1 - kGrid];
    }
    for (Index i = 0; i < n; ++i) {
      const Index a = std::max<Index>(0, i - kGrid / 2), b = std::min(n - 1, i + kGrid / 2);
      const double middle = 0.5 * (run.time[a] + run.time[b]);
      point_speed[i] =
          kTwoPi / kGrid * static_cast<double>(b - a) / (run.time[b] - run.time[a]) + rate[i] * (run.time[i] - middle);
    }
  }
};

/// One step of c' = m c + b(t), b linear between its ends: c_1 = g c_0 + w_0 b_0 + w_1 b_1.
struct StepWeights {
  Complex growth, first, last;
  StepWeights(Complex m, double h) {
    const Complex z = m * h;
    growth = std::exp(z);
    Complex one, two;  // (e^z - 1) / z, (e^z - 1 - z) / z^2
    if (std::abs(z) < 1e-2) {
      one = 1.0 + z / 2.0 + z * z / 6.0 + z * z * z / 24.0;
      two = 0.5 + z / 6.0 + z * z / 24.0 + z * z * z / 120.0;
    } else {
      one = (growth - 1.0) / z;
      two = (one - 1.0) / z;
    }
    first = h * (one - two);
    last = h * two;
  }
};

/// e^{2 i theta} at the points of a turn.
std::array<Complex, kGrid> double_turn() {
  std::array<Complex, kGrid> turn;
  for (int k = 0; k < kGrid; ++k) turn[static_cast<std::size_t>(k)] = std::polar(1.0, 2 * kTwoPi * k / kGrid);
  return turn;
}

/// Coordinates of the modes along a run: of each column and their slopes over the pole, averaged over blocks as the
/// record was.
class SweepIntegration {
 public:
  SweepIntegration(const FitModel& model, const SweepModes& modes, const OrderRun& run)
      : model_(model), modes_(modes), run_(run), path_(run), count_(modes.count), columns_(model.columns() + 1) {}

  SweepPart integrate() {
    part_.readings = part_.conjugate = MatrixXcd::Zero(model_.probe_rows().rows() * (columns_ - 1), run_.blocks());
    if (count_ == 0) return std::move(part_);
    for (MatrixXcd* m : {&part_.value, &part_.twice, &part_.slope, &part_.twice_slope})
      m->resize(count_ * columns_, run_.blocks());
    start();
    const Index per_block = static_cast<Index>(run_.turns) * kGrid;
    for (Index b = 0; b < run_.blocks(); ++b) {
      clear_sums();
      add_point(0.5, 0, 1);
      for (Index i = 0; i < per_block; ++i) {
        advance(b * per_block + i);
        const bool end = i + 1 == per_block;
        add_point(end ? 0.5 : 1.0, (i + 1) % kGrid, end ? -1 : 0);
      }
      finish_block(b, static_cast<double>(per_block));
    }
    return std::move(part_);
  }

 private:
  Complex input(Index column, Index point) const {
    const double speed = path_.point_speed[point];
    return model_.is_bow(column) ? Complex(1) : Complex(speed * speed, -path_.rate[point]);
  }
  void drive(Index point, const MatrixXcd& source, MatrixXcd& d) const {
    for (Index c = 0; c + 1 < columns_; ++c) d.col(c) = input(c, point) * source.col(c);
    d.col(columns_ - 1).setConstant(input(columns_ - 1, point));
  }

  /// The steady state at the first speed.
  void start() {
    modes_.read(path_.point_speed[0], node_, true);
    drive_ = next_drive_ = turning_ = turning_slope_ = MatrixXcd::Zero(count_, columns_);
    drive(0, node_.source, drive_);
    const VectorXcd apart = (Complex(0, path_.point_speed[0]) - node_.pole.array()).inverse();
    c_ = apart.asDiagonal() * drive_;
    e_ = apart.asDiagonal() * c_;
  }

  void advance(Index step) {
    const double h = path_.step[step], speed = path_.speed[step];
    modes_.read(speed, node_, false);
    drive(step + 1, node_.source, next_drive_);
    turning_.noalias() = path_.rate[step] * node_.coupling.lazyProduct(c_);
    turning_slope_.noalias() = path_.rate[step] * node_.coupling.lazyProduct(e_);
    for (Index k = 0; k < count_; ++k) {
      const StepWeights w(node_.pole[k] - Complex(0, speed), h);
      const Complex both = w.first + w.last;
      for (Index c = 0; c < columns_; ++c) {
        const Complex before = c_(k, c);
        c_(k, c) = w.growth * before + w.first * drive_(k, c) + w.last * next_drive_(k, c) + both * turning_(k, c);
        e_(k, c) = w.growth * e_(k, c) + w.first * before + w.last * c_(k, c) + both * turning_slope_(k, c);
      }
    }
    drive_.swap(next_drive_);
  }

  void clear_sums() {
    for (MatrixXcd* m : {&c_sum_, &c_double_, &e_sum_, &e_double_}) m->setZero(count_, columns_);
  }
  /// The sums of a record run over the begins of its 64 steps a turn: the trapezoid and `lean` half a step of theirs,
  /// +1 at the first point of a block, -1 at the last.
  void add_point(double weight, Index in_turn, int lean) {
    static const std::array<Complex, kGrid> turn = double_turn();
    const double w = weight + 0.5 * lean * kGrid / kOrderSamples;
    const Complex doubled = w * turn[static_cast<std::size_t>(in_turn)];
    c_sum_ += w * c_;
    e_sum_ += w * e_;
    c_double_ += doubled * c_;
    e_double_ += doubled * e_;
  }

  void finish_block(Index b, double points) {
    const double speed = run_.speed[b];
    modes_.read(speed, node_, true);
    const Index probes = node_.reading.rows();
    for (Index c = 0; c < columns_; ++c) {
      const bool unit = c + 1 == columns_;
      for (Index k = 0; k < count_; ++k) {
        const Complex apart = Complex(0, speed) - node_.pole[k];
        const Complex steady = model_.factor(c, speed) * (unit ? Complex(1) : node_.source(k, c)) / apart;
        const Index at = c * count_ + k;
        part_.value(at, b) = c_sum_(k, c) / points - steady;
        part_.twice(at, b) = c_double_(k, c) / points;
        part_.slope(at, b) = e_sum_(k, c) / points - steady / apart;
        part_.twice_slope(at, b) = e_double_(k, c) / points;
        for (Index p = 0; p < probes && !unit; ++p) {
          part_.readings(c * probes + p, b) += node_.reading(p, k) * part_.value(at, b);
          part_.conjugate(c * probes + p, b) += std::conj(node_.reading(p, k) * part_.twice(at, b));
        }
      }
    }
  }

  const FitModel& model_;
  const SweepModes& modes_;
  const OrderRun& run_;
  Path path_;
  Index count_, columns_;
  SweepNode node_;
  MatrixXcd c_, e_, drive_, next_drive_, turning_, turning_slope_;
  MatrixXcd c_sum_, c_double_, e_sum_, e_double_;
  SweepPart part_;
};

}  // namespace

SweepPart sweep_part(const FitModel& model, const SweepModes& modes, const OrderRun& run) {
  return SweepIntegration(model, modes, run).integrate();
}

}  // namespace whirl::shaft
