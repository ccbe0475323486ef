#include "tables.hpp"

#include <cmath>
#include <list>
#include <mutex>
#include <unsupported/Eigen/MatrixFunctions>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/rig/tilt.hpp"
#include "whirl/rotor/equations.hpp"
#include "whirl/rotor/mode_step.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::rig {

namespace {

// q'' + 2 zeta w q' + w^2 q = b f, f' = (c - f) / tau, c held; without lag f = c.
ModeMap mode_map(const RigMode& mode, double mass, double bandwidth, double time) {
  const double w = kTwoPi * mode.frequency, b = mode.participation / mass;
  Eigen::Matrix4d a = Eigen::Matrix4d::Zero();  // (q, q', f, c)
  a(0, 1) = 1;
  a(1, 0) = -w * w;
  a(1, 1) = -2 * mode.damping_ratio * w;
  if (bandwidth > 0) {
    a(1, 2) = b;
    a(2, 2) = -kTwoPi * bandwidth;
    a(2, 3) = kTwoPi * bandwidth;
  } else {
    a(1, 3) = b;
  }
  const Eigen::Matrix4d scaled = a * time;
  const Eigen::Matrix4d e = scaled.exp();
  return {e(0, 0), e(0, 1), e(0, 2), e(0, 3), e(1, 0), e(1, 1), e(1, 2), e(1, 3)};
}

// Surface error under the x sensor and, a quarter turn behind, under the y sensor.
class Surface {
 public:
  explicit Surface(const RigLaser& laser)
      : once_(std::polar(laser.runout_1x, laser.runout_phase_1x)),
        twice_(std::polar(laser.runout_2x, laser.runout_phase_2x)),
        thrice_(std::polar(laser.runout_3x, laser.runout_phase_3x)) {}
  /// `turn` is e^{i beta}.
  rotor::LateralInput<double> error(std::complex<double> turn) const {
    const std::complex<double> a1 = once_ * turn, a2 = twice_ * turn * turn, a3 = thrice_ * turn * turn * turn;
    // e^{-i k pi/2}: -i, -1, i.
    return {a1.real() + a2.real() + a3.real(), a1.imag() - a2.real() - a3.imag()};
  }

 private:
  std::complex<double> once_, twice_, thrice_;
};

// Encoder counts followed by a third-order tracking loop with three equal poles: no lag at constant
// acceleration.
class EncoderTracker {
 public:
  EncoderTracker(const RigEncoder& encoder, double dt, const rotor::AngleState& start)
      : width_(kTwoPi / encoder.counts), dt_(dt), pole_(kTwoPi * encoder.bandwidth), state_(start) {}

  rotor::AngleState read(double beta) {
    const double counted = (std::floor(beta / width_) + 0.5) * width_;
    const double error = counted - state_.beta;
    const double p = pole_;
    state_.beta += 3 * p * dt_ * error;
    state_.omega += 3 * p * p * dt_ * error;
    state_.alpha += p * p * p * dt_ * error;
    const rotor::AngleState now{counted, state_.omega, state_.alpha};
    state_.beta += dt_ * (state_.omega + 0.5 * dt_ * state_.alpha);
    state_.omega += dt_ * state_.alpha;
    return now;
  }

