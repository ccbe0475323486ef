#include "certificate/certificate_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "whirl/control/supervisor.hpp"
#include "whirl/core/parallel.hpp"

namespace whirl::tuning {
namespace {

enum class Varied { actuators, structure, course };

struct Case {
  std::string name;  ///< of the structure " 1.5 times as strong"; empty: as known
  TuningScenario scenario;
  Varied varied = Varied::actuators;
};

/// `critical`: the profile passes the critical speed.
std::vector<Case> cases_of(const TuningScenario& nominal, bool modes, bool critical) {
  std::vector<Case> out;
  const auto add_course = [&](Course course) {
    out.push_back({course_name(course), nominal, Varied::course});
    out.back().scenario.course = course;
  };
  add_course(Course::reversed);
  if (critical) {
    add_course(Course::dwell);
    add_course(Course::swinging);
  }
  if (modes) {
    const auto add = [&](const char* name, double strength, double frequency) {
      Case c{name, nominal, Varied::structure};
      c.scenario.modes = strength, c.scenario.mode_frequency = frequency;
      out.push_back(c);
    };
    add("", 1, 1);
    add(" 1.5 times as strong", 1.5, 1);
    add(" 0.2 % higher in frequency", 1, 1.002);
    add(" 0.2 % lower in frequency", 1, 0.998);
  }
  for (const double gain : {1 + kGainTolerance, 1 - kGainTolerance}) {
    for (const double axis : {kAxisTolerance, -kAxisTolerance}) {
      Case c{fmt::format("forces {:.0f} % {} and their axes {:+.1f} degrees off", 100 * kGainTolerance,
                         gain > 1 ? "stronger" : "weaker", axis * 180 / std::numbers::pi),
             nominal};
      c.scenario.gain = gain, c.scenario.axis = axis;
      out.push_back(c);
    }
  }
  return out;
}

}  // namespace

CertificateRuns certificate_runs(const ControllerDesign& trial, const TuningScenario& ringing, double nominal_peak,
                                 const RotorModel& model, const Hardware& hardware, std::uint64_t seed, int threads) {
  // A loop whose motion follows the last per cent of the force is a loop that nobody has seen hold.
  constexpr double kFragile = 2, kAlways = 30e-6;  // m
  TuningScenario still = ringing;
  still.ringing = 0;
  const std::vector<Case> cases = cases_of(still, !hardware.modes.empty(), passes_critical(model, hardware));
  const std::vector<Hardware> signs = hardware.sign_cases();
  std::vector<CertificateRuns> found(cases.size() * signs.size());
  parallel_for(static_cast<int>(found.size()), threads, [&](int i) {
    const auto index = static_cast<std::size_t>(i);
    const Hardware& h = signs[index / cases.size()];
    const Case& c = cases[index % cases.size()];
    const ClosedLoopMetrics run = scenario_plant(c.scenario, model, h, seed).run(trial);
    const bool fragile = c.varied == Varied::actuators && run.closed.all > kFragile * nominal_peak + kAlways;
    TuningScenario rings = c.scenario;
    rings.ringing = ringing.ringing;
    CertificateRuns& out = found[index];
    out.peak = std::max(run.closed.all, scenario_plant(rings, model, h, seed).run(trial).closed.all);
    if (run.verdict.passed() && !fragile) return;
    const std::string chosen = hardware.signs_of(h);
    out.refused = c.varied == Varied::structure
                      ? (chosen.empty() ? "with the structural modes" : "with " + chosen) + c.name
                      : "with " + c.name + (chosen.empty() ? "" : ", " + chosen);
    out.refused += ": " + (run.verdict.passed() ? fmt::format("the peak rises from {:.3f} to {:.3f} mm",
                                                              1e3 * nominal_peak, 1e3 * run.closed.all)
                                                : run.verdict.text());
  });
  CertificateRuns all;
  for (const CertificateRuns& one : found) {
    all.peak = std::max(all.peak, one.peak);
    if (!one.refused.empty()) all.refused += (all.refused.empty() ? "" : "; ") + one.refused;
  }
  return all;
}

std::string nominal_alarm(const ControllerDesign& supervised, const TuningScenario& ringing, const RotorModel& model,
                          const Hardware& hardware, std::uint64_t seed, int threads) {
  std::vector<Case> cases = cases_of(ringing, false, passes_critical(model, hardware));
  cases.push_back({"", ringing});
  std::vector<std::string> text(cases.size());
  parallel_for(static_cast<int>(cases.size()), threads, [&](int i) {
    const Case& c = cases[static_cast<std::size_t>(i)];
    const std::uint32_t word = scenario_plant(c.scenario, model, hardware, seed).run(supervised).supervision;
    if ((word & control::kUnheld) == 0) return;
    text[static_cast<std::size_t>(i)] = std::string("supervision steps in ") +
                                        (c.name.empty() ? "on its own tuning plant" : "with " + c.name) + ": " +
                                        control::supervision_text(word);
  });
  for (const std::string& alarm : text) {
    if (!alarm.empty()) return alarm;
  }
  return {};
}

}  // namespace whirl::tuning
