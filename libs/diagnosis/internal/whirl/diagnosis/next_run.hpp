#pragma once
#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {

/// What a balancing job needs next.
enum class BalancingStep {
  as_found,    ///< the rotor without masses
  trial,       ///< a trial mass on one plane
  repeat,      ///< a run again: it contradicts the others or their corrections do not do what they should
  correction,  ///< the masses that the runs ask for; the run with them is the check, and the next fit uses it
  done         ///< nothing more: the target holds, or these planes cannot do better
};
std::string step_name(BalancingStep step);

/// What the next run has to respect.
struct BalancingPlan {
  double trial = 0;                                        ///< size of the first trial mass, unit of the masses, > 0
  double limit = std::numeric_limits<double>::infinity();  ///< largest mass on a plane
  double target = 0;  ///< every reading at or below it is good, m zero-to-peak; 0: none
  double allowed = std::numeric_limits<double>::infinity();  ///< no run may be predicted above it, m zero-to-peak
  /// By row: angle (rad, with rotation, from the mark) of the shaft's high spot at a reading of phase zero; NaN:
  /// unknown.
  Eigen::VectorXd high_spot;
  /// By row: angle from the high spot to the heavy spot, rad with rotation: 0 far below the critical speed, pi far
  /// above it; NaN: unknown.
  Eigen::VectorXd heavy_ahead;
  Criterion criterion = Criterion::least_squares;
  std::vector<Places> places;   ///< by plane; empty: anywhere
  bool drop_dependent = false;  ///< planes below Darlow's 20 % get no mass
};

/// A run to make, with the reason.
struct NextRun {
  BalancingStep step = BalancingStep::as_found;
  int plane = -1;                   ///< of a trial
  Eigen::VectorXcd masses;          ///< all that shall be on the rotor, by plane
  std::vector<PlacedMass> placed;   ///< the same on holes and pieces, when the plan has places
  std::string why;                  ///< one sentence
  std::vector<Estimate> predicted;  ///< |reading| by row with these masses; empty when nothing tells it
  bool target_held = false;         ///< of `done`: every reading of the last run is at or below the target
  Summary summary;                  ///< ok, or why the job cannot end well
};

/// Rules, in this order: the rotor as found; a contradiction that nothing decides is measured again; each plane a
/// trial, the first at `plan.trial`, later ones scaled by what the earlier did (an effect of 40 % of the readings is
/// wanted, below 15 % the trial is made again with more); then the correction for the rotor as it is now, as often as
/// it is predicted to take away a fifth of the largest reading or more (least squares: of the root of the squares)
/// beyond the scatter. A trial stands opposite to the heavy spot where the plan knows it, at a right angle to the high
/// spot where only that is known (it is then never the worst place), where earlier trials tell the influence opposite
/// to what the readings ask for. Throws Error as job.check().
NextRun next_run(const BalancingJob& job, const BalancingPlan& plan, const InfluenceOptions& options = {});

/// One reading of the last run against what all runs before it foretold.
struct Foretold {
  Estimate predicted;  ///< |reading|, 95 % for one new reading
  double measured = 0;
  bool inside = true;  ///< the vector, not only its length
};
/// Empty when the runs before do not tell every plane; without an interval (NaN) when they do not tell their scatter.
std::vector<Foretold> check_last_run(const BalancingJob& job, const InfluenceOptions& options = {});

}  // namespace whirl::diagnosis