 private:
  double width_, dt_, pole_;
  rotor::AngleState state_;
};

std::vector<rotor::AngleState> measured_angles(const RigParameters& p, const std::vector<rotor::AngleState>& truth) {
  std::vector<rotor::AngleState> out(truth.size());
  const double dt = 1 / p.timing.rate;
  const rotor::AngleFunction commanded(p.profile.without_ripple());
  EncoderTracker tracker(p.encoder, dt, truth.front());
  for (std::size_t k = 0; k < out.size(); ++k) {
    if (p.encoder.profile_angle) {
      out[k] = commanded(dt * static_cast<double>(k));
    } else {
      out[k] = p.encoder.counts > 0 ? tracker.read(truth[k].beta) : truth[k];
    }
  }
  return out;
}

// Adds the motion of one mode under the unbalance, from its steady state, at the sensor instants. Nothing
// acts back on the rotor, so that it can be known beforehand.
void add_forced_mode(const ForcedMode& mode, const AngleTables& angle, double omega0,
                     std::vector<rotor::LateralInput<double>>& seen) {
  using Complex = std::complex<double>;
  const rotor::ModeStep step(mode.omega, mode.zeta, angle.step);
  const auto force = [&](std::size_t half) { return Complex(angle.forcing[half].x, angle.forcing[half].y); };
  Complex q = force(0) / Complex(mode.omega * mode.omega - omega0 * omega0, 2 * mode.zeta * mode.omega * omega0);
  Complex dq = Complex(0, omega0) * q;
  std::size_t tick = 0;
  for (std::size_t i = 0; tick < seen.size(); ++i) {
    for (; tick < seen.size() && angle.sensor_step[tick] == static_cast<long>(i); ++tick) {
      const Complex z = mode.participation * q;
      seen[tick].x += z.real();
      seen[tick].y += z.imag();
    }
    if (2 * i + 2 >= angle.forcing.size()) break;
    step.advance<Complex>(q, dq, force(2 * i), force(2 * i + 1), force(2 * i + 2));
  }
}

}  // namespace

rotor::TiltCoefficients tilt_coefficients(const RigParameters& parameters) {
  if (!parameters.tilt.active()) return {};
  const rotor::GyroscopicRotor r = gyroscopic_rotor(parameters);
  const double id = r.diametral;
  return {r.shaft.k12 / r.mass, r.shaft.k12 / r.shaft.k22, r.polar / id, r.tilt_damping / id, r.shaft.k12 / id,
          r.shaft.k22 / id,     (1 - r.polar / id) * r.chi};
}

AngleTables::AngleTables(const RigParameters& p) {
  const int n = p.timing.substeps;
  const rotor::AngleFunction profile(p.profile);
  ticks = std::lround(p.profile.duration() * p.timing.rate);
  step = 1 / (p.timing.rate * n);

  forcing.resize(static_cast<std::size_t>(2 * n * ticks + 1));
  omega.resize(forcing.size());
  for (std::size_t i = 0; i < forcing.size(); ++i) {
    const rotor::AngleState a = profile(0.5 * step * static_cast<double>(i));
    omega[i] = a.omega;
    const std::complex<double> f = rotor::unbalance_forcing(a.beta, a.omega, a.alpha);
    forcing[i] = {f.real(), f.imag()};
  }

  // In steps: the newest sensor instant that is at least `latency` old at the tick.
  const long per_sample = p.laser.rate > 0 ? std::lround(1 / (p.laser.rate * step)) : 1;
  const long latency = static_cast<long>(std::ceil(p.laser.latency / step - 1e-9));
  for (long k = 0; k <= ticks; ++k) {
    const long newest = std::max(0L, k * n - latency) / per_sample * per_sample;
    sensor_step.push_back(newest);
    sensor_turn.push_back(std::polar(1.0, profile(static_cast<double>(newest) * step).beta));
    true_angle.push_back(profile(static_cast<double>(k) / p.timing.rate));
  }
  measured_angle = measured_angles(p, true_angle);
}

