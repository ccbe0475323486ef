#include "fit/fit_problem.hpp"

#include <algorithm>
#include <cmath>

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

using Complex = std::complex<double>;
constexpr int kNodes = 16;  // speeds at which the modes of a sweep are found

constexpr double kFarthest = 4;   // a tolerance, in its standard deviations: normal errors pass it once in 16000
constexpr double kLongest = 0.7;  // largest step of a logarithm: a factor of two

SweepPart no_sweep(const FitModel& model, const OrderRun& run) {
  SweepPart part;
  part.readings = part.conjugate = MatrixXcd::Zero(model.probe_rows().rows() * model.columns(), run.blocks());
  return part;
}

}  // namespace

VectorXd scatter(const OrderRun& run) {
  const Index n = run.blocks();
  VectorXd sd(run.vectors.rows());
  for (Index p = 0; p < sd.size(); ++p) {
    std::vector<double> differences;
    for (Index b = 0; b + 3 < n; ++b) {
      const auto z = [&](Index k) { return run.vectors(p, b + k); };
      const Complex d = z(3) - 3.0 * z(2) + 3.0 * z(1) - z(0);
      // A vector of m samples has variance 2 sd^2 / m in each part; squared binomials of order 3 sum to 20.
      const double scale = std::sqrt(0.5 * run.samples[b + 1] / 20);
      differences.push_back(scale * std::abs(d.real()));
      differences.push_back(scale * std::abs(d.imag()));
    }
    const auto middle = differences.begin() + static_cast<long>(differences.size() / 2);
    std::nth_element(differences.begin(), middle, differences.end());
    sd[p] = std::max(*middle / 0.6745, 1e-12 * run.vectors.row(p).cwiseAbs().maxCoeff());
    if (!(sd[p] > 0)) sd[p] = 1e-12;
  }
  return sd;
}

FitProblem::FitProblem(std::shared_ptr<FitModel> model, const std::vector<OrderRun>& runs)
    : model_(std::move(model)), runs_(runs), states_(runs.size()), residuals_(runs.size()) {
  reset_noise();
}

void FitProblem::reset_noise() {
  noise_.clear();
  for (const OrderRun& run : runs_) noise_.push_back(scatter(run));
}

FitPoint FitProblem::moved(const FitPoint& from, const VectorXd& step) const {
  FitPoint next = from;
  for (Index k = 0; k < step.size(); ++k) {
    const Parameter& p = model_->parameters().all[static_cast<std::size_t>(k)];
    // Damping that turns with the shaft makes the rotor unstable where it moves too far.
    const bool turning = p.kind == UnknownKind::material_damping || p.kind == UnknownKind::joint_damping;
    const bool bounded = p.logarithmic || turning;
    next.t[k] += bounded ? std::clamp(step[k], -kLongest, kLongest) : step[k];
    if (is_tolerance(p.kind))
      next.t[k] = std::clamp(next.t[k], p.prior - kFarthest * p.prior_sd, p.prior + kFarthest * p.prior_sd);
  }
  return next;
}

bool FitProblem::small(const SquareSum&, const VectorXd&, double decrease) const {
  return decrease < 4e-3;  // a step of less than 0.07 standard deviations along its direction
}

Index FitProblem::equations() const {
  Index n = 0;
  for (const OrderRun& run : runs_) n += 2 * run.vectors.size();
  return n;
}

double FitProblem::weight(std::size_t run, Index probe, Index block) const {
  return std::sqrt(0.5 * runs_[run].samples[block]) / noise_[run][probe];
}

void FitProblem::evaluate(const VectorXd& t) {
  model_->set(t);
  const ParameterSet& set = model_->parameters();
  modes_ = sweep_modes(*model_, set.lowest, set.highest, kNodes);
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    const OrderRun& run = runs_[r];
    RunState& state = states_[r];
    // A run without times is a table of steady vectors.
    SweepPart sweep = run.time.size() > 0 ? sweep_part(*model_, modes_, run) : no_sweep(*model_, run);
    state.readings = std::move(sweep.readings);
    state.conjugate = std::move(sweep.conjugate);
    state.steady.resize(static_cast<std::size_t>(run.blocks()));
    for (Index b = 0; b < run.blocks(); ++b) {
      SteadyPoint& point = state.steady[static_cast<std::size_t>(b)];
      point = model_->steady(run.speed[b]);
      state.readings.col(b) += point.readings.reshaped();
    }
  }
}

