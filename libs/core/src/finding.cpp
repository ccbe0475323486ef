#include "whirl/core/finding.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "whirl/core/nan.hpp"

namespace whirl {
namespace {

struct CodeText {
  FindingCode code;
  std::string_view name;
  std::string_view
      trust;  ///< why the result is not to be trusted, after "Do not trust this model beyond these records: "
};

constexpr std::array kCodes{
    CodeText{FindingCode::motion_unexplained, "motion_unexplained", "it leaves motion unexplained."},
    CodeText{FindingCode::model_error, "model_error", ""},
    CodeText{FindingCode::held_out_not_predicted, "held_out_not_predicted", "it does not predict a part held out."},
    CodeText{FindingCode::held_out_diverges, "held_out_diverges", "it diverges on a part held out."},
    CodeText{FindingCode::held_out_missed, "held_out_missed", "it does not predict a part held out to the noise."},
    CodeText{FindingCode::held_out_not_tried, "held_out_not_tried", "nothing tests it."},
    CodeText{FindingCode::parameter_differs, "parameter_differs", "parts of them give different parameters."},
    CodeText{FindingCode::parts_differ, "parts_differ", "parts of them give different coefficients."},
    CodeText{FindingCode::term_too_large, "term_too_large", "a term of a size that rotors do not have drives it."},
    CodeText{FindingCode::inertia_impossible, "inertia_impossible", "no disc has its moments of inertia."},
    CodeText{FindingCode::model_not_trusted, "model_not_trusted", "it comes from a model that is not to be trusted."},
    CodeText{FindingCode::part_left_out, "part_left_out", "it lacks a part of the model."},
    CodeText{FindingCode::readings_differ, "readings_differ", "its records allow another reading."},
    CodeText{FindingCode::held_out_cannot_check, "held_out_cannot_check", "nothing tests it."},
    CodeText{FindingCode::work_limit, "work_limit", "the fit ended at its limit of work."},
    CodeText{FindingCode::freedom_spent, "freedom_spent", ""},
    CodeText{FindingCode::option_not_taken, "option_not_taken", ""},
    CodeText{FindingCode::not_repeatable, "not_repeatable", ""},
    CodeText{FindingCode::run_contradicted, "run_contradicted", ""},
    CodeText{FindingCode::runs_undecided, "runs_undecided", ""},
    CodeText{FindingCode::angles_reversed, "angles_reversed", ""},
    CodeText{FindingCode::scatter_unknown, "scatter_unknown", ""},
    CodeText{FindingCode::sense_not_stated, "sense_not_stated", ""},
    CodeText{FindingCode::answer_ambiguous, "answer_ambiguous", ""},
    CodeText{FindingCode::requirement_missed, "requirement_missed", ""},
    CodeText{FindingCode::sliding_bound_missed, "sliding_bound_missed", ""},
};

/// " (k1_drift 3.2 1/s^3, e_2 12 um)"; empty without amounts.
std::string amounts_text(const std::vector<Amount>& amounts) {
  std::string out;
  for (const Amount& a : amounts) {
    out +=
        fmt::format("{}{} {:.3g}{}{}", out.empty() ? " (" : ", ", a.name, a.value, a.unit.empty() ? "" : " ", a.unit);
  }
  return out.empty() ? out : out + ")";
}

/// With as many digits as show the value on the wrong side of its limit.
std::string missed_requirement(const Finding& f, const std::string& unit) {
  const bool most = std::isnan(f.amount("least"));
  const double value = f.amount("value"), limit = f.amount(most ? "most" : "least");
  const auto digits = [](double v, int n) { return fmt::format("{:.{}g}", v, n); };
  int n = 3;
  while (n < 17 && value != limit && digits(value, n) == digits(limit, n)) ++n;
  return fmt::format("{} {}{}: must be at {} {}{}", f.where, digits(value, n), unit, most ? "most" : "least",
                     digits(limit, n), unit);
}

std::string spare_runs(const Finding& f) {
  const double spare = f.amount("spare");
  return spare < 1 ? "no spare run" : fmt::format("{:.0f} spare run{}", spare, spare < 2 ? "" : "s");
}

/// Findings of the runs of a balancing job.
std::string balancing_text(const Finding& f) {
  const auto of = [&f](std::string_view name) { return f.amount(name); };
  switch (f.code) {
    case FindingCode::freedom_spent:
      return fmt::format(
          "{} leaves {} to show the scatter: a wrong reading may hide in it; make another run, or leave the option out",
          f.where, spare_runs(f));
    case FindingCode::option_not_taken:
      return fmt::format("{} is not fitted: it would leave {}; make another run, or state the option", f.where,
                         spare_runs(f));
    case FindingCode::not_repeatable:
      return fmt::format(
          "the machine does not repeat: runs with nearly the same masses ({}) differ by {:.0f} % of the reading; no "
          "run is left out, and the intervals hold the scatter",
          f.where, 100 * of("share"));
    case FindingCode::run_contradicted:
      return fmt::format("run {} contradicts the others", f.where);
    case FindingCode::runs_undecided:
      return fmt::format("runs {} contradict each other and nothing tells which is wrong: repeat one of them", f.where);
    case FindingCode::angles_reversed:
      return "the runs agree far better when every mass angle is counted the other way: looks as if angles and phases "
             "are counted in opposite senses; check the convention";
    case FindingCode::scatter_unknown:
      return "no run repeats another: the scatter is not known and no interval can be given; repeat the "
             "run as found, or state the noise";
    case FindingCode::sense_not_stated:
      return fmt::format(
          "--phase and --angles are not both stated: phases are taken as lag, mass angles as counted with the "
          "rotation. "
          "If one of the two is the other way, the answer is {}",
          f.where);
    case FindingCode::answer_ambiguous:
      return fmt::format("the amplitudes fit other masses as well: {}; one run with these masses decides", f.where);
    default:
      return {};
  }
}

/// Findings of a controller.
std::string controller_text(const Finding& f) {
  const auto of = [&f](std::string_view name) { return f.amount(name); };
  const std::string unit = f.amounts.empty() || f.amounts.front().unit.empty() ? "" : " " + f.amounts.front().unit;
  switch (f.code) {
    case FindingCode::requirement_missed:
      if (std::isnan(of("value"))) return f.where;
      return missed_requirement(f, unit);
    case FindingCode::sliding_bound_missed:
      return fmt::format(
          "eq. 42 of the paper does not hold{}: switching gain {:.3g} m/s^2, disturbance up to {:.3g} m/s^2; the "
          "argument by V = S^2/2 does not show that the sliding surface is reached",
          f.where, of("switching gain"), of("disturbance"));
    default:
      return {};
  }
}

const CodeText& entry(FindingCode code) {
  for (const CodeText& c : kCodes)
    if (c.code == code) return c;
  return kCodes.front();
}

}  // namespace

std::string_view to_string(FindingCode code) { return entry(code).name; }

std::string_view to_string(Consequence consequence) {
  switch (consequence) {
    case Consequence::note:
      return "note";
    case Consequence::warning:
      return "warning";
    case Consequence::no_trust:
      return "no_trust";
    case Consequence::unusable:
      return "unusable";
  }
  return "";
}

double Finding::amount(std::string_view name) const {
  for (const Amount& a : amounts)
    if (a.name == name) return a.value;
  return kNaN;
}

std::string text(const Finding& f) {
  const auto of = [&f](std::string_view name) { return f.amount(name); };
  switch (f.code) {
    case FindingCode::motion_unexplained:
      return fmt::format("{} {:.0f} % of the motion unexplained beyond the noise", f.where, 100 * of("share"));
    case FindingCode::model_error:
      return fmt::format(
          "model error: chi-square {:.2f} (1 when the model fits){}", of("chi_square"),
          std::isfinite(of("share")) ? fmt::format(", {:.2g} % of the motion unexplained", 100 * of("share")) : "");
    case FindingCode::held_out_not_predicted:
      return fmt::format("a model of the rest does not predict {}: error {:.0f} % of the motion beyond the noise",
                         f.where, 100 * of("share"));
    case FindingCode::held_out_diverges:
      return fmt::format("the free run of a model of the rest diverges on {}", f.where);
    case FindingCode::held_out_missed:
      return fmt::format("a model of the rest predicts {} with an error of {:.3g} rms, {:.1f} times the noise", f.where,
                         of("rmse"), of("rmse") / of("noise"));
    case FindingCode::held_out_not_tried:
      return "no prediction of " + f.where;
    case FindingCode::parameter_differs:
      if (std::isfinite(of("record"))) {
        const bool metres = f.amounts.front().unit == "m";
        const double by = metres ? 1e6 : 1;
        return fmt::format(
            "{} is {:.4g} {unit} in this record and {:.4g} {unit} in the model, {:.1f} standard "
            "deviations apart",
            f.where, by * of("record"), by * of("model"), of("deviations"),
            fmt::arg("unit", metres ? "um" : f.amounts.front().unit));
      }
      return fmt::format(
          "{} is {:.5g} by all records and {:.5g} without the part held out, {:.1f} standard "
          "deviations apart: they do not follow one model",
          f.where, of("all"), of("rest"), of("deviations"));
    case FindingCode::parts_differ:
      return fmt::format(
          "parts of the records give different coefficients: {}, {:.1f} standard deviations apart: the "
          "system changed, or something acts on a part of them only; intervals hold both",
          f.where, of("deviations"));
    case FindingCode::term_too_large:
      return fmt::format(
          "{} is {:.2g} times what rotors with such a term have: it represents something that the model lacks, and "
          "biases other parameters",
          f.where, of("ratio"));
    case FindingCode::inertia_impossible:
      return fmt::format(
          "polar_ratio is {:.3g}: that of a disc lies between 0 and 2; the tilt represents something that the model "
          "lacks, and biases other parameters",
          of("polar_ratio"));
    case FindingCode::work_limit:
      return fmt::format("the fit of {} ended at its limit of work{}: parts of the result may be missing", f.where,
                         amounts_text(f.amounts));
    case FindingCode::model_not_trusted:
      return "the model it is designed on is not to be trusted: " + f.where;
    case FindingCode::part_left_out:
      return fmt::format("left out: {} of the model{}", f.where, amounts_text(f.amounts));
    case FindingCode::readings_differ:
      return fmt::format("the records allow another reading of the model, {}{}", f.where, amounts_text(f.amounts));
    case FindingCode::held_out_cannot_check:
      if (std::isfinite(of("instant")))
        return fmt::format(
            "the change at {:.4g} s cannot be checked: without {} the records do not hold both its sides",
            of("instant"), f.where);
      return fmt::format(
          "the resonance at {:.4g} Hz cannot be checked: without {} the records turn at {:.3g} to {:.3g} Hz{}",
          of("frequency"), f.where, of("low"), of("high"),
          std::isnan(of("share")) ? "" : fmt::format(" and show {:.0f} % of the largest motion", 100 * of("share")));
    case FindingCode::requirement_missed:
    case FindingCode::sliding_bound_missed:
      return controller_text(f);
    default:
      return balancing_text(f);
  }
}

std::string trust_text(const Finding& finding) {
  if (finding.consequence == Consequence::unusable && !controller_text(finding).empty())
    return "Do not use this controller.";
  if (finding.consequence == Consequence::unusable)
    return balancing_text(finding).empty() ? "Do not use this model." : "Do not use these masses.";
  if (finding.code == FindingCode::model_error)
    return fmt::format(
        "Do not trust this model beyond these records: chi-square is {:.3g} after the search for terms, "
        "so that something it does not have drives the motion.",
        finding.amount("chi_square"));
  return fmt::format("Do not trust this model beyond these records: {}", entry(finding.code).trust);
}

}  // namespace whirl