namespace {

bool same_angle(const RigParameters& a, const RigParameters& b) {
  return a.profile == b.profile && a.laser.rate == b.laser.rate && a.laser.latency == b.laser.latency &&
         a.encoder == b.encoder && a.timing == b.timing;
}

std::size_t bytes_of(const AngleTables& t) {
  return t.forcing.size() * sizeof t.forcing[0] + t.omega.size() * sizeof t.omega[0] +
         t.sensor_step.size() * (sizeof t.sensor_step[0] + sizeof t.sensor_turn[0] + 2 * sizeof t.true_angle[0]);
}

/// Margins, a search and the runs of a design come back to a few profiles again and again, and their tables take as
/// long as the run of a short loop: the last ones are kept.
std::shared_ptr<const AngleTables> angle_tables(const RigParameters& p) {
  constexpr std::size_t kMostBytes = 32 << 20;
  struct Kept {
    RigParameters of;
    std::shared_ptr<const AngleTables> tables;
  };
  static std::mutex mutex;
  static std::list<Kept> kept;
  {
    const std::lock_guard lock(mutex);
    for (auto k = kept.begin(); k != kept.end(); ++k) {
      if (!same_angle(k->of, p)) continue;
      kept.splice(kept.begin(), kept, k);
      return k->tables;
    }
  }
  auto made = std::make_shared<const AngleTables>(p);  // others go on in the meantime
  const std::lock_guard lock(mutex);
  kept.push_front({p, made});
  std::size_t bytes = 0;
  for (auto k = kept.begin(); k != kept.end();) {
    bytes += bytes_of(*k->tables);
    k = bytes > kMostBytes ? kept.erase(k) : std::next(k);
  }
  return made;
}

}  // namespace

RigTables::RigTables(const RigParameters& given, const RigTables* like) : parameters(given) {
  const RigParameters& p = parameters;
  p.check();
  angle = like != nullptr && same_angle(like->parameters, p) ? like->angle : angle_tables(p);

  const RotorModel model = p.true_model();
  const double step = angle->step;
  coefficients = rotor::lateral_coefficients(model);
  forces = p.forces.per_mass(p.rotor.mass);
  further = rotor::acts(forces);
  dry = forces.c2 != 0 || forces.friction != 0;
  eps_re = model.eps.real();
  eps_im = model.eps.imag();
  gain = model.gain;
  lag_half_step = p.actuator.bandwidth > 0 ? std::exp(-0.5 * step * kTwoPi * p.actuator.bandwidth) : 0;

  const rotor::AngleState first = p.profile.at(0);
  const rotor::WhirlState whirl = rotor::steady_whirl(model, first.omega, first.beta);
  const auto motion = [](std::complex<double> z, std::complex<double> dz) {
    return rotor::LateralState<double>{z.real(), z.imag(), dz.real(), dz.imag()};
  };
  start.disk = motion(whirl.z, whirl.dz);
  tilt = tilt_coefficients(p);
  if (p.tilt.active()) {
    const rotor::GyroscopicRotor r = gyroscopic_rotor(p);
    // The steady whirl of the linear isotropic rotor.
    const std::complex<double> turn = std::polar(1.0, first.beta), rate(0, first.omega);
    const Eigen::Vector2cd steady = rotor::steady_unbalance(r, first.omega);
    start.disk = motion(steady[0] * turn, rate * steady[0] * turn);
    start.tilt = motion(steady[1] * turn, rate * steady[1] * turn);
  }

  not_disk.reserve(angle->sensor_turn.size());
  const Surface surface(p.laser);
  for (const std::complex<double>& turn : angle->sensor_turn) not_disk.push_back(surface.error(turn));
  for (const ForcedMode& mode : model.modes) add_forced_mode(mode, *angle, first.omega, not_disk);
  for (int i = 1; i <= p.timing.substeps; ++i) {
    std::vector<ModeMap>& maps = mode_maps.emplace_back();
    for (const RigMode& mode : p.modes) maps.push_back(mode_map(mode, p.rotor.mass, p.actuator.bandwidth, i * step));
  }
  sensor_lsb = p.laser.bits > 0 ? p.laser.range / std::ldexp(1.0, p.laser.bits) : 0;
  volt_lsb = p.actuator.bits > 0 ? 2 * p.actuator.voltage_limit / std::ldexp(1.0, p.actuator.bits) : 0;
}

std::shared_ptr<const RigTables> make_rig_tables(const RigParameters& parameters,
                                                 const std::shared_ptr<const RigTables>& like) {
  return std::make_shared<const RigTables>(parameters, like.get());
}

}  // namespace whirl::rig
