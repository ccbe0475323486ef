#include "fit/sweep.hpp"
#include "fit/sweep_path.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;

namespace {

using Complex = std::complex<double>;

/// Coordinates of the modes along a run, of each column, averaged over blocks as the record was.
class SweepIntegration {
 public:
  SweepIntegration(const FitModel& model, const SweepModes& modes, const OrderRun& run)
      : model_(model), modes_(modes), run_(run), path_(run), count_(modes.count), columns_(model.columns()) {}

  SweepPart integrate() {
    part_.readings = part_.conjugate = MatrixXcd::Zero(model_.probe_rows().rows() * columns_, run_.blocks());
    if (count_ == 0) return std::move(part_);
    start();
    const Index per_block = static_cast<Index>(run_.turns) * kGridPerTurn;
    for (Index b = 0; b < run_.blocks(); ++b) {
      sum_.setZero(count_, columns_);
      double_.setZero(count_, columns_);
      for (Index i = 0; i < per_block; ++i) {
        before_ = c_;
        advance(b * per_block + i);
        const auto in_turn = static_cast<std::size_t>(i % kGridPerTurn);
        sum_ += weights_.first * before_ + weights_.last * c_;
        double_ += weights_.first_twice[in_turn] * before_ + weights_.last_twice[in_turn] * c_;
      }
      finish_block(b, static_cast<double>(per_block));
    }
    return std::move(part_);
  }

 private:
  void drive(Index point, const MatrixXcd& source, MatrixXcd& d) const {
    const double speed = path_.point_speed[point];
    for (Index c = 0; c < columns_; ++c)
      d.col(c) = (model_.is_bow(c) ? Complex(1) : Complex(speed * speed, -path_.rate[point])) * source.col(c);
  }

  /// The steady state at the first speed.
  void start() {
    modes_.read(path_.point_speed[0], node_, SweepModes::Part::motion);
    drive_ = next_drive_ = turning_ = MatrixXcd::Zero(count_, columns_);
    drive(0, node_.source, drive_);
    c_ = (Complex(0, path_.point_speed[0]) - node_.pole.array()).inverse().matrix().asDiagonal() * drive_;
  }

  void advance(Index step) {
    const double h = path_.step[step], speed = path_.speed[step];
    modes_.read(speed, node_, SweepModes::Part::motion);
    drive(step + 1, node_.source, next_drive_);
    turning_.noalias() = path_.rate[step] * node_.coupling.lazyProduct(c_);
    for (Index k = 0; k < count_; ++k) {
      const StepWeights w(node_.pole[k] - Complex(0, speed), h);
      const Complex both = w.first + w.last;
      for (Index c = 0; c < columns_; ++c)
        c_(k, c) = w.growth * c_(k, c) + w.first * drive_(k, c) + w.last * next_drive_(k, c) + both * turning_(k, c);
    }
    drive_.swap(next_drive_);
  }

  void finish_block(Index b, double points) {
    const double speed = run_.speed[b];
    modes_.read(speed, node_, SweepModes::Part::whole);
    const Index probes = node_.reading.rows();
    for (Index c = 0; c < columns_; ++c) {
      for (Index k = 0; k < count_; ++k) {
        const Complex steady = model_.factor(c, speed) * node_.source(k, c) / (Complex(0, speed) - node_.pole[k]);
        const Complex value = sum_(k, c) / points - steady, twice = double_(k, c) / points;
        for (Index p = 0; p < probes; ++p) {
          part_.readings(c * probes + p, b) += node_.reading(p, k) * value;
          part_.conjugate(c * probes + p, b) += std::conj(node_.reading(p, k) * twice);
        }
      }
    }
  }

  const FitModel& model_;
  const SweepModes& modes_;
  const OrderRun& run_;
  SweepPath path_;
  const SampleWeights weights_;
  Index count_, columns_;
  SweepNode node_;
  MatrixXcd c_, before_, drive_, next_drive_, turning_, sum_, double_;
  SweepPart part_;
};

}  // namespace

SweepPart sweep_part(const FitModel& model, const SweepModes& modes, const OrderRun& run) {
  return SweepIntegration(model, modes, run).integrate();
}

}  // namespace whirl::shaft
