#include "model_draws.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <complex>

#include "whirl/core/decompositions.hpp"
#include "whirl/identify/rotor_terms.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;
constexpr std::array kAnisotropy{"k1_conj_re", "k1_conj_im", "c_conj_re", "c_conj_im"};

/// The number of the further mode that a parameter belongs to ("mode2_re": 1), and which of its numbers it is.
std::optional<std::pair<std::size_t, std::string>> mode_part(const std::string& name) {
  const std::size_t underscore = name.find('_');
  if (!name.starts_with("mode") || underscore == std::string::npos || underscore < 5) return std::nullopt;
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(name.data() + 4, name.data() + underscore, number);
  if (error != std::errc{} || end != name.data() + underscore || number == 0) return std::nullopt;
  return std::pair(number - 1, name.substr(underscore + 1));
}

void move_mode(const std::string& name, double by, RotorModel& rotor) {
  const auto part = mode_part(name);
  if (!part || part->first >= rotor.modes.size()) return;
  ForcedMode& mode = rotor.modes[part->first];
  constexpr double kLeastDamping = 1e-6;
  if (part->second == "omega") mode.omega = std::max(mode.omega + by, 1e-9);
  if (part->second == "zeta") mode.zeta = std::max(mode.zeta + by, kLeastDamping);
  if (part->second == "re") mode.participation += by;
  if (part->second == "im") mode.participation += std::complex<double>(0, by);
}

bool is_further(const std::string& name) {
  return mode_part(name).has_value() || std::ranges::find(kAnisotropy, name) != kAnisotropy.end() ||
         identification::is_force_parameter(name);
}

bool same_size(const Estimate& a, const Estimate& b) {
  return std::abs(std::abs(a.value) - std::abs(b.value)) <= 1e-12 * std::abs(b.value) &&
         std::abs(a.sd - b.sd) <= 1e-9 * b.sd;
}

double square(double sd) { return std::isfinite(sd) ? sd * sd : 0; }

}  // namespace

ModelDraws::ModelDraws(const IdentifiedModel& model, unsigned seed)
    : model_(model), rotor_(model.rotor.has_value()), random_(seed) {
  if (rotor_)
    join_rotor();
  else
    join_coefficients();
}

