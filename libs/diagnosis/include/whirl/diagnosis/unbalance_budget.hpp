#pragma once
#include <Eigen/Core>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {

/// Permissible residual unbalance of a rotor, kg m: mass * G / Omega (ISO 21940-11; in g mm, kg and r/min
/// 9549 G mass / n). `grade` G in mm/s, `mass` kg, `speed` rad/s. Throws Error for values <= 0.
double permissible_unbalance(double grade, double mass, double speed);

/// What a mass on a plane may differ from what is written; limits of 95 %.
struct PlacingErrors {
  double mass = 0;    ///< kg
  double angle = 0;   ///< rad
  double radius = 0;  ///< m
};

enum class Tolerance { held, not_held, undecided };

/// Residual unbalance of one correction plane with its error budget, kg m. Sources of error as ISO 21940-14 asks to
/// list them: what is known is a part of the residual, what is random adds by the root of the sum of squares (JCGM
/// 100).
struct PlaneBudget {
  double residual = 0;                     ///< of the masses on the rotor against the best ones
  double scatter = 0;                      ///< of the runs, 95 %; NaN: not known
  double mass = 0, angle = 0, radius = 0;  ///< what the placing errors bring
  double error = 0;                        ///< all together, 95 %
  double permitted = 0;                    ///< this plane's share
  /// held: residual + error within `permitted`; not held: residual - error above it; else undecided.
  Tolerance tolerance = Tolerance::undecided;
};

/// `best` with `uncertainty`: the masses that the runs ask for; `on`: what is on the rotor, both by plane in kg;
/// `radius` of the planes, m; `permitted` of the plane, kg m.
PlaneBudget unbalance_budget(Eigen::Index plane, const Eigen::VectorXcd& best, const CorrectionUncertainty& uncertainty,
                             const Eigen::VectorXcd& on, double radius, const PlacingErrors& errors, double permitted);

}  // namespace whirl::diagnosis