/// Calls row(run, block, probe, residual, slopes of all unknowns): model = gain * motion + runout.
template <class Row>
void FitProblem::visit(const VectorXd& t, bool slopes, Row&& row) {
  const ParameterSet& set = model_->parameters();
  const Index probes = set.probes, first_linear = set.structural;
  VectorXcd slope = VectorXcd::Zero(set.size());
  MatrixXcd structural = MatrixXcd::Zero(probes, set.structural);
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    const OrderRun& run = runs_[r];
    const RunState& state = states_[r];
    const VectorXcd sizes = model_->sizes(t, run.name);
    const bool swept = run.time.size() > 0 && modes_.count > 0;
    const MatrixXcd sweep = slopes && swept ? sweep_slopes(*model_, modes_, run, sizes) : MatrixXcd();
    for (Index b = 0; b < run.blocks(); ++b) {
      if (slopes) {
        structural = model_->steady_slopes(run.speed[b], state.steady[static_cast<std::size_t>(b)], sizes);
        if (swept) structural += sweep.col(b).reshaped(probes, set.structural);
      }
      for (Index p = 0; p < probes; ++p) {
        Complex motion = 0, turned = 0;
        for (Index j = 0; j < sizes.size(); ++j) {
          motion += state.readings(j * probes + p, b) * sizes[j];
          turned += state.conjugate(j * probes + p, b) * std::conj(sizes[j]);
        }
        const Complex gain = set.complex_value(t, set.gain + 2 * p), runout = set.complex_value(t, set.runout + 2 * p);
        // The angle of a gain is a delay: it acts on the conjugate part the other way, and on the drift of the motion,
        // which is 2 i conj(turned) a radian.
        const Complex drift(0, 2), late = drift * std::conj(turned);
        const Complex read = gain * motion + std::conj(gain) * turned + gain.imag() * late;
        if (slopes) slope.head(set.structural) = gain * structural.row(p).transpose();
        slope.tail(set.size() - first_linear).setZero();
        for (Index j = 0; j < set.stations + set.bows; ++j) {
          const Index at = set.unbalance + 2 * j;
          const double scale = set.all[static_cast<std::size_t>(at)].scale;
          const Complex straight = state.readings(j * probes + p, b), conjugate = state.conjugate(j * probes + p, b);
          slope[at] = scale * gain * (straight + conjugate);
          slope[at + 1] = scale * gain * Complex(0, 1) * (straight - conjugate);
        }
        slope[set.gain + 2 * p] = motion + turned;
        slope[set.gain + 2 * p + 1] = Complex(0, 1) * (motion - turned) + late;
        const double scale = set.all[static_cast<std::size_t>(set.runout)].scale;
        slope[set.runout + 2 * p] = scale;
        slope[set.runout + 2 * p + 1] = Complex(0, scale);
        const double w = weight(r, p, b);
        row(r, b, p, Complex(w * (run.vectors(p, b) - read - runout)), w, slope);
      }
    }
  }
}

void FitProblem::refine_linear(VectorXd& t) {
  const ParameterSet& set = model_->parameters();
  const Index first = set.structural, n = set.size() - first;
  double before = std::numeric_limits<double>::infinity();
  share_scale(t);
  for (int pass = 0; pass < 6; ++pass) {
    MatrixXd normal = MatrixXd::Zero(n, n);
    VectorXd gradient = VectorXd::Zero(n);
    double cost = 0;
    VectorXd real(n), imaginary(n);
    visit(t, false, [&](std::size_t, Index, Index, Complex residual, double w, const VectorXcd& slope) {
      real = w * slope.tail(n).real();
      imaginary = w * slope.tail(n).imag();
      normal.selfadjointView<Eigen::Lower>().rankUpdate(real);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(imaginary);
      gradient += residual.real() * real + residual.imag() * imaginary;
      cost += std::norm(residual);
    });
    normal = MatrixXd(normal.selfadjointView<Eigen::Lower>());
    for (Index k = 0; k < n; ++k) {
      const Parameter& p = set.all[static_cast<std::size_t>(first + k)];
      const double w = 1 / (p.prior_sd * p.prior_sd), off = p.prior - t[first + k];
      normal(k, k) += w;
      gradient[k] += w * off;
      cost += w * off * off;
    }
    if (before - cost < 1e-3 * std::max(1.0, 1e-4 * cost)) break;
    before = cost;
    VectorXd step;
    if (!damped_step(normal, gradient, 0, step)) break;
    t.tail(n) += step;
  }
}

