#include "whirl/tuning/compare.hpp"

#include <algorithm>
#include <mutex>
#include <tuple>

#include "whirl/control/method.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/parallel.hpp"

namespace whirl::tuning {
namespace {

rig::RigParameters without_added_mass(rig::RigParameters rig) {
  rig.rotor.added_mass = 0;
  return rig;
}

/// The rig with nothing wrong but its rotor.
rig::RigParameters perfect(rig::RigParameters p) {
  p.modes.clear();
  p.laser = {.noise = 0,
             .range = p.laser.range,
             .bits = 0,
             .rate = p.laser.rate,
             .latency = 0,
             .runout_1x = 0,
             .runout_2x = 0,
             .runout_3x = 0};
  p.actuator.bits = 0;
  p.actuator.gain_error = p.actuator.axis_rotation = 0;
  p.actuator.bandwidth = 0;
  p.actuator.delay_samples = p.actuator.extra_delay_samples = 0;
  p.encoder = {.counts = 0, .bandwidth = p.encoder.bandwidth, .profile_angle = false};
  p.profile = p.profile.without_ripple();
  return p;
}

}  // namespace

std::string ComparedMethod::label() const { return law + ", " + estimator + (feedforward ? "" : ", no feedforward"); }

ComparedMethod parse_method(const std::string& text) {
  std::vector<std::string> parts{""};
  for (char c : text) {
    if (c == ':') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  ComparedMethod m{parts[0], parts.size() > 1 ? parts[1] : "lpf", !control::law_entry(parts[0]).cancels_synchronous};
  if (parts.size() > 3 || (parts.size() == 3 && parts[2] != "no-feedforward")) {
    throw Error::in_field("method", text, "LAW, LAW:ESTIMATOR or LAW:ESTIMATOR:no-feedforward");
  }
  if (parts.size() == 3) m.feedforward = false;
  control::estimator_info(m.estimator);
  return m;
}

std::vector<ComparedMethod> default_methods() {
  std::vector<ComparedMethod> out;
  for (const control::MethodInfo& law : control::laws()) {
    if (!control::law_entry(law.name).own) out.push_back(parse_method(law.name));
  }
  for (const char* method :
       {"pd:lpf:no-feedforward", "tsmc_paper:lpf:no-feedforward", "tsmc:red_implicit", "tsmc:eso", "tsmc:kalman",
        "tsmc:kfo", "tsmc:kfe", "pd:kfe", "lsmc:kfe", "ftsmc:kfe", "sta_implicit:kfe", "mpc:kfe", "pd:kfo",
        "pd_scheduled:kfe", "pd_fxlms_xy:kfe", "hinf:kfe", "lqi:kfe", "lqi:kfo"}) {
    out.push_back(parse_method(method));
  }
  return out;
}

bool ComparedResult::stable_everywhere() const {
  return nominal.stable && std::ranges::all_of(matrix, [](const RobustnessCase& c) { return c.metrics.stable; });
}

std::vector<ComparedResult> compare(const IdentifiedModel& model, const rig::RigParameters& rig,
                                    const CompareOptions& options) {
  ClosedLoopOptions run;
  run.run.seed = options.seeds.empty() ? 101 : options.seeds.front();
  const ClosedLoopPlant plant(rig, run);
  std::optional<ClosedLoopPlant> balanced;
  if (options.balanced_eps) balanced.emplace(without_added_mass(rig), run);

  std::vector<ComparedResult> out(options.methods.size());
  std::mutex guard;
  std::size_t done = 0;
  parallel_for(static_cast<int>(out.size()), options.design.threads, [&](int index) {
    const ComparedMethod& method = options.methods[static_cast<std::size_t>(index)];
    DesignOptions d = options.design;
    d.threads = 1;
    d.law = method.law;
    d.estimator = method.estimator;
    d.feedforward = method.feedforward;
    d.fixed = method.fixed;
    ComparedResult& r = out[static_cast<std::size_t>(index)];
    r.label = method.label();
    r.design = design(model, d);
    r.nominal = plant.run(r.design);
    for (const std::uint64_t seed : options.seeds) {
      const double peak = plant.run(r.design, nullptr, seed).closed.all;
      r.peak_mean += peak / static_cast<double>(options.seeds.size());
      r.peak_worst = std::max(r.peak_worst, peak);
    }
    if (balanced) {
      ControllerDesign told = r.design;
      told.model.eps = *options.balanced_eps;
      r.balanced = balanced->run(told);
      r.balanced_eps = told.model.eps;
    }
    if (options.matrix) r.matrix = robustness_matrix(r.design, rig, run.run.seed, 1);
    if (options.progress) {
      const std::lock_guard lock(guard);
      options.progress(r.label, static_cast<double>(++done) / static_cast<double>(out.size()));
    }
  });
  return out;
}

const ComparedResult& best_result(const std::vector<ComparedResult>& results) {
  if (results.empty()) throw Error("best_result: nothing was compared");
  return *std::ranges::min_element(results, {}, [](const ComparedResult& r) {
    const auto failures = std::ranges::count_if(r.matrix, [](const RobustnessCase& c) { return !c.metrics.stable; });
    return std::tuple{!r.nominal.stable, failures, r.peak_mean};
  });
}

std::vector<FloorCase> physical_floor(const ControllerDesign& design, const rig::RigParameters& rig,
                                      std::optional<std::complex<double>> balanced_eps, std::uint64_t seed) {
  struct Source {
    const char* name;
    std::function<void(rig::RigParameters&)> add;
    bool remove_runout = true;
  };
  const auto runout = [&](rig::RigParameters& p) {
    p.laser.runout_1x = rig.laser.runout_1x, p.laser.runout_phase_1x = rig.laser.runout_phase_1x;
    p.laser.runout_2x = rig.laser.runout_2x, p.laser.runout_phase_2x = rig.laser.runout_phase_2x;
    p.laser.runout_3x = rig.laser.runout_3x, p.laser.runout_phase_3x = rig.laser.runout_phase_3x;
  };
  const std::vector<Source> sources{
      {"nothing but the rotor", [](rig::RigParameters&) {}},
      {"runout, as far as it is removed", runout},
      {"runout, not removed", runout, false},
      {"sensor noise and resolution",
       [&](rig::RigParameters& p) { p.laser.noise = rig.laser.noise, p.laser.bits = rig.laser.bits; }},
      {"delay and actuator lag",
       [&](rig::RigParameters& p) {
         p.laser.latency = rig.laser.latency;
         p.laser.bandwidth = rig.laser.bandwidth;
         p.laser.hysteresis = rig.laser.hysteresis;
         p.actuator.delay_samples = rig.actuator.delay_samples;
         p.actuator.bandwidth = rig.actuator.bandwidth;
       }},
      {"actuator gain, axes and resolution",
       [&](rig::RigParameters& p) {
         p.actuator.gain_error = rig.actuator.gain_error;
         p.actuator.axis_rotation = rig.actuator.axis_rotation;
         p.actuator.bits = rig.actuator.bits;
       }},
      {"structural modes", [&](rig::RigParameters& p) { p.modes = rig.modes; }},
      {"encoder and speed ripple", [&](rig::RigParameters& p) { p.encoder = rig.encoder, p.profile = rig.profile; }},
      {"all of it: the rig", [&](rig::RigParameters& p) { p = rig; }},
  };
  ClosedLoopOptions options;
  options.run.seed = seed;
  std::vector<FloorCase> out;
  for (const Source& source : sources) {
    rig::RigParameters p = perfect(rig);
    source.add(p);
    ControllerDesign d = design;
    const Hardware told = data_sheet(p);
    d.delay = told.loop_delay();
    d.parameters["sensor_delay"] = told.laser.delay();
    const bool has_runout = p.laser.runout_1x != 0 || p.laser.runout_2x != 0 || p.laser.runout_3x != 0;
    if (p.modes.empty()) {
      std::erase_if(d.parameters, [](const auto& entry) { return entry.first.starts_with("mode_"); });
    }
    if (!source.remove_runout || !has_runout) {
      std::erase_if(d.parameters, [](const auto& entry) { return entry.first.starts_with("runout_"); });
    }
    FloorCase c{source.name, ClosedLoopPlant(p, options).run(d).closed.all};
    if (balanced_eps) {
      d.model.eps = *balanced_eps;
      c.balanced = ClosedLoopPlant(without_added_mass(p), options).run(d).closed.all;
    }
    out.push_back(std::move(c));
  }
  return out;
}

}  // namespace whirl::tuning
