// The two tests of the paper on the rotor at rest: lateral stiffness (section III-B) and modal hammer
// (section IV-B).
#include <fmt/format.h>

#include <cmath>

#include "normal.hpp"
#include "tables.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/rotor/mode_step.hpp"

namespace whirl::rig {

namespace {

double rounded(double value, double resolution) {
  return resolution > 0 ? std::round(value / resolution) * resolution : value;
}

// Voltage over +- 10 V, clipped and converted, back to the physical unit.
double digitise(double value, const MeasuringChain& chain, int bits, double noise) {
  constexpr double kVolts = 10;
  const double clipped = std::max(-chain.range, std::min(chain.range, value));
  const double volts = std::max(-kVolts, std::min(kVolts, clipped * chain.volt_per_unit + noise));
  const double lsb = bits > 0 ? 2 * kVolts / std::ldexp(1.0, bits) : 0;
  return rounded(volts, lsb) / chain.volt_per_unit;
}

}  // namespace

StiffnessTable simulate_stiffness_test(const RigParameters& parameters, const StiffnessTestOptions& o) {
  parameters.check();
  require_range("max_deflection", o.max_deflection, 1e-9, 1, "m");
  require_range("points", o.points, 2, 1e6);
  const RotorModel model = parameters.true_model();
  const rotor::FurtherForces<double> forces = parameters.forces.per_mass(parameters.rotor.mass);
  const double mass = parameters.rotor.mass;
  const std::complex<double> along = std::polar(1.0, o.direction);
  Normal normal(o.seed);
  const int total = o.unloading ? 2 * o.points - 1 : o.points;
  StiffnessTable table{Eigen::VectorXd(total), Eigen::VectorXd(total)};
  for (int i = 0; i < total; ++i) {
    const int step = i < o.points ? i : total - 1 - i;
    // Set by hand to about a graduation: without that scatter the rounding of the dial would be the same in every
    // table.
    const double d = o.max_deflection * step / (o.points - 1) + 0.5 * o.deflection_resolution * normal();
    const std::complex<double> z = d * along;
    const rotor::LateralInput<double> more =
        rotor::further_rate(forces, rotor::at_speed(forces, 0, 0), false, {z.real(), z.imag(), 0, 0});
    const std::complex<double> spring = mass * ((model.k1 + model.k2 * d * d) * z + model.k1_conj * std::conj(z) -
                                                std::complex<double>(more.x, more.y));
    const double force = (spring * std::conj(along)).real();
    table.force[i] = rounded(force + o.force_noise * normal(), o.force_resolution);
    table.deflection[i] = rounded(d + o.zero_offset, o.deflection_resolution);
  }
  return table;
}

std::vector<Recording> simulate_hammer_test(const RigParameters& parameters, const HammerTestOptions& o) {
  parameters.check();
  require_range("impacts", o.blows, 1, 10000);
  require_range("rate", o.rate, 10, 1e6, "Hz");
  require_range("duration", o.duration, 10 / o.rate, 1e4, "s");
  require_range("pretrigger", o.pretrigger, 0, o.duration, "s");
  require_range("pulse", o.pulse[0], 1e-6, o.pulse[1], "s");
  require_range("force", o.force[1], o.force[0], 1e6, "N");

  // The pulse is smooth on the step; steps are far below the shortest period of interest.
  constexpr int kSubsteps = 8;
  const double step = 1 / (o.rate * kSubsteps);
  const rotor::LateralCoefficients<double> coefficients = rotor::lateral_coefficients(parameters.true_model());
  const rotor::FurtherForces<double> forces = parameters.forces.per_mass(parameters.rotor.mass);
  const rotor::TiltCoefficients tilt = tilt_coefficients(parameters);
  const double mass = parameters.rotor.mass;
  std::vector<rotor::ModeStep> steps;
  for (const RigMode& mode : parameters.modes) {
    steps.emplace_back(2 * std::numbers::pi * mode.frequency, mode.damping_ratio, step);
  }
  struct ModeState {
    std::complex<double> q, dq;
  };

  Normal normal(o.seed);
  const std::complex<double> along = std::polar(1.0, o.direction);
  const Eigen::Index samples = std::lround(o.duration * o.rate);
  std::vector<Recording> records;
  for (int blow = 0; blow < o.blows; ++blow) {
    const auto between = [&](double low, double high) { return low + (high - low) * 0.5 * (1 + normal.uniform()); };
    const double peak = between(o.force[0], o.force[1]), length = between(o.pulse[0], o.pulse[1]);
    // The blow does not fall on a sample.
    const double start = o.pretrigger + between(0, 1) / o.rate;
    const auto pulse = [&](double t) {
      return t > start && t < start + length ? peak * std::sin(std::numbers::pi * (t - start) / length) : 0.0;
    };
    const auto input = [&](double t) {
      const std::complex<double> a = pulse(t) / mass * along;
      return rotor::TiltedInput{.disk = {a.real(), a.imag()}};
    };
    rotor::TiltedState rotor;
    std::vector<ModeState> modes(steps.size());
    Eigen::VectorXd force(samples), acc_x(samples), acc_y(samples);
    for (Eigen::Index i = 0; i < samples; ++i) {
      const double t = static_cast<double>(i) / o.rate;
      const rotor::LateralState<double> rate = rotor::tilted_rate(coefficients, forces, tilt, rotor, input(t)).disk;
      std::complex<double> acceleration(rate.vx, rate.vy);
      for (std::size_t k = 0; k < modes.size(); ++k) {
        const RigMode& mode = parameters.modes[k];
        const double w = 2 * std::numbers::pi * mode.frequency;
        acceleration += mode.sensor_sign * (mode.participation * pulse(t) / mass * along -
                                            2 * mode.damping_ratio * w * modes[k].dq - w * w * modes[k].q);
      }
      const auto noise = [&] { return o.converter_noise * normal(); };
      force[i] = digitise(pulse(t), o.hammer, o.bits, noise());
      acc_x[i] = digitise(acceleration.real(), o.accelerometer, o.bits, noise());
      acc_y[i] = digitise(acceleration.imag(), o.accelerometer, o.bits, noise());
      for (int s = 0; s < kSubsteps; ++s) {
        const double now = t + s * step, mid = now + 0.5 * step, end = now + step;
        for (std::size_t k = 0; k < modes.size(); ++k) {
          const std::complex<double> gain = parameters.modes[k].participation / mass * along;
          steps[k].advance<std::complex<double>>(modes[k].q, modes[k].dq, gain * pulse(now), gain * pulse(mid),
                                                 gain * pulse(end));
        }
        rotor = rotor::tilted_step(coefficients, forces, tilt, rotor, input(now), input(mid), input(end), step);
      }
    }
    Recording r;
    r.dt = 1 / o.rate;
    r.source = fmt::format("simulated rig, hammer impact {}", blow + 1);
    r.add("force", Quantity::force, std::move(force));
    r.add("acc_x", Quantity::acceleration, std::move(acc_x));
    r.add("acc_y", Quantity::acceleration, std::move(acc_y));
    records.push_back(std::move(r));
  }
  return records;
}

}  // namespace whirl::rig
