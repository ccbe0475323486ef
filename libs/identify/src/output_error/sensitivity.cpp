#include "output_error/sensitivity.hpp"

#include <cmath>

namespace whirl::identification::detail {

SensitivitySystem::SensitivitySystem(std::vector<SensitiveTerm> terms, std::vector<std::string> states,
                                     std::vector<std::string> inputs)
    : terms_(std::move(terms)),
      n_(static_cast<Eigen::Index>(states.size())),
      p_(0),
      m_(static_cast<Eigen::Index>(inputs.size())) {
  std::vector<expr::Expr> functions;
  for (const SensitiveTerm& t : terms_) {
    functions.push_back(t.function);
    column_.push_back(t.free ? p_++ : -1);
  }
  std::vector<std::string> names = states;
  names.insert(names.end(), inputs.begin(), inputs.end());
  for (std::size_t k = 0; k < terms_.size(); ++k) {
    for (Eigen::Index j = 0; j < n_; ++j) {
      expr::Expr d = expr::differentiate(terms_[k].function, states[static_cast<std::size_t>(j)]);
      if (d.is_number(0)) continue;
      partials_.push_back({k, j});
      functions.push_back(std::move(d));
    }
  }
  tape_ = expr::compile(functions, names);
  in_.resize(n_ + m_);
  out_.resize(static_cast<Eigen::Index>(functions.size()));
  dx_.resize(n_);
  jacobian_.resize(n_, n_);
  forcing_ = Eigen::MatrixXd::Zero(p_, n_);
}

void SensitivitySystem::rate(const double* state, const double* input) {
  for (Eigen::Index i = 0; i < n_; ++i) in_[i] = state[i];
  for (Eigen::Index i = 0; i < m_; ++i) in_[n_ + i] = input[i];
  tape_.evaluate_point(in_.data(), out_.data());
  dx_.setZero();
  for (std::size_t k = 0; k < terms_.size(); ++k) {
    const double f = out_[static_cast<Eigen::Index>(k)];
    dx_[terms_[k].state] += terms_[k].theta * f;
    if (column_[k] >= 0) forcing_(column_[k], terms_[k].state) = f;
  }
  jacobian_.setZero();
  const Eigen::Index offset = static_cast<Eigen::Index>(terms_.size());
  for (std::size_t i = 0; i < partials_.size(); ++i) {
    const SensitiveTerm& t = terms_[partials_[i].term];
    jacobian_(t.state, partials_[i].variable) += t.theta * out_[offset + static_cast<Eigen::Index>(i)];
  }
}

StepSums SensitivitySystem::run(const std::vector<FreeRun>& runs, double dt, const std::vector<Eigen::Index>& outputs,
                                const Eigen::VectorXd& weight, Eigen::Index skip, bool free_start) {
  const Eigen::Index starts = free_start ? n_ : 0;
  const Eigen::Index total = p_ + starts * static_cast<Eigen::Index>(runs.size());
  const Eigen::Index local = p_ + starts;
  StepSums sums;
  sums.normal = Eigen::MatrixXd::Zero(total, total);
  sums.gradient = Eigen::VectorXd::Zero(total);
  sums.cost_of = sums.rows_of = Eigen::VectorXd::Zero(weight.size());
  // Sensitivities have one row per unknown and one column per state, so that the long dimension is contiguous.
  Eigen::VectorXd x(n_), xs(n_), x1(n_), x2(n_), x3(n_), x4(n_);
  Eigen::MatrixXd s(local, n_), stage(local, n_), s1(local, n_), s2(local, n_), s3(local, n_), s4(local, n_);
  const auto slope = [&](const Eigen::VectorXd& at, const Eigen::MatrixXd& sens, const double* input,
                         Eigen::VectorXd& kx, Eigen::MatrixXd& ks) {
    rate(at.data(), input);
    kx = dx_;
    for (Eigen::Index i = 0; i < n_; ++i) {
      ks.col(i).setZero();
      ks.col(i).head(p_) = forcing_.col(i);
      for (Eigen::Index j = 0; j < n_; ++j) {
        if (jacobian_(i, j) != 0) ks.col(i) += jacobian_(i, j) * sens.col(j);
      }
    }
  };
  constexpr Eigen::Index batch = 64;
  Eigen::MatrixXd rows(local, batch * static_cast<Eigen::Index>(outputs.size()));
  Eigen::VectorXd residuals(rows.cols());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const FreeRun& run = runs[r];
    const Eigen::Index samples = run.measured.rows();
    const Eigen::MatrixXd inputs = run.inputs.transpose();  // one contiguous column per half sample
    const auto input = [&](Eigen::Index half) { return m_ > 0 ? inputs.col(half).data() : nullptr; };
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(local, local);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(local);
    x = run.start;
    s.setZero();
    if (free_start) s.bottomRows(n_).setIdentity();
    Eigen::Index filled = 0;
    const auto flush = [&] {
      if (filled == 0) return;
      normal.selfadjointView<Eigen::Lower>().rankUpdate(rows.leftCols(filled));
      gradient.noalias() += rows.leftCols(filled) * residuals.head(filled);
      filled = 0;
    };
    for (Eigen::Index i = 0; i < samples; ++i) {
      if (!x.allFinite() || x.cwiseAbs().maxCoeff() > 1e30) {
        sums.diverged = true;
        return sums;
      }
      if (i >= skip) {
        for (std::size_t o = 0; o < outputs.size(); ++o) {
          const Eigen::Index column = static_cast<Eigen::Index>(o);
          const double residual = (run.measured(i, column) - x[outputs[o]]) * weight[column];
          if (!std::isfinite(residual)) continue;
          sums.cost_of[column] += residual * residual;
          ++sums.rows_of[column];
          rows.col(filled) = weight[column] * s.col(outputs[o]);
          residuals[filled++] = residual;
        }
        if (filled + static_cast<Eigen::Index>(outputs.size()) > rows.cols()) flush();
      }
      if (i + 1 == samples) break;
      slope(x, s, input(2 * i), x1, s1);
      xs = x + 0.5 * dt * x1;
      stage = s + 0.5 * dt * s1;
      slope(xs, stage, input(2 * i + 1), x2, s2);
      xs = x + 0.5 * dt * x2;
      stage = s + 0.5 * dt * s2;
      slope(xs, stage, input(2 * i + 1), x3, s3);
      xs = x + dt * x3;
      stage = s + dt * s3;
      slope(xs, stage, input(2 * i + 2), x4, s4);
      x += dt / 6 * (x1 + 2 * (x2 + x3) + x4);
      s += dt / 6 * (s1 + 2 * (s2 + s3) + s4);
    }
    flush();
    normal.triangularView<Eigen::StrictlyUpper>() = normal.transpose();
    const Eigen::Index at = p_ + starts * static_cast<Eigen::Index>(r);
    sums.normal.topLeftCorner(p_, p_) += normal.topLeftCorner(p_, p_);
    sums.gradient.head(p_) += gradient.head(p_);
    if (starts > 0) {
      sums.normal.block(at, at, starts, starts) = normal.bottomRightCorner(starts, starts);
      sums.normal.block(at, 0, starts, p_) = normal.bottomLeftCorner(starts, p_);
      sums.normal.block(0, at, p_, starts) = normal.topRightCorner(p_, starts);
      sums.gradient.segment(at, starts) = gradient.tail(starts);
    }
  }
  sums.cost = sums.cost_of.sum();
  sums.rows = static_cast<Eigen::Index>(sums.rows_of.sum());
  return sums;
}

}  // namespace whirl::identification::detail
