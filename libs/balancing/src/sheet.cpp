#include "whirl/balancing/sheet.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/diagnosis/standards.hpp"
#include "whirl/report/units.hpp"

namespace whirl::balancing {
namespace {

using Eigen::Index;

std::string number(double value, int digits = 3) { return report::format_number(value, digits); }

/// The unit in which balancers read the quantity.
report::Unit unit_of(const BalancingSheet& s) {
  if (s.unit == "mil") return {"mil", 25.4e-6};
  if (s.unit == "in_s") return {"in/s", 25.4e-3};
  if (s.unit == "g") return {"g", 9.80665};
  switch (s.quantity) {
    case Quantity::velocity:
      return {"mm/s", 1e-3};
    case Quantity::acceleration:
      return {"m/s²", 1};
    default:
      return {"µm", 1e-6};
  }
}

std::string degrees(double rad) {
  if (std::isnan(rad)) return "–";
  double d = std::fmod(rad / kRadPerDegree, 360);
  if (d < 0) d += 360;
  return report::format_fixed(d, 1);
}

std::string interval(const Estimate& e, double factor) {
  if (std::isnan(e.low)) return "not known";
  return number(e.low * factor) + (std::isinf(e.high) ? " or more" : " to " + number(e.high * factor));
}

std::string angle_interval(const Estimate& e) {
  if (std::isnan(e.low)) return "not known";
  if (e.high - e.low >= 2 * std::numbers::pi - 1e-9) return "any";
  return "± " + report::format_fixed((e.high - e.low) / 2 / kRadPerDegree, 1);
}

report::Table masses(const BalancingSheet& s) {
  report::Table t;
  t.caption = s.next.empty() ? "Masses to add to the rotor as found (trial masses taken off)"
                             : "Best masses by all runs, on the rotor as found";
  t.columns = {{"plane", "", report::Align::left},
               {"mass", "g"},
               {"95 % interval", "g"},
               {"angle", "deg"},
               {"95 % interval", "deg"},
               {"put in", "", report::Align::left},
               {"independent", "%"}};
  for (const auto& p : s.planes) {
    std::string placed;
    for (const auto& [mass, angle] : p.placed)
      placed += (placed.empty() ? "" : "; ") + number(mass * 1e3) + " g at " + degrees(angle);
    t.add({p.name, number(p.mass.value * 1e3), interval(p.mass, 1e3), degrees(p.angle.value), angle_interval(p.angle),
           placed.empty() ? "as computed" : placed, report::format_fixed(100 * p.independent, 0)});
  }
  t.notes = {s.convention};
  return t;
}

char stated_zone(double reading, const std::vector<double>& limits) {
  for (std::size_t k = 0; k < limits.size(); ++k)
    if (reading <= limits[k]) return static_cast<char>('A' + k);
  return 'D';
}

report::Table budget(const BalancingSheet& s) {
  report::Table t;
  t.caption = "Residual unbalance with its errors (95 %), all in g mm";
  t.columns = {{"plane", "", report::Align::left},
               {"residual", ""},
               {"scatter", ""},
               {"mass", ""},
               {"angle", ""},
               {"radius", ""},
               {"error", ""},
               {"permitted", ""},
               {fmt::format("G {:g}", s.grade), "", report::Align::left}};
  for (const auto& p : s.planes) {
    if (!p.budget) continue;
    const diagnosis::PlaneBudget& b = *p.budget;
    const auto g_mm = [](double v) { return std::isnan(v) ? std::string("not known") : number(v * 1e6); };
    t.add({p.name, g_mm(b.residual), g_mm(b.scatter), g_mm(b.mass), g_mm(b.angle), g_mm(b.radius), g_mm(b.error),
           g_mm(b.permitted),
           b.tolerance == diagnosis::Tolerance::held       ? "held"
           : b.tolerance == diagnosis::Tolerance::not_held ? "not held"
                                                           : "undecided"});
  }
  t.notes = {
      "permitted: mass G / speed (ISO 21940-11) shared alike by the planes; errors add by the root of the squares; "
      "held: "
      "residual + error within it"};
  return t;
}

report::Table readings(const BalancingSheet& s) {
  report::Table t;
  t.caption = "Readings of the rotor as found, and predicted with the masses above";
  const report::Unit unit = unit_of(s);
  const std::string shown = unit.symbol + " " + s.amplitude;
  const bool shaft = s.quantity == Quantity::displacement;
  t.columns = {{"reading", "", report::Align::left},
               {"measured as found", shown},
               {"fitted as found", shown},
               {"phase", "deg"},
               {"predicted after", shown},
               {"95 % interval", unit.symbol},
               {"zone", ""}};
  for (const auto& r : s.rows) {
    std::string zone = "–";
    if (!s.zones.empty())
      zone = std::string{stated_zone(r.before.value, s.zones)} + " → " + stated_zone(r.after.value, s.zones);
    else if (shaft && s.amplitude_stated && r.speed > 0)
      zone = std::string{diagnosis::shaft_vibration_zone(r.before_pp, r.speed)} + " → " +
             diagnosis::shaft_vibration_zone(r.after_pp, r.speed);
    t.add({r.name, std::isnan(r.measured) ? "–" : number(r.measured / unit.factor),
           number(r.before.value / unit.factor), degrees(r.before_phase), number(r.after.value / unit.factor),
           interval(r.after, 1 / unit.factor), zone});
  }
  t.notes = {
      "As found: no masses of this job on the rotor. Measured: mean of the runs without a mass. Fitted: by all runs; "
      "zones "
      "compare it with what is predicted.",
      !shaft ? "no zones: those of housing vibration (ISO 20816-3) depend on the group of the machine and are of the "
               "whole velocity from 10 Hz to 1 kHz, not of its 1X part"
      : s.zones.empty() && !s.amplitude_stated
          ? "no zones: it is not stated whether the amplitudes are peak, pp or rms (--amplitude)"
      : s.zones.empty() ? "zones of ISO 20816-3 (shaft vibration) of the 1X part alone: guidance, not a statement of "
                          "compliance"
                        : "zones by the stated limits, of the 1X part alone"};
  return t;
}

report::Table coefficients(const BalancingSheet& s) {
  report::Table t;
  t.caption = "Influence coefficients";
  t.columns = {{"reading", "", report::Align::left},
               {"plane", "", report::Align::left},
               {"magnitude", unit_of(s).symbol + " " + s.amplitude + "/g"},
               {"sd", unit_of(s).symbol + "/g"},
               {"phase", "deg"}};
  for (const auto& c : s.influence)
    t.add({c.row, c.plane, number(c.magnitude * 1e-3 / unit_of(s).factor),
           std::isnan(c.sd) ? "not known" : number(c.sd * 1e-3 / unit_of(s).factor, 2), degrees(c.phase)});
  return t;
}

report::Table check(const BalancingSheet& s) {
  report::Table t;
  t.caption = "Check: the last run against what the earlier runs predict";
  t.columns = {{"reading", "", report::Align::left},
               {"predicted", unit_of(s).symbol + " " + s.amplitude},
               {"95 % interval", unit_of(s).symbol},
               {"measured", unit_of(s).symbol + " " + s.amplitude},
               {"vector inside", "", report::Align::left}};
  for (std::size_t m = 0; m < s.check.size(); ++m)
    t.add({m < s.rows.size() ? s.rows[m].name : "", number(s.check[m].predicted.value / unit_of(s).factor),
           interval(s.check[m].predicted, 1 / unit_of(s).factor), number(s.check[m].measured / unit_of(s).factor),
           std::isnan(s.check[m].predicted.low) ? "not known"
           : s.check[m].inside                  ? "yes"
                                                : "no"});
  return t;
}

report::Table left_out(const BalancingSheet& s) {
  report::Table t;
  const report::Unit unit = unit_of(s);
  const std::string shown = unit.symbol + " " + s.amplitude;
  t.caption = "Leave-one-state-out: each state predicted from the runs of the others";
  t.columns = {{"runs", "", report::Align::left},
               {"reading", "", report::Align::left},
               {"predicted", shown},
               {"measured", shown},
               {"rms error of the vectors", shown}};
  for (const auto& state : s.left_out) {
    Index m = 0;
    if (state.told) state.measured.maxCoeff(&m);
    const auto i = static_cast<std::size_t>(m);
    t.add({state.runs, state.told && i < s.rows.size() ? s.rows[i].name : "",
           state.told ? number(state.foretold[m] / unit.factor) : "not predictable from the others",
           state.told ? number(state.measured[m] / unit.factor) : "–",
           state.told ? number(state.error / unit.factor, 2) : "–"});
  }
  t.notes = {std::isnan(s.left_out_error)
                 ? std::string("no state can be predicted from the others")
                 : fmt::format("the largest reading of each state; rms error of all {} {}, {:.0f} % of the reading",
                               number(s.left_out_error / unit.factor, 2), shown, 100 * s.left_out_share)};
  return t;
}

report::Figure polar(const BalancingSheet& s) {
  report::Figure figure;
  figure.title = "Readings before and after";
  figure.description = "Polar plots of every reading in all runs, before and predicted after the correction.";
  figure.columns = 2;
  const double sign = s.lag ? -1 : 1;
  for (Index m = 0; m < s.before.size(); ++m) {
    report::Panel& panel =
        figure.panel(s.rows[static_cast<std::size_t>(m)].name, {s.lag ? "phase lag" : "phase lead", report::kDegree},
                     {fmt::format("amplitude {}, phase {}", s.amplitude, s.lag ? "lag" : "lead"), unit_of(s)});
    panel.kind = report::Panel::Kind::polar;
    panel.clockwise = s.lag;  // vectors stand as they are, rotation counter-clockwise
    Eigen::VectorXd angle(static_cast<Index>(s.runs.size())), radius(angle.size());
    Index n = 0;
    for (const auto& [name, v] : s.runs) {
      if (std::isnan(std::abs(v[m]))) continue;
      angle[n] = sign * std::arg(v[m]);
      radius[n++] = s.kind * std::abs(v[m]);
    }
    const auto point = [&](std::complex<double> z) {
      return std::pair(Eigen::VectorXd::Constant(1, sign * std::arg(z)),
                       Eigen::VectorXd::Constant(1, s.kind * std::abs(z)));
    };
    panel.scatter("runs", angle.head(n), radius.head(n), {.color = 7, .mark = report::Mark::circle});
    panel.scatter("as found", point(s.before[m]).first, point(s.before[m]).second,
                  {.color = 1, .mark = report::Mark::square});
    panel.scatter("predicted", point(s.after[m]).first, point(s.after[m]).second,
                  {.color = 0, .mark = report::Mark::diamond});
  }
  return figure;
}

}  // namespace

report::Document balancing_sheet(const BalancingSheet& s) {
  report::Document d;
  d.title = "Balancing sheet";
  d.subtitle = s.title;
  if (!s.next.empty()) d.key_values(s.next);
  const report::Unit unit = unit_of(s);
  const auto shown = [&](double value, int digits) { return number(value / unit.factor, digits) + " " + unit.symbol; };
  d.table(masses(s));
  d.table(readings(s));
  if (!s.check.empty()) d.table(check(s));
  if (!s.left_out.empty()) d.table(left_out(s));
  if (!s.planes.empty() && s.planes[0].budget) d.table(budget(s));
  std::vector<std::pair<std::string, std::string>> items = {
      {"criterion",
       s.criterion +
           (s.criterion == "min-max"
                ? ": largest reading (masses as computed) " + shown(s.objective, 4) + " " + s.amplitude +
                      ", no masses within the limits can be below " + shown(s.bound, 4)
                : ": root of the sum of squares (masses as computed) " + shown(s.objective, 4) + " " + s.amplitude)},
      {"repeatability", std::isnan(s.repeatability) ? "not known: no run was nearly repeated"
                                                    : fmt::format("{} per component, {:.0f} % of the reading",
                                                                  shown(s.repeatability, 2), 100 * s.repeat_share)},
      {"drift over the job",
       s.drift > 0 ? "at most " + shown(s.drift, 2) + ", taken off" : "not fitted (too few runs)"}};
  d.key_values(std::move(items));
  d.summary(s.summary, "the runs");
  d.table(coefficients(s));
  if (!s.runs.empty()) d.figure(polar(s), "Readings of every run, as found and predicted after the correction.");
  return d;
}

}  // namespace whirl::balancing
