#include "output_error/sensitivity.hpp"

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

Eigen::VectorXd SensitivitySystem::free_values() const {
  Eigen::VectorXd theta(p_);
  for (std::size_t k = 0; k < terms_.size(); ++k) {
    if (column_[k] >= 0) theta[column_[k]] = terms_[k].theta;
  }
  return theta;
}

void SensitivitySystem::set_free_values(const Eigen::VectorXd& theta) {
  for (std::size_t k = 0; k < terms_.size(); ++k) {
    if (column_[k] >= 0) terms_[k].theta = theta[column_[k]];
  }
}

/// Rates of x and s at a stage: S' = (df/dx) S + df/dtheta.
void SensitivitySystem::slope(const Eigen::VectorXd& x, const Eigen::MatrixXd& s, const double* input,
                              std::size_t stage) {
  rate(x.data(), input);
  x_[stage] = dx_;
  Eigen::MatrixXd& ks = s_[stage];
  ks.resizeLike(s);
  for (Eigen::Index i = 0; i < n_; ++i) {
    ks.col(i).setZero();
    ks.col(i).head(p_) = forcing_.col(i);
    for (Eigen::Index j = 0; j < n_; ++j) {
      if (jacobian_(i, j) != 0) ks.col(i) += jacobian_(i, j) * s.col(j);
    }
  }
}

void SensitivitySystem::step(double h, const double* begin, const double* middle, const double* end, Eigen::VectorXd& x,
                             Eigen::MatrixXd& s) {
  slope(x, s, begin, 0);
  for (std::size_t stage = 1; stage < 4; ++stage) {
    const double ahead = stage < 3 ? 0.5 * h : h;
    moved_ = x + ahead * x_[stage - 1];
    moved_s_ = s + ahead * s_[stage - 1];
    slope(moved_, moved_s_, stage < 3 ? middle : end, stage);
  }
  x += h / 6 * (x_[0] + 2 * (x_[1] + x_[2]) + x_[3]);
  s += h / 6 * (s_[0] + 2 * (s_[1] + s_[2]) + s_[3]);
}

}  // namespace whirl::identification::detail
