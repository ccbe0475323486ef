#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/core/summary.hpp"
#include "whirl/response/harmonic_balance.hpp"

namespace whirl::response {

struct CurveOptions {
  double from = 0, to = 0;     ///< range of the parameter: speed in rad/s or force; the curve starts at `from`
  int harmonics = 5;           ///< to start with
  int most_harmonics = 21;     ///< where the truncation asks for more
  double truncation = 1e-4;    ///< missed part of the spectrum that asks for more harmonics; 0: never
  double longest_step = 0.05;  ///< arclength, relative to the range and to the amplitude
  double shortest_step = 1e-7;
  int most_points = 4000;
  bool stability = true;
};

struct CurvePoint {
  PeriodicSolution solution;
  bool stable = false;    ///< only with options.stability
  double multiplier = 0;  ///< largest magnitude of a Floquet multiplier
  bool forward = true;    ///< the parameter grows along the curve here
};

enum class EventKind { fold, branch_point, period_doubling, neimark_sacker };
const char* to_string(EventKind kind);

/// A point where the answer changes its nature.
struct CurveEvent {
  EventKind kind = EventKind::fold;
  std::size_t after = 0;  ///< index of the point before it
  PeriodicSolution solution;
  double parameter = 0;
};

struct ResponseCurve {
  Parameter parameter = Parameter::speed;
  std::vector<std::string> names;  ///< coordinates
  std::vector<CurvePoint> points;  ///< along the curve
  std::vector<CurveEvent> events;
  bool closed = false;  ///< the curve came back to its first point: an isola
  Summary summary;      ///< warning where the curve ends before `to`

  double value(const CurvePoint& p) const {
    return parameter == Parameter::speed ? p.solution.omega : p.solution.force;
  }
  /// Largest |q| over a period of one coordinate; `radius`: largest sqrt(x^2 + y^2) of the first two.
  static double peak(const PeriodicSolution& s, Eigen::Index coordinate);
  static double radius(const PeriodicSolution& s);
};

/// The curve of periodic answers by pseudo-arclength continuation (Krack and Gross 2019, ch. 4). `fixed` is the
/// parameter that stands still: the force (for a curve over speed) or the speed. Folds are where the parameter turns,
/// found to 1e-10; branch points where the determinant of the bordered system changes sign. Throws Error for a range
/// that is empty or not positive in speed.
ResponseCurve response_curve(const PeriodicSystem& system, Parameter parameter, double fixed,
                             const CurveOptions& options);

/// The curve through a known answer, `start`, both parameters as there; it ends where it closes or leaves the range.
ResponseCurve follow_curve(const PeriodicSystem& system, Parameter parameter, const PeriodicSolution& start,
                           const CurveOptions& options);

/// Answers in the range that `main`, a curve over speed at `force`, does not pass through, because it goes on beyond
/// the range: the curve from the other end of the range back, when its answer there is another one.
std::vector<ResponseCurve> other_branches(const PeriodicSystem& system, const ResponseCurve& main, double force,
                                          const CurveOptions& options);

/// Closed curves (isolas) apart from `main`, a curve over speed at `force`: at `speeds` speeds the answers are followed
/// over the force, from almost none to `reach` times `force`; where this sheet crosses `force` at an answer that is not
/// on `main`, the curve through it is followed over speed. An isola is found only when the sheet connects it at one of
/// these speeds. `known`: curves beside `main` whose answers do not count. Rotors need Forcing::free_unbalance.
std::vector<ResponseCurve> find_isolas(const PeriodicSystem& system, const ResponseCurve& main, double force,
                                       const CurveOptions& options, const std::vector<ResponseCurve>& known = {},
                                       int speeds = 25, double reach = 3);

}  // namespace whirl::response
