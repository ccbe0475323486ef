#include "whirl/rotor/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/core/integrate.hpp"
#include "whirl/rotor/lateral_step.hpp"
#include "whirl/rotor/mode_step.hpp"

namespace whirl::rotor {

namespace {

using Complex = std::complex<double>;
using Input = LateralInput<double>;

struct Steps {
  const RotorModel& model;
  const Eigen::VectorXcd& forcing;  // 2 per step, and one
  double h;
};

// Calls store(i, state) at every `per_sample`-th step.
template <class Store>
void integrate_main(const Steps& steps, const WhirlState& start, int per_sample, const Eigen::VectorXcd& force,
                    Store&& store) {
  const RotorModel& m = steps.model;
  const LateralCoefficients<double> a = lateral_coefficients(m);
  const double er = m.eps.real(), ei = m.eps.imag();
  const auto input = [&](Eigen::Index i, double ux, double uy) {
    const double fr = steps.forcing[i].real(), fi = steps.forcing[i].imag();
    return Input{er * fr - ei * fi + ux, er * fi + ei * fr + uy};
  };
  LateralState<double> s{start.z.real(), start.z.imag(), start.dz.real(), start.dz.imag()};
  const Eigen::Index samples = (steps.forcing.size() - 1) / (2 * per_sample) + 1;
  store(0, s);
  for (Eigen::Index n = 1; n < samples; ++n) {
    const double ux = force.size() ? m.gain * force[n - 1].real() : 0,
                 uy = force.size() ? m.gain * force[n - 1].imag() : 0;
    for (int k = 0; k < per_sample; ++k) {
      const Eigen::Index i = 2 * ((n - 1) * per_sample + k);
      s = lateral_step(a, s, input(i, ux, uy), input(i + 1, ux, uy), input(i + 2, ux, uy), steps.h);
    }
    store(n, s);
  }
}

void add_forced_mode(const ForcedMode& mode, const AngleSignal& angle, const Eigen::VectorXcd& forcing, double h,
                     int per_sample, Response& out) {
  const ModeStep step(mode.omega, mode.zeta, h);
  const double w = angle.omega[0];
  Complex q = forcing[0] / Complex(mode.omega * mode.omega - w * w, 2 * mode.zeta * mode.omega * w),
          dq = Complex(0, w) * q;
  out.z[0] += mode.participation * q;
  out.dz[0] += mode.participation * dq;
  for (Eigen::Index n = 1; n < out.z.size(); ++n) {
    for (int k = 0; k < per_sample; ++k) {
      const Eigen::Index i = 2 * ((n - 1) * per_sample + k);
      step.advance<Complex>(q, dq, forcing[i], forcing[i + 1], forcing[i + 2]);
    }
    out.z[n] += mode.participation * q;
    out.dz[n] += mode.participation * dq;
  }
}

Response empty_response(double dt, Eigen::Index samples) {
  Response out;
  out.dt = dt;
  out.z.resize(samples);
  out.dz.resize(samples);
  return out;
}

auto store_in(Response& out) {
  return [&out](Eigen::Index n, const LateralState<double>& s) {
    out.z[n] = Complex(s.x, s.y);
    out.dz[n] = Complex(s.vx, s.vy);
  };
}

void check_grid(const Eigen::Index size, double dt) {
  if (!(dt > 0)) throw Error::in_field("dt", fmt::format("{:g} s", dt), "above 0");
  if (size % 2 == 0) throw Error::in_field("angle size", fmt::format("{}", size), "odd: 2 N - 1 entries for N samples");
}

}  // namespace

AngleSignal refine(const AngleSignal& angle, int substeps) {
  const Eigen::Index panels = angle.beta.size() - 1;
  AngleSignal fine;
  fine.dt = angle.dt / substeps;
  fine.beta.resize(panels * substeps + 1);
  fine.omega.resize(fine.beta.size());
  fine.alpha.resize(fine.beta.size());
  const double h = 0.5 * angle.dt;
  for (Eigen::Index i = 0; i < panels; ++i) {
    const double b0 = angle.beta[i], w0 = angle.omega[i] * h, a0 = 0.5 * angle.alpha[i] * h * h;
    const double b1 = angle.beta[i + 1] - b0 - w0 - a0;
    const double w1 = angle.omega[i + 1] * h - w0 - 2 * a0;
    const double a1 = angle.alpha[i + 1] * h * h - 2 * a0;
    const double c3 = 10 * b1 - 4 * w1 + 0.5 * a1, c4 = -15 * b1 + 7 * w1 - a1, c5 = 6 * b1 - 3 * w1 + 0.5 * a1;
    for (int k = 0; k < substeps; ++k) {
      const double s = static_cast<double>(k) / substeps;
      const Eigen::Index at = i * substeps + k;
      fine.beta[at] = b0 + s * (w0 + s * (a0 + s * (c3 + s * (c4 + s * c5))));
      fine.omega[at] = (w0 + s * (2 * a0 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / h;
      fine.alpha[at] = (2 * a0 + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))) / (h * h);
    }
  }
  fine.beta.tail<1>() = angle.beta.tail<1>();
  fine.omega.tail<1>() = angle.omega.tail<1>();
  fine.alpha.tail<1>() = angle.alpha.tail<1>();
  return fine;
}

Recording Response::recording() const {
  Recording r;
  r.dt = dt;
  r.source = "simulation";
  r.add("x", Quantity::displacement, z.real());
  r.add("y", Quantity::displacement, z.imag());
  return r;
}

Response simulate_main_mode(const RotorModel& model, const Eigen::VectorXcd& forcing, double dt,
                            const WhirlState& start) {
  check_grid(forcing.size(), dt);
  Response out = empty_response(dt, (forcing.size() + 1) / 2);
  integrate_main({model, forcing, dt}, start, 1, {}, store_in(out));
  return out;
}

Response simulate(const RotorModel& model, const AngleSignal& angle, const WhirlState& start, int substeps,
                  const Eigen::VectorXcd& force) {
  check_grid(angle.beta.size(), angle.dt);
  if (angle.omega.size() != angle.beta.size() || angle.alpha.size() != angle.beta.size()) {
    throw Error::in_field(
        "angle", fmt::format("{} / {} / {} entries", angle.beta.size(), angle.omega.size(), angle.alpha.size()),
        "of equal length in beta, omega and alpha");
  }
  if (substeps < 1) throw Error::in_field("substeps", fmt::format("{}", substeps), "at least 1");
  const Eigen::Index samples = angle.samples();
  if (force.size() != 0 && force.size() != samples) {
    throw Error::in_field("force", fmt::format("{} values", force.size()), fmt::format("one per sample ({})", samples));
  }
  if (force.size() != 0 && model.gain == 0)
    throw Error("force given, but model.gain = 0: the effect of a force is not known");
  const Eigen::VectorXcd forcing = unbalance_forcing(substeps == 1 ? angle : refine(angle, substeps));
  const double h = angle.dt / substeps;
  Response out = empty_response(angle.dt, samples);
  integrate_main({model, forcing, h}, start, substeps, force, store_in(out));
  for (const ForcedMode& mode : model.modes) add_forced_mode(mode, angle, forcing, h, substeps, out);
  out.z.array() += model.offset;
  return out;
}

Response simulate(const RotorModel& model, const AngleSignal& angle) {
  check_grid(angle.beta.size(), angle.dt);
  if (angle.omega.size() != angle.beta.size()) return simulate(model, angle, WhirlState{});
  const WhirlState start = steady_whirl(model, angle.omega[0], angle.beta[0]);
  const double forced = angle.omega.cwiseAbs().maxCoeff();
  int substeps = steps_per_sample(angle.dt, free_frequency(model, std::abs(start.z)), forced);
  while (true) {
    Response out = simulate(model, angle, start, substeps);
    // A harder spring far out is a faster motion.
    const double radius = (out.z.array() - model.offset).abs().maxCoeff();
    const int needed = steps_per_sample(angle.dt, free_frequency(model, radius), forced);
    if (!std::isfinite(radius) || needed <= substeps) return out;
    substeps = needed;
  }
}

int steps_per_sample(double dt, double free, double forced) {
  constexpr double kFree = 0.1, kForced = 0.5;  // rad a step
  constexpr double kMost = 1e4;
  const double steps = std::max(dt * free / kFree, dt * forced / kForced);
  return static_cast<int>(std::ceil(std::clamp(steps, 1.0, kMost)));
}

double free_frequency(const RotorModel& model, double radius) {
  return std::sqrt(std::abs(model.k1) + std::abs(model.k1_conj) + 3 * std::abs(model.k2) * radius * radius);
}

DrivenResponse simulate_driven(const UnbalancedDisk& disk, const TorqueModel& torque, const DiskState& start, double dt,
                               Eigen::Index samples) {
  using State = Eigen::Matrix<double, 6, 1>;  // eq. 22
  if (!(disk.inertia_about_g() > 0)) throw Error("disk.inertia must be above mass * eccentricity^2");
  if (samples < 1) throw Error::in_field("samples", fmt::format("{}", samples), "at least 1");
  DrivenResponse out{empty_response(dt, samples), {}};
  const Eigen::Index entries = 2 * samples - 1;
  check_grid(entries, dt);
  out.angle.dt = dt;
  out.angle.beta.resize(entries);
  out.angle.omega.resize(entries);
  out.angle.alpha.resize(entries);
  bool held = false;  // by Coulomb friction; then the unbalance exerts no force
  UnbalancedDisk held_disk = disk;
  held_disk.eccentricity = 0;
  const auto acceleration = [&](const State& s) {
    const DiskState state{s[0], s[1], s[2], s[3], s[4], s[5]};
    return held ? lagrange_acceleration(held_disk, state, 0, 0, 0)
                : lagrange_acceleration(disk, state, 0, 0, torque.torque(s[5]));
  };
  const auto rate = [&](double, const State& s) {
    const DiskAcceleration a = acceleration(s);
    State r;
    r << s[1], a.ddx, s[3], a.ddy, s[5], a.alpha;
    return r;
  };
  State s;
  s << start.x, start.dx, start.y, start.dy, start.beta, start.omega;
  for (Eigen::Index i = 0; i < entries; ++i) {
    if (i % 2 == 0) {
      out.lateral.z[i / 2] = {s[0], s[2]};
      out.lateral.dz[i / 2] = {s[1], s[3]};
    }
    out.angle.beta[i] = s[4];
    out.angle.omega[i] = s[5];
    out.angle.alpha[i] = acceleration(s).alpha;
    // Within the step that would reverse it Coulomb friction stops the rotor: constant deceleration to that instant.
    if (std::abs(torque.motor) <= torque.coulomb && s[5] * (s[5] + 0.5 * dt * out.angle.alpha[i]) <= 0) {
      if (!held && s[5] != 0) s[4] -= 0.5 * s[5] * s[5] / out.angle.alpha[i];
      held = true;
      s[5] = 0;
    }
    s = rk4_step(rate, 0.0, s, 0.5 * dt);
  }
  return out;
}

}  // namespace whirl::rotor
