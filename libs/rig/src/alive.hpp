#pragma once
#include "vector_registers.hpp"

namespace whirl::rig {

/// The distance of a lagging force from its target, N; none once it has died out. Numbers too small to be normal take
/// ten times as long: without this a rig whose force was switched off ran thirteen times slower.
inline double alive(double distance) { return distance < 1e-100 && distance > -1e-100 ? 0 : distance; }
inline Vector alive(Vector distance) {
  const Vector least = Vector{} + 1e-100;
  return (distance < least) & (distance > -least) ? Vector{} : distance;
}

}  // namespace whirl::rig
