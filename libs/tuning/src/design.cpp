#include "whirl/tuning/design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <numbers>

#include "certificate/design_peak.hpp"
#include "design_parts.hpp"
#include "monte_carlo/training.hpp"
#include "runs/design_scenarios.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/control/method.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/parallel.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/tuning/loop_margins.hpp"

namespace whirl::tuning {
namespace {

/// One number the search varies. Layers are searched as the loop gain rho/eps, the well-conditioned quantity.
struct Variable {
  std::string name;
  double low = 0, high = 0, start = 0;
  bool linear = false;
  bool gain_over_layer = false;
  double velocity_gain = 0;  ///< power of this number in the gain from velocity to force; 0: another number

  double value(double u) const { return linear ? low + u * (high - low) : low * std::pow(high / low, u); }
  double unit(double v) const {
    const double c = std::clamp(v, low, high);
    return linear ? (c - low) / (high - low) : std::log(c / low) / std::log(high / low);
  }
};

double switching_gain_of(const std::map<std::string, double>& values) {
  const auto it = values.find("switching_gain");
  return it != values.end() ? it->second : values.at("gain_max");
}

/// `weights`: those of a learned law too, which only its training varies.
std::vector<Variable> variables_of(const ControllerDesign& start, const DesignOptions& options, bool weights = false) {
  const auto values = control::resolve_parameters(start);
  const std::vector<std::string>& learned = control::law_entry(start.law).weights;
  std::vector<Variable> out;
  const auto add = [&](const control::ParameterInfo& info) {
    if (!(info.tune_low < info.tune_high) || options.fixed.count(info.name)) return;
    if (!weights && std::ranges::find(learned, info.name) != learned.end()) return;
    Variable v{info.name, info.tune_low, info.tune_high, values.at(info.name), info.tune_low < 0, false};
    if (info.name == "boundary_layer") {
      v.low = 3, v.high = 150, v.gain_over_layer = true;
      v.start = switching_gain_of(values) / values.at(info.name);
    }
    v.velocity_gain = v.gain_over_layer || info.name.starts_with("kd") ? 1 : info.name == "velocity_scale" ? -1 : 0;
    out.push_back(v);
  };
  for (const auto& info : control::law_info(start.law).parameters) add(info);
  for (const auto& info : control::estimator_info(start.estimator).parameters) add(info);
  if (!control::law_entry(start.law).model_free) {
    for (const auto& info : control::common_parameters()) add(info);
  }
  return out;
}

void set_variables(ControllerDesign& d, const std::vector<Variable>& variables, const std::vector<double>& u) {
  for (std::size_t i = 0; i < variables.size(); ++i) d.parameters[variables[i].name] = variables[i].value(u[i]);
  for (std::size_t i = 0; i < variables.size(); ++i) {
    if (!variables[i].gain_over_layer) continue;
    d.parameters["boundary_layer"] = switching_gain_of(control::resolve_parameters(d)) / variables[i].value(u[i]);
  }
}

/// What a candidate pays for a peak sensitivity above three quarters of the limit: a look at three speeds, with less
/// time than the certificate takes. Graded, and more than designs that hold differ by.
double margin_cost(const ControllerDesign& candidate, const rig::RigParameters& rig) {
  constexpr double kInside = 0.75, kWeight = 0.1, kUnstable = 0.5;
  MarginOptions o;
  o.speeds = 3, o.settle = 1, o.window = 2, o.repeats = 2, o.threads = 1, o.verify = false;
  const LoopMargins m = worst_margins(loop_margins(candidate, rig, o));
  if (!m.stable) return kUnstable;
  return kWeight * std::max(0.0, std::log(m.peak_sensitivity / (kInside * VerdictLimits().peak_sensitivity)));
}

struct Search {
  ControllerDesign design;
  std::vector<Variable> variables;
  std::vector<TuningScenario> scenarios;
  std::vector<ClosedLoopPlant> plants;
  std::vector<rig::RigParameters> loops;  ///< on which the margins are looked at
  const DesignOptions* options = nullptr;
  long evaluation = 0;
  double best = 1e9;
  std::vector<double> best_u;
  std::vector<std::pair<double, std::vector<double>>> tried;  ///< cost and variables of every evaluation
  std::map<std::string, double> training;                     ///< what the margins say of it; empty: nothing learned
  std::exception_ptr thrown;                                  ///< by an evaluation inside NLopt

