#include "problem/rotor_equations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace whirl::identification::detail {

Estimate ParameterView::sum(const Combination& terms) const {
  double value = 0;
  for (const auto& [factor, name] : terms) {
    if (const Eigen::Index i = fit_.index(name); i >= 0) value += factor * fit_.values[i];
  }
  return Estimate::from_sd(value, std::sqrt(std::max(0.0, covariance(terms, terms))));
}

double ParameterView::covariance(const Combination& a, const Combination& b) const {
  double sum = 0;
  for (const auto& [fa, name_a] : a) {
    const Eigen::Index i = fit_.index(name_a);
    if (i < 0) continue;
    for (const auto& [fb, name_b] : b) {
      if (const Eigen::Index j = fit_.index(name_b); j >= 0) sum += fa * fb * fit_.covariance(i, j);
    }
  }
  return scale_ * sum;
}

std::pair<Estimate, Estimate> ParameterView::polar(const std::string& re, const std::string& im) const {
  const double a = (*this)[re].value, b = (*this)[im].value;
  const double size = std::hypot(a, b);
  Estimate magnitude = sum({{a / size, re}, {b / size, im}});
  Estimate turn = sum({{-b / (size * size), re}, {a / (size * size), im}});
  return {magnitude, Estimate::from_sd(std::atan2(b, a), turn.sd)};
}

double ParameterView::covariance(const std::string& a, const std::string& b) const {
  return scale_ * fit_.covariance(fit_.index(a), fit_.index(b));
}

