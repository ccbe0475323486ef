#include "whirl/pipeline/robustness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "design_scenarios.hpp"
#include "robustness_parallel.hpp"
#include "whirl/core/error.hpp"

namespace whirl {
namespace {

struct Condition {
  std::string name;
  std::function<void(RigParameters&, ControllerDesign&, RigRun&)> change;
};

/// Time at which the profile passes the natural frequency, s.
double critical_time(const RigParameters& rig) {
  const double w = rig.natural_frequency(), end = rig.profile.duration();
  double best = 0, distance = 1e99;
  for (double t = 0; t < end; t += 0.01) {
    const double gap = std::abs(rig.profile.at(t).omega - w);
    if (gap < distance) distance = gap, best = t;
  }
  return best;
}

std::vector<Condition> conditions(const RigParameters& nominal) {
  using P = RigParameters;
  using D = ControllerDesign;
  const auto stiffness = [](double f) { return [f](P& p, D&, RigRun&) { p.rotor.stiffness *= f; }; };
  const auto damping = [](double f) { return [f](P& p, D&, RigRun&) { p.rotor.damping *= f; }; };
  const auto delay = [](int n, bool told) {
    return [n, told](P& p, D& d, RigRun&) {
      p.actuator.extra_delay_samples += n;
      if (told) d.delay += n * d.sample_time;
    };
  };
  const auto modes = [](double f) {
    return [f](P& p, D&, RigRun&) {
      for (RigMode& mode : p.modes) mode.participation *= f;
    };
  };
  const auto limit = [](double f) {
    return [f](P& p, D& d, RigRun&) {
      p.actuator.voltage_limit *= f;
      d.force_limit = p.actuator.force_limit();
    };
  };
  std::vector<Condition> all{
      {"nominal", [](P&, D&, RigRun&) {}},
      {"K1 +30 %", stiffness(1.3)},
      {"K1 -30 %", stiffness(0.7)},
      {"C +50 %", damping(1.5)},
      {"C -50 %", damping(0.5)},
      {"2x unbalance",
       [](P& p, D&, RigRun&) {
         p.rotor.residual_eccentricity *= 2;
         p.rotor.added_mass *= 2;
       }},
  };
  for (int n = 1; n <= 3; ++n) all.push_back({fmt::format("delay +{}, told", n), delay(n, true)});
  for (int n = 1; n <= 3; ++n) all.push_back({fmt::format("delay +{}, untold", n), delay(n, false)});
  all.push_back({"modes x3", modes(3)});
  all.push_back({"modes x15", modes(15)});
  all.push_back({"force / 2", limit(0.5)});
  all.push_back({"force / 8", limit(0.125)});
  const double t = critical_time(nominal);
  all.push_back({"50 ms sensor loss", [t](P&, D&, RigRun& r) {
                   r.faults.push_back({RigFault::sensor_loss, t, t + 0.05, RigAxis::both, 0});
                 }});
  all.push_back({"profile angle", [](P& p, D&, RigRun&) { p.encoder.profile_angle = true; }});
  all.push_back({"speed ripple x5", [](P& p, D&, RigRun&) { p.profile.ripple *= 5; }});
  all.push_back({"sensor noise x10", [](P& p, D&, RigRun&) { p.laser.noise *= 10; }});
  all.push_back({"run-up", [](P& p, D&, RigRun&) { p = p.run_up(); }});
  return all;
}

using Root = std::array<std::array<double, 5>, 5>;

/// Lower triangular L with L L^T = covariance (Cholesky of the correlations, which are all of order one while
/// k2 and eps differ by twelve orders of magnitude); zero when no covariance is known. Eigen is not used: g++
/// 12 with AVX-512 warns inside its decompositions.
Root covariance_root(const IdentifiedModel& model) {
  const auto& c = model.rotor_covariance;
  Root root{};
  if (c.empty()) return root;
  if (c.size() != 25) {
    throw Error(fmt::format(
        "rotor_covariance of the model has {} entries: must be 25 (k1, k2, c, eps_re, eps_im)", c.size()));
  }
  std::array<double, 5> sd{};
  for (std::size_t i = 0; i < 5; ++i) sd[i] = c[6 * i] > 0 ? std::sqrt(c[6 * i]) : 1;
  bool definite = true;
  for (std::size_t j = 0; j < 5; ++j) {
    for (std::size_t i = j; i < 5; ++i) {
      double left = c[5 * i + j] / (sd[i] * sd[j]);
      for (std::size_t k = 0; k < j; ++k) left -= root[i][k] * root[j][k];
      if (i == j) {
        definite = definite && left > -1e-6;
        root[j][j] = std::sqrt(std::max(left, 0.0));
      } else if (root[j][j] > 1e-6) {
        root[i][j] = left / root[j][j];
      } else {
        definite = definite && std::abs(left) < 1e-5;
      }
    }
  }
  if (!definite) throw Error("rotor_covariance of the model is not positive semi-definite");
  for (std::size_t i = 0; i < 5; ++i) {
    for (double& entry : root[i]) entry *= sd[i];
  }
  return root;
}

}  // namespace

std::vector<RobustnessCase> robustness_matrix(const ControllerDesign& design, const RigParameters& rig,
                                              std::uint64_t seed, int threads) {
  const auto all = conditions(rig);
  std::vector<RobustnessCase> out(all.size());
  parallel_for(static_cast<int>(all.size()), threads, [&](int i) {
    const Condition& c = all[static_cast<std::size_t>(i)];
    RigParameters p = rig;
    ControllerDesign d = design;
    ClosedLoopOptions options;
    options.run.seed = seed;
    c.change(p, d, options.run);
    // With less force than the task needs, saturation is the condition and no sign of instability.
    if (d.force_limit < design.force_limit) options.saturation_limit = 1;
    out[static_cast<std::size_t>(i)] = {c.name, ClosedLoopPlant(p, options).run(d)};
  });
  return out;
}

MonteCarloResult monte_carlo(const ControllerDesign& design, const IdentifiedModel& model,
                             const Hardware& hardware, const MonteCarloOptions& options) {
  if (!model.rotor) throw Error("Monte Carlo: the model is no rotor");
  require_range("samples", options.samples, 1, 1e7);
  RotorModel centre = *model.rotor;
  if (!(centre.gain > 0)) centre.gain = design.model.gain;
  if (!(centre.gain > 0)) throw Error("Monte Carlo: the input gain of the model is not known");
  const Root root = covariance_root(model);
  const ControllerDesign trial =
      on_scenario(design, {});  // the rotors drawn rest at zero, their runout is another one
  const Hardware machine = tuning_hardware(design, hardware);

  MonteCarloResult out;
  out.samples.resize(static_cast<std::size_t>(options.samples));
  parallel_for(options.samples, options.threads, [&](int i) {
    std::seed_seq sequence{static_cast<std::uint32_t>(options.seed),
                           static_cast<std::uint32_t>(options.seed >> 32), static_cast<std::uint32_t>(i)};
    std::mt19937_64 random(sequence);
    std::normal_distribution<double> normal(0, 1);
    std::uniform_real_distribution<double> angle(0, 2 * std::numbers::pi);
    RotorModel m = centre;
    std::array<double, 5> unit{}, shift{};
    for (double& u : unit) u = normal(random);
    for (std::size_t r = 0; r < 5; ++r) {
      for (std::size_t k = 0; k < 5; ++k) shift[r] += options.covariance_scale * root[r][k] * unit[k];
    }
    m.k1 += shift[0];
    m.k2 += shift[1];
    m.c += shift[2];
    m.eps += std::complex<double>(shift[3], shift[4]);
    // One after the other: the order of evaluation of function arguments is free, that of statements is not.
    m.k1 *= std::max(0.1, 1 + options.stiffness_sd * normal(random));
    m.c *= std::max(0.05, 1 + options.damping_sd * normal(random));
    const double scale = options.unbalance_sd * normal(random), turn = options.unbalance_sd * normal(random);
    m.eps *= std::complex<double>(1 + scale, turn);
    m.c = std::max(m.c, 0.0);
    Hardware h = machine;
    h.actuator.gain_error = std::max(-0.9, options.gain_sd * normal(random));
    h.actuator.axis_rotation = options.rotation_sd * normal(random);
    h.laser.runout_phase_1x = angle(random);
    h.laser.runout_phase_2x = angle(random);
    h.laser.runout_phase_3x = angle(random);
    ClosedLoopOptions run;
    run.run.seed = random();
    const ClosedLoopMetrics metrics = ClosedLoopPlant(tuning_plant(m, h), run).run(trial);
    out.samples[static_cast<std::size_t>(i)] = {m, metrics.closed.all, metrics.suppression.all,
                                                metrics.stable};
  });

  std::vector<double> peaks;
  double stable = 0;
  for (const auto& s : out.samples) peaks.push_back(s.peak), stable += s.stable;
  std::ranges::sort(peaks);
  const auto quantile = [&](double q) {
    return peaks[static_cast<std::size_t>(std::lround(q * static_cast<double>(peaks.size() - 1)))];
  };
  out.peak_median = quantile(0.5);
  out.peak_p95 = quantile(0.95);
  out.peak_worst = peaks.back();
  const double n = options.samples, p = stable / n, z = 1.6449;  // one-sided 95 %
  out.stable_fraction = p;
  out.stable_low =
      (p + z * z / (2 * n) - z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n))) / (1 + z * z / n);
  return out;
}

}  // namespace whirl
