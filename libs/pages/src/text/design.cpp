#include "whirl/pages/text/design.hpp"

#include <fmt/format.h>

#include <optional>

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
std::string millimetres(double metres) { return fmt::format("{:.3g} mm", 1e3 * metres); }
std::string milliseconds(double seconds) { return fmt::format("{:.3g} ms", 1e3 * seconds); }

void add_loop_margins(const ControllerDesign& design, report::Table& t) {
  const Stated stated(design);
  const tuning::VerdictLimits limits;
  if (const auto gain = stated("gain_margin"))
    t.add({"gain margin, upwards", fmt::format("{:.2f} times", *gain), fmt::format("at least {:g}", limits.gain_margin),
           met(*gain >= limits.gain_margin)});
  if (const auto down = stated("gain_margin_down"))
    t.add({"gain margin, downwards", fmt::format("{:.2g} times", *down), "", ""});
  if (const auto delay = stated("delay_margin_s")) {
    const double least = limits.delay_samples * design.sample_time;
    t.add({"further delay", milliseconds(*delay), "at least " + milliseconds(least), met(*delay >= least)});
  }
  if (const auto phase = stated("phase_margin_deg")) t.add({"phase margin", fmt::format("{:.1f} deg", *phase), "", ""});
  if (const auto modulus = stated("modulus_margin")) t.add({"modulus margin", fmt::format("{:.3f}", *modulus), "", ""});
  if (const auto peak = stated("peak_sensitivity")) {
    const char zone = tuning::sensitivity_zone(*peak);
    t.add({"peak sensitivity (ISO 14839-3)", fmt::format("{:.1f}, zone {}", *peak, zone), "zone A to C, below 5",
           met(zone != 'D')});
  }
}

void add_motion(const ControllerDesign& design, report::Table& t) {
  const Stated stated(design);
  const auto open = stated("open_peak_m");
  if (const auto peak = stated("nominal_peak_m"); peak && open)
    t.add({"vibration, nominal run", millimetres(*peak), "below " + millimetres(*open) + " (open loop)",
           met(*peak < *open)});
  if (const auto peak = stated("peak_m"); peak && open)
    t.add({"vibration, any plant tried", millimetres(*peak), "below " + millimetres(*open) + " (open loop)",
           met(*peak < *open)});
  if (const auto left = stated("static_stiffness"))
    t.add(
        {"static stiffness, softest support", fmt::format("{:.0f} % of k1", 100 * *left), "above 0 %", met(*left > 0)});
  if (const auto trip = stated("trip_displacement_m"))
    t.add({"displacement at which the loop trips", millimetres(*trip), "", ""});
}

void add_sliding(const ControllerDesign& design, report::Table& t) {
  const Stated stated(design);
  const auto bound = stated("disturbance_bound"), above = stated("kappa");
  if (bound && above)
    t.add({"switching gain (eq. 42 of the paper)", fmt::format("{:.3g} m/s^2", *bound + *above),
           fmt::format("above {:.3g} m/s^2 (disturbance)", *bound), met(*above > 0)});
  if (const auto reach = stated("reach_time_s"))
    t.add({"time to reach the sliding surface", milliseconds(*reach), "", ""});
  if (const auto slide = stated("slide_time_s")) t.add({"time on the surface to rest", milliseconds(*slide), "", ""});
}

}  // namespace

report::Table requirements_table(const ControllerDesign& design) {
  report::Table t;
  t.caption = fmt::format("{} with estimator {}", design.law, design.estimator);
  t.columns = {{"requirement", "", report::Align::left}, {"value", ""}, {"limit", ""}, {"met", ""}};
  add_loop_margins(design, t);
  add_motion(design, t);
  add_sliding(design, t);
  if (const auto certified = Stated(design)("certified"))
    t.add({"certified on the tuning plant", *certified > 0 ? "yes" : "no", "", met(*certified > 0)});
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
