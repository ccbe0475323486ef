#pragma once
#include "whirl/control/power.hpp"

namespace whirl::control {

/// One axis of the plant seen by a law, x' = v, v' = f + a + D, |D| <= D_max. SI.
struct AxisInput {
  double x = 0;  ///< displacement, m
  double v = 0;  ///< velocity, m/s
  double f = 0;  ///< acceleration by the model without control: stiffness, damping, cubic and disturbance, m/s^2
  double d = 0;  ///< the disturbance (unbalance) part of f, m/s^2
  double d_quarter = 0;  ///< d a quarter turn later: it turns with the rotor, m/s^2
  double omega = 0;      ///< rotor speed, rad/s
};

/// What a law asks for; the force is a / b with b = acceleration per newton.
struct AxisOutput {
  double a = 0;  ///< control acceleration, m/s^2
  double s = 0;  ///< sliding variable, m/s (0 for laws without one)
};

/// Every law is a value for one axis: construction from checked numbers (make_controller does the checking),
/// `step` without allocation, exception or clock, `reset` to the initial memory.
///
/// Saturation: laws with memory take the acceleration that the clipped force really gave through
/// `saturated(a)`.

/// Terminal sliding mode, paper eq. 43 with the input gain carried explicitly (outside):
///   s = v + C phi(x),  a = -[ f + C phi'(x) v + rho tanh(s / eps) ],  phi(x) = L sig(x/L)^r.
/// Regularisation::none is the printed law. rho > D_max reaches |s| <= eps atanh(D_max / rho) (times.hpp).
struct TerminalSmc {
  double surface_gain = 60;     ///< C, 1/s
  double switching_gain = 3;    ///< rho, m/s^2
  double boundary_layer = 0.1;  ///< eps, m/s
  TerminalPower power;

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * power.value(in.x);
    return {-(in.f + surface_gain * power.slope(in.x) * in.v + switching_gain * std::tanh(s / boundary_layer)), s};
  }
  void reset() noexcept {}
};

/// Linear sliding mode: s = v + C x, a = -[ f + C v + rho tanh(s / eps) ]. Exponential decay on the surface,
/// rate C.
struct LinearSmc {
  double surface_gain = 60, switching_gain = 3, boundary_layer = 0.1;

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x;
    return {-(in.f + surface_gain * in.v + switching_gain * std::tanh(s / boundary_layer)), s};
  }
  void reset() noexcept {}
};

/// Nonsingular terminal sliding mode (Feng, Yu, Man, Automatica 2002), the same surface as TerminalSmc solved
/// for x, scaled to a velocity, g = 1/r in (1, 2):
///   s = C x + C L sig(v/(C L))^g,  a = -[ f + (C/g) C L sig(v/(C L))^(2-g) + rho tanh(s / eps) ].
/// No singular term; reaching is slower near v = 0 where the surface is flat. Sliding time: that of
/// TerminalSmc.
struct NonsingularTerminalSmc {
  double surface_gain = 60, switching_gain = 3, boundary_layer = 0.1, exponent = 0.7, length = 1e-3;

  AxisOutput step(const AxisInput& in) noexcept {
    const double g = 1 / exponent, unit = surface_gain * length;
    const double s = surface_gain * in.x + unit * sig(in.v / unit, g);
    return {
        -(in.f + surface_gain / g * unit * sig(in.v / unit, 2 - g) + switching_gain * std::tanh(s / boundary_layer)),
        s};
  }
  void reset() noexcept {}
};

/// Fast terminal sliding mode (Yu, Man, IEEE TCAS-I 2002): s = v + alpha x + C phi(x), linear decay far out
/// and terminal near 0:  a = -[ f + (alpha + C phi'(x)) v + rho tanh(s / eps) ]. Sliding time:
/// slide_time_fast_terminal.
struct FastTerminalSmc {
  double linear_gain = 30;  ///< alpha, 1/s
  double surface_gain = 30, switching_gain = 3, boundary_layer = 0.1;
  TerminalPower power;

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + linear_gain * in.x + surface_gain * power.value(in.x);
    return {-(in.f + (linear_gain + surface_gain * power.slope(in.x)) * in.v +
              switching_gain * std::tanh(s / boundary_layer)),
            s};
  }
  void reset() noexcept {}
};

