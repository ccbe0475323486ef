#include "certificate/design_peak.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "runs/design_scenarios.hpp"
#include "whirl/tuning/monte_carlo.hpp"

namespace whirl::tuning {

void bound_peak(ControllerDesign& design, const IdentifiedModel& model, const DesignOptions& options) {
  // The largest of n is passed by at most 5 % of all with a confidence of 1 - 0.95^n: 96 %.
  constexpr int kMachines = 64;
  MonteCarloOptions o;
  o.samples = kMachines;
  o.threads = options.threads;
  IdentifiedModel centre = model;
  centre.rotor->gain = design.model.gain;
  auto& margins = design.margins;
  const auto missed = [&](std::vector<Amount> amounts, std::string what) {
    margins["certified"] = 0;
    design.summary.add(
        {FindingCode::requirement_missed, Consequence::unusable, std::move(amounts), "not certified: " + what});
  };
  double peak = margins.at("peak_m");
  std::vector<Course> courses{Course::profile, Course::reversed};
  if (passes_critical(design.model, options.hardware)) courses.push_back(Course::dwell);
  for (const Course course : courses) {
    Hardware hardware = options.hardware;
    hardware.profile = profile_of(course, hardware.profile, design.model.natural_frequency());
    // Not the seeds of the tuning, nor of the certificate's runs.
    o.seed = options.seed + 3000 + static_cast<std::uint64_t>(course);
    const MonteCarloResult drawn = monte_carlo(design, centre, hardware, o);
    if (course == Course::profile) margins["typical_peak_m"] = drawn.peak_median;
    peak = std::max(peak, drawn.peak_worst);
    if (drawn.stable.high < kEnoughPass)
      missed({{"value", 100 * drawn.stable.value, "%"}, {"least", 100 * kEnoughPass, "%"}},
             fmt::format("with {}, machines that the model allows and that keep the limits", course_name(course)));
  }
  const double open = margins.at("open_peak_m");
  margins["peak_m"] = peak;
  margins["trip_displacement_m"] = trip_displacement(open, peak);
  if (peak >= open)
    missed({{"value", 1e3 * peak, "mm"}, {"most", 1e3 * open, "mm"}},
           "peak of 95 % of the machines that the model allows, against the run without control");
  if (margins.at("certified") != 1) return;
  design.summary.trust +=
      fmt::format("; peak of machines that the model allows {:.3f} mm typically, at most {:.3f} mm for 95 % of them",
                  1e3 * margins.at("typical_peak_m"), 1e3 * peak);
}

}  // namespace whirl::tuning
