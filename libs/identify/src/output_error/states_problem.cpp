#include "output_error/states_problem.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "whirl/core/error.hpp"
#include "whirl/core/gram.hpp"
#include "whirl/identify/simulate_model.hpp"

namespace whirl::identification::detail {
namespace {

/// The sums in the tied unknowns: normal = M' N M, gradient = M' g, M = diag(ties, 1).
void reduce(SquareSum& sums, const Eigen::MatrixXd& ties) {
  const Eigen::Index p = ties.rows(), w = ties.cols(), rest = sums.gradient.size() - p;
  Eigen::MatrixXd normal(w + rest, w + rest);
  normal.topLeftCorner(w, w) = ties.transpose() * sums.normal.topLeftCorner(p, p) * ties;
  normal.topRightCorner(w, rest) = ties.transpose() * sums.normal.topRightCorner(p, rest);
  normal.bottomLeftCorner(rest, w) = normal.topRightCorner(w, rest).transpose();
  normal.bottomRightCorner(rest, rest) = sums.normal.bottomRightCorner(rest, rest);
  Eigen::VectorXd gradient(w + rest);
  gradient << ties.transpose() * sums.gradient.head(p), sums.gradient.tail(rest);
  sums.normal = std::move(normal);
  sums.gradient = std::move(gradient);
}

/// Rows of a Jacobian on their way into J'J and J'r, a batch at a time.
class RowBatch {
 public:
  RowBatch(SquareSum& into, Eigen::Index unknowns)
      : into_(into), rows_(kBatch, unknowns), residuals_(static_cast<Eigen::Index>(kBatch)) {}
  template <class Row>
  void add(const Row& row, double residual) {
    rows_.row(filled_) = row.transpose();
    residuals_[filled_++] = residual;
    if (filled_ == kBatch) flush();
  }
  void flush() {
    if (filled_ == 0) return;
    add_gram(rows_.topRows(filled_), into_.normal);
    into_.gradient.noalias() += rows_.topRows(filled_).transpose() * residuals_.head(filled_);
    filled_ = 0;
  }

 private:
  static constexpr Eigen::Index kBatch = 128;
  SquareSum& into_;
  Eigen::MatrixXd rows_;
  Eigen::VectorXd residuals_;
  Eigen::Index filled_ = 0;
};

/// Residuals of one output on their way: without what the one before foretells of each, and their products over lags.
class Whitening {
 public:
  Whitening(double correlation, Eigen::Index unknowns) : correlation_(correlation) {
    if (correlation != 0) before_ = Eigen::VectorXd::Zero(unknowns);
  }
  bool white() const { return correlation_ == 0; }
  /// What is new in the residual and its row; the first of a run, or after a gap, is all new.
  double apply(double residual, Eigen::VectorXd& row) {
    const double kept = residual;
    if (seen_) {
      const Eigen::VectorXd now = row;
      row -= correlation_ * before_;
      residual -= correlation_ * residual_;
      before_ = now;
    } else {
      const double all = std::sqrt(1 - correlation_ * correlation_);
      before_ = row;
      row *= all;
      residual *= all;
    }
    residual_ = kept;
    seen_ = true;
    return residual;
  }
  template <class Row>
  void add_lags(double residual, Row&& sums) {
    for (Eigen::Index l = 0; l < std::min<Eigen::Index>(count_, StatesProblem::kLags); ++l)
      sums[l] += residual * recent_[static_cast<std::size_t>((count_ - 1 - l) % StatesProblem::kLags)];
    recent_[static_cast<std::size_t>(count_++ % StatesProblem::kLags)] = residual;
  }
  void forget() {
    seen_ = false;
    count_ = 0;
  }

 private:
  double correlation_, residual_ = 0;
  Eigen::VectorXd before_;
  bool seen_ = false;
  std::array<double, StatesProblem::kLags> recent_{};
  Eigen::Index count_ = 0;
};

}  // namespace

StatesProblem::StatesProblem(SensitivitySystem system, const std::vector<FreeRun>& runs, double dt,
                             std::vector<Eigen::Index> outputs, const RefineOptions& options)
    : system_(std::move(system)),
      runs_(runs),
      dt_(dt),
      outputs_(std::move(outputs)),
      weight_(options.output_sd.size() > 0 ? Eigen::VectorXd(options.output_sd.cwiseInverse())
                                           : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(outputs_.size()))),
      correlation_(options.output_correlation.size() > 0
                       ? options.output_correlation
                       : Eigen::VectorXd::Zero(static_cast<Eigen::Index>(outputs_.size()))),
      options_(options),
      tied_(options.ties.size() > 0) {
  const auto n_out = static_cast<Eigen::Index>(outputs_.size());
  if (n_out == 0) throw Error("refinement needs at least one measured state");
  if (weight_.size() != n_out || correlation_.size() != n_out)
    throw Error("one noise sd and correlation per output is needed");
  if (tied_ && options.ties.rows() != system_.parameters()) throw Error("ties need one row per estimated coefficient");
  for (const FreeRun& r : runs) {
    const Eigen::Index rows = r.measured.rows();
    const bool driven = system_.inputs() > 0;
    if (rows < 2 || r.measured.cols() != n_out || r.start.size() != system_.states() ||
        (driven && (input_steps(r.inputs.rows(), rows) == 0 || r.inputs.cols() != system_.inputs()))) {
      throw Error("a run for refinement has sizes that do not fit the model");
    }
    inputs_.emplace_back(r.inputs.transpose());
  }
}

