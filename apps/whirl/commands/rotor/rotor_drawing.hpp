#pragma once
#include "whirl/report/figure.hpp"
#include "whirl/shaft/rotor.hpp"

namespace whirl::app {

/// The rotor to scale, seen from the side: shaft with bore, discs as the cylinders of their mass and inertia, supports,
/// bodies, unbalance and probes.
void draw_rotor(report::Figure& figure, const shaft::Rotor& rotor);

}  // namespace whirl::app
