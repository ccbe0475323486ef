#include "whirl/deploy/fmu_survey.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify_rotor.hpp"

namespace whirl::deploy {
namespace {

constexpr double kPullTime = 8, kBlowTime = 8;  // s

/// Columns x, y, beta, omega, omega_dot, ux of a run under the force along x of every tick.
Eigen::MatrixXd run(const std::filesystem::path& fmu, const FmuPlantOptions& options,
                    const std::function<double(long)>& force) {
  FmuPlant plant(fmu, options);
  Eigen::MatrixXd out(plant.ticks(), 6);
  for (Eigen::Index k = 0; k < out.rows(); ++k) {
    const Measurement m = plant.read();
    if (plant.failed() || !std::isfinite(m.x) || !std::isfinite(m.y)) {
      throw Error::in_file(fmu.string(), 0, fmt::format("the FMU refused a step at {:g} s", m.t));
    }
    const double u = force(k);
    out.row(k) << m.x, m.y, m.beta, m.omega, m.omega_dot, u;
    plant.write({u, 0});
    plant.advance();
  }
  return out;
}

FmuPlantOptions at_rest(const FmuPlantOptions& options, double time) {
  FmuPlantOptions still = options;
  still.profile = {};
  still.profile.ramp_time = time;
  return still;
}

/// Mean displacement along x under a Hann window: what rings has no part in it.
double mean_under_window(const Eigen::MatrixXd& table) {
  double sum = 0, weight = 0;
  const auto n = static_cast<double>(table.rows());
  for (Eigen::Index k = 0; k < table.rows(); ++k) {
    const double w = 1 - std::cos(2 * std::numbers::pi * (static_cast<double>(k) + 0.5) / n);
    sum += w * table(k, 0), weight += w;
  }
  return sum / weight;
}

Recording recording(const Eigen::MatrixXd& table, double dt, const std::string& source) {
  Recording r;
  r.dt = dt;
  r.source = source;
  const std::pair<const char*, Quantity> columns[] = {{"x", Quantity::displacement},
                                                      {"y", Quantity::displacement},
                                                      {"beta", Quantity::angle},
                                                      {"omega", Quantity::angular_velocity},
                                                      {"omega_dot", Quantity::angular_acceleration}};
  for (Eigen::Index c = 0; c < 5; ++c) r.add(columns[c].first, columns[c].second, table.col(c));
  return r;
}

}  // namespace

FmuSurvey survey_fmu(const std::filesystem::path& fmu, const FmuPlantOptions& options, double noise) {
  require_range("noise", noise, 0, 1, "m");
  const double h = options.sample_time;
  FmuSurvey out;
  const FmuPlantOptions pull = at_rest(options, kPullTime);
  const double rest = mean_under_window(run(fmu, pull, [](long) { return 0.0; }));
  const auto bent = [&](double force) {
    return mean_under_window(run(fmu, pull, [force](long) { return force; })) - rest;
  };
  // The first pull says how far a force bends it, the second bends it by a fifth of the eccentricity.
  constexpr double kFirst = 0.1;  // N
  const auto pulled = [&](double force) {
    const double x = bent(force);
    if (std::isfinite(x) && x > 0) return x;
    throw Error::in_file(
        fmu.string(), 0,
        fmt::format("at standstill a force ux of {:.3g} N moves x by {:.3g} m: must push it", force, x));
  };
  const double first = pulled(kFirst);
  Eigen::MatrixXd measured = run(fmu, options, [](long) { return 0.0; });
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (double& v : measured.leftCols<2>().reshaped()) v += noise * normal(random);
  out.run = recording(measured, h, "run of " + fmu.string());
  out.model = identification::identify_rotor(out.run);
  if (!out.model.rotor || out.model.summary.status == Status::unusable) {
    throw Error::in_file(fmu.string(), 0,
                         "a run without force gives no rotor with stiffness, damping and unbalance" +
                             (out.model.summary.reason.empty() ? "" : ": " + out.model.summary.reason));
  }
  RotorModel& rotor = *out.model.rotor;

  const double force = 0.2 * std::max(std::abs(rotor.eps), 1e-6) * kFirst / first, x = pulled(force);
  rotor.gain = (rotor.k1 * x + rotor.k2 * x * x * x) / force;

  // The velocity after the blow is that of an orbit of half an eccentricity at the natural frequency.
  const double strength = 0.5 * std::max(std::abs(rotor.eps), 1e-6) * rotor.natural_frequency() / (rotor.gain * h);
  const long begin = std::lround(0.05 / h);
  Eigen::MatrixXd blow = run(fmu, at_rest(options, kBlowTime), [&](long k) { return k == begin ? strength : 0.0; });
  out.blow.dt = h;
  out.blow.source = "impact on " + fmu.string();
  out.blow.add("force", Quantity::force, blow.col(5));
  out.blow.add("x", Quantity::displacement, Eigen::VectorXd(blow.col(0).array() - rest));
  return out;
}

}  // namespace whirl::deploy
