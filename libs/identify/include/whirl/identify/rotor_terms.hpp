#pragma once
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/identified_model.hpp"

namespace whirl::identification {

/// Forces that a rotor may have beyond RotorModel, per unit mass, with one real coefficient each. w: rotor speed,
/// rad/s; b: its angle, rad; t: time since the drift reference, s.
enum class RotorTermKind {
  quintic_stiffness,     ///< -k3 |z|^4 z
  cubic_per_axis,        ///< -k2_axis (x^3 + i y^3): springs along the axes
  quadratic_damping,     ///< -c2 |z'| z'
  coulomb_friction,      ///< -friction z' / sqrt(|z'|^2 + v0^2), v0 a small speed
  gyroscopic,            ///< +gyroscopic i w z': a disc that tilts with the shaft
  rotating_damping,      ///< -c_rotating (z' - i w z): internal damping of the shaft
  cross_coupled,         ///< +k_cross i z: seals, journal bearings
  stiffness_with_speed,  ///< -k1_speed |w| z
  damping_with_speed,    ///< -c_speed |w| z'
  stiffness_drift,       ///< -k1_drift t z: warming
  damping_drift,         ///< -c_drift t z'
  twice_forward_re,      ///< +e2_forward_re w^2 exp(2 i b): misalignment, shafts of unequal stiffness under weight
  twice_forward_im,      ///< +e2_forward_im i w^2 exp(2 i b)
  twice_backward_re,     ///< +e2_backward_re w^2 exp(-2 i b): with the forward ones a force along a fixed direction
  twice_backward_im,     ///< +e2_backward_im i w^2 exp(-2 i b)
};

struct RotorTerm {
  RotorTermKind kind;
  double value = 0;
  double reference = 0;  ///< v0 of Coulomb friction, m/s; the time at which k1 and c hold, s, of a drift
};

/// How an engineer calls a term, its parameter and the unit of it. Terms of one label are one candidate.
struct RotorTermName {
  RotorTermKind kind;
  std::string_view label, parameter, unit;
};
inline constexpr std::array<RotorTermName, 15> kRotorTermNames{{
    {RotorTermKind::quintic_stiffness, "quintic stiffness", "k3", "1/(m^4 s^2)"},
    {RotorTermKind::cubic_per_axis, "cubic stiffness per axis", "k2_axis", "1/(m^2 s^2)"},
    {RotorTermKind::quadratic_damping, "quadratic damping", "c2", "1/m"},
    {RotorTermKind::coulomb_friction, "Coulomb friction", "friction", "m/s^2"},
    {RotorTermKind::gyroscopic, "gyroscopic term", "gyroscopic", ""},
    {RotorTermKind::rotating_damping, "rotating damping", "c_rotating", "1/s"},
    {RotorTermKind::cross_coupled, "cross-coupled stiffness", "k_cross", "1/s^2"},
    {RotorTermKind::stiffness_with_speed, "stiffness changing with speed", "k1_speed", "1/(rad s)"},
    {RotorTermKind::damping_with_speed, "damping changing with speed", "c_speed", "1/rad"},
    {RotorTermKind::stiffness_drift, "stiffness drifting in time", "k1_drift", "1/s^3"},
    {RotorTermKind::damping_drift, "damping drifting in time", "c_drift", "1/s^2"},
    {RotorTermKind::twice_forward_re, "force at twice the speed", "e2_forward_re", "m"},
    {RotorTermKind::twice_forward_im, "force at twice the speed", "e2_forward_im", "m"},
    {RotorTermKind::twice_backward_re, "force at twice the speed", "e2_backward_re", "m"},
    {RotorTermKind::twice_backward_im, "force at twice the speed", "e2_backward_im", "m"},
}};
constexpr const RotorTermName& name_of(RotorTermKind kind) { return kRotorTermNames[static_cast<std::size_t>(kind)]; }

/// The parameter that keeps the reference of a Coulomb or drift term.
std::string reference_name(const RotorTermName& name);

/// Those among the parameters of a model.
std::vector<RotorTerm> terms_of(const IdentifiedModel& model);

/// What a term adds to the equation of x'' or y'', as a function of the paper's states; its coefficient enters with
/// `sign`.
struct TermText {
  std::string function;
  double sign;
};
std::vector<TermText> term_text(const RotorTerm& term, bool x);

/// Of a force that acts whatever the motion is.
constexpr bool is_twice(RotorTermKind kind) { return kind >= RotorTermKind::twice_forward_re; }

/// Of a force that can drive a forward whirl by itself.
constexpr bool drives_whirl(RotorTermKind kind) {
  return kind == RotorTermKind::rotating_damping || kind == RotorTermKind::cross_coupled;
}

/// "Coulomb friction, gyroscopic term"; empty without terms.
std::string names_of(const std::vector<RotorTerm>& terms);

/// Lowest of 1000 equal steps of speed up to `most`, rad/s, from which on small motion about rest grows by rotating
/// damping, cross-coupled stiffness or negative damping; infinite where it does not. Dry friction, which holds small
/// motion, is left out.
double unstable_from(const RotorModel& rotor, const std::vector<RotorTerm>& terms, double most);

/// Force of a term for coefficient 1, and its derivatives.
struct TermForce {
  double x = 0, y = 0;                            ///< m/s^2 per unit of the coefficient
  double x_x = 0, x_y = 0, y_x = 0, y_y = 0;      ///< by the displacement
  double x_vx = 0, x_vy = 0, y_vx = 0, y_vy = 0;  ///< by the velocity
};

inline TermForce term_force(const RotorTerm& term, double x, double y, double vx, double vy, double w, double beta,
                            double time) {
  TermForce f;
  const auto displaced = [&](double g) { f.x = -g * x, f.y = -g * y, f.x_x = f.y_y = -g; };
  const auto damped = [&](double g) { f.x = -g * vx, f.y = -g * vy, f.x_vx = f.y_vy = -g; };
  switch (term.kind) {
    case RotorTermKind::quintic_stiffness: {
      const double r2 = x * x + y * y;
      displaced(r2 * r2);
      f.x_x -= 4 * r2 * x * x, f.y_y -= 4 * r2 * y * y, f.x_y = f.y_x = -4 * r2 * x * y;
      break;
    }
    case RotorTermKind::cubic_per_axis:
      f.x = -x * x * x, f.y = -y * y * y, f.x_x = -3 * x * x, f.y_y = -3 * y * y;
      break;
    case RotorTermKind::quadratic_damping: {
      const double v = std::sqrt(vx * vx + vy * vy), by = v > 0 ? 1 / v : 0;
      damped(v);
      f.x_vx -= by * vx * vx, f.y_vy -= by * vy * vy, f.x_vy = f.y_vx = -by * vx * vy;
      break;
    }
    case RotorTermKind::coulomb_friction: {
      const double v = std::sqrt(vx * vx + vy * vy + term.reference * term.reference), by = 1 / (v * v * v);
      damped(1 / v);
      f.x_vx += by * vx * vx, f.y_vy += by * vy * vy, f.x_vy = f.y_vx = by * vx * vy;
      break;
    }
    case RotorTermKind::gyroscopic:
      f.x = -w * vy, f.y = w * vx, f.x_vy = -w, f.y_vx = w;
      break;
    case RotorTermKind::rotating_damping:
      damped(1);
      f.x -= w * y, f.y += w * x, f.x_y = -w, f.y_x = w;
      break;
    case RotorTermKind::cross_coupled:
      f.x = -y, f.y = x, f.x_y = -1, f.y_x = 1;
      break;
    case RotorTermKind::stiffness_with_speed:
      displaced(std::abs(w));
      break;
    case RotorTermKind::damping_with_speed:
      damped(std::abs(w));
      break;
    case RotorTermKind::stiffness_drift:
      displaced(time - term.reference);
      break;
    case RotorTermKind::damping_drift:
      damped(time - term.reference);
      break;
    case RotorTermKind::twice_forward_re:
      f.x = w * w * std::cos(2 * beta), f.y = w * w * std::sin(2 * beta);
      break;
    case RotorTermKind::twice_forward_im:
      f.x = -w * w * std::sin(2 * beta), f.y = w * w * std::cos(2 * beta);
      break;
    case RotorTermKind::twice_backward_re:
      f.x = w * w * std::cos(2 * beta), f.y = -w * w * std::sin(2 * beta);
      break;
    case RotorTermKind::twice_backward_im:
      f.x = w * w * std::sin(2 * beta), f.y = w * w * std::cos(2 * beta);
      break;
  }
  return f;
}

}  // namespace whirl::identification
