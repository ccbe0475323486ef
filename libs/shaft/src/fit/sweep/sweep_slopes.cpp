#include "fit/sweep/sweep.hpp"
#include "fit/sweep/sweep_path.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;

namespace {

using Complex = std::complex<double>;

/// The modes with all unbalances as one column of their sources, all bows as a second.
SweepModes with_sizes(const FitModel& model, const SweepModes& modes, const VectorXcd& sizes) {
  SweepModes joined = modes;
  const Index count = modes.count;
  for (std::size_t n = 0; n < modes.nodes.size(); ++n) {
    const SweepNode& from = modes.nodes[n];
    SweepNode& node = joined.nodes[n];
    node.source = MatrixXcd::Zero(count, 2);
    node.source_slopes = MatrixXcd::Zero(2 * count, from.source_slopes.cols());
    for (Index c = 0; c < sizes.size(); ++c) {
      const Index at = model.is_bow(c) ? 1 : 0;
      node.source.col(at) += sizes[c] * from.source.col(c);
      node.source_slopes.middleRows(at * count, count) += sizes[c] * from.source_slopes.middleRows(c * count, count);
    }
  }
  return joined;
}

/// Coordinates c of the modes along a run and their slopes e over the structural unknowns u,
///     e' = (a - i Omega) e + a_u c + (Omega^2 - i Omega') (l'f)_u + Omega' N e,
/// averaged over blocks as the record was.
class SlopeIntegration {
 public:
  SlopeIntegration(const FitModel& model, const SweepModes& modes, const OrderRun& run, const VectorXcd& sizes)
      : modes_(with_sizes(model, modes, sizes)), run_(run), path_(run), count_(modes.count) {
    unknowns_ = model.parameters().structural;
    slopes_ = MatrixXcd::Zero(model.probe_rows().rows() * unknowns_, run.blocks());
  }

  MatrixXcd integrate() {
    if (count_ == 0) return std::move(slopes_);
    start();
    const Index per_block = static_cast<Index>(run_.turns) * kGridPerTurn;
    for (Index b = 0; b < run_.blocks(); ++b) {
      c_sum_ = c_double_ = VectorXcd::Zero(count_);
      e_sum_ = e_double_ = MatrixXcd::Zero(count_, unknowns_);
      c_begin_ = c_;
      e_begin_ = e_;
      for (Index i = 0; i < per_block; ++i) advance(b * per_block + i, twice_turned(i));
      finish_block(b, static_cast<double>(per_block));
    }
    return std::move(slopes_);
  }

 private:
  /// Source of the modes and its slopes at a point, as the node says.
  void drive(Complex unbalance, VectorXcd& source, MatrixXcd& slopes) const {
    source = unbalance * node_.source.col(0) + node_.source.col(1);
    slopes = unbalance * node_.source_slopes.topRows(count_) + node_.source_slopes.bottomRows(count_);
  }
  Complex unbalance_factor(Index point) const {
    const double speed = path_.point_speed[point];
    return {speed * speed, -path_.rate[point]};
  }

  /// The steady state at the first speed.
  void start() {
    const double speed = path_.point_speed[0];
    modes_.read(speed, node_, SweepModes::Part::slopes);
    drive(unbalance_factor(0), source_, source_slopes_);
    const VectorXcd apart = (Complex(0, speed) - node_.pole.array()).inverse();
    c_ = apart.cwiseProduct(source_);
    e_ = apart.asDiagonal() * (source_slopes_ + c_.asDiagonal() * node_.pole_slopes);
  }

  void advance(Index step, Complex phase) {
    const double h = path_.step[step], speed = path_.speed[step], rate = path_.rate[step];
    modes_.read(speed, node_, SweepModes::Part::slopes);
    drive(unbalance_factor(step + 1), next_source_, next_slopes_);
    turning_.noalias() = rate * node_.coupling.lazyProduct(c_);
    turning_slopes_.noalias() = rate * node_.coupling.lazyProduct(e_);
    for (Index k = 0; k < count_; ++k) {
      const StepWeights w(node_.pole[k] * h - Complex(0, kStepAngle), h);
      const Complex first = source_[k] + turning_[k], last = next_source_[k] + turning_[k], before = c_[k];
      const auto moved = [&](const StepWeights::Row& r) { return r.state * before + r.first * first + r.last * last; };
      c_sum_[k] += moved(w.mean);
      c_double_[k] += phase * moved(w.twice);
      c_[k] = moved(w.next);
      // The pole's slope drives e by c, straight between the ends.
      first_ = before * node_.pole_slopes.row(k) + source_slopes_.row(k) + turning_slopes_.row(k);
      last_ = c_[k] * node_.pole_slopes.row(k) + next_slopes_.row(k) + turning_slopes_.row(k);
      e_sum_.row(k) += w.mean.state * e_.row(k) + w.mean.first * first_ + w.mean.last * last_;
      e_double_.row(k) += phase * (w.twice.state * e_.row(k) + w.twice.first * first_ + w.twice.last * last_);
      moved_ = w.next.state * e_.row(k) + w.next.first * first_ + w.next.last * last_;
      e_.row(k) = moved_;
    }
    source_.swap(next_source_);
    source_slopes_.swap(next_slopes_);
  }

  void finish_block(Index b, double points) {
    const double speed = run_.speed[b];
    modes_.read(speed, node_, SweepModes::Part::whole);
    VectorXcd steady;
    MatrixXcd steady_slopes;
    drive(speed * speed, steady, steady_slopes);
    const VectorXcd apart = (Complex(0, speed) - node_.pole.array()).inverse();
    steady = apart.cwiseProduct(steady).eval();
    steady_slopes = apart.asDiagonal() * (steady_slopes + steady.asDiagonal() * node_.pole_slopes);
    const VectorXcd lost = (c_begin_ - c_) / static_cast<double>(run_.turns);
    const MatrixXcd lost_slopes = (e_begin_ - e_) / static_cast<double>(run_.turns);
    const VectorXcd value = c_sum_ / points + SampleSums::once * lost - steady;
    const VectorXcd twice = c_double_ / points + SampleSums::twice * lost;
    const MatrixXcd value_slopes = e_sum_ / points + SampleSums::once * lost_slopes - steady_slopes;
    const MatrixXcd twice_slopes = e_double_ / points + SampleSums::twice * lost_slopes;
    const Index probes = node_.reading.rows();
    for (Index u = 0; u < unknowns_; ++u)
      for (Index k = 0; k < count_; ++k)
        for (Index p = 0; p < probes; ++p) {
          const Complex reading = node_.reading(p, k), turned = node_.reading_slopes(k * probes + p, u);
          slopes_(u * probes + p, b) += reading * value_slopes(k, u) + turned * value[k] +
                                        std::conj(reading * twice_slopes(k, u) + turned * twice[k]);
        }
  }

  SweepModes modes_;
  const OrderRun& run_;
  SweepPath path_;
  Index count_, unknowns_ = 0;
  SweepNode node_;
  VectorXcd c_, c_begin_, source_, next_source_, turning_, c_sum_, c_double_;
  Eigen::RowVectorXcd first_, last_, moved_;
  MatrixXcd e_, e_begin_, source_slopes_, next_slopes_, turning_slopes_, e_sum_, e_double_;
  MatrixXcd slopes_;
};

}  // namespace

MatrixXcd sweep_slopes(const FitModel& model, const SweepModes& modes, const OrderRun& run, const VectorXcd& sizes) {
  return SlopeIntegration(model, modes, run, sizes).integrate();
}

}  // namespace whirl::shaft
