#pragma once
#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/quantity.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/diagnosis/unbalance_budget.hpp"
#include "whirl/report/document.hpp"

namespace whirl::balancing {

/// What stands on a field balancing sheet. Amplitudes of rows and influence in the reader's kind (`amplitude`), phases
/// and angles in the reader's convention; SI.
struct BalancingSheet {
  struct Plane {
    std::string name;
    Estimate mass;                                  ///< kg
    Estimate angle;                                 ///< rad
    std::vector<std::pair<double, double>> placed;  ///< kg, rad; empty: as computed
    double independent = 1;                         ///< part that no other plane gives
    std::optional<diagnosis::PlaneBudget> budget;   ///< when mass, radius and speed are stated
  };
  struct Row {
    std::string name;
    double speed = 0;  ///< rad/s; 0: not known
    Estimate before, after;
    double before_phase = 0, after_phase = 0;
    double before_pp = 0, after_pp = 0;  ///< m peak-to-peak, for the zones
    double measured = std::nan("");      ///< mean vector of the runs without any mass, its size; NaN: there are none
  };
  struct Coefficient {
    std::string row, plane;
    double magnitude = 0, sd = 0;  ///< m/kg
    double phase = 0;
  };
  /// A reading of the last run (the check) against what the runs before foretold.
  struct Check {
    Estimate predicted;
    double measured = 0;
    bool inside = true;
  };
  /// A state (runs that are near-repeats) foretold by the runs of the other states.
  struct LeftOut {
    std::string runs;
    bool told = false;
    Eigen::VectorXd foretold, measured;  ///< by row, in the reader's kind; NaN: not read
    double error = 0;                    ///< rms over the rows, m
  };
  struct OtherMass {
    std::string plane;
    double mass = 0, angle = 0;  ///< kg, rad
  };
  std::string title, convention, criterion, amplitude;
  bool amplitude_stated = true;                ///< else `amplitude` is "as read", and no zones follow
  Quantity quantity = Quantity::displacement;  ///< of all readings, SI
  std::string unit;                            ///< suffix in which the readings were written; empty: usual
  bool phases = true;                          ///< false: amplitudes alone
  bool lag = false;                            ///< the reader's phases
  double kind = 1;                             ///< the reader's amplitude of a vector of one metre 0-p
  std::vector<Plane> planes;
  std::vector<Row> rows;
  std::vector<Coefficient> influence;
  std::vector<std::pair<std::string, Eigen::VectorXcd>> runs;  ///< readings, lead, 0-p
  Eigen::VectorXcd before, after;                              ///< lead, 0-p
  std::vector<std::pair<std::string, std::string>> next;       ///< guided job: what to do next, or its end
  std::vector<Check> check;                                    ///< empty: nothing was foretold
  std::vector<LeftOut> left_out;
  std::vector<std::vector<OtherMass>> other_answers;  ///< masses that amplitudes alone allow as well
  double left_out_error = 0, left_out_share = 0;      ///< m; of the rms reading; NaN: none is predictable
  double repeat_share = 0;                            ///< scatter of near-repeats over the rms reading; NaN: none
  std::vector<double> zones;  ///< stated upper limits of A, B, C in the reader's kind, m; empty: ISO 20816-3
  double grade = 0;           ///< asked for, mm/s
  double repeatability = 0, drift = 0, objective = 0, bound = 0;
  Summary summary;
};

/// Masses, readings before and after with zones of ISO 20816-3, influence coefficients, polar plots.
report::Document balancing_sheet(const BalancingSheet& sheet);

}  // namespace whirl::balancing
