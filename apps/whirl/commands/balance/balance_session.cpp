#include "balance_session.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "session_file.hpp"
#include "whirl/diagnosis/next_run.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/pages/balancing_sheet.hpp"
#include "whirl/report/document.hpp"

namespace whirl::app {
namespace {

using Eigen::Index;
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Trial mass in kg whose force is a tenth of the weight that a bearing carries, at the highest speed.
double usual_trial(const JobOptions& o, const JobFile& file) {
  const double speed = file.speeds.back(), share = file.job.planes.size() > 1 ? 0.5 : 1.0;
  if (!(speed > 0)) throw Error("the first trial mass needs --trial-gram, or speeds and the rotor's mass and radius");
  return 0.1 * share * o.mass_kg * 9.80665 / (o.radius_mm * 1e-3 * speed * speed);
}

diagnosis::BalancingPlan plan_of(const JobFile& file, const JobOptions& o) {
  const JobPlan& p = file.plan;
  const double factor = file.convention.amplitude_factor();
  diagnosis::BalancingPlan plan;
  plan.trial = p.trial > 0 ? p.trial : usual_trial(o, file);
  if (o.limit_gram > 0) plan.limit = o.limit_gram * 1e-3;
  plan.target = p.target * factor;
  if (p.allowed > 0) plan.allowed = p.allowed * factor;
  plan.criterion = o.criterion == "min-max" ? diagnosis::Criterion::min_max : diagnosis::Criterion::least_squares;
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

std::string run_name(const GuidedOptions& g, const diagnosis::NextRun& next, const JobFile& file) {
  std::string name = diagnosis::step_name(next.step);
  if (next.step == diagnosis::BalancingStep::trial) name += " " + file.job.planes[static_cast<std::size_t>(next.plane)];
  if (next.step == diagnosis::BalancingStep::done ||
      (!g.masses.empty() && next.step != diagnosis::BalancingStep::trial))
    name = next.step == diagnosis::BalancingStep::as_found ? name : "check";
  return unique_name(g.run.empty() ? name : g.run, file);
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

void refuse_new_statements(const GuidedOptions& g, const JobOptions& o) {
  const JobOptions plain;
  if (g.states_job() || o.limit_gram != 0 || g.trial_gram != 0 || g.target_um != 0 || o.holes != 0 ||
      o.criterion != plain.criterion || o.drift != plain.drift || o.slow_roll_rpm != 0 || !g.probe_deg.empty() ||
      g.keyphasor_deg != 0 || g.critical_rpm != 0)
    throw Error(g.file +
                " exists: what a job is made of (planes, probes, speeds, limits, criterion) is stated there; "
                "change it in the file");
}

/// A new job, a run more, or a run less, in the file; says what was done.
void update_file(const GuidedOptions& g, const JobOptions& flags, Session& session) {
  if (!std::filesystem::exists(g.file)) {
    if (!g.readings.empty() || !g.record.empty() || g.undo)
      throw Error(g.file + " does not exist: make the job first (--planes, --probes, --phase, --amplitude, --angles)");
    const std::string text = new_session_text(g, flags);
    session.check_output(g.file, "settings");
    io::write_text(g.file, text);
    session.say("new job " + g.file);
    return;
  }
  refuse_new_statements(g, flags);
  const std::string text = io::read_text(g.file);
  if (g.undo) {
    io::write_text(g.file, without_last_run(text, g.file));
    session.say("the last run was taken back");
  }
  if (g.readings.empty() && g.record.empty()) {
    if (!g.masses.empty() || !g.run.empty()) throw Error("--masses and --run belong to --readings or --record");
    if (g.steady) throw Error("--steady belongs to --record");
    return;
  }
  const JobFile file = read_job(g.file, {}, 0, true);
  const JobOptions o = with_plan(flags, file);
  diagnosis::NextRun next;
  next.masses = Eigen::VectorXcd::Zero(static_cast<Index>(file.job.planes.size()));
  next = diagnosis::next_run(file.job, plan_of(file, o), influence_options(o));
  VectorConvention typed = file.convention;
  if (!flags.phase.empty()) typed.phase = flags.phase;
  if (!flags.amplitude.empty()) typed.amplitude = flags.amplitude;
  if (!flags.angles.empty()) typed.angles = flags.angles;
  const std::string name = run_name(g, next, file);
  std::string with_run = io::read_text(g.file);
  if (!with_run.empty() && with_run.back() != '\n') with_run += '\n';
  with_run += run_text(g, typed, file, next.masses, name);
  // What cannot be read again is not written.
  io::parse_settings(with_run, g.file);
  io::write_text(g.file, with_run);
  session.say(fmt::format("run {} \"{}\" taken down{}", file.job.runs.size() + 1, name,
                          g.masses.empty() ? ", with the masses that were proposed" : ""));
}

/// Vectors of run-ups are linear in the masses only where all runs have one rate. Empty: they do, or it is not stated.
std::string differing_rates(const JobFile& file) {
  constexpr double kSlow = 5e-5;  // a rotor that stays at a speed, as it is read from a record
  constexpr double kAlike = 0.15;
  double low = INFINITY, high = -INFINITY;
  for (const double sweep : file.sweeps) {
    if (std::isnan(sweep)) continue;
    const double rate = std::abs(sweep) < kSlow ? 0 : sweep;
    low = std::min(low, rate);
    high = std::max(high, rate);
  }
  if (!(high - low > kAlike * std::max(std::abs(low), std::abs(high)))) return {};
  return fmt::format(
      "the runs were read from records whose speed changes at differing rates ({:.2g} to {:.2g} of the squared speed): "
      "such vectors do not belong together; begin the job again with --record FILE --steady, or make all runs at one "
      "rate",
      low, high);
}

}  // namespace

void GuidedOptions::add_to(CommandLine* sub) {
  constexpr const char* kGroup = "Guided job";
  sub->add_option("--session", file, "job file (TOML): made, resumed, one run added; says the next run to make")
      ->group(kGroup);
  sub->add_option("--planes", planes, "new job: names of the planes, as A,B")->delimiter(',')->group(kGroup);
  sub->add_option("--probes", probes, "new job: names of the probes, as DE,NDE")->delimiter(',')->group(kGroup);
  sub->add_option("--speeds-rpm", speeds_rpm, "new job: speeds at which each run is read")
      ->delimiter(',')
      ->group(kGroup);
  sub->add_option("--trial-gram", trial_gram, "new job: first trial mass; else from --mass-kg and --radius-mm")
      ->group(kGroup);
  sub->add_option("--target-um", target_um, "new job: good when every reading is at or below (as --amplitude)")
      ->group(kGroup);
  sub->add_option("--allowed-um", allowed_um, "new job: a run predicted above is warned of (as --amplitude)")
      ->group(kGroup);
  sub->add_option("--probe-deg", probe_deg, "new job: angle of each probe, counted as the masses")
      ->delimiter(',')
      ->group(kGroup);
  sub->add_option("--keyphasor-deg", keyphasor_deg, "new job: angle of the keyphasor's probe, counted alike")
      ->group(kGroup);
  sub->add_option("--edge", edge, "new job: edge of the mark that triggers")
      ->one_of({"leading", "trailing"})
      ->show_default()
      ->group(kGroup);
  sub->add_option("--notch-deg", notch_deg, "new job: width of the mark")->range(0, 360)->group(kGroup);
  sub->add_option("--critical-rpm", critical_rpm, "new job: critical speed; tells on which side the heavy spot is")
      ->group(kGroup);
  sub->add_option("--readings", readings,
                  "the run just made: \"48.3@270 ...\", all probes at the first speed, then the next; - missing")
      ->group(kGroup);
  sub->add_option("--record", record, "the run just made, as a record with keyphasor; channels named as the probes")
      ->input()
      ->group(kGroup);
  sub->add_flag("--steady", steady,
                "with --record: vectors of a rotor that stays at each speed, from modes fitted to the run-up or "
                "run-down, so that runs of differing rates belong together")
      ->group(kGroup);
  sub->add_option("--masses", masses, "what was on the rotor, plane by plane: \"10@90 0\"; default: as proposed")
      ->group(kGroup);
  sub->add_option("--run", run, "name of the run just made")->group(kGroup);
  sub->add_flag("--undo", undo, "take back the last run")->group(kGroup);
}

void balance_session(const GuidedOptions& g, const JobOptions& flags, Session& session) {
  update_file(g, flags, session);
  const JobFile file = read_job(g.file, {}, 0, true);
  const JobOptions o = with_plan(flags, file);
  const diagnosis::NextRun next = diagnosis::next_run(file.job, plan_of(file, o), influence_options(o));
  const std::vector<diagnosis::Foretold> check = diagnosis::check_last_run(file.job, influence_options(o));
  const std::vector<std::pair<std::string, std::string>> lines = instructions(file, next);
  Summary summary = next.summary;
  if (const std::string warning = differing_rates(file); !warning.empty()) summary.warn(warning);
  const auto outside = std::count_if(check.begin(), check.end(), [](const auto& f) { return !f.inside; });
  if (!check.empty() && outside > 1 + static_cast<long>(check.size()) / 10)
    summary.warn(fmt::format("{} of {} readings of the last run are outside of what the runs before foretold", outside,
                             check.size()));
  for (const auto& [key, value] : lines) session.say(fmt::format("{:<14} {}", key, value));
  const double unit = 1e-6 * file.convention.amplitude_factor();
  for (std::size_t m = 0; m < next.predicted.size() && next.step != diagnosis::BalancingStep::done; ++m) {
    const Estimate& e = next.predicted[m];
    const double value = e.value < 1e-6 * unit ? 0 : e.value / unit;
    session.say(fmt::format("{:<14} {}: {:.3g} um{}", m == 0 ? "predicted" : "", file.job.rows[m], value,
                            std::isnan(e.low) ? "" : fmt::format(" ({:.3g} to {:.3g})", e.low / unit, e.high / unit)));
  }
  io::Json json = step_json(file, next, check);
  if (solvable(file, o)) {
    const bool done = next.step == diagnosis::BalancingStep::done;
    SolvedJob solved = solve_job(g.file, file, o, done ? std::optional<Eigen::VectorXcd>(next.masses) : std::nullopt);
    solved.sheet.next = lines;
    for (const diagnosis::Foretold& f : check) solved.sheet.check.push_back({f.predicted, f.measured, f.inside});
    for (auto& c : solved.sheet.check) {
      const double factor = 1 / file.convention.amplitude_factor();
      c.measured *= factor;
      for (double* v : {&c.predicted.value, &c.predicted.sd, &c.predicted.low, &c.predicted.high}) *v *= factor;
    }
    for (const std::string& warning : solved.sheet.summary.warnings) summary.warnings.push_back(warning);
    summary.status = std::max(summary.status, solved.sheet.summary.status);
    if (done) session.say(report::to_text(pages::balancing_sheet(solved.sheet)));
    json.set("job", solved.json);
    if (!o.out.empty()) io::save_json(o.out, solved.json);
    if (!o.html.empty()) report::write_html(pages::balancing_sheet(solved.sheet), o.html);
  } else if (!o.html.empty() || !o.out.empty()) {
    throw Error(g.file + ": there is no sheet yet: the runs do not tell every plane's influence");
  }
  session.result(json);
  session.finish(summary);
}

}  // namespace whirl::app
