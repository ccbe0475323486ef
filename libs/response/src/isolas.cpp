#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/response/continuation.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;

Eigen::MatrixXd widened(const Eigen::MatrixXd& x, Index rows) {
  Eigen::MatrixXd wide = Eigen::MatrixXd::Zero(rows, x.cols());
  wide.topRows(std::min(rows, x.rows())) = x.topRows(std::min(rows, x.rows()));
  return wide;
}

bool alike(const PeriodicSolution& a, const PeriodicSolution& b) {
  const Index rows = std::max(a.coefficients.rows(), b.coefficients.rows());
  const Eigen::MatrixXd x = widened(a.coefficients, rows), y = widened(b.coefficients, rows);
  return (x - y).norm() <= 1e-3 * std::max(x.norm(), y.norm());
}

/// Does the curve pass through `s`, at its value of the parameter?
bool holds(const PeriodicSystem& system, const ResponseCurve& curve, const PeriodicSolution& s) {
  for (std::size_t i = 0; i + 1 < curve.points.size(); ++i) {
    const PeriodicSolution &a = curve.points[i].solution, &b = curve.points[i + 1].solution;
    if ((a.omega - s.omega) * (b.omega - s.omega) > 0 || a.omega == b.omega) continue;
    const double part = (s.omega - a.omega) / (b.omega - a.omega);
    const Index rows = std::max(a.coefficients.rows(), b.coefficients.rows());
    PeriodicSolution between = s;
    between.coefficients = (1 - part) * widened(a.coefficients, rows) + part * widened(b.coefficients, rows);
    if (solve_periodic(system, between) && alike(between, s)) return true;
  }
  return false;
}

/// Answers at `force` on the sheet over the force at one speed.
std::vector<PeriodicSolution> crossings(const PeriodicSystem& system, double omega, double force,
                                        const CurveOptions& options, double reach) {
  CurveOptions over = options;
  over.from = 1e-3 * force;
  over.to = reach * force;
  over.stability = false;
  const ResponseCurve sheet = response_curve(system, Parameter::force, omega, over);
  std::vector<PeriodicSolution> found;
  for (std::size_t i = 0; i + 1 < sheet.points.size(); ++i) {
    const PeriodicSolution &a = sheet.points[i].solution, &b = sheet.points[i + 1].solution;
    if ((a.force - force) * (b.force - force) > 0 || a.force == b.force) continue;
    const double part = (force - a.force) / (b.force - a.force);
    const Index rows = std::max(a.coefficients.rows(), b.coefficients.rows());
    PeriodicSolution s = a;
    s.coefficients = (1 - part) * widened(a.coefficients, rows) + part * widened(b.coefficients, rows);
    s.force = force;
    if (solve_periodic(system, s)) found.push_back(std::move(s));
  }
  return found;
}

/// The answer at `border` of the curve that comes from rest at `far`.
bool followed_to(const PeriodicSystem& system, double border, double far, double force, const CurveOptions& options,
                 PeriodicSolution& end) {
  CurveOptions o = options;
  o.from = far;
  o.to = border;
  o.stability = false;
  const ResponseCurve curve = response_curve(system, Parameter::speed, force, o);
  if (curve.points.empty() || std::abs(curve.points.back().solution.omega - border) > 1e-9 * border) return false;
  end = curve.points.back().solution;
  return true;
}

}  // namespace

std::vector<ResponseCurve> other_branches(const PeriodicSystem& system, const ResponseCurve& main, double force,
                                          const CurveOptions& options) {
  std::vector<ResponseCurve> found;
  if (main.points.empty() || main.parameter != Parameter::speed) return found;
  CurveOptions back = options;
  std::swap(back.from, back.to);
  const double border = back.from;
  // Newton from rest at the border, or the answer of a higher speed followed back to it.
  for (const double beyond : {1.0, 1.5, 2.5}) {
    PeriodicSolution end;
    end.coefficients = Eigen::MatrixXd::Zero(2 * options.harmonics + 1, system.size());
    end.omega = border;
    end.force = force;
    if (beyond == 1 && !solve_periodic(system, end)) continue;
    if (beyond > 1 && !followed_to(system, border, beyond * border, force, options, end)) continue;
    if (alike(end, main.points.back().solution) || holds(system, main, end)) continue;
    found.push_back(follow_curve(system, Parameter::speed, end, back));
    break;
  }
  return found;
}

std::vector<ResponseCurve> find_isolas(const PeriodicSystem& system, const ResponseCurve& main, double force,
                                       const CurveOptions& options, const std::vector<ResponseCurve>& known, int speeds,
                                       double reach) {
  require_range("speeds", speeds, 1, 10000);
  require_range("reach", reach, 1, 1e3);
  if (!(force > 0)) throw Error::in_field("force", fmt::format("{:g}", force), "positive");
  if (main.parameter != Parameter::speed) throw Error("isolas are looked for beside a curve over speed");
  std::vector<ResponseCurve> isolas;
  for (int k = 0; k < speeds; ++k) {
    const double omega = options.from + (options.to - options.from) * (k + 0.5) / speeds;
    for (const PeriodicSolution& s : crossings(system, omega, force, options, reach)) {
      if (holds(system, main, s)) continue;
      if (std::any_of(known.begin(), known.end(), [&](const ResponseCurve& c) { return holds(system, c, s); }))
        continue;
      if (std::any_of(isolas.begin(), isolas.end(), [&](const ResponseCurve& c) { return holds(system, c, s); }))
        continue;
      CurveOptions over = options;
      over.truncation = 0;  // the first and the last point have the same harmonics
      ResponseCurve curve = follow_curve(system, Parameter::speed, s, over);
      if (curve.closed) isolas.push_back(std::move(curve));
    }
  }
  return isolas;
}

}  // namespace whirl::response
