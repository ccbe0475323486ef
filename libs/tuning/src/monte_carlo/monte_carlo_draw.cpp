#include "monte_carlo/monte_carlo_draw.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "monte_carlo/random_numbers.hpp"
#include "runs/design_scenarios.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/rotor_terms.hpp"

namespace whirl::tuning {
namespace {

/// Lower triangular L with L L^T = covariance (Cholesky of the correlations, which are all of order one while
/// k2 and eps differ by twelve orders of magnitude); zero when no covariance is known. Eigen is not used: g++
/// 12 with AVX-512 warns inside its decompositions.
Root covariance_root(const IdentifiedModel& model) {
  const auto& c = model.rotor_covariance;
  Root root{};
  if (c.empty()) return root;
  if (c.size() != 25) {
    throw Error(
        fmt::format("rotor_covariance of the model has {} entries: must be 25 (k1, k2, c, eps_re, eps_im)", c.size()));
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

/// The numbers of one rig of a study.
class Random {
 public:
  Random(std::uint64_t seed, int sample) {
    std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                           static_cast<std::uint32_t>(sample)};
    engine_.seed(sequence);
  }
  std::uint64_t bits() { return engine_(); }
  double uniform() { return tuning::uniform(engine_); }
  double normal() { return tuning::normal(engine_); }
  /// A tolerance of standard deviation 1: evenly between its limits, or Student's distribution with four degrees of
  /// freedom. Both take as many numbers.
  double tolerance(bool limits) {
    const double top = normal(), side = uniform(), chi = -2 * std::log(1 - side) - 2 * std::log(1 - uniform());
    return limits ? std::sqrt(3.0) * (2 * side - 1) : top / std::sqrt(0.5 * chi);
  }
  /// The same, or normal: what an identification says has no limits.
  double measured(bool limits) {
    const double one = normal(), side = uniform();
    return limits ? std::sqrt(3.0) * (2 * side - 1) : one;
  }
  /// A factor about 1 that is not negative: log-normal, or evenly spread with the same standard deviation.
  double factor(double sd, bool limits) {
    const double one = measured(limits);
    return limits ? std::max(1 + sd * one, 0.0) : std::exp(sd * one);
  }
  double angle() { return 2 * std::numbers::pi * uniform(); }

 private:
  std::mt19937_64 engine_;
};

/// A participation is the rotor's modal mass by that of the mode. What carries a rotor is heavier than the rotor: a
/// mode that is lighter is one of the shaft, held by the same steel as the first, and another stiffness moves it too.
bool of_shaft(const rig::RigMode& mode) { return mode.participation > 1; }

/// What sensors and actuators of this machine are of what their data sheets state. Not stated, 0, stays so.
void draw_sheets(rig::RigParameters& rig, double sd, bool limits, Random& random) {
  for (double* number : {&rig.laser.bandwidth, &rig.laser.hysteresis, &rig.actuator.bandwidth,
                         &rig.actuator.current_limit, &rig.actuator.slew, &rig.actuator.hysteresis}) {
    *number *= random.factor(sd, limits);
  }
}

}  // namespace

RigDraw::RigDraw(const RotorModel& centre, const IdentifiedModel& model, const Hardware& hardware,
                 const MonteCarloOptions& options, const control::Runout& removed)
    : centre_(centre), hardware_(hardware), options_(options), removed_(removed), root_(covariance_root(model)) {
  std::vector<identification::RotorTerm> terms = identification::terms_of(model);
  for (identification::RotorTerm& term : terms) {
    const Estimate* value = model.parameter(std::string(term.parameter()));
    term.value = value->sd, term.reference = 0;
  }
  forces_sd_ = further_forces(terms);
}

DrawnRig RigDraw::operator()(int sample) const {
  Random random(options_.seed, sample);
  const bool limits = common_case(CommonUnknown::distribution, sample);
  RotorModel m = centre_;
  std::array<double, 5> unit{}, shift{};
  for (double& u : unit) u = random.normal();
  for (std::size_t r = 0; r < 5; ++r) {
    for (std::size_t k = 0; k < 5; ++k) shift[r] += options_.covariance_scale * root_[r][k] * unit[k];
  }
  m.k1 += shift[0];
  m.k2 += shift[1];
  m.c += shift[2];
  m.eps += std::complex<double>(shift[3], shift[4]);
  // One after the other: the order of evaluation of function arguments is free, that of statements is not.
  const double stiff = std::max(0.1, 1 + options_.stiffness_sd * random.measured(limits));
  m.k1 *= stiff;
  m.c *= std::max(0.05, 1 + options_.damping_sd * random.measured(limits));
  const double scale = options_.unbalance_sd * random.tolerance(limits),
               turn = options_.unbalance_sd * random.tolerance(limits);
  m.eps *= std::complex<double>(1 + scale, turn);
  m.c = std::max(m.c, 0.0);
  Hardware h = hardware_;
  h.actuator.gain_error = std::max(-0.9, options_.gain_sd * random.tolerance(limits));
  h.actuator.axis_rotation = options_.rotation_sd * random.tolerance(limits);
  h.laser.runout_phase_1x = random.angle();
  h.laser.runout_phase_2x = random.angle();
  h.laser.runout_phase_3x = random.angle();
  const std::uint64_t noise_seed = random.bits();
  const double all = common_case(CommonUnknown::runout, sample) ? options_.runout_common : -options_.runout_common;
  for (double* runout : {&h.laser.runout_1x, &h.laser.runout_2x, &h.laser.runout_3x}) {
    *runout *= std::exp(all) * random.factor(options_.runout_sd, limits);
  }
  if (options_.other_machines) {
    m.eps *= std::polar(1.0, random.angle());
    const std::array<std::pair<double*, double*>, 3> own{{{&h.laser.runout_1x, &h.laser.runout_phase_1x},
                                                          {&h.laser.runout_2x, &h.laser.runout_phase_2x},
                                                          {&h.laser.runout_3x, &h.laser.runout_phase_3x}}};
    for (std::size_t k = 0; k < own.size(); ++k) {
      // Of the x axis, as the rig counts it: x = Re(runout e^{i k beta}).
      const std::complex<double> left =
          std::polar(*own[k].first, *own[k].second) - std::complex<double>(removed_.x_cos[k], -removed_.x_sin[k]);
      *own[k].first = std::abs(left), *own[k].second = std::arg(left);
    }
  }
  const double split = 0.2 * options_.stiffness_sd * m.k1, along = random.normal(), across = random.normal();
  RotorModel uneven = m;
  uneven.k1_conj += split * std::complex<double>(along, across);
  rig::RigParameters rig = tuning_plant(uneven, h);
  const rotor::SpeedProfile& run = hardware_.profile;
  const double speed = options_.ringing * std::abs(centre_.eps) * std::max(run.omega_start, run.omega_end);
  const bool rings = common_case(CommonUnknown::ringing, sample);
  for (std::size_t i = 0; i < rig.modes.size(); ++i) {
    rig::RigMode& mode = rig.modes[i];
    if (of_shaft(mode)) mode.frequency *= std::sqrt(stiff);
    mode.participation *= random.factor(options_.participation_sd, limits);
    const bool minus = random.uniform() < 0.5;
    if (hardware_.modes[i].sensor_sign == 0 && minus) mode.sensor_sign = -mode.sensor_sign;
    const double ringing = speed / (2 * std::numbers::pi * mode.frequency) * random.normal();
    if (rings && mode.initial == 0) mode.initial = ringing;
  }
  if (rotor::acts(hardware_.forces)) {
    rotor::FurtherForces<double> forces = hardware_.forces;
    const double friction = forces.friction;
    rotor::each_force(forces, forces_sd_, [&](double& value, const double& sd) {
      if (value != 0 && sd > 0) value += options_.covariance_scale * sd * random.normal();
    });
    // The steps are made for this friction and somewhat more (with_forces).
    forces.friction = std::clamp(forces.friction, 0.0, 2.5 * friction);
    rig.forces = rig::RigForces::of(forces, rig.rotor.mass);
  }
  draw_sheets(rig, options_.sheet_sd, limits, random);
  return {m, rig, noise_seed};
}

}  // namespace whirl::tuning