/// Nonsingular fast terminal sliding mode (Yang, Yang, Nonlinear Dynamics 2011), 1 < g = 1/r < 2, g < a1 =
/// fast_exponent:
///   s = C [ x + kappa L sig(x/L)^a1 ] + C L sig(v/(C L))^g,
///   a = -[ f + (C/g) C L sig(v/(C L))^(2-g) (1 + kappa a1 |x/L|^(a1-1)) + rho tanh(s / eps) ].
struct NonsingularFastTerminalSmc {
  double surface_gain = 60, switching_gain = 3, boundary_layer = 0.1, exponent = 0.7, length = 1e-3;
  double fast_gain = 0.2;      ///< kappa, dimensionless
  double fast_exponent = 1.8;  ///< a1 > 1/r

  AxisOutput step(const AxisInput& in) noexcept {
    const double g = 1 / exponent, unit = surface_gain * length, ratio = in.x / length;
    const double s =
        surface_gain * (in.x + fast_gain * length * sig(ratio, fast_exponent)) + unit * sig(in.v / unit, g);
    const double slope = 1 + fast_gain * fast_exponent * std::pow(std::abs(ratio), fast_exponent - 1);
    return {-(in.f + surface_gain / g * unit * sig(in.v / unit, 2 - g) * slope +
              switching_gain * std::tanh(s / boundary_layer)),
            s};
  }
  void reset() noexcept {}
};

/// Implicit (backward Euler) linear sliding mode: the sign function solved at the next sample is a projection
/// (Acary, Brogliato, Orlov, IEEE TAC 2012):  a = -f - C v - clamp(s / tau, -rho, rho), s = v + C x. tau = h
/// without delay (layer exactly h rho); with n samples of delay tau >= h (n+1)^(n+1)/n^n.
struct ImplicitSmc {
  double surface_gain = 60, switching_gain = 3;
  double tau = 4e-3;  ///< s

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x;
    return {-(in.f + surface_gain * in.v + std::clamp(s / tau, -switching_gain, switching_gain)), s};
  }
  void reset() noexcept {}
};

/// Solves z + g sig(z)^r = x for z (monotone, one root), 0 < r < 1, g >= 0.
double solve_implicit_power(double x, double g, double exponent) noexcept;

/// Implicit terminal sliding mode as a velocity set-point: one backward Euler step on the surface never
/// evaluates the singular term.  z + h C phi(z) = x,  v* = (z - x)/h,  a = -f + clamp((v* - v)/tau, -rho,
/// rho);  s = v - v*.
struct ImplicitTerminalSmc {
  double surface_gain = 60, switching_gain = 3;
  double tau = 4e-3;  ///< s; 3 to 5 h with noise or delay
  double exponent = 0.7, length = 1e-3;
  double sample_time = 1e-3;

  AxisOutput step(const AxisInput& in) noexcept {
    const double z = length * solve_implicit_power(in.x / length, sample_time * surface_gain, exponent);
    const double s = in.v - (z - in.x) / sample_time;
    return {-in.f + std::clamp(-s / tau, -switching_gain, switching_gain), s};
  }
  void reset() noexcept {}
};

/// Super-twisting on s' = phi + u, |phi'| <= L (Levant 1998; gains of Moreno and Osorio 2012):
///   u = -k1 sig(s)^(1/2) + w,  w' = -k2 sgn s,  k1 = 1.5 sqrt(L),  k2 = 1.1 L.
struct SuperTwisting {
  double rate = 100;  ///< L, m/s^3
  double limit = 10;  ///< |w| <= limit, m/s^2: no wind-up under saturation
  double w = 0;       ///< state