StatesPoint StatesProblem::start() const {
  StatesPoint p{system_.free_values(), {}, {}, {}, {}};
  for (const FreeRun& r : runs_) p.starts.push_back(r.start);
  return p;
}

StatesPoint StatesProblem::moved(const StatesPoint& p, const Eigen::VectorXd& step) const {
  StatesPoint next = p;
  next.theta += tied_ ? Eigen::VectorXd(options_.ties * step.head(coefficients())) : step.head(coefficients());
  const Eigen::Index n = system_.states();
  for (std::size_t r = 0; options_.free_start && r < next.starts.size(); ++r) {
    next.starts[r] += step.segment(coefficients() + n * static_cast<Eigen::Index>(r), n);
  }
  return next;
}

void StatesProblem::linearise(StatesPoint& p, SquareSum& sum) {
  ++passes_;
  system_.set_free_values(p.theta);
  const Eigen::Index terms = system_.parameters(), starts = options_.free_start ? system_.states() : 0;
  const Eigen::Index total = terms + starts * static_cast<Eigen::Index>(runs_.size());
  sum = {0, Eigen::MatrixXd::Zero(total, total), Eigen::VectorXd::Zero(total)};
  p.cost_of = p.rows_of = Eigen::VectorXd::Zero(weight_.size());
  p.lag_of = Eigen::MatrixXd::Zero(weight_.size(), kLags);
  std::vector<Eigen::Index> unknowns(static_cast<std::size_t>(terms + starts));
  std::iota(unknowns.begin(), unknowns.end(), 0);
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    SquareSum run{0, Eigen::MatrixXd::Zero(terms + starts, terms + starts), Eigen::VectorXd::Zero(terms + starts)};
    if (!follow(r, p, run)) {
      sum.cost = INFINITY;
      return;
    }
    std::iota(unknowns.begin() + terms, unknowns.end(), terms + starts * static_cast<Eigen::Index>(r));
    add_run(run, unknowns, sum);
  }
  sum.cost = p.cost_of.sum();
  values_ = p.rows_of.sum();
  if (tied_) reduce(sum, options_.ties);
}

/// Sums of run r in its own unknowns, lower half of the normal matrix; false when it diverges.
bool StatesProblem::follow(std::size_t r, StatesPoint& p, SquareSum& run) {
  const Eigen::MatrixXd& measured = runs_[r].measured;
  RowBatch batch(run, run.gradient.size());
  const int steps = system_.inputs() > 0 ? input_steps(inputs_[r].cols(), measured.rows()) : options_.substeps;
  std::vector<Whitening> whitening;
  for (const double c : correlation_) whitening.emplace_back(c, run.gradient.size());
  Eigen::VectorXd row;
  Eigen::VectorXd x = p.starts[r];
  const Eigen::Index unknowns = run.gradient.size();
  Eigen::MatrixXd s = Eigen::MatrixXd::Zero(SensitivityStep::rows(unknowns), system_.states());
  if (options_.free_start) s.middleRows(system_.parameters(), system_.states()).setIdentity();
  for (Eigen::Index i = 0; i < measured.rows(); ++i) {
    if (!x.allFinite() || x.cwiseAbs().maxCoeff() > 1e30) return false;
    for (std::size_t o = 0; i >= options_.skip && o < outputs_.size(); ++o) {
      const auto column = static_cast<Eigen::Index>(o);
      double residual = (measured(i, column) - x[outputs_[o]]) * weight_[column];
      Whitening& w = whitening[o];
      if (!std::isfinite(residual)) {
        w.forget();
        continue;
      }
      if (w.white()) {
        batch.add(weight_[column] * s.col(outputs_[o]).head(unknowns), residual);
      } else {
        row = weight_[column] * s.col(outputs_[o]).head(unknowns);
        residual = w.apply(residual, row);
        batch.add(row, residual);
      }
      p.cost_of[column] += residual * residual;
      ++p.rows_of[column];
      w.add_lags(residual, p.lag_of.row(column));
    }
    if (i + 1 == measured.rows()) break;
    for (int k = 0; k < steps; ++k) {
      if (system_.inputs() > 0) {
        const Eigen::Index at = 2 * (i * steps + k);
        const auto input = [&](Eigen::Index column) { return inputs_[r].col(column).data(); };
        system_.step(dt_ / steps, input(at), input(at + 1), input(at + 2), x, s);
      } else {
        system_.step(dt_ / steps, nullptr, nullptr, nullptr, x, s);
      }
    }
  }
  batch.flush();
  return true;
}

}  // namespace whirl::identification::detail
