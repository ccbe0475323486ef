#pragma once
#include <vector>

#include "terms/growing_model.hpp"
#include "weak/weak_rows.hpp"
#include "whirl/identify/score_test.hpp"

namespace whirl::identification::detail {

/// Weak rows of one candidate with one or more unknowns.
struct ScoreColumns {
  int place = 0;
  std::vector<Eigen::VectorXcd> columns = {};
  bool real = false;  ///< the unknowns of the columns are real
};

/// Springs about the simulated motion: an error n of z is taken for the force stiffness n + turned conj n.
struct Linearised {
  Eigen::VectorXd stiffness;
  Eigen::VectorXcd turned;
};

/// What the score test of one record hands to the terms.
class ScorePoint {
 public:
  ScorePoint(const RotorRecord& record, const WeakRows& rows, const OutputErrorFit& fit, std::size_t number,
             const OutputErrorOptions& active, const ScoreTestOptions& options, bool both_axes);

  const RotorRecord& record;
  const WeakRows& rows;
  const OutputErrorFit& fit;
  const OutputErrorRecord& own;  ///< with the simulated motion
  const OutputErrorOptions& active;
  const ScoreTestOptions& options;
  const bool both;                          ///< some record shows both axes
  const Eigen::VectorXcd carrier, forcing;  ///< e^{i beta}, F
  const Linearised springs;

  /// Rows of a force, m/s^2, along the simulated motion.
  Eigen::VectorXcd force(const Eigen::VectorXcd& along) const { return rows.apply(0, along); }
  /// Rows of an error of the readings, m.
  Eigen::VectorXcd error(const Eigen::VectorXcd& along) const;
  /// Force by an angle that is read later, m/s^2 per s.
  Eigen::VectorXcd late() const;
  /// State of the simulated motion at a sample.
  TermPoint state(Eigen::Index sample) const;
  /// Readings that turn forward, and where both axes are measured backward.
  std::vector<Eigen::VectorXcd> both_ways(const Eigen::VectorXcd& forward) const;
};

}  // namespace whirl::identification::detail
