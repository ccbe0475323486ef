#include "sensitivity.hpp"

#include <cmath>

namespace whirl::detail {

SensitivitySystem::SensitivitySystem(std::vector<SensitiveTerm> terms, std::vector<std::string> states,
                                     std::vector<std::string> inputs)
    : terms_(std::move(terms)),
      n_(static_cast<Eigen::Index>(states.size())),
      p_(0),
      m_(static_cast<Eigen::Index>(inputs.size())) {
  std::vector<Expr> functions;
  for (const SensitiveTerm& t : terms_) {
    functions.push_back(t.function);
    column_.push_back(t.free ? p_++ : -1);
  }
  std::vector<std::string> names = states;
  names.insert(names.end(), inputs.begin(), inputs.end());
  values_ = compile(functions, names);
  for (std::size_t k = 0; k < terms_.size(); ++k) {
    for (Eigen::Index j = 0; j < n_; ++j) {
      Expr d = differentiate(terms_[k].function, states[static_cast<std::size_t>(j)]);
      if (d.is_number(0)) continue;
      partials_.push_back({k, j});
      functions.push_back(std::move(d));
    }
  }
  all_ = compile(functions, names);
  in_.resize(n_ + m_);
  out_.resize(static_cast<Eigen::Index>(functions.size()));
  dx_.resize(n_);
  jacobian_.resize(n_, n_);
  forcing_ = Eigen::MatrixXd::Zero(n_, p_);
}

void SensitivitySystem::rate(const double* state, const double* input, bool derivatives) {
  for (Eigen::Index i = 0; i < n_; ++i) in_[i] = state[i];
  for (Eigen::Index i = 0; i < m_; ++i) in_[n_ + i] = input[i];
  (derivatives ? all_ : values_).evaluate_point(in_.data(), out_.data());
  dx_.setZero();
  for (std::size_t k = 0; k < terms_.size(); ++k) {
    const double f = out_[static_cast<Eigen::Index>(k)];
    dx_[terms_[k].state] += terms_[k].theta * f;
    if (derivatives && column_[k] >= 0) forcing_(terms_[k].state, column_[k]) = f;
  }
  if (!derivatives) return;
  jacobian_.setZero();
  const Eigen::Index offset = static_cast<Eigen::Index>(terms_.size());
  for (std::size_t i = 0; i < partials_.size(); ++i) {
    const SensitiveTerm& t = terms_[partials_[i].term];
    jacobian_(t.state, partials_[i].variable) += t.theta * out_[offset + static_cast<Eigen::Index>(i)];
  }
}

StepSums SensitivitySystem::run(const std::vector<FreeRun>& runs, double dt, const std::vector<Eigen::Index>& outputs,
                                const Eigen::VectorXd& weight, Eigen::Index skip, bool free_start, bool derivatives) {
  const Eigen::Index starts = free_start ? n_ : 0;
  const Eigen::Index total = p_ + starts * static_cast<Eigen::Index>(runs.size());
  const Eigen::Index local = p_ + starts;
  StepSums sums;
  if (derivatives) {
    sums.normal = Eigen::MatrixXd::Zero(total, total);
    sums.gradient = Eigen::VectorXd::Zero(total);
  }
  // Columns 0: state, then sensitivities to parameters, then to the start.
  const Eigen::Index columns = derivatives ? 1 + local : 1;
  Eigen::MatrixXd s(n_, columns), stage(n_, columns), k1(n_, columns), k2(n_, columns), k3(n_, columns), k4(n_, columns);
  const auto slope = [&](const Eigen::MatrixXd& at, const double* input, Eigen::MatrixXd& k) {
    rate(at.data(), input, derivatives);
    k.col(0) = dx_;
    if (!derivatives) return;
    k.rightCols(local).noalias() = jacobian_.lazyProduct(at.rightCols(local));
    k.middleCols(1, p_) += forcing_;
  };
  constexpr Eigen::Index batch = 64;
  Eigen::MatrixXd rows(batch * static_cast<Eigen::Index>(outputs.size()), local);
  Eigen::VectorXd residuals(rows.rows());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const FreeRun& run = runs[r];
    const Eigen::Index samples = run.measured.rows();
    const Eigen::MatrixXd inputs = run.inputs.transpose();  // one contiguous column per half sample
    const auto input = [&](Eigen::Index half) { return m_ > 0 ? inputs.col(half).data() : nullptr; };
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(local, local);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(local);
    s.setZero();
    s.col(0) = run.start;
    if (derivatives && free_start) s.rightCols(n_).setIdentity();
    Eigen::Index filled = 0;
    const auto flush = [&] {
      if (!derivatives || filled == 0) return;
      normal.selfadjointView<Eigen::Lower>().rankUpdate(rows.topRows(filled).transpose());
      gradient.noalias() += rows.topRows(filled).transpose() * residuals.head(filled);
      filled = 0;
    };
    for (Eigen::Index i = 0; i < samples; ++i) {
      if (!s.col(0).allFinite() || s.col(0).cwiseAbs().maxCoeff() > 1e30) {
        sums.diverged = true;
        return sums;
      }
      if (i >= skip) {
        for (std::size_t o = 0; o < outputs.size(); ++o) {
          const Eigen::Index column = static_cast<Eigen::Index>(o);
          const double residual = (run.measured(i, column) - s(outputs[o], 0)) * weight[column];
          if (!std::isfinite(residual)) continue;
          sums.cost += residual * residual;
          ++sums.rows;
          if (!derivatives) continue;
          rows.row(filled) = weight[column] * s.row(outputs[o]).tail(local);
          residuals[filled++] = residual;
        }
        if (filled + static_cast<Eigen::Index>(outputs.size()) > rows.rows()) flush();
      }
      if (i + 1 == samples) break;
      slope(s, input(2 * i), k1);
      stage = s + 0.5 * dt * k1;
      slope(stage, input(2 * i + 1), k2);
      stage = s + 0.5 * dt * k2;
      slope(stage, input(2 * i + 1), k3);
      stage = s + dt * k3;
      slope(stage, input(2 * i + 2), k4);
      s += dt / 6 * (k1 + 2 * (k2 + k3) + k4);
    }
    flush();
    if (!derivatives) continue;
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
  return sums;
}

}  // namespace whirl::detail