  double k1() const noexcept { return 1.5 * std::sqrt(rate); }
  double k2() const noexcept { return 1.1 * rate; }
  /// Explicit Euler step; returns u of this sample.
  double explicit_step(double s, double h) noexcept {
    const double u = -k1() * sig(s, 0.5) + w;
    w = std::clamp(w - h * k2() * sgn(s), -limit, limit);
    return u;
  }
  /// Backward Euler step solved exactly (Brogliato, Polyakov, Efimov, IEEE TAC 2020).
  double implicit_step(double s, double h) noexcept;
};

/// Super-twisting sliding mode on s = v + C x: a = -f - C v + u. `implicit` chooses the discretisation.
struct SuperTwistingSmc {
  double surface_gain = 60;
  SuperTwisting twist;
  double sample_time = 1e-3;
  bool implicit = false;

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x;
    const double u = implicit ? twist.implicit_step(s, sample_time) : twist.explicit_step(s, sample_time);
    return {-in.f - surface_gain * in.v + u, s};
  }
  void reset() noexcept { twist.w = 0; }
};

/// Adaptive gain (Plestan, Shtessel, Bregeault, Poznyak, IJC 2010) on s = v + C x, a = -f - C v - K
/// tanh(s/eps):
///   K' = rate |s| sgn(|s| - mu),  K_min <= K <= K_max; mu >= 4 K h keeps the sampled gain from growing on
///   its own ripple.
struct AdaptiveSmc {
  double surface_gain = 60, boundary_layer = 0.1;
  double rate = 2000;                    ///< Kbar, 1/s^2
  double dead_zone = 0.02;               ///< mu, m/s
  double gain_min = 0.1, gain_max = 10;  ///< m/s^2
  double sample_time = 1e-3;
  double gain = 0.1;  ///< K, state

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x;
    gain = std::clamp(gain + sample_time * rate * std::abs(s) * sgn(std::abs(s) - dead_zone), gain_min, gain_max);
    return {-(in.f + surface_gain * in.v + gain * std::tanh(s / boundary_layer)), s};
  }
  void reset() noexcept { gain = gain_min; }
};

/// Barrier-function gain (Obeid, Fridman, Laghrouche, Harmouche, Automatica 2018): K = K0 |s| / (e - |s|)
/// keeps |s| < e without knowing D_max; capped at gain_max, also for |s| >= e.   a = -f - C v - K(s) sgn s.
struct BarrierSmc {
  double surface_gain = 60;
  double width = 0.1;    ///< e, m/s
  double gain = 1;       ///< K0, m/s^2
  double gain_max = 10;  ///< m/s^2

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x, margin = width - std::abs(s);
    const double k = margin > 0 ? std::min(gain * std::abs(s) / margin, gain_max) : gain_max;
    return {-(in.f + surface_gain * in.v + k * sgn(s)), s};
  }
  void reset() noexcept {}
};

/// Proportional plus derivative with disturbance feedforward: a = -kp x - kd v - d. No model of the stiffness
/// is used; negative kp means that stiffness is taken away.
struct Pd {
  double kp = 0;   ///< 1/s^2
  double kd = 60;  ///< 1/s

  AxisOutput step(const AxisInput& in) noexcept { return {-kp * in.x - kd * in.v - in.d, 0}; }
  void reset() noexcept {}
};

/// PD plus integral with clamped integrator: a = -kp x - kd v - i - d, i' = ki x, |i| <= limit.
struct Pid {
  double kp = 0, kd = 60;
  double ki = 1000;  ///< 1/s^3
  double limit = 5;  ///< of the integral part, m/s^2
  double sample_time = 1e-3;
  double integral = 0;  ///< state, m/s^2

  AxisOutput step(const AxisInput& in) noexcept {
    integral = std::clamp(integral + sample_time * ki * in.x, -limit, limit);
    return {-kp * in.x - kd * in.v - integral - in.d, 0};
  }
  void reset() noexcept { integral = 0; }
};

/// A law for both axes, each with its own memory.
template <class Law>
struct LateralLaw {
  Law x, y;
};

}  // namespace whirl::control