/// Parts of rounding below zero do not count; the parts are scaled first, as their units differ by many powers of ten.
void ModelDraws::take(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd by = (sd.array() > 0).select(sd.cwiseInverse(), 0.0);
  const Eigen::MatrixXd shape = by.asDiagonal() * (0.5 * (covariance + covariance.transpose())) * by.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(shape);
  if (!(sd.size() > 0 && sd.maxCoeff() > 0)) return;
  root_ = sd.asDiagonal() * eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

void ModelDraws::join_rotor() {
  const auto n = static_cast<Index>(model_.parameters.size());
  for (std::size_t k = 0; k < model_.parameters.size(); ++k)
    if (is_further(model_.parameters[k].first)) further_.push_back(k);
  const auto more = static_cast<Index>(further_.size());
  Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(5 + more, 5 + more);
  if (model_.rotor_covariance.size() == 25)
    joint.topLeftCorner(5, 5) = Eigen::Map<const Eigen::Matrix<double, 5, 5>>(model_.rotor_covariance.data());
  const bool stated = n > 0 && static_cast<Index>(model_.parameter_covariance.size()) == n * n;
  const Eigen::Map<const Eigen::MatrixXd> all(model_.parameter_covariance.data(), stated ? n : 0, stated ? n : 0);
  // eps = e exp(i phase) moves with e and its phase.
  const std::complex<double> eps = model_.rotor->eps, along = std::polar(1.0, std::arg(eps)),
                             across = std::complex<double>(0, 1) * eps;
  const std::array<std::pair<const char*, std::array<double, 5>>, 5> moves{
      {{"k1", {1, 0, 0, 0, 0}},
       {"k2", {0, 1, 0, 0, 0}},
       {"c", {0, 0, 1, 0, 0}},
       {"e", {0, 0, 0, along.real(), along.imag()}},
       {"e_phase", {0, 0, 0, across.real(), across.imag()}}}};
  for (Index i = 0; i < more; ++i) {
    const auto own = static_cast<Index>(further_[static_cast<std::size_t>(i)]);
    joint(5 + i, 5 + i) = square(model_.parameters[static_cast<std::size_t>(own)].second.sd);
    if (!stated) continue;
    for (Index j = 0; j < more; ++j)
      joint(5 + i, 5 + j) = all(own, static_cast<Index>(further_[static_cast<std::size_t>(j)]));
    for (const auto& [name, by] : moves) {
      const auto at = std::ranges::find(model_.parameters, std::string(name), [](const auto& p) { return p.first; });
      if (at == model_.parameters.end()) continue;
      const double shared = all(own, static_cast<Index>(at - model_.parameters.begin()));
      for (Index k = 0; k < 5; ++k) joint(5 + i, k) += by[static_cast<std::size_t>(k)] * shared;
    }
    joint.col(5 + i).head(5) = joint.row(5 + i).head(5).transpose();
  }
  take(joint);
}

void ModelDraws::join_coefficients() {
  const std::size_t n = model_.parameters.size();
  const bool stated = n > 0 && model_.parameter_covariance.size() == n * n;
  std::vector<std::ptrdiff_t> parameter;
  std::vector<double> sds, values;
  bool joint = stated;
  for (std::size_t e = 0; e < model_.equations.size(); ++e) {
    const Equation& equation = model_.equations[e];
    for (std::size_t t = 0; t < equation.terms.size(); ++t) {
      const Estimate& c = equation.terms[t].coefficient;
      if (!(c.sd > 0)) continue;
      const auto named = [&](const auto& p) {
        return p.first == equation.lhs + ": " + equation.terms[t].function || p.first == equation.terms[t].function;
      };
      auto at = std::ranges::find_if(model_.parameters, named);
      // k1 of "-k1 x": a parameter of the coefficient's size and deviation.
      if (at == model_.parameters.end() && stated)
        at = std::ranges::find_if(model_.parameters, [&](const auto& p) { return same_size(p.second, c); });
      const std::ptrdiff_t index = at == model_.parameters.end() ? -1 : at - model_.parameters.begin();
      std::size_t same = places_.size();
      for (std::size_t k = 0; index < 0 && k < places_.size(); ++k)
        if (same_size({values[k], sds[k], 0, 0}, c)) same = k;
      for (std::size_t k = 0; index >= 0 && k < places_.size(); ++k)
        if (parameter[k] == index) same = k;
      if (same == places_.size()) {
        places_.emplace_back();
        parameter.push_back(index);
        sds.push_back(c.sd);
        values.push_back(index >= 0 ? at->second.value : c.value);
      }
      const double sign = values[same] * c.value >= 0 ? 1 : -1;
      places_[same].push_back({e, t, sign});
      joint = joint && index >= 0;
    }
  }
  const auto count = static_cast<Index>(places_.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  for (Index i = 0; i < count; ++i) {
    covariance(i, i) = square(sds[static_cast<std::size_t>(i)]);
    if (!joint) continue;
    for (Index j = 0; j < count; ++j)
      covariance(i, j) =
          model_.parameter_covariance[static_cast<std::size_t>(parameter[static_cast<std::size_t>(i)]) * n +
                                      static_cast<std::size_t>(parameter[static_cast<std::size_t>(j)])];
  }
  if (count > 0) take(covariance);
}

IdentifiedModel ModelDraws::operator()() {
  IdentifiedModel drawn = model_;
  if (!any()) return drawn;
  Eigen::VectorXd white(root_.cols());
  for (double& x : white) x = normal_(random_);
  const Eigen::VectorXd change = root_ * white;
  if (!rotor_) {
    for (std::size_t k = 0; k < places_.size(); ++k)
      for (const Place& p : places_[k])
        drawn.equations[p.equation].terms[p.term].coefficient.value += p.sign * change[static_cast<Index>(k)];
    return drawn;
  }
  RotorModel& r = *drawn.rotor;
  r.k1 = std::max(r.k1 + change[0], 1e-9);
  r.k2 += change[1];
  r.c += change[2];
  r.eps += std::complex<double>(change[3], change[4]);
  for (std::size_t k = 0; k < further_.size(); ++k) {
    auto& [name, e] = drawn.parameters[further_[k]];
    const double by = change[static_cast<Index>(5 + k)];
    e.value += by;
    if (name == "k1_conj_re") r.k1_conj += by;
    if (name == "k1_conj_im") r.k1_conj += std::complex<double>(0, by);
    if (name == "c_conj_re") r.c_conj += by;
    if (name == "c_conj_im") r.c_conj += std::complex<double>(0, by);
    move_mode(name, by, r);
  }
  return drawn;
}

}  // namespace whirl::pages
