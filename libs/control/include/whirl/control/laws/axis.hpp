#pragma once

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

/// Every law is a value for one axis: construction from checked numbers (its factory in src/laws does the checking),
/// `step` without allocation, exception or clock, `reset` to the initial memory. The force limit acts outside: a law
/// with memory bounds that memory itself.

/// A law for both axes, each with its own memory.
template <class Law>
struct LateralLaw {
  Law x, y;
};

}  // namespace whirl::control