namespace {

/// How far a parameter of the model moves with those of the fit; empty: it was not estimated.
ParameterView::Combination combination(const ParameterView& view, const IdentifiedModel& model,
                                       const std::string& name) {
  for (const bool phase : {false, true}) {
    const std::string stem = phase ? "e_phase" : "e";
    const std::string record = name == stem ? "" : name.starts_with(stem + "_") ? name.substr(stem.size()) : "-";
    const std::string re = "eps_re" + record, im = "eps_im" + record;
    if (!view.has(re)) continue;
    const double a = view[re].value, b = view[im].value, size = std::hypot(a, b);
    if (phase) return {{-b / (size * size), re}, {a / (size * size), im}};
    return {{a / size, re}, {b / size, im}};
  }
  const double k1 = model.parameter("k1")->value, root = std::sqrt(k1);
  if (name == "natural_frequency") return {{1 / (2 * root), "k1"}};
  if (name == "damping_ratio") return {{1 / (2 * root), "c"}, {-model.parameter("c")->value / (4 * k1 * root), "k1"}};
  if (name.starts_with("offset_")) return {{1, name.ends_with("_x") ? "offset_re" : "offset_im"}};
  if (view.has(name)) return {{1, name}};
  return {};
}

/// The equation of X2' (x) or X4'.
Equation axis_equation(const ParameterView& view, const OutputErrorFit& fit, bool x) {
  const bool k = view.has("k1_conj_re"), c = view.has("c_conj_re");
  const double sign = x ? -1 : 1;  // of the conj terms: -k_conj conj z = -(a x + b y) - i (b x - a y)
  const std::string own = x ? "X1" : "X3", other = x ? "X3" : "X1", v = x ? "X2" : "X4", w = x ? "X4" : "X2";
  Equation e{v + "'", {}};
  e.terms.push_back({own, view.sum({{-1, "k1"}, {sign, "k1_conj_re"}}), "1/s^2"});
  if (k) e.terms.push_back({other, view.sum({{-1, "k1_conj_im"}}), "1/s^2"});
  e.terms.push_back({own + "*(X1^2 + X3^2)", view.sum({{-1, "k2"}}), "1/(m^2 s^2)"});
  e.terms.push_back({v, view.sum({{-1, "c"}, {sign, "c_conj_re"}}), "1/s"});
  if (c) e.terms.push_back({w, view.sum({{-1, "c_conj_im"}}), "1/s"});
  const char* in_phase = x ? "X6^2*cos(X5) + X7*sin(X5)" : "X6^2*sin(X5) - X7*cos(X5)";
  const char* quadrature = x ? "X7*cos(X5) - X6^2*sin(X5)" : "X6^2*cos(X5) + X7*sin(X5)";
  for (const RotorTerm& term : fit.terms) {
    const std::string name(term.parameter());
    for (const auto& [function, factor] : term_text(term, x)) {
      // Rotating damping damps as c does: one term of the equation.
      const auto same = std::find_if(e.terms.begin(), e.terms.end(),
                                     [&, &f = function](const EquationTerm& t) { return t.function == f; });
      if (same != e.terms.end()) {
        same->coefficient = function == v ? view.sum({{-1, "c"}, {sign, "c_conj_re"}, {factor, name}})
                                          : view.sum({{-1, "k1_conj_im"}, {factor, name}});
      } else {
        e.terms.push_back({function, view.sum({{factor, name}}), std::string(term.unit())});
      }
    }
  }
  e.terms.push_back({in_phase, view["eps_re"], "m"});
  e.terms.push_back({quadrature, view["eps_im"], "m"});
  return e;
}

/// The machine itself: rotor, eccentricities, anisotropy, further forces, errors of the sensors.
NamedEstimates machine_parameters(const ParameterView& view, const OutputErrorFit& fit, Quantity quantity) {
  NamedEstimates p{{"k1", view["k1"]}, {"k2", view["k2"]}, {"c", view["c"]}};
  const auto [e, phase] = view.polar("eps_re", "eps_im");
  p.emplace_back("e", e);
  p.emplace_back("e_phase", phase);
  for (std::size_t r = 1; r < fit.records.size(); ++r) {
    const auto [er, pr] = view.polar(fmt::format("eps_re_{}", r + 1), fmt::format("eps_im_{}", r + 1));
    p.emplace_back(fmt::format("e_{}", r + 1), er);
    p.emplace_back(fmt::format("e_phase_{}", r + 1), pr);
    for (const char* change : {"k1_change", "c_change"}) {
      const std::string name = fmt::format("{}_{}", change, r + 1);
      if (view.has(name)) p.emplace_back(name, view[name]);
    }
  }
  const double k1 = view["k1"].value, root = std::sqrt(k1), damping = view["c"].value;
  p.emplace_back("natural_frequency", Estimate::from_sd(root, view["k1"].sd / (2 * root)));
  p.emplace_back("damping_ratio",
                 Estimate::from_sd(damping / (2 * root),
                                   view.sum({{1 / (2 * root), "c"}, {-damping / (4 * k1 * root), "k1"}}).sd));
  for (const char* name : {"k1_conj_re", "k1_conj_im", "c_conj_re", "c_conj_im"}) {
    if (view.has(name)) p.emplace_back(name, view[name]);
  }
  // Of an axis that no record shows there is none.
  const std::string offset = offset_name(quantity);
  if (view.has("offset_re") || !view.has("offset_im")) p.emplace_back(offset + "_x", view["offset_re"]);
  if (view.has("offset_im") || !view.has("offset_re")) p.emplace_back(offset + "_y", view["offset_im"]);
  for (const RotorTerm& term : fit.terms) {
    const std::string name(term.parameter()), reference(term.entry->reference_name);
    p.emplace_back(name, view[name]);
    const bool kept = std::any_of(p.begin(), p.end(), [&](const auto& q) { return q.first == reference; });
    if (term.reference != 0 && !kept)
      p.emplace_back(reference, view.has(reference) ? view[reference] : Estimate{term.reference, NAN, NAN, NAN});
  }
  for (const TermEntry* entry : term_catalogue()) {
    if (entry->sensor == nullptr) continue;
    const std::string name(entry->parameters[0].name);
    if (view.has(name)) p.emplace_back(name, view[name]);
  }
  if (fit.sensor.gain_drift != 0 && fit.sensor.drift_start != 0)
    p.emplace_back("sensor_drift_start", Estimate{fit.sensor.drift_start, NAN, NAN, NAN});
  return p;
}

/// What stands beside the rotor in the readings: delay, decays, runout, further modes.
void add_beside(const ParameterView& view, const OutputErrorFit& fit, NamedEstimates& p) {
  for (const char* name : {"delay", "clock_drift"})
    if (view.has(name)) p.emplace_back(name, view[name]);
  for (std::size_t j = 0; j < fit.decays.size(); ++j) {
    for (const auto& [part, name] : {std::pair("omega", "w"), std::pair("zeta", "zeta")}) {
      const std::string key = fmt::format("{}_decay{}", name, j + 1);
      const double v = *part == 'o' ? fit.decays[j].omega : fit.decays[j].zeta;
      p.emplace_back(fmt::format("decay{}_{}", j + 1, part), view.has(key) ? view[key] : Estimate{v, NAN, NAN, NAN});
    }
  }
  for (std::size_t j = 0; j < fit.records[0].runout.size(); ++j) {
    for (const char* part : {"_re", "_im"}) {
      const std::string name = fmt::format("runout{}{}{}", j / 2 + 1, j % 2 == 0 ? "+" : "-", part);
      p.emplace_back(name, view[name]);
    }
  }
  for (std::size_t j = 0; j < fit.model.modes.size(); ++j) {
    const ForcedMode& m = fit.model.modes[j];
    const std::string mode = fmt::format("mode{}", j + 1);
    const auto fixed = [](double v) { return Estimate{v, NAN, NAN, NAN}; };
    p.emplace_back(mode + "_omega", view.has("w_" + mode) ? view["w_" + mode] : fixed(m.omega));
    p.emplace_back(mode + "_zeta", view.has("zeta_" + mode) ? view["zeta_" + mode] : fixed(m.zeta));
    p.emplace_back(mode + "_re", view[mode + "_re"]);
    p.emplace_back(mode + "_im", view[mode + "_im"]);
  }
}

}  // namespace

SensorAxes sensor_of(const IdentifiedModel& model) {
  SensorAxes axes;
  for (const TermEntry* entry : term_catalogue()) {
    if (entry->sensor == nullptr) continue;
    if (const Estimate* e = model.parameter(std::string(entry->parameters[0].name))) axes.*entry->sensor = e->value;
  }
  if (const Estimate* start = model.parameter("sensor_drift_start")) axes.drift_start = start->value;
  return axes;
}