  double objective(const std::vector<double>& u) {
    ControllerDesign candidate = design;
    set_variables(candidate, variables, u);
    std::vector<double> cost(plants.size()), missed(loops.size());
    parallel_for(static_cast<int>(plants.size() + loops.size()), options->threads, [&](int i) {
      const auto s = static_cast<std::size_t>(i);
      if (s < plants.size()) {
        cost[s] = tuning_cost(plants[s].run(on_scenario(candidate, scenarios[s])));
      } else {
        missed[s - plants.size()] = margin_cost(on_scenario(candidate, {}), loops[s - plants.size()]);
      }
    });
    double sum = 0;
    for (double c : cost) sum += c;
    sum /= static_cast<double>(cost.size());
    if (!missed.empty()) sum += *std::ranges::max_element(missed);
    // A rotor that would rest off centre with the stiffness at its lower bound; graded, so that a search can climb out.
    constexpr double kLeft = 0.05;
    const double left = 1 - options->stiffness_uncertainty + static_control_stiffness(candidate) / candidate.model.k1;
    if (left < kLeft) sum += 0.2 + std::min(1.0, kLeft - left);
    ++evaluation;
    if (sum < best) best = sum, best_u = u;
    tried.emplace_back(sum, u);
    if (options->progress.tuning) options->progress.tuning({evaluation, options->evaluations, sum, best});
    return sum;
  }
};

/// NLopt turns every exception into a failure of its own; what the user's progress report threw is kept.
double nlopt_objective(const std::vector<double>& u, std::vector<double>&, void* data) {
  auto& search = *static_cast<Search*>(data);
  try {
    return search.objective(u);
  } catch (...) {
    search.thrown = std::current_exception();
    throw nlopt::forced_stop();
  }
}

void optimize(nlopt::opt& method, std::vector<double>& u, double& value, const Search& search) {
  try {
    method.optimize(u, value);
  } catch (...) {
    if (search.thrown) std::rethrow_exception(search.thrown);
    throw;
  }
}

/// A start that does not hold on every scenario is tried with a half and a quarter of its gain on the velocity: with
/// structure between force and sensor that is where a loop holds. Returns the number of tries.
int soften_start(Search& search, std::vector<double>& start, double& value) {
  constexpr double kLost = 0.2;  // more than any loop that holds costs
  constexpr int kHalvings = 2;
  int tried = 0;
  for (int k = 1; k <= kHalvings && value > kLost && search.options->evaluations > 6; ++k) {
    std::vector<double> u = start;
    for (std::size_t i = 0; i < u.size(); ++i) {
      const Variable& v = search.variables[i];
      if (v.velocity_gain != 0) u[i] = std::clamp(v.unit(v.value(u[i]) * std::pow(0.5, v.velocity_gain)), 0.02, 0.98);
    }
    const double cost = search.objective(u);
    ++tried;
    start = u;
    value = cost;
  }
  start = search.best_u;
  value = search.best;
  return tried;
}

void run_search(Search& search) {
  const auto n = static_cast<unsigned>(search.variables.size());
  const int budget = search.options->evaluations, wide = budget - budget / 3;
  std::vector<double> u(n);
  for (unsigned i = 0; i < n; ++i) u[i] = std::clamp(search.variables[i].unit(search.variables[i].start), 0.02, 0.98);
  double value = search.objective(u);
  if (n == 0 || budget <= 1) return;
  const int steps = soften_start(search, u, value);

  nlopt::srand(static_cast<unsigned long>(search.options->seed));
  nlopt::opt global(nlopt::GN_CRS2_LM, n);
  global.set_lower_bounds(0);
  global.set_upper_bounds(1);
  // The default population, 10 (n + 1), would spend the whole budget on random points.
  global.set_population(std::max<unsigned>(n + 2, std::min<unsigned>(10 * (n + 1), static_cast<unsigned>(wide) / 3)));
  global.set_maxeval(std::max(1, wide - 1 - steps));
  global.set_min_objective(nlopt_objective, &search);
  optimize(global, u, value, search);

  if (budget < 3) return;  // a limit of 0 would be none
  u = search.best_u;
  nlopt::opt local(nlopt::LN_SBPLX, n);
  local.set_lower_bounds(0);
  local.set_upper_bounds(1);
  local.set_initial_step(0.1);
  local.set_maxeval(budget / 3);
  local.set_min_objective(nlopt_objective, &search);
  optimize(local, u, value, search);
}

/// Training of a law with weights on random machines of the model: the start of the search.
void train_weights(Search& search, const IdentifiedModel& model) {
  const DesignOptions& o = *search.options;
  const std::vector<Variable> variables = variables_of(search.design, o, true);
  std::vector<double> start;
  for (const Variable& v : variables) start.push_back(v.unit(v.start));
  const auto make = [&](const std::vector<double>& u) {
    ControllerDesign d = search.design;
    set_variables(d, variables, u);
    return d;
  };
  constexpr long kPerEvaluation = 48;
  const long runs = o.inputs.training_runs > 0 ? o.inputs.training_runs : kPerEvaluation * o.evaluations;
  const Training found = train(make, start, model, o.hardware, runs, o.seed + 2000, o.threads, o.progress.training);
  search.design = make(found.best);
  search.training = {{"training_runs", static_cast<double>(found.runs)},
                     {"training_start", found.before},
                     {"training_cost", found.after}};
}

/// What the search found, best first: the best, and others that are something else and cost at most half as much again.
std::vector<std::vector<double>> candidates_of(const Search& search) {
  constexpr std::size_t kMost = 6;
  constexpr double kApart = 0.1, kCost = 1.5;
  auto tried = search.tried;
  std::ranges::stable_sort(tried, {}, [](const auto& t) { return t.first; });
  std::vector<std::vector<double>> out{search.best_u};
  for (const auto& [cost, u] : tried) {
    if (out.size() == kMost || cost > kCost * search.best) break;
    const bool apart = std::ranges::all_of(out, [&](const std::vector<double>& other) {
      double most = 0;
      for (std::size_t i = 0; i < u.size(); ++i) most = std::max(most, std::abs(u[i] - other[i]));
      return most > kApart;
    });
    if (apart) out.push_back(u);
  }
  return out;
}

/// The design with those variables, every number that was used written down, and its assessment: the whole one of the
/// first, of others only what certifies them.
ControllerDesign assessed_design(const Search& search, const std::vector<double>& u, bool first) {
  ControllerDesign d = search.design;
  set_variables(d, search.variables, u);
  d.parameters = control::resolve_parameters(d);
  std::erase_if(d.parameters, [](const auto& p) {
    return (p.first.starts_with("runout_") || p.first.starts_with("mode_")) && p.second == 0;
  });
  if (const control::LawEntry& law = control::law_entry(d.law); law.entries != nullptr) {
    for (const control::ParameterInfo& info : law.entries(d.parameters)) {
      if (d.parameters.at(info.name) == info.fallback) d.parameters.erase(info.name);
    }
  }
  (first ? assess : assess_until_missed)(d, *search.options);
  d.margins.insert(search.training.begin(), search.training.end());
  for (const auto& [cost, variables] : search.tried) {
    if (variables == u) d.margins["objective"] = cost;
  }
  return d;
}

/// Why no controller may be designed on this model; empty: none.
std::string refusal(const IdentifiedModel& model, const Hardware& hardware) {
  for (const FindingCode code : {FindingCode::held_out_not_predicted, FindingCode::held_out_diverges}) {
    if (const Finding* found = model.summary.find(code))
      return "the model does not explain its record: " + text(*found);
  }
  if (model.summary.status == Status::unusable) {
    return "the model does not explain its record" + (model.summary.reason.empty() ? "" : ": " + model.summary.reason);
  }
  const double top = std::max(hardware.profile.omega_start, hardware.profile.omega_end);
  for (const ForcedMode& mode : model.rotor->modes) {
    if (!(mode.omega > 0 && mode.omega < 1.1 * top) || mode.zeta > 0.2) continue;
    if (std::abs(mode.participation) < 0.05 * std::abs(model.rotor->eps)) continue;
    const double f = mode.omega / (2 * std::numbers::pi);
    if (knows(hardware, mode)) continue;
    return fmt::format(
        "the record shows a second critical speed at {:.1f} Hz, inside the speed range; how the force and the sensor "
        "take part in that mode is not known: give its hammer test (modes.json) or [modes.N] in the data sheet",
        f);
  }
  return {};
}

/// The structural modes whose sign is known go into the controller, the strongest ones that a sampled loop can follow.
void add_structure(ControllerDesign& d, std::vector<rig::RigMode> modes) {
  std::erase_if(modes, [&](const rig::RigMode& m) {
    return m.sensor_sign == 0 || m.participation == 0 || m.frequency * d.sample_time > 0.4;
  });
  std::ranges::sort(modes, std::greater<>{}, &rig::RigMode::participation);
  modes.resize(std::min<std::size_t>(modes.size(), control::Structure::kModes));
  std::ranges::sort(modes, {}, &rig::RigMode::frequency);
  for (std::size_t k = 0; k < modes.size(); ++k) {
    const std::string name = fmt::format("mode_{}_", k + 1);
    d.parameters[name + "omega"] = 2 * std::numbers::pi * modes[k].frequency;
    d.parameters[name + "damping"] = std::min(modes[k].damping_ratio, 0.9);
    d.parameters[name + "share"] = modes[k].sensor_sign * modes[k].participation;
  }
}

}  // namespace

control::Runout identified_runout(const IdentifiedModel& model) {
  control::Runout out;
  for (std::size_t k = 0; k < control::Runout::kHarmonics; ++k) {
    for (const double sign : {1.0, -1.0}) {
      const std::string name = fmt::format("runout{}{}_", k + 1, sign > 0 ? '+' : '-');
      const Estimate *re = model.parameter(name + "re"), *im = model.parameter(name + "im");
      if (re == nullptr || im == nullptr) continue;
      // (a + i b)(cos k beta + i sign sin k beta), x the real part, y the imaginary one.
      out.x_cos[k] += re->value;
      out.x_sin[k] -= sign * im->value;
      out.y_cos[k] += im->value;
      out.y_sin[k] += sign * re->value;
    }
  }
  return out;
}

ControllerDesign untuned_design(const IdentifiedModel& identified, const DesignOptions& options) {
  if (!identified.rotor) {
    throw Error(
        fmt::format("model identified by method {}: it is no rotor with stiffness, damping and unbalance, so no "
                    "controller can be designed from it",
                    identified.method));
  }
  const RotorModel& model = *identified.rotor;
  ControllerDesign d;
  d.law = options.law;
  d.estimator = options.estimator;
  d.model = model;
  if (options.gain > 0) d.model.gain = options.gain;
  d.sample_time = 1 / options.hardware.timing.rate;
  d.delay = options.hardware.loop_delay();
  d.force_limit = options.hardware.actuator.force_limit();
  d.feedforward = options.feedforward;
  d.parameters["sensor_delay"] = options.hardware.laser.delay();
  if (options.hardware.actuator.slew > 0) d.parameters["slew_limit"] = options.hardware.actuator.slew;
  if (options.hardware.actuator.hysteresis > 0) d.parameters["hysteresis"] = options.hardware.actuator.hysteresis;
  d.parameters["sensor_range"] = 0.49 * options.hardware.laser.range;
  add_structure(d, options.hardware.modes);
  const control::EstimatorEntry& estimator = control::estimator_entry(options.estimator);
  d.parameters["predict"] = estimator.model_based ? 1 : 0;
  const control::LawEntry& law = control::law_entry(options.law);
  for (const auto& [name, value] : law.design_values) d.parameters[name] = value;
  if (law.measures != nullptr) {
    const rotor::SpeedProfile& profile = options.hardware.profile;
    const double top = std::max(std::abs(profile.omega_start), std::abs(profile.omega_end));
    for (const auto& [name, value] : law.measures(d, top)) d.parameters[name] = value;
  }
  const control::Runout runout =
      options.hardware.slow_roll ? *options.hardware.slow_roll : identified_runout(identified);
  if (!runout.empty()) d.parameters.merge(control::runout_parameters(runout));
  if (estimator.knows_noise) {
    // The noise of the readings in quadrature with 1 um: runout harmonics and quantisation.
    const rig::RigLaser& laser = options.hardware.laser;
    const double lsb = laser.bits > 0 ? laser.range / std::ldexp(1.0, laser.bits) : 0;
    d.parameters["measurement_noise"] = std::hypot(laser.noise, 1e-6, lsb / std::sqrt(12.0));
  }
  if (options.inputs.own) {
    const OwnLaw& own = *options.inputs.own;
    for (const auto& [name, value] : control::linear_parameters(own.x, own.y, d.model.gain, own.sample_time))
      d.parameters[name] = value;
  }
  for (const auto& [name, value] : options.fixed) d.parameters[name] = value;
  control::make_controller(d);  // throws for whatever is wrong
  return d;
}

namespace {

/// The further forces that the plants have, by name.
std::string carried(const IdentifiedModel& model, const Hardware& hardware) {
  std::vector<identification::RotorTerm> terms = identification::terms_of(model);
  const std::vector<identification::RotorTerm> left = forces_left_out(model, hardware);
  std::erase_if(terms, [&](const auto& t) {
    return std::ranges::find(left, t.entry, &identification::RotorTerm::entry) != left.end();
  });
  return names_of(terms);
}

}  // namespace

ControllerDesign design(const IdentifiedModel& model, const DesignOptions& given) {
  require_range("evaluations", given.evaluations, 1, 1e6);
  DesignOptions options = given;
  options.hardware = with_forces(given.hardware, model);
  if (options.hardware.slow_roll) options.hardware.runout_error = 0;  // a slow roll found it
  Search search;
  search.options = &options;
  search.design = untuned_design(model, options);
  if (const std::string why = refusal(model, options.hardware); !why.empty()) {
    search.design.margins["certified"] = 0;
    search.design.summary.trust = "not designed";
    search.design.summary.fail("refused: " + why);
    return search.design;
  }
  if (!control::law_entry(options.law).weights.empty()) train_weights(search, model);
  search.variables = variables_of(search.design, options);
  search.scenarios = tuning_scenarios(options.hardware, options.stiffness_uncertainty);
  const Hardware hardware = tuning_hardware(search.design, options.hardware);
  for (const auto& s : search.scenarios) {
    search.plants.push_back(scenario_plant(s, search.design.model, hardware, options.seed));
  }
  const std::vector<Hardware> signs = hardware.sign_cases();
  search.loops.push_back(tuning_plant(search.design.model, signs.front()));
  if (signs.size() > 1) search.loops.push_back(tuning_plant(search.design.model, signs.back()));
  run_search(search);

  // The cost of a few runs is not the certificate: the best that is certified, else the best with what it lacks.
  ControllerDesign best;
  for (const std::vector<double>& u : candidates_of(search)) {
    ControllerDesign d = assessed_design(search, u, best.law.empty());
    if (d.margins.at("certified") == 1) bound_peak(d, model, options);
    const bool certified = d.margins.at("certified") == 1;
    if (certified || best.law.empty()) best = std::move(d);
    if (certified) break;
  }
  if (rotor::acts(options.hardware.forces) && best.margins.at("certified") == 1) {
    best.summary.trust += "; with the model's " + carried(model, given.hardware);
  }
  state_parts(identification::Consumer::design, model, given.hardware, best.summary);
  hold_on_readings(model, given, best);
  if (const Finding* distrust = model.summary.distrust()) {
    best.margins["certified"] = 0;
    best.summary.add({FindingCode::model_not_trusted, Consequence::no_trust, {}, text(*distrust)});
  }
  best.provenance.version = version();
  best.provenance.inputs = model.provenance.inputs;
  best.provenance.seed = options.seed;
  best.provenance.options = fmt::format("law={} estimator={} evaluations={} feedforward={} delay={:.4g}", best.law,
                                        best.estimator, options.evaluations, best.feedforward, best.delay);
  return best;
}

}  // namespace whirl::tuning
