#include <numbers>

#include "balance_job.hpp"

namespace whirl::app {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

void take(double& flag, double stated, double unit) {
  if (flag == 0) flag = stated / unit;
}

}  // namespace

VectorConvention JobOptions::convention() const {
  VectorConvention v;
  if (!phase.empty()) v.phase = phase;
  if (!amplitude.empty()) v.amplitude = amplitude;
  if (!angles.empty()) v.angles = angles;
  return v;
}

JobOptions with_plan(JobOptions o, const JobFile& file) {
  const JobPlan& p = file.plan;
  take(o.limit_gram, p.limit, 1e-3);
  take(o.noise_um, p.noise, 1e-6);
  take(o.first_hole_deg, p.first_hole, kDegree);
  take(o.piece_gram, p.piece, 1e-3);
  take(o.hole_gram, p.hole, 1e-3);
  take(o.mass_kg, p.mass, 1);
  take(o.radius_mm, p.radius, 1e-3);
  take(o.grade, p.grade, 1);
  take(o.speed_rpm, p.service_speed, std::numbers::pi / 30);
  if (o.holes == 0) o.holes = p.holes;
  if (!p.criterion.empty() && o.criterion == JobOptions().criterion) o.criterion = p.criterion;
  if (!p.drift.empty() && o.drift == JobOptions().drift) o.drift = p.drift;
  o.drop_dependent = o.drop_dependent || p.drop_dependent;
  return o;
}

void JobOptions::add_to(CommandLine* sub) {
  sub->add_option("--phase", phase, "runs.csv: phases are lag or lead [lag]; a session must be told")
      ->one_of({"lag", "lead"});
  sub->add_option("--amplitude", amplitude, "runs.csv: amplitudes are 0p, pp or rms [0p]; a session must be told")
      ->one_of({"0p", "pp", "rms"});
  sub->add_option("--angles", angles,
                  "runs.csv: mass angles count with or against the rotation [with]; a session must be told")
      ->one_of({"with", "against"});
  sub->add_option("--criterion", criterion, "least-squares or min-max (smallest largest reading)")
      ->one_of({"least-squares", "min-max"})
      ->show_default();
  sub->add_option("--slow-roll-rpm", slow_roll_rpm, "readings at or below are runout, taken off the others");
  sub->add_option("--drift", drift, "automatic, linear or none: warming up during the job")
      ->one_of({"automatic", "linear", "none"})
      ->show_default();
  sub->add_option("--noise-um", noise_um, "sd of one reading, zero-to-peak; default: from the runs");
  sub->add_option("--limit-gram", limit_gram, "largest mass on a plane");
  sub->add_option("--holes", holes, "equally spaced holes of each plane")->range(1, 1000);
  sub->add_option("--first-hole-deg", first_hole_deg, "angle of the first hole")->show_default();
  sub->add_option("--piece-gram", piece_gram, "masses come in multiples of this");
  sub->add_option("--hole-gram", hole_gram, "largest mass in one hole");
  sub->add_flag("--drop-dependent", drop_dependent, "no mass on a plane that acts as another (Darlow: below 20 %)");
  sub->add_flag("--all-runs", all_runs, "name a run that contradicts the others, but use it");
  sub->add_option("--prior", prior,
                  "balance.json of an earlier job (this machine or its sister), or model.json: fewer trial runs")
      ->input();
  sub->add_option("--prior-common", prior_common,
                  "sd of the error that its coefficients share at a speed (complex part)")
      ->range(0, 10)
      ->show_default();
  sub->add_option("--prior-each", prior_each, "sd of the error of each coefficient alone")
      ->range(0, 10)
      ->show_default();
  sub->add_option("--zones-um", zones_um,
                  "upper limits of zones A, B, C in the kind of the readings; default ISO 20816-3")
      ->delimiter(',');
  sub->add_option("--mass-error-gram", mass_error_gram, "a mass may differ by (95 %), for the error budget");
  sub->add_option("--angle-error-deg", angle_error_deg, "its angle may differ by");
  sub->add_option("--radius-error-mm", radius_error_mm, "its radius may differ by");
  sub->add_option("--out", out, "write the result as JSON")->output("whirl.balancing");
  sub->add_option("--html", html, "write the balancing sheet")->output();
}

}  // namespace whirl::app
