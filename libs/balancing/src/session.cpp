#include "whirl/balancing/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "session_text.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/output.hpp"
#include "whirl/io/settings.hpp"

namespace whirl::balancing {
namespace {

using Eigen::Index;

/// Trial mass in kg whose force is a tenth of the weight that a bearing carries, at the highest speed.
double usual_trial(const JobOptions& o, const JobFile& file) {
  const double speed = file.speeds.back(), share = file.job.planes.size() > 1 ? 0.5 : 1.0;
  if (!(speed > 0)) throw Error("the first trial mass needs --trial-gram, or speeds and the rotor's mass and radius");
  return 0.1 * share * o.rotor.mass * 9.80665 / (o.rotor.radius * speed * speed);
}

diagnosis::BalancingPlan plan_of(const JobFile& file, const JobOptions& o) {
  const JobPlan& p = file.plan;
  const double factor = file.convention.amplitude_factor();
  diagnosis::BalancingPlan plan;
  plan.trial = p.trial > 0 ? p.trial : usual_trial(o, file);
  if (o.limit > 0) plan.limit = o.limit;
  plan.target = p.target * factor;
  if (p.allowed > 0) plan.allowed = p.allowed * factor;
  plan.criterion = o.criterion.value_or(plan.criterion);
  plan.drop_dependent = o.drop_dependent;
  plan.places = places_of(o, file.convention, file.job.planes.size());
  const auto rows = static_cast<Index>(file.job.rows.size());
  plan.high_spot = plan.heavy_ahead = Eigen::VectorXd::Constant(rows, kNaN);
  for (Index m = 0; m < rows && !p.probe_angles.empty(); ++m) {
    const auto i = static_cast<std::size_t>(m);
    // The mark's leading edge passes half its width before its middle.
    const double edge = (p.edge == "leading" ? 0.5 : -0.5) * p.notch;
    plan.high_spot[m] = p.probe_angles[i % file.probes.size()] - p.keyphasor + edge;
    const double ratio =
        p.critical_speed > 0 ? file.speeds[static_cast<std::size_t>(file.job.speed[i])] / p.critical_speed : kNaN;
    // The high spot lags the heavy spot: hardly below the critical speed, by a quarter at it, by half a turn above.
    if (!std::isnan(ratio)) plan.heavy_ahead[m] = std::numbers::pi * (ratio < 0.9 ? 0 : ratio > 1.1 ? 1 : 0.5);
  }
  return plan;
}

std::string mass_text(std::complex<double> w, double sign) {
  return std::abs(w) == 0 ? "nothing"
                          : fmt::format("{:.4g} g at {:.1f} deg", std::abs(w) * 1e3, written_angle(std::arg(w), sign));
}

std::string unique_name(std::string name, const JobFile& file) {
  const auto taken = [&](const std::string& n) {
    return std::any_of(file.job.runs.begin(), file.job.runs.end(), [&](const auto& run) { return run.name == n; });
  };
  if (!taken(name)) return name;
  int k = 2;
  while (taken(fmt::format("{} {}", name, k))) ++k;
  return fmt::format("{} {}", name, k);
}

std::string run_name(const RunMade& run, const diagnosis::NextRun& next, const JobFile& file) {
  std::string name = diagnosis::step_name(next.step);
  if (next.step == diagnosis::BalancingStep::trial) name += " " + file.job.planes[static_cast<std::size_t>(next.plane)];
  if (next.step == diagnosis::BalancingStep::done ||
      (!run.masses.empty() && next.step != diagnosis::BalancingStep::trial))
    name = next.step == diagnosis::BalancingStep::as_found ? name : "check";
  return unique_name(run.name.empty() ? name : run.name, file);
}

void require_phases(const JobFile& file, const std::string& path) {
  if (!file.job.phases)
    throw Error(path + ": a guided job needs phases: each [[run]] states phases_deg; `whirl balance " + path +
                "` balances from amplitudes alone");
}

/// What to do and why, in lines.
std::vector<std::pair<std::string, std::string>> instructions(const JobFile& file, const diagnosis::NextRun& next) {
  const double sign = file.convention.angle_sign();
  std::vector<std::pair<std::string, std::string>> lines;
  std::string step = diagnosis::step_name(next.step);
  if (next.step == diagnosis::BalancingStep::trial)
    step += " on plane " + file.job.planes[static_cast<std::size_t>(next.plane)];
  lines.emplace_back(next.step == diagnosis::BalancingStep::done ? "state" : "next run", step);
  lines.emplace_back("why", next.why);
  if (next.step == diagnosis::BalancingStep::as_found)
    lines.emplace_back("on the rotor", "no mass");
  else
    for (Index p = 0; p < next.masses.size(); ++p) {
      const std::string& plane = file.job.planes[static_cast<std::size_t>(p)];
      const std::complex<double> now = file.job.runs.empty() ? 0.0 : file.job.runs.back().masses[p];
      std::string text = mass_text(next.masses[p], sign);
      std::string holes;
      for (const diagnosis::PlacedMass& m : next.placed)
        if (m.plane == p) holes += (holes.empty() ? "" : " + ") + mass_text(std::polar(m.mass, m.angle), sign);
      if (!holes.empty() && holes.find('+') != std::string::npos) text = holes + " (together " + text + ")";
      if (std::abs(now - next.masses[p]) > 1e-9 * std::abs(now) && std::abs(now) > 0)
        text += fmt::format(" (in the last run: {})", mass_text(now, sign));
      lines.emplace_back("plane " + plane, text);
    }
  return lines;
}

io::Json step_json(const JobFile& file, const diagnosis::NextRun& next, const std::vector<diagnosis::Foretold>& check) {
  io::Json out = io::start_document("whirl.balancing_step", 1);
  io::Json masses = io::Json::array(), predicted = io::Json::array(), checked = io::Json::array();
  for (Index p = 0; p < next.masses.size(); ++p)
    masses.push(io::Json::object()
                    .set("plane", file.job.planes[static_cast<std::size_t>(p)])
                    .set("mass_kg", std::abs(next.masses[p]))
                    .set("angle_deg", std::abs(next.masses[p]) == 0
                                          ? 0.0
                                          : written_angle(std::arg(next.masses[p]), file.convention.angle_sign())));
  for (std::size_t m = 0; m < next.predicted.size(); ++m)
    predicted.push(io::Json::object().set("reading", file.job.rows[m]).set("after", to_json(next.predicted[m], "m")));
  for (const diagnosis::Foretold& f : check)
    checked.push(io::Json::object()
                     .set("predicted", to_json(f.predicted, "m"))
                     .set("measured_m", f.measured)
                     .set("inside", f.inside));
  out.set("runs", static_cast<double>(file.job.runs.size())).set("step", diagnosis::step_name(next.step));
  out.set("plane", next.plane < 0 ? std::string() : file.job.planes[static_cast<std::size_t>(next.plane)]);
  out.set("why", next.why).set("masses", std::move(masses)).set("predicted_0p", std::move(predicted));
  out.set("last_run_check", std::move(checked)).set("target_held", next.target_held);
  return out;
}

/// Whether the runs tell enough for a correction and a sheet.
bool solvable(const JobFile& file, const JobOptions& o) {
  if (file.job.runs.empty()) return false;
  try {
    diagnosis::fit_influence(file.job, influence_options(o));
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Estimates and readings of the check in the kind of the job's readings.
std::vector<BalancingSheet::Check> check_rows(const std::vector<diagnosis::Foretold>& check, double factor) {
  std::vector<BalancingSheet::Check> rows;
  for (const diagnosis::Foretold& f : check)
    rows.push_back({scaled(f.predicted, factor), f.measured * factor, f.inside});
  return rows;
}

}  // namespace

RunTaken add_run(const std::string& path, const RunMade& run, const JobOptions& options) {
  const io::WriterLock lock(path);
  const JobFile file = read_job(path, {}, 0, true);
  require_phases(file, path);
  const JobOptions o = with_plan(options, file);
  const diagnosis::NextRun next = diagnosis::next_run(file.job, plan_of(file, o), influence_options(o));
  VectorConvention typed = file.convention;
  if (!run.typed.phase.empty()) typed.phase = run.typed.phase;
  if (!run.typed.amplitude.empty()) typed.amplitude = run.typed.amplitude;
  if (!run.typed.angles.empty()) typed.angles = run.typed.angles;
  const std::string name = run_name(run, next, file);
  std::string text = io::read_text(path);
  if (!text.empty() && text.back() != '\n') text += '\n';
  text += run_text(run, typed, file, next.masses, name);
  // What cannot be read again is not written.
  io::parse_settings(text, path);
  io::write_text(path, text);
  return {file.job.runs.size() + 1, name};
}

void undo_run(const std::string& path) {
  const io::WriterLock lock(path);
  io::write_text(path, without_last_run(io::read_text(path), path));
}

GuidedStep guided_step(const std::string& path, const JobOptions& options) {
  GuidedStep step;
  step.file = read_job(path, {}, 0, true);
  const JobFile& file = step.file;
  require_phases(file, path);
  const JobOptions o = with_plan(options, file);
  step.next = diagnosis::next_run(file.job, plan_of(file, o), influence_options(o));
  step.check = diagnosis::check_last_run(file.job, influence_options(o));
  step.instructions = instructions(file, step.next);
  step.summary = step.next.summary;
  const auto outside = std::count_if(step.check.begin(), step.check.end(), [](const auto& f) { return !f.inside; });
  if (!step.check.empty() && outside > 1 + static_cast<long>(step.check.size()) / 10)
    step.summary.warn(fmt::format("{} of {} readings of the last run are outside of what the earlier runs predict",
                                  outside, step.check.size()));
  step.json = step_json(file, step.next, step.check);
  if (!solvable(file, o)) {
    warn_of_differing_rates(file, step.summary);
    return step;
  }
  const bool done = step.next.step == diagnosis::BalancingStep::done;
  step.solved = solve_job(path, file, o, done ? std::optional<Eigen::VectorXcd>(step.next.masses) : std::nullopt);
  step.solved->sheet.next = step.instructions;
  step.solved->sheet.check = check_rows(step.check, 1 / file.convention.amplitude_factor());
  step.summary.take(step.solved->sheet.summary);
  step.json.set("job", step.solved->json);
  return step;
}

}  // namespace whirl::balancing
