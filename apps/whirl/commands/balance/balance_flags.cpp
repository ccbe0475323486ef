#include "balance_flags.hpp"

#include "whirl/core/angles.hpp"
#include "whirl/io/units.hpp"

namespace whirl::app {
namespace {

std::vector<double> times(std::vector<double> values, double unit) {
  for (double& v : values) v *= unit;
  return values;
}

}  // namespace

balancing::VectorConvention JobFlags::convention() const { return {phase, amplitude, angles}; }

balancing::JobOptions JobFlags::options() const {
  balancing::JobOptions o = plain;
  o.criterion = balancing::criterion_of(criterion);
  o.drift = balancing::drift_of(drift);
  o.noise = noise_um * 1e-6;
  o.noise_written = noise;
  o.limit = limit_gram * 1e-3;
  o.places.first_hole = first_hole_deg * kRadPerDegree;
  o.places.piece = piece_gram * 1e-3;
  o.places.hole = hole_gram * 1e-3;
  o.prior.from = prior;
  o.zones = times(zones_um, 1e-6);
  o.errors.mass = mass_error_gram * 1e-3;
  o.errors.angle = angle_error_deg * kRadPerDegree;
  o.errors.radius = radius_error_mm * 1e-3;
  o.rotor.mass = mass_kg;
  o.rotor.radius = radius_mm * 1e-3;
  o.rotor.grade = grade;
  o.rotor.service_speed = speed_rpm * kRadPerSecPerRpm;
  return o;
}

balancing::NewJob GuidedFlags::job(const JobFlags& flags) const {
  balancing::NewJob job;
  job.planes = planes;
  job.probes = probes;
  job.speeds = times(speeds_rpm, kRadPerSecPerRpm);
  job.convention = flags.convention();
  job.probe_angles = times(probe_deg, kRadPerDegree);
  job.keyphasor = keyphasor_deg * kRadPerDegree;
  job.notch = notch_deg * kRadPerDegree;
  job.edge = edge;
  job.critical_speed = critical_rpm * kRadPerSecPerRpm;
  job.trial = trial_gram * 1e-3;
  job.unit = unit;
  const io::UnitSuffix& of = *io::find_unit(unit);
  if (of.quantity != Quantity::displacement && (target_um > 0 || allowed_um > 0 || flags.noise_um > 0))
    throw Error("--target-um, --allowed-um and --noise-um are displacements; with --unit " + unit +
                " state --target, --allowed and --noise");
  job.target = target_um > 0 ? target_um * 1e-6 : of.to_si(target);
  job.allowed = allowed_um > 0 ? allowed_um * 1e-6 : of.to_si(allowed);
  job.slow_roll = flags.slow_roll_rpm * kRadPerSecPerRpm;
  job.options = flags.options();
  if (flags.noise > 0) job.options.noise = of.to_si(flags.noise);
  return job;
}

void JobFlags::add_to(CommandLine* sub) {
  sub->add_option("--phase", phase, "runs.csv: phases are lag or lead [lag]; required by a session")
      ->one_of({"lag", "lead"});
  sub->add_option("--amplitude", amplitude,
                  "runs.csv: amplitudes are peak (0p), pp or rms; unstated: printed as read, without zones; required "
                  "by a session")
      ->one_of({"0p", "peak", "pp", "rms"});
  sub->add_option("--angles", angles,
                  "runs.csv: mass angles count with or against the rotation [with]; required by a session")
      ->one_of({"with", "against"});
  sub->add_option("--criterion", criterion, "least-squares [default] or min-max (smallest largest reading)")
      ->one_of({"least-squares", "min-max"});
  sub->add_option("--slow-roll-rpm", slow_roll_rpm, "readings at or below are runout, taken off the others")
      ->range(0, 1e6);
  sub->add_option("--drift", drift, "automatic [default], linear or none: warming up during the job")
      ->one_of({"automatic", "linear", "none"});
  sub->add_option("--noise-um", noise_um, "sd of one reading, zero-to-peak; default: from the runs")->range(0, 1e6);
  sub->add_option("--noise", noise, "the same in the unit of the readings")->range(0, 1e6);
  sub->add_option("--limit-gram", limit_gram, "largest mass on a plane")->positive();
  sub->add_option("--holes", plain.places.holes, "equally spaced holes of each plane")->range(1, 1000);
  sub->add_option("--first-hole-deg", first_hole_deg, "angle of the first hole")->range(-360, 360)->show_default();
  sub->add_option("--piece-gram", piece_gram, "masses come in multiples of this")->positive();
  sub->add_option("--hole-gram", hole_gram, "largest mass in one hole")->positive();
  sub->add_flag("--drop-dependent", plain.drop_dependent,
                "no mass on a plane that acts as another (Darlow: below 20 %)");
  sub->add_flag("--all-runs", plain.all_runs, "name a run that contradicts the others, but use it");
  sub->add_option("--prior", prior,
                  "balance.json of an earlier job (this machine or its sister), model.json, or modes.json of impacts "
                  "on the planes")
      ->input();
  sub->add_option("--prior-common", plain.prior.common,
                  "sd of the error that its coefficients share at a speed (complex part)")
      ->range(0, 10)
      ->show_default();
  sub->add_option("--prior-each", plain.prior.each, "sd of the error of each coefficient alone")
      ->range(0, 10)
      ->show_default();
  sub->add_option("--zones-um", zones_um,
                  "upper limits of zones A, B, C in the kind of the readings; default ISO 20816-3")
      ->range(0, 1e6)
      ->delimiter(',');
  sub->add_option("--mass-error-gram", mass_error_gram, "a mass may differ by (95 %), for the error budget")
      ->range(0, 1e9);
  sub->add_option("--angle-error-deg", angle_error_deg, "its angle may differ by")->range(0, 360);
  sub->add_option("--radius-error-mm", radius_error_mm, "its radius may differ by")->range(0, 1e6);
  sub->add_option("--out", out, "write the result as JSON")->output("whirl.balancing");
  sub->add_option("--page,--html", html, "write the balancing sheet (HTML)")->output();
  sub->add_option("--pdf", pdf, "write the balancing sheet as PDF (needs chromium)")->output("PDF");
}

void GuidedFlags::add_to(CommandLine* sub) {
  sub->section("Guided job", "--session");
  sub->add_option("--session", file, "job file (TOML): made, resumed, one run added; says the next run to make");
  sub->add_option("--planes", planes, "new job: names of the planes, as A,B")->delimiter(',');
  sub->add_option("--probes", probes, "new job: names of the probes, as DE,NDE")->delimiter(',');
  sub->add_option("--speeds-rpm", speeds_rpm, "new job: speeds at which each run is read")
      ->range(1e-3, 1e6)
      ->delimiter(',');
  sub->add_option("--trial-gram", trial_gram, "new job: first trial mass; else from --mass-kg and --radius-mm")
      ->range(0, 1e9);
  sub->add_option("--target-um", target_um, "new job: good when every reading is at or below (as --amplitude)")
      ->range(0, 1e6);
  sub->add_option("--unit", unit, "new job: of the readings, --target, --allowed and --noise")
      ->one_of({"um", "mil", "mm_s", "in_s", "g", "m_s2"})
      ->show_default();
  sub->add_option("--target", target, "new job: --target-um in the unit of the job")->range(0, 1e6);
  sub->add_option("--allowed", allowed, "new job: --allowed-um in the unit of the job")->range(0, 1e6);
  sub->add_option("--allowed-um", allowed_um, "new job: a run predicted above is warned of (as --amplitude)")
      ->range(0, 1e6);
  sub->add_option("--probe-deg", probe_deg, "new job: angle of each probe, counted as the masses")
      ->range(-360, 360)
      ->delimiter(',');
  sub->add_option("--keyphasor-deg", keyphasor_deg, "new job: angle of the keyphasor's probe, counted alike")
      ->range(-360, 360);
  sub->add_option("--edge", edge, "new job: edge of the mark that triggers")
      ->one_of({"leading", "trailing"})
      ->show_default();
  sub->add_option("--notch-deg", notch_deg, "new job: width of the mark")->range(0, 360);
  sub->add_option("--critical-rpm", critical_rpm, "new job: critical speed; tells on which side the heavy spot is")
      ->range(0, 1e6);
  sub->add_option("--readings", run.readings,
                  "the run just made: \"48.3@270 ...\", all probes at the first speed, then the next; - missing");
  sub->add_option("--record", run.record, "the run just made, as a record with keyphasor; channels named as the probes")
      ->input();
  sub->add_flag("--steady", run.steady,
                "with --record: vectors of a rotor that stays at each speed, from modes fitted to the run-up or "
                "run-down, so that runs of differing rates belong together");
  sub->add_option("--masses", run.masses, "what was on the rotor, plane by plane: \"10@90 0\"; default: as proposed");
  sub->add_option("--run", run.name, "name of the run just made");
  sub->add_flag("--undo", undo, "take back the last run");
  sub->section();
}

}  // namespace whirl::app
