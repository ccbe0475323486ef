#include "whirl/identify/rotor_terms.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

#include "terms/catalogue.hpp"
#include "whirl/core/error.hpp"

namespace whirl::identification {

std::span<const TermEntry* const> term_catalogue() {
  static const std::vector<const TermEntry*> entries = [] {
    using namespace terms;
    std::vector<const TermEntry*> list;
#define TERM(name) list.push_back(&name())
#include "terms/list.hpp"
#undef TERM
    return list;
  }();
  return entries;
}

namespace {

/// Of the forces, the one with that parameter.
std::optional<RotorTerm> find_force(std::string_view parameter) {
  for (const TermEntry* entry : term_catalogue()) {
    for (std::size_t part = 0; entry->force != nullptr && part < entry->parameters.size(); ++part)
      if (entry->parameters[part].name == parameter) return RotorTerm{entry, part};
  }
  return std::nullopt;
}

}  // namespace

RotorTerm force_term(std::string_view parameter) {
  const std::optional<RotorTerm> term = find_force(parameter);
  if (!term) throw Error(fmt::format("'{}' is no parameter of a force", parameter));
  return *term;
}

bool is_force_parameter(std::string_view name) { return find_force(name).has_value(); }

std::string_view to_string(Decider decider) {
  switch (decider) {
    case Decider::dc_coupling:
      return "the data sheet of the pickup and its integrator, or a record with DC coupling";
    case Decider::one_clock:
      return "displacement and angle by one recorder";
    case Decider::second_run:
      return "a second run: what changed at one instant stays changed";
    case Decider::probes:
      return "calibrate the probes, or pull the shaft along x and along y";
    case Decider::another_rate:
      return "a run-up after the run-down, or a run at another rate";
    case Decider::free_decay:
      return "a free decay (impact) at rest and at speed, or a run over another speed range";
    case Decider::unbalance:
      return "a run with more unbalance";
    case Decider::hammer_test:
      return "a hammer test (--modes), or a second plane of probes";
  }
  return "?";
}

std::vector<TermText> term_text(const RotorTerm& term, bool x) {
  const TermAxis axis = x ? TermAxis{x, "X1", "X2", "X3", "X4", -1} : TermAxis{x, "X3", "X4", "X1", "X2", 1};
  return term.entry->text(axis, term);
}

std::vector<RotorTerm> terms_of(const IdentifiedModel& model) {
  std::vector<RotorTerm> terms;
  for (const TermEntry* entry : term_catalogue()) {
    for (std::size_t part = 0; entry->force != nullptr && part < entry->parameters.size(); ++part) {
      const Estimate* value = model.parameter(std::string(entry->parameters[part].name));
      if (value == nullptr) continue;
      const Estimate* reference = model.parameter(std::string(entry->reference_name));
      terms.push_back({entry, part, value->value, reference != nullptr ? reference->value : 0});
    }
  }
  return terms;
}

std::string names_of(const std::vector<RotorTerm>& terms) {
  std::string names;
  for (auto term = terms.begin(); term != terms.end(); ++term) {
    if (std::any_of(terms.begin(), term, [&](const RotorTerm& t) { return t.is(*term->entry); })) continue;
    names += (names.empty() ? "" : ", ") + std::string(term->entry->label);
  }
  return names;
}

double unstable_from(const RotorModel& rotor, const std::vector<RotorTerm>& terms, double most) {
  constexpr int kSteps = 1000;
  // The part of the terms in small motion about rest: x'' and y'' by x, y, x', y'.
  const auto linear = [&](double w) {
    Eigen::Matrix<double, 2, 4> sum = Eigen::Matrix<double, 2, 4>::Zero();
    for (const RotorTerm& term : terms) {
      if (term.entry->dry) continue;
      const double time = term.entry->by_reference != nullptr ? INFINITY : term.reference;  // after a change
      const TermForce f = term_force(term, {.w = w, .time = time});
      Eigen::Matrix<double, 2, 4> more;
      more << f.x_x, f.x_y, f.x_vx, f.x_vy, f.y_x, f.y_y, f.y_vx, f.y_vy;
      sum += term.value * more;
    }
    return sum;
  };
  const auto growth = [&](double w) {
    Eigen::Matrix4d a = Eigen::Matrix4d::Zero();
    a.topRightCorner<2, 2>().setIdentity();
    const double kr = rotor.k1_conj.real(), ki = rotor.k1_conj.imag(), cr = rotor.c_conj.real(),
                 ci = rotor.c_conj.imag();
    a.bottomRows<2>() << -rotor.k1 - kr, -ki, -rotor.c - cr, -ci, -ki, -rotor.k1 + kr, -ci, -rotor.c + cr;
    a.bottomRows<2>() += linear(w);
    return Eigen::MatrixXd(a).eigenvalues().real().maxCoeff();
  };
  const int steps = linear(0) != linear(most) ? kSteps : 0;
  for (int k = 0; k <= steps; ++k) {
    const double w = most * k / kSteps;
    if (growth(w) > 0) return w;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace whirl::identification
