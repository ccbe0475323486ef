#include "whirl/identify/rotor_terms.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <complex>
#include <limits>

namespace whirl::identification {

std::string reference_name(const RotorTermName& name) {
  return name.kind == RotorTermKind::coulomb_friction ? "friction_speed" : "drift_start";
}

std::vector<TermText> term_text(const RotorTerm& term, bool x) {
  const std::string own = x ? "X1" : "X3", v = x ? "X2" : "X4", other = x ? "X3" : "X1", other_v = x ? "X4" : "X2";
  const double turn = x ? -1 : 1;  // of i z and i z'
  const std::string since = term.reference == 0 ? "t" : fmt::format("(t - {:.17g})", term.reference);
  switch (term.kind) {
    case RotorTermKind::quintic_stiffness:
      return {{own + "*(X1^2 + X3^2)^2", -1}};
    case RotorTermKind::cubic_per_axis:
      return {{own + "^3", -1}};
    case RotorTermKind::quadratic_damping:
      return {{v + "*sqrt(X2^2 + X4^2)", -1}};
    case RotorTermKind::coulomb_friction:
      return {{fmt::format("{}/sqrt(X2^2 + X4^2 + {:.17g})", v, term.reference * term.reference), -1}};
    case RotorTermKind::gyroscopic:
      return {{"X6*" + other_v, turn}};
    case RotorTermKind::rotating_damping:
      return {{v, -1}, {"X6*" + other, turn}};
    case RotorTermKind::cross_coupled:
      return {{other, turn}};
    case RotorTermKind::stiffness_with_speed:
      return {{"abs(X6)*" + own, -1}};
    case RotorTermKind::damping_with_speed:
      return {{"abs(X6)*" + v, -1}};
    case RotorTermKind::stiffness_drift:
      return {{since + "*" + own, -1}};
    case RotorTermKind::damping_drift:
      return {{since + "*" + v, -1}};
    case RotorTermKind::twice_forward_re:
      return {{x ? "X6^2*cos(2*X5)" : "X6^2*sin(2*X5)", 1}};
    case RotorTermKind::twice_forward_im:
      return {{x ? "X6^2*sin(2*X5)" : "X6^2*cos(2*X5)", turn}};
    case RotorTermKind::twice_backward_re:
      return {{x ? "X6^2*cos(2*X5)" : "X6^2*sin(2*X5)", -turn}};
    case RotorTermKind::twice_backward_im:
      return {{x ? "X6^2*sin(2*X5)" : "X6^2*cos(2*X5)", 1}};
  }
  return {};
}

std::vector<RotorTerm> terms_of(const IdentifiedModel& model) {
  std::vector<RotorTerm> terms;
  for (const RotorTermName& name : kRotorTermNames) {
    const Estimate* value = model.parameter(std::string(name.parameter));
    if (value == nullptr) continue;
    const bool refers = name.kind == RotorTermKind::coulomb_friction || name.kind == RotorTermKind::stiffness_drift ||
                        name.kind == RotorTermKind::damping_drift;
    const Estimate* reference = refers ? model.parameter(reference_name(name)) : nullptr;
    terms.push_back({name.kind, value->value, reference != nullptr ? reference->value : 0});
  }
  return terms;
}

std::string names_of(const std::vector<RotorTerm>& terms) {
  std::string names;
  for (auto term = terms.begin(); term != terms.end(); ++term) {
    const std::string_view label = name_of(term->kind).label;
    if (std::any_of(terms.begin(), term, [&](const RotorTerm& t) { return name_of(t.kind).label == label; })) continue;
    names += (names.empty() ? "" : ", ") + std::string(label);
  }
  return names;
}

namespace {

/// Of a term whose part in small motion about rest depends on the speed.
bool changes_with_speed(RotorTermKind kind) {
  return kind == RotorTermKind::gyroscopic || kind == RotorTermKind::rotating_damping ||
         kind == RotorTermKind::stiffness_with_speed || kind == RotorTermKind::damping_with_speed;
}

}  // namespace

double unstable_from(const RotorModel& rotor, const std::vector<RotorTerm>& terms, double most) {
  constexpr int kSteps = 1000;
  const auto growth = [&](double w) {
    // x, y, x', y' about rest.
    Eigen::Matrix4d a = Eigen::Matrix4d::Zero();
    a.topRightCorner<2, 2>().setIdentity();
    const double kr = rotor.k1_conj.real(), ki = rotor.k1_conj.imag(), cr = rotor.c_conj.real(),
                 ci = rotor.c_conj.imag();
    a.bottomRows<2>() << -rotor.k1 - kr, -ki, -rotor.c - cr, -ci, -ki, -rotor.k1 + kr, -ci, -rotor.c + cr;
    for (const RotorTerm& term : terms) {
      if (term.kind == RotorTermKind::coulomb_friction) continue;
      const TermForce f = term_force(term, 0, 0, 0, 0, w, 0, term.reference);
      Eigen::Matrix<double, 2, 4> more;
      more << f.x_x, f.x_y, f.x_vx, f.x_vy, f.y_x, f.y_y, f.y_vx, f.y_vy;
      a.bottomRows<2>() += term.value * more;
    }
    return a.eigenvalues().real().maxCoeff();
  };
  const int steps =
      std::ranges::any_of(terms, [](const RotorTerm& t) { return changes_with_speed(t.kind); }) ? kSteps : 0;
  for (int k = 0; k <= steps; ++k) {
    const double w = most * k / kSteps;
    if (growth(w) > 0) return w;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace whirl::identification
