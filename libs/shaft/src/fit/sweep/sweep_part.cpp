#include "fit/sweep/sweep.hpp"
#include "fit/sweep/sweep_path.hpp"

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
      begin_ = c_;
      sum_.setZero(count_, columns_);
      double_.setZero(count_, columns_);
      moment_.setZero(count_, columns_);
      middle_ = run_.speed[b];
      for (Index i = 0; i < per_block; ++i) advance(b * per_block + i, twice_turned(i));
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

  void advance(Index step, Complex phase) {
    const double h = path_.step[step], speed = path_.speed[step], rate = path_.rate[step];
    modes_.read(speed, node_, SweepModes::Part::motion);
    drive(step + 1, node_.source, next_drive_);
    turning_.noalias() = rate * node_.coupling.lazyProduct(c_);
    next_ = c_;
    weights_.clear();
    for (Index k = 0; k < count_; ++k) {
      weights_.emplace_back(node_.pole[k] * h - Complex(0, kStepAngle), h);
      const StepWeights::Row& w = weights_.back().next;
      next_.row(k) = w.state * c_.row(k) + w.first * (drive_.row(k) + turning_.row(k)) +
                     w.last * (next_drive_.row(k) + turning_.row(k));
    }
    next_turning_.noalias() = rate * node_.coupling.lazyProduct(next_);
    const double off = 0.5 * (path_.point_speed[step] + path_.point_speed[step + 1]) - middle_;
    for (Index k = 0; k < count_; ++k) {
      const StepWeights& w = weights_[static_cast<std::size_t>(k)];
      first_ = drive_.row(k) + turning_.row(k);
      last_ = next_drive_.row(k) + next_turning_.row(k);
      mean_ = w.mean.state * c_.row(k) + w.mean.first * first_ + w.mean.last * last_;
      sum_.row(k) += mean_;
      moment_.row(k) += off * mean_;
      double_.row(k) += phase * (w.twice.state * c_.row(k) + w.twice.first * first_ + w.twice.last * last_);
      next_.row(k) += w.next.last * (next_turning_.row(k) - turning_.row(k));
    }
    c_.swap(next_);
    drive_.swap(next_drive_);
  }

  void finish_block(Index b, double points) {
    const double speed = run_.speed[b];
    modes_.read(speed, node_, SweepModes::Part::whole);
    const MatrixXcd lost = (begin_ - c_) / static_cast<double>(run_.turns);
    const Index probes = node_.reading.rows();
    for (Index c = 0; c < columns_; ++c) {
      for (Index k = 0; k < count_; ++k) {
        const Complex steady = model_.factor(c, speed) * node_.source(k, c) / (Complex(0, speed) - node_.pole[k]);
        const Complex value = sum_(k, c) / points + SampleSums::once * lost(k, c) - steady;
        const Complex twice = double_(k, c) / points + SampleSums::twice * lost(k, c);
        // The shape turns with the speed while the coordinate changes.
        const Complex moment = moment_(k, c) / points;
        for (Index p = 0; p < probes; ++p) {
          part_.readings(c * probes + p, b) += node_.reading(p, k) * value + node_.reading_rate(p, k) * moment;
          part_.conjugate(c * probes + p, b) += std::conj(node_.reading(p, k) * twice);
        }
      }
    }
  }

  const FitModel& model_;
  const SweepModes& modes_;
  const OrderRun& run_;
  SweepPath path_;
  Index count_, columns_;
  SweepNode node_;
  MatrixXcd c_, next_, begin_, drive_, next_drive_, turning_, next_turning_, sum_, double_, moment_;
  Eigen::RowVectorXcd first_, last_, mean_;
  double middle_ = 0;  ///< mean speed of the block
  std::vector<StepWeights> weights_;
  SweepPart part_;
};

}  // namespace

SweepPart sweep_part(const FitModel& model, const SweepModes& modes, const OrderRun& run) {
  return SweepIntegration(model, modes, run).integrate();
}

}  // namespace whirl::shaft