void describe_rotor(const ParameterView& view, const OutputErrorFit& fit, IdentifiedModel& model) {
  model.states = {"X1", "X2", "X3", "X4"};
  model.inputs = {"X5", "X6", "X7"};
  const Estimate one = Estimate::from_sd(1, 0);
  model.equations = {{"X1'", {{"X2", one, "1"}}},
                     axis_equation(view, fit, true),
                     {"X3'", {{"X4", one, "1"}}},
                     axis_equation(view, fit, false)};
  model.parameters = machine_parameters(view, fit, model.quantity);
  add_beside(view, fit, model.parameters);

  const char* five[] = {"k1", "k2", "c", "eps_re", "eps_im"};
  model.rotor_covariance.clear();
  for (const char* a : five) {
    for (const char* b : five) model.rotor_covariance.push_back(view.covariance(a, b));
  }
  model.rotor = fit.model;
  if (model.quantity != Quantity::displacement) model.rotor->offset = 0;  // they do not show where the rotor rests
}

std::string offset_name(Quantity quantity) {
  return quantity == Quantity::displacement ? "offset" : fmt::format("offset_{}", to_string(quantity));
}

void join_covariance(const ParameterView& view, IdentifiedModel& model) {
  const auto n = static_cast<Eigen::Index>(model.parameters.size());
  std::vector<ParameterView::Combination> of;
  for (const auto& [name, estimate] : model.parameters)
    of.push_back(std::isfinite(estimate.sd) ? combination(view, model, name) : ParameterView::Combination{});
  Eigen::MatrixXd joint(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j)
      joint(i, j) = view.covariance(of[static_cast<std::size_t>(i)], of[static_cast<std::size_t>(j)]);
  }
  // What was added to the five parameters of the rotor since the fit, as it was added: together.
  const char* five[] = {"k1", "k2", "c", "eps_re", "eps_im"};
  Eigen::MatrixXd more(5, 5), moves = Eigen::MatrixXd::Zero(n, 5);
  for (Eigen::Index a = 0; a < 5; ++a) {
    for (Eigen::Index b = 0; b < 5; ++b)
      more(a, b) = model.rotor_covariance[static_cast<std::size_t>(5 * a + b)] - view.covariance(five[a], five[b]);
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::string& name = model.parameters[static_cast<std::size_t>(i)].first;
      if (name != "k1" && name != "k2" && name != "c" && name != "e" && name != "e_phase") continue;
      for (const auto& [factor, part] : of[static_cast<std::size_t>(i)])
        if (part == five[a]) moves(i, a) += factor;
    }
  }
  joint += moves * more * moves.transpose();
  for (Eigen::Index i = 0; i < n; ++i) {
    const double sd = model.parameters[static_cast<std::size_t>(i)].second.sd;
    if (std::isfinite(sd)) joint(i, i) = std::max(joint(i, i), sd * sd);
  }
  model.parameter_covariance.assign(joint.data(), joint.data() + joint.size());
}

void widen_equations(const NamedEstimates& before, IdentifiedModel& model) {
  const auto added = [&](std::string_view name) {
    const Estimate* now = model.parameter(std::string(name));
    const auto was = std::ranges::find(before, name, &NamedEstimates::value_type::first);
    if (now == nullptr || was == before.end()) return 0.0;
    const double more = now->sd * now->sd - was->second.sd * was->second.sd;
    return more > 0 ? more : 0.0;
  };
  const double e = model.parameter("e")->value, phase = model.parameter("e_phase")->value;
  const double along = added("e"), across = e * e * added("e_phase");
  const double co = std::cos(phase) * std::cos(phase), si = 1 - co;
  const std::vector<std::pair<std::string_view, double>> by_function{
      {"X1", added("k1")},
      {"X1*(X1^2 + X3^2)", added("k2")},
      {"X2", added("c")},
      {"X3", added("k1")},
      {"X3*(X1^2 + X3^2)", added("k2")},
      {"X4", added("c")},
      {"X6^2*cos(X5) + X7*sin(X5)", co * along + si * across},
      {"X7*cos(X5) - X6^2*sin(X5)", si * along + co * across},
      {"X6^2*sin(X5) - X7*cos(X5)", co * along + si * across}};
  for (Equation& equation : model.equations) {
    const bool x = equation.lhs == "X2'";
    if (!x && equation.lhs != "X4'") continue;
    for (EquationTerm& term : equation.terms) {
      // Coupled terms hold the difference of the axes, not k1 and c.
      if (term.function == (x ? "X3" : "X1") || term.function == (x ? "X4" : "X2")) continue;
      double more = 0;
      for (const auto& [function, variance] : by_function) {
        if (term.function == function) more = variance;
      }
      // The quadrature of y is written as the phase of x.
      if (!x && term.function == "X6^2*cos(X5) + X7*sin(X5)") more = si * along + co * across;
      Estimate& c = term.coefficient;
      if (more > 0) c = Estimate::from_sd(c.value, std::sqrt(c.sd * c.sd + more));
    }
  }
}

}  // namespace whirl::identification::detail
