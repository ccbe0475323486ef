// The flags of `whirl identify`: names, ranges, help. What they ask for: identify_options.cpp.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "identify_options.hpp"
#include "whirl/io/library_toml.hpp"

namespace whirl::app {

void IdentifyFlags::add_to(CommandLine* sub) {
  sub->add_option("RECORDS", files, "records (CSV)")->input()->required();
  sub->add_option("--out", out, "write the model as JSON")->output("whirl.model|whirl.method_comparison");
  sub->add_option("--method", method, "weak (default), paper, consistent, second-order, sindy or drive")
      ->one_of({"weak", "paper", "consistent", "second-order", "sindy", "drive"});
  sub->add_flag("--compare", compare, "table over all regression methods on this record instead of one model");
  sub->add_option("--holdout", holdout, "share of a single record kept out of a second fit, to be predicted (0.3)")
      ->range(0.05, 0.8);
  sub->add_flag("--no-holdout", no_holdout, "no second fit: no held-out error");
  record.add_to(sub);

  sub->section("Rotor");
  sub->add_option("--modes", modes, "modes of the hammer test (modes.json): candidates beside the main mode")->input();
  sub->add_option(
         "--angle", angle,
         "measured; profile: the rate of an assumed profile is refined too; or vibration: none is measured, the "
         "motion itself tells the speed")
      ->one_of({"measured", "profile", "vibration"});
  record.add_tacho_to(sub);
  sub->add_option("--slow-roll", slow_roll,
                  "record at slow roll: its runout and bow are taken off the readings (vectors of "
                  "orders 1 to 3)")
      ->input();
  sub->add_option("--slow-roll-reads", slow_roll_reads,
                  "what the slow roll is: unknown (e covers both), runout of the track, or bow of the shaft")
      ->one_of({"unknown", "runout", "bow"});
  sub->add_option("--filter-ms", filter_ms, "Gaussian filter of paper and consistent, standard deviation");

  sub->add_option("--drive", drive,
                  "channel of the drive (voltage or share, 0: off): the torque equation too, all six states; records "
                  "without it coast");
  sub->add_option("--inertia-kgm2", inertia, "moment of inertia about the centre of mass: torques in N m")
      ->range(0, 1e9);
  sub->add_option("--mass-kg", mass, "mass of the disk")->range(0, 1e9);

  sub->section("One degree of freedom (second-order)");
  sub->add_option("--output-channel", output, "displacement")->show_default();
  sub->add_option("--input-channel", input, "force or other input")->show_default();
  add_general_to(sub);
  add_regression_to(sub);
}

void IdentifyFlags::add_general_to(CommandLine* sub) {
  sub->section("Any system (sindy)");
  sub->add_option("--states", states, "channels whose equations are sought; default: all that are no inputs")
      ->delimiter(',')
      ->one_value();
  sub->add_option("--inputs", inputs, "channels that drive them")->delimiter(',')->one_value();
  sub->add_option("--hold", holds,
                  "what inputs do between samples: zero (D/A converter), first (straight lines) or band-limited, for "
                  "all or as INPUT=HOLD, repeatable; default: by evidence")
      ->one_value();
  sub->add_option("--dead-time-s", dead_times,
                  "known dead time of the inputs, s, for all or as INPUT=SECONDS, repeatable; default: estimated")
      ->one_value();
  sub->add_flag("--no-timing", no_timing, "inputs not named by --hold are band-limited without dead time");
  sub->add_option(
         "--hidden", hidden,
         "states without a channel (lag, store, hysteresis, memory) that may be added on evidence, at most (0)")
      ->range(0, 4);
  sub->add_option("--denominator", denominators,
                  "candidate terms of denominators beside 1, e.g. \"x, x^2\": rational right-hand sides");
  sub->add_option("--order", order, "1: x' = f(x, u); 2: x'' = f(x, x', u) from displacements alone")->range(1, 2);
  sub->add_flag("--discrete", discrete, "map: x[k+1] = f(x, u)");
  sub->add_option("--degree", degree, "library: all monomials up to this degree (default 3; 2 beyond three variables)")
      ->range(1, 8);
  sub->add_option("--fourier", fourier, "library: sin(k v), cos(k v) of every variable up to k")->range(1, 20);
  sub->add_flag("--time", time, "library: time t is a variable too");
  sub->add_option("--terms", term_list,
                  "library: further terms, e.g. \"x*abs(x), exp(-t)\"; alone they are the library");
  Option* file =
      sub->add_option("--library", library,
                      "library.toml: exactly these terms, ties and known parts; states, inputs and order are its own "
                      "(docs/formats.md)")
          ->existing_file()
          ->input();
  for (const char* flag : {"--degree", "--fourier", "--time", "--terms"}) file->excludes(flag);
  sub->add_option("--known", known, "equation with given coefficients, kept as it is, e.g. \"x' = v\"")
      ->one_value()
      ->excludes(file);
  sub->add_option("--sign", signs,
                  "sign of a coefficient, repeatable: TERM=+ (>= 0 in every equation), EQUATION:TERM=- (<= 0), e.g. "
                  "\"v':x^3=-\"")
      ->one_value()
      ->excludes(file);
  sub->add_option("--window", window, "half-width of the weak form's test functions, s; 0: from the record")
      ->range(0, 1e6);
  sub->add_option("--t-value", term_t_value, "terms with a smaller |coefficient / sd| go (4)")->range(0, 1000);
  sub->add_option("--max-passes", max_passes,
                  "refinement: passes over the free runs after which the search for terms ends (500)")
      ->range(1, 1000000);
  sub->add_flag("--no-refine", no_refine, "stop after the regression: no refinement on free runs");
  sub->add_flag("--stream", stream, "read the file part by part in bounded memory (files larger than memory)");
}

void IdentifyFlags::add_regression_to(CommandLine* sub) {
  sub->section("Any system (sindy)");
  sub->add_option("--bound", bounds,
                  "inequality between coefficients, repeatable: \"[v': x] + 2*[v': v] <= -1\"; with --library its "
                  "group names, \"k >= 3*c\"")
      ->one_value();
  sub->add_option("--stable-1s", least_decay,
                  "every mode of the part linear about the origin decays at least at this rate, 1/s; 0: it does not "
                  "grow")
      ->range(0, 1e9);
  sub->add_flag(
      "--trapping", trapping,
      "a quadratic system whose motion stays bounded from any start, with a certificate; candidate terms up to "
      "degree 2");
  const char* regression = "Regression (paper, second-order, sindy; parameters also under --compare)";
  sub->section(regression);
  sub->add_option("--regressor", regressor, fmt::format("{}", fmt::join(regression::regression_methods(), ", ")))
      ->one_of(regression::regression_methods());
  std::vector<std::string> selections;
  for (const auto& [name, value] : kSelections) selections.push_back(name);
  sub->add_option("--selection", selection, "of one model on a path: automatic, bic, aic, cv, cv-1se")
      ->one_of(selections);
  sub->section(regression, "", true);
  sub->add_option("--threshold", solve.threshold, "share of the target below which a term goes (stlsq, sr3, ensemble)")
      ->range(0, 1);
  sub->add_option("--lambda", solve.lasso.lambda,
                  "weight of lasso, sqrt_lasso as a share of the smallest that empties the model")
      ->range(0, 1);
  sub->add_option("--ridge", solve.ridge, "ridge on scaled columns (ols, ridge, stlsq)")->range(0, 1e12);
  sub->add_option("--max-terms", solve.max_terms, "largest model of frols, best_subset; 0: all")->range(0, 1000);
  sub->add_option("--backward-t", solve.t_value, "backward: terms with a smaller |t| go")->range(0, 1e6);
  sub->add_option("--nu", solve.sr3_nu, "sr3: relaxation")->range(1e-12, 1e12);
  sub->add_option("--resamples", solve.ensemble.resamples, "ensemble: block bootstraps")->range(1, 100000);
  sub->add_option("--inclusion", solve.ensemble.inclusion, "ensemble: share of resamples in which a term must be kept")
      ->range(0, 1);
  sub->add_option("--drop-terms", solve.ensemble.drop_terms, "ensemble: terms left out of each resample at random")
      ->range(0, 1000);
  sub->add_option("--folds", solve.folds, "cross-validation: folds of contiguous time blocks")->range(2, 50);
  sub->add_option("--seed", solve.ensemble.seed, "ensemble");
  sub->add_flag("--debias", solve.lasso.debias, "lasso: least squares on the support found");
  sub->section();
}

}  // namespace whirl::app
