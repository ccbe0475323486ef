#include "balance_job.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "whirl/io/file.hpp"
#include "whirl/io/units.hpp"
#include "whirl/pages/printed_page.hpp"
#include "whirl/report/document.hpp"

namespace whirl::app {
namespace {

void write(Session& session, const balancing::SolvedJob& solved, const JobFlags& flags) {
  const std::string page = flags.wants_sheet() ? report::to_html(balancing::balancing_sheet(solved.sheet)) : "";
  const std::string pdf = flags.pdf.empty() ? "" : pages::printed_page(page, flags.pdf);
  session.write_together();
  if (!flags.out.empty()) io::save_json(flags.out, solved.json);
  if (!flags.html.empty()) io::write_text(flags.html, page);
  if (!flags.pdf.empty()) io::write_text(flags.pdf, pdf);
}

void refuse_new_statements(const GuidedFlags& g, const JobFlags& o) {
  if (!g.planes.empty() || !g.probes.empty() || !g.speeds_rpm.empty() || o.limit_gram != 0 || g.trial_gram != 0 ||
      g.target_um != 0 || g.target != 0 || g.unit != "um" || o.plain.places.holes != 0 || !o.criterion.empty() ||
      !o.drift.empty() || o.slow_roll_rpm != 0 || !g.probe_deg.empty() || g.keyphasor_deg != 0 || g.critical_rpm != 0)
    throw Error(g.file +
                " exists: what a job is made of (planes, probes, speeds, limits, criterion) is stated there; "
                "change it in the file");
}

/// A new job, a run more, or a run less, in the file; says what was done.
void update_file(const GuidedFlags& g, const JobFlags& flags, Session& session) {
  balancing::RunMade run = g.run;
  run.typed = flags.convention();
  const bool made = !run.readings.empty() || !run.record.empty();
  if (!std::filesystem::exists(g.file)) {
    if (made || g.undo)
      throw Error(g.file + " does not exist: make the job first (--planes, --probes, --phase, --amplitude, --angles)");
    const std::string text = balancing::new_job_text(g.job(flags), g.file);
    session.check_output(g.file, "settings");
    io::write_text(g.file, text);
    session.say("new job " + g.file);
    return;
  }
  refuse_new_statements(g, flags);
  if (g.undo) {
    balancing::undo_run(g.file);
    session.say("the last run was taken back");
  }
  if (!made) {
    if (!run.masses.empty() || !run.name.empty()) throw Error("--masses and --run belong to --readings or --record");
    if (run.steady) throw Error("--steady belongs to --record");
    return;
  }
  const balancing::RunTaken taken = balancing::add_run(g.file, run, flags.options());
  session.say(fmt::format("run {} \"{}\" taken down{}", taken.number, taken.name,
                          run.masses.empty() ? ", with the masses that were proposed" : ""));
}

}  // namespace

void balance_runs(const std::string& path, const JobFlags& flags, Session& session) {
  for (const auto& [flag, value] : {std::pair{"--slow-roll-rpm", flags.slow_roll_rpm},
                                    {"--noise-um", flags.noise_um},
                                    {"--limit-gram", flags.limit_gram},
                                    {"--piece-gram", flags.piece_gram},
                                    {"--hole-gram", flags.hole_gram}})
    require_range(flag, value, 0, 1e9);
  const auto convention = balancing::VectorConvention::stated(flags.phase, flags.amplitude, flags.angles);
  const balancing::JobFile file = balancing::read_job(path, convention, flags.slow_roll_rpm * std::numbers::pi / 30);
  const balancing::SolvedJob solved = balancing::solve_job(path, file, flags.options());
  session.say(report::to_text(balancing::balancing_sheet(solved.sheet)));
  session.result(solved.json);
  write(session, solved, flags);
  session.finish(solved.sheet.summary);
}

void balance_session(const GuidedFlags& g, const JobFlags& flags, Session& session) {
  update_file(g, flags, session);
  const balancing::GuidedStep step = balancing::guided_step(g.file, flags.options());
  for (const auto& [key, value] : step.instructions) session.say(fmt::format("{:<14} {}", key, value));
  const bool done = step.next.step == diagnosis::BalancingStep::done;
  const io::UnitSuffix& written = *io::find_unit(step.file.unit);
  const double unit = written.to_si(1) * step.file.convention.amplitude_factor();
  for (std::size_t m = 0; m < step.next.predicted.size() && !done; ++m) {
    const Estimate& e = step.next.predicted[m];
    const double value = e.value < 1e-6 * unit ? 0 : e.value / unit;
    session.say(fmt::format("{:<14} {}: {:.3g} {}{}", m == 0 ? "predicted" : "", step.file.job.rows[m], value,
                            written.suffix,
                            std::isnan(e.low) ? "" : fmt::format(" ({:.3g} to {:.3g})", e.low / unit, e.high / unit)));
  }
  if (step.solved) {
    if (done) session.say(report::to_text(balancing::balancing_sheet(step.solved->sheet)));
    write(session, *step.solved, flags);
  } else if (flags.wants_sheet() || !flags.out.empty()) {
    throw Error(g.file + ": there is no sheet yet: the runs do not tell every plane's influence");
  }
  session.result(step.json);
  session.finish(step.summary);
}

}  // namespace whirl::app
