#pragma once
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "whirl/core/modal_model.hpp"
#include "whirl/io/uff.hpp"

namespace whirl::io {

/// Where the points of a test lie and which lines join them.
struct Geometry {
  struct Node {
    std::string name;
    Eigen::Vector3d position;  ///< m
  };
  std::vector<Node> nodes;
  std::vector<std::array<std::size_t, 2>> lines;  ///< indices into `nodes`

  bool empty() const { return nodes.empty(); }
  /// Index of the node; npos when there is none.
  std::size_t find(const std::string& name) const;
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);
};

/// From a universal file (datasets 15, 2411, 82, 2412, lengths by 164) or a TOML file:
///
///     [nodes]
///     1_mm = [0, 0, 0]
///     2_mm = [250, 0, 0]
///     [lines]
///     frame = ["1", "2"]      # joined one after the other
///
/// Throws Error with file and line for a line to a node that is not there.
Geometry read_geometry(const std::filesystem::path& path);

/// A direction of motion of a point, "12:+X": node and unit vector; no direction: zero vector.
struct PointDirection {
  std::string node;
  Eigen::Vector3d direction;
};
PointDirection point_direction(const std::string& point);

/// Modes as dataset 55 (complex eigenvalues, displacement) with the geometry (datasets 15, 82, 2412). `shapes`: points
/// x modes, points named "node:+X". Nodes without a number are numbered on from the largest, their names in the header.
UffFile uff_from_modes(const ModalModel& model, const std::vector<std::string>& points, const Eigen::MatrixXcd& shapes,
                       const Geometry& geometry);

}  // namespace whirl::io
