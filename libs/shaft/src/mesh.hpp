#pragma once
#include <vector>

#include "element.hpp"
#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

struct MeshElement {
  ElementShape shape;
  std::size_t material;
};
/// Nodes at the ends of all sections and at every station that the rotor names, elements between them.
struct Mesh {
  std::vector<double> nodes;
  std::vector<MeshElement> elements;

  /// The node at a station; the nearest one.
  std::size_t node(double position) const;
};
Mesh make_mesh(const Rotor& rotor, int refinement);

}  // namespace whirl::shaft
