#pragma once
#include "vector_registers.hpp"

namespace whirl::rig {

/// The distance of a lagging force from its target, N; none once it has died out. Numbers too small to be normal take
/// ten times as long: without this a rig whose force was switched off ran twelve times slower. A force of 1e-100 N
/// changes no digit of a motion that is not itself so small.
inline double alive(double distance) { return distance < 1e-100 && distance > -1e-100 ? 0 : distance; }
inline Vector alive(Vector distance) {
  const Vector least = Vector{} + 1e-100;
  return (distance < least) & (distance > -least) ? Vector{} : distance;
}

}  // namespace whirl::rig