/// Where no trial mass is known the probes read gain times unbalance: of all pairs of one product the one with gains
/// near
/// 1. A descent from another pair follows a long bend.
void FitProblem::share_scale(VectorXd& t) const {
  const ParameterSet& set = model_->parameters();
  if (!model_->trials().empty()) return;
  Complex along = 0;
  double square = 0;
  for (Index k = set.gain; k < set.gain + 2 * set.probes; k += 2) {
    const Complex gain = set.complex_value(t, k);
    along += std::conj(gain);
    square += std::norm(gain);
  }
  const Complex factor = along / square;
  if (!std::isfinite(std::norm(factor)) || factor == 0.0) return;
  const auto scale = [&](Index first, Index count, Complex by) {
    for (Index k = first; k < first + 2 * count; k += 2) {
      const Complex value = by * set.complex_value(t, k);
      const auto at = static_cast<std::size_t>(k);
      t[k] = set.all[at].internal(value.real());
      t[k + 1] = set.all[at + 1].internal(value.imag());
    }
  };
  scale(set.gain, set.probes, factor);
  scale(set.unbalance, set.stations + set.bows, 1.0 / factor);
}

MatrixXd FitProblem::information_at(const VectorXd& t) {
  evaluate(t);
  MatrixXd information = MatrixXd::Zero(t.size(), t.size());
  visit(t, true, [&](std::size_t, Index, Index, Complex, double w, const VectorXcd& slope) {
    information.noalias() +=
        (w * w) * (slope.real() * slope.real().transpose() + slope.imag() * slope.imag().transpose());
  });
  return information;
}

void FitProblem::linearise(FitPoint& p, SquareSum& s) {
  const ParameterSet& set = model_->parameters();
  const Index n = set.size();
  evaluate(p.t);
  refine_linear(p.t);
  for (std::size_t r = 0; r < runs_.size(); ++r) residuals_[r].value.resize(set.probes, runs_[r].blocks());
  // Rows are gathered for products of matrices, which are faster than sums of outer products.
  constexpr Index kRows = 256;
  MatrixXd rows(kRows, n);
  VectorXd values(kRows);
  Index filled = 0;
  s.cost = 0;
  s.normal = MatrixXd::Zero(n, n);
  s.gradient = VectorXd::Zero(n);
  const auto flush = [&] {
    s.normal.noalias() += rows.topRows(filled).transpose() * rows.topRows(filled);
    s.gradient.noalias() += rows.topRows(filled).transpose() * values.head(filled);
    filled = 0;
  };
  visit(p.t, true, [&](std::size_t run, Index b, Index probe, Complex residual, double w, const VectorXcd& slope) {
    residuals_[run].value(probe, b) = residual;
    rows.row(filled) = w * slope.real().transpose();
    values[filled++] = residual.real();
    rows.row(filled) = w * slope.imag().transpose();
    values[filled++] = residual.imag();
    s.cost += std::norm(residual);
    if (filled == kRows) flush();
  });
  flush();
  information_ = s.normal;
  for (Index k = 0; k < n; ++k) {
    const Parameter& q = set.all[static_cast<std::size_t>(k)];
    const double w = 1 / (q.prior_sd * q.prior_sd), off = q.prior - p.t[k];
    s.normal(k, k) += w;
    s.gradient[k] += w * off;
    s.cost += w * off * off;
  }
}

}  // namespace whirl::shaft
