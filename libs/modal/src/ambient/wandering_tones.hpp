#pragma once
#include "whirl/modal/oma.hpp"

namespace whirl::modal {

/// Takes off tones whose frequency wanders, and what else turns with the same speed: a tone has a steady size where
/// random response has none. `y`: samples x channels; `low`, `high`: Hz.
std::vector<Tone> take_off_wandering_tones(Eigen::MatrixXd& y, double dt, double low, double high);

/// Takes off what stands at multiples m/n of a tone that does not wander, the tone itself left out.
std::vector<Tone> take_off_multiples(Eigen::MatrixXd& y, double dt, double frequency, double low, double high);

/// Takes off the orders of a rotor's angle (rad, per sample) that the record shows: halves and multiples below `high`
/// Hz, at most 20.
std::vector<Tone> take_off_shaft_orders(Eigen::MatrixXd& y, double dt, const Eigen::VectorXd& angle, double high);

}  // namespace whirl::modal
