#include "output_error/sensitivity.hpp"

#include <map>
#include <utility>

namespace whirl::identification::detail {

SensitivitySystem::SensitivitySystem(const std::vector<SensitiveTerm>& terms, const std::vector<std::string>& states,
                                     const std::vector<std::string>& inputs)
    : n_(static_cast<Eigen::Index>(states.size())), p_(0), m_(static_cast<Eigen::Index>(inputs.size())) {
  std::vector<expr::Expr> functions;
  std::vector<Eigen::Index> column;
  for (const SensitiveTerm& t : terms) {
    functions.push_back(t.function);
    theta_.push_back(t.theta);
    if (of_state_.empty() || of_state_.back().first != t.state) of_state_.emplace_back(t.state, 0);
    of_state_.back().second = theta_.size();
    column.push_back(t.free ? p_++ : -1);
  }
  std::vector<std::string> names = states;
  names.insert(names.end(), inputs.begin(), inputs.end());
  std::map<std::pair<Eigen::Index, Eigen::Index>, std::vector<Partial>> by_entry;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    for (Eigen::Index j = 0; j < n_; ++j) {
      expr::Expr d = expr::differentiate(terms[k].function, states[static_cast<std::size_t>(j)]);
      if (d.is_number(0)) continue;
      by_entry[{terms[k].state, j}].push_back({k, static_cast<Eigen::Index>(functions.size())});
      functions.push_back(std::move(d));
    }
  }
  std::vector<SensitivityStep::Entry> entries;
  for (const auto& [entry, partials] : by_entry) {
    entries.push_back({entry.first, entry.second});
    partials_.insert(partials_.end(), partials.begin(), partials.end());
    entry_ends_.push_back(partials_.size());
  }
  tape_ = expr::compile(functions, names);
  tape_.hold(nullptr, slots_);  // its constants stay where they are
  step_ = SensitivityStep(n_, p_, entries);
  const Eigen::Index rows = step_.stage(0).forcing.rows();
  for (std::size_t k = 0; k < terms.size(); ++k)
    place_.push_back(column[k] < 0 ? -1 : column[k] + rows * terms[k].state);
  in_.resize(n_ + m_);
  out_.resize(static_cast<Eigen::Index>(functions.size()));
  for (Eigen::VectorXd& rates : rates_) rates.resize(n_);
}

/// Rates at the states in in_, and what the sensitivities need of them.
void SensitivitySystem::stage(int k, const double* input) {
  for (Eigen::Index i = 0; i < m_; ++i) in_[n_ + i] = input[i];
  tape_.evaluate_held(in_.data(), slots_, out_.data());
  SensitivityStep::Stage& at = step_.stage(k);
  Eigen::VectorXd& rates = rates_[static_cast<std::size_t>(k)];
  rates.setZero();
  const double* value = out_.data();
  double* forcing = at.forcing.data();
  std::size_t next = 0;
  for (const auto& [state, end] : of_state_) {
    double sum = 0;
    for (; next < end; ++next) {
      sum += theta_[next] * value[next];
      if (place_[next] >= 0) forcing[place_[next]] = value[next];
    }
    rates[state] += sum;
  }
  for (std::size_t e = 0, i = 0; e < entry_ends_.size(); ++e) {
    double sum = 0;
    for (; i < entry_ends_[e]; ++i) sum += theta_[partials_[i].term] * value[partials_[i].output];
    at.jacobian[e] = sum;
  }
}

Eigen::VectorXd SensitivitySystem::free_values() const {
  Eigen::VectorXd values(p_);
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < place_.size(); ++k)
    if (place_[k] >= 0) values[next++] = theta_[k];
  return values;
}

void SensitivitySystem::set_free_values(const Eigen::VectorXd& values) {
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < place_.size(); ++k)
    if (place_[k] >= 0) theta_[k] = values[next++];
}

void SensitivitySystem::step(double h, const double* begin, const double* middle, const double* end, Eigen::VectorXd& x,
                             Eigen::MatrixXd& s) {
  // Loops of their own: of so few numbers an expression of Eigen costs more than the sums.
  double *const at = x.data(), *const in = in_.data();
  const auto ahead = [&](double by, const double* rates) {
    for (Eigen::Index i = 0; i < n_; ++i) in[i] = at[i] + by * rates[i];
  };
  const double *const r0 = rates_[0].data(), *const r1 = rates_[1].data(), *const r2 = rates_[2].data(),
                      *const r3 = rates_[3].data();
  for (Eigen::Index i = 0; i < n_; ++i) in[i] = at[i];
  stage(0, begin);
  ahead(0.5 * h, r0);
  stage(1, middle);
  ahead(0.5 * h, r1);
  stage(2, middle);
  ahead(h, r2);
  stage(3, end);
  const double share = h / 6;
  for (Eigen::Index i = 0; i < n_; ++i) at[i] += share * (r0[i] + 2 * (r1[i] + r2[i]) + r3[i]);
  step_.advance(h, s);
}

}  // namespace whirl::identification::detail
