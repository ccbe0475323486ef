#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/fit_model.hpp"
#include "whirl/shaft/fit/order_run.hpp"

namespace whirl::shaft {

/// The modes that the speed passes or comes near, at nodes over speed, each continued from node to node: what makes the
/// motion of a run differ from the steady one. Of mode k, with a' its pole (1/s) and r, l its vectors in state space,
/// l' r = 1, the coordinate c of the motion c(t) r e^{i theta} obeys
///     c' = (a - i Omega) c + (Omega^2 - i Omega') l'f + Omega' sum_j N_kj c_j,   N_kj = -l_k' A' r_j / (a_j - a_k),
/// where N holds the turning of the shapes with speed.
struct SweepNode {
  Eigen::VectorXcd pole, slope;     ///< and its slope over speed
  Eigen::MatrixXcd reading;         ///< probes x modes: of r
  Eigen::MatrixXcd reading_rate;    ///< and its slope over speed
  Eigen::MatrixXcd source;          ///< modes x columns: l'f
  Eigen::MatrixXcd coupling;        ///< N
  Eigen::MatrixXcd pole_slopes;     ///< modes x structural unknowns
  Eigen::MatrixXcd reading_slopes;  ///< (probes modes) x structural unknowns
  Eigen::MatrixXcd source_slopes;   ///< (modes columns) x structural unknowns
};
struct SweepModes {
  Eigen::VectorXd speed;
  std::vector<SweepNode> nodes;
  Eigen::Index count = 0;

  enum class Part {
    motion,  ///< poles, sources and coupling
    slopes,  ///< with them the slopes of poles and sources
    whole,   ///< with these the readings, their slopes and how they change over speed
  };
  /// Between two nodes: poles by the cubic through values and slopes, all else by the cubic through the four nodes
  /// about.
  void read(double speed, SweepNode& node, Part part) const;
};
SweepModes sweep_modes(const FitModel& model, double lowest, double highest, int nodes);

/// How the vectors of a run differ from the steady ones: mean coordinates of the modes in each block less their steady
/// ones.
struct SweepPart {
  Eigen::MatrixXcd readings;   ///< (probes columns) x blocks: added to the steady readings, for a unit of a column
  Eigen::MatrixXcd conjugate;  ///< the same, times the conjugate size: what a change within a turn leaves
};
SweepPart sweep_part(const FitModel& model, const SweepModes& modes, const OrderRun& run);

/// Slopes of the same over the structural unknowns, for given sizes of the columns: (probes unknowns) x blocks. The
/// equation of a coordinate, differentiated, is integrated beside it: the slope at a block holds the way there. How the
/// coupling of the modes moves is left out.
Eigen::MatrixXcd sweep_slopes(const FitModel& model, const SweepModes& modes, const OrderRun& run,
                              const Eigen::VectorXcd& sizes);

}  // namespace whirl::shaft
