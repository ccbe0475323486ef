#include "whirl/pages/text/identification.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "whirl/io/model_json.hpp"
#include "whirl/pages/estimate_text.hpp"
#include "whirl/report/equation.hpp"

namespace whirl::pages {
namespace {

std::string show(const std::vector<identification::StateScore>& scores, const std::string& unit) {
  const std::string in = unit.empty() ? "" : " " + unit;
  std::vector<std::string> parts;
  for (const identification::StateScore& s : scores) {
    parts.push_back(std::isfinite(s.rmse) ? fmt::format("{} {:.3g}{} ({:.2g} %, noise {:.3g}{})", s.state, s.rmse, in,
                                                        100 * s.nrmse, s.noise, in)
                                          : fmt::format("{} diverges", s.state));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace

std::string to_text(const IdentifiedModel& model) {
  std::string text = fmt::format("method: {}\n", model.method);
  for (const Equation& equation : model.equations) {
    // x' = x' and X1' = X2 say no more than the names do.
    const bool kinematic =
        equation.terms.size() == 1 && equation.terms[0].coefficient.sd == 0 &&
        (equation.terms[0].function == equation.lhs || equation.lhs == "X1'" || equation.lhs == "X3'");
    if (kinematic) continue;
    text += report::to_text(equation, report::names_of(model)) + "\n";
  }
  for (const auto& [name, value] : model.parameters) {
    if (!report::names_term(model, name))
      text += fmt::format("{:18} {}\n", name, estimate_text(value, io::parameter_unit(name)));
  }
  for (const InputTiming& t : model.timing) {
    text +=
        fmt::format("input {:12} hold {}, dead time {}\n", t.input, to_string(t.hold), estimate_text(t.dead_time, "s"));
  }
  if (!model.rotor && !model.equations.empty()) text += "\n" + report::to_text(report::coefficient_table(model)) + "\n";
  return text;
}

std::string to_text(const identification::Evidence& evidence, const Summary& summary,
                    const std::vector<Ambiguity>& ambiguities) {
  std::string text;
  text += std::isfinite(summary.chi_square)
              ? fmt::format("chi^2             {:.3g} (1: the model explains the records down to their noise)\n",
                            summary.chi_square)
              : std::string(
                    "chi^2             not known (noise cannot be determined from this record, or no free run was "
                    "fitted)\n");
  if (std::isfinite(summary.condition_number))
    text += fmt::format("condition number  {:.3g}\n", summary.condition_number);
  for (const identification::BoundOutcome& b : evidence.bounds) {
    text += fmt::format(
        "sign bound        {}: {} {} 0 {}\n", b.equation, b.function, b.sign > 0 ? ">=" : "<=",
        b.active ? fmt::format("is active: held at 0, no interval; without the bound about {:.3g} (t {:.3g})",
                               b.unbounded, b.t)
        : b.kept ? "is not active: the term is in the model"
                 : "is not active: the term is not needed");
  }
  if (evidence.trapping) {
    const identification::Trapping& t = *evidence.trapping;
    text += fmt::format(
        "trapping          every motion ends within {:.4g} of {} = {:.4g}{}; largest eigenvalue there {:.4g} 1/s\n",
        t.radius, fmt::join(t.states, ", "), fmt::join(t.shift, ", "),
        std::all_of(t.weights.begin(), t.weights.end(), [](double w) { return w == 1; })
            ? ""
            : fmt::format(" (squares weighted {:.4g})", fmt::join(t.weights, ", ")),
        t.eigenvalue);
  }
  if (evidence.collinear.empty()) {
    text += "collinear         no group of terms (all condition indices below 30)\n";
  }
  for (const identification::CollinearGroup& g : evidence.collinear) {
    text += fmt::format("collinear         {}{}: hard to tell apart on these records (condition index {:.3g})\n",
                        g.equation.empty() ? "" : g.equation + ": ", fmt::join(g.terms, ", "), g.condition_index);
  }
  for (const std::string& a : evidence.assumptions) text += fmt::format("assumed           {}\n", a);
  for (const Ambiguity& a : ambiguities) {
    text += fmt::format("not distinguished {}\n                  {}\n                  to decide: {}\n", a.readings,
                        a.consequence, a.experiment);
  }
  const identification::HeldOut& h = evidence.held_out;
  if (!h.reason.empty()) {
    text += fmt::format("held out          {}: no prediction, {}\n", h.what, h.reason);
  } else if (!h.scores.empty()) {
    text += fmt::format("held out          {}, predicted by a model of the rest; free-run error, rms:\n", h.what);
    if (h.horizon > 0) text += fmt::format("  restarted every {:.3g} s: {}\n", h.horizon, show(h.near, h.unit));
    text += fmt::format("  one free run: {}\n", show(h.scores, h.unit));
  }
  return text;
}

}  // namespace whirl::pages
