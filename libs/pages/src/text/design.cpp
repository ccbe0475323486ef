#include "whirl/pages/text/design.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>

#include "whirl/tuning/delivered_delay.hpp"
#include "whirl/tuning/loop_margins.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::pages {
namespace {

/// The margins of a design by name; empty where it does not state one.
class Stated {
 public:
  explicit Stated(const ControllerDesign& design) : margins_(design.margins) {}
  std::optional<double> operator()(const char* name) const {
    const auto at = margins_.find(name);
    return at == margins_.end() ? std::nullopt : std::optional(at->second);
  }

 private:
  const std::map<std::string, double>& margins_;
};

std::string met(bool yes) { return yes ? "yes" : "NO"; }
std::string millimetres(double metres) { return fmt::format("{:.2g} mm", 1e3 * metres); }
std::string milliseconds(double seconds) { return fmt::format("{:.3g} ms", 1e3 * seconds); }

void add_loop_margins(const ControllerDesign& design, report::Table& t) {
  const Stated stated(design);
  const tuning::VerdictLimits limits;
  constexpr double kDegree = std::numbers::pi / 180;
  const std::string why = fmt::format("forced by a peak sensitivity of {:g}", limits.peak_sensitivity);
  if (const auto gain = stated("gain_margin"))
    t.add({"gain of the loop, up to", fmt::format("{:.2f} times", *gain),
           fmt::format("at least {:.2f} times", limits.gain_up()), met(*gain >= limits.gain_up()), why});
  if (const auto down = stated("gain_margin_down"))
    t.add({"gain of the loop, down to", fmt::format("{:.2g} times", *down < 0.005 ? 0 : *down),
           fmt::format("at most {:.2g} times", limits.gain_down()), met(*down <= limits.gain_down()), why});
  if (const auto delay = stated("delay_margin_s")) {
    const double least = limits.delay_samples * design.sample_time;
    std::string by;
    if (const auto limit = stated("delay_limit"))
      by = fmt::format(", limited by: {}", name_of(static_cast<tuning::DelayLimit>(static_cast<int>(*limit))));
    t.add({"further delay", milliseconds(*delay) + by, "at least " + milliseconds(least), met(*delay >= least),
           "half a tick of the loop"});
  }
  if (const auto phase = stated("phase_margin_deg"))
    t.add({"phase margin", fmt::format("{:.1f} deg", *phase),
           fmt::format("at least {:.1f} deg", limits.phase() / kDegree), met(*phase >= limits.phase() / kDegree), why});
  if (const auto peak = stated("peak_sensitivity"))
    t.add({"peak sensitivity", fmt::format("{:.1f}, zone {}", *peak, tuning::sensitivity_zone(*peak)),
           fmt::format("zone A or B, at most {:g}", limits.peak_sensitivity), met(*peak <= limits.peak_sensitivity),
           "ISO 14839-3: no limit of time"});
}

void add_motion(const ControllerDesign& design, report::Table& t) {
  const Stated stated(design);
  const auto open = stated("open_peak_m");
  if (const auto peak = stated("nominal_peak_m"); peak && open)
    t.add({"vibration, nominal run, peak", millimetres(*peak), "below " + millimetres(*open), met(*peak < *open),
           "without control"});
  if (const auto peak = stated("typical_peak_m"); peak && open)
    t.add({"vibration, typical machine, peak", millimetres(*peak), "below " + millimetres(*open), met(*peak < *open),
           "median of 64 that the model allows"});
  if (const auto peak = stated("peak_m"); peak && open)
    t.add({"vibration, 95 % of machines, peak", "at most " + millimetres(*peak), "below " + millimetres(*open),
           met(*peak < *open), "largest of those and of all plants tried"});
  if (const auto left = stated("static_stiffness"))
    t.add({"stiffness at rest, softest support", fmt::format("{:.0f} % of k1", 100 * *left), "above 0 %",
           met(*left > 0), "else the rotor rests off centre"});
  if (const auto trip = stated("trip_displacement_m"))
    t.add({"displacement that ends the run", millimetres(*trip), "", "", "for `safety` of the loop"});
}

void add_sliding(const ControllerDesign& design, report::Table& t) {
  const Stated stated(design);
  const auto bound = stated("disturbance_bound"), above = stated("kappa");
  if (bound && above)
    t.add({"switching gain", fmt::format("{:.3g} m/s^2", *bound + *above), fmt::format("above {:.3g} m/s^2", *bound),
           met(*above > 0), *above > 0 ? "eq. 42 of the paper" : "eq. 42; not part of the certificate"});
  if (const auto reach = stated("reach_time_s"))
    t.add({"time to reach the sliding surface", "at most " + milliseconds(*reach), "", "", "eqs. 38 to 42"});
  if (const auto slide = stated("slide_time_s"))
    t.add({"time on the surface to rest", milliseconds(*slide), "", "", "eq. 30"});
}

}  // namespace

report::Table requirements_table(const ControllerDesign& design) {
  report::Table t;
  t.caption = fmt::format("{} with estimator {}", design.law, design.estimator);
  t.columns = {{"requirement", "", report::Align::left},
               {"value", ""},
               {"limit", ""},
               {"met", ""},
               {"why", "", report::Align::left}};
  add_loop_margins(design, t);
  add_motion(design, t);
  add_sliding(design, t);
  if (const auto certified = Stated(design)("certified"))
    t.add({"certified", *certified > 0 ? "yes" : "no", "", met(*certified > 0),
           *certified > 0 ? "margins, runs and supervision, in simulation" : "see the warnings"});
  return t;
}

report::Table parameters_table(const ControllerDesign& design) {
  report::Table t;
  t.caption = "Tuned numbers";
  t.columns = {{"parameter", "", report::Align::left}, {"value", ""}};
  for (const auto& [name, value] : design.parameters) t.add({name, fmt::format("{:.6g}", value)});
  return t;
}

}  // namespace whirl::pages
