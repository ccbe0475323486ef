#pragma once
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "output_error/rotor/reading_shift.hpp"
#include "terms/catalogue.hpp"
#include "terms/score_point.hpp"

/// What the files of terms share.
namespace whirl::identification::terms {

using detail::Complex;
using detail::Growth;
using detail::ProbePoint;
using detail::ScoreColumns;
using detail::ScorePoint;
using Candidates = std::vector<ScoreColumns>;

inline std::vector<TermText> one(std::string function, double sign) { return {{std::move(function), sign}}; }

/// Time since the reference of a drift.
inline std::string since(const RotorTerm& term) {
  return term.reference == 0 ? "t" : fmt::format("(t - {:.17g})", term.reference);
}

/// What the y probe alone reads, of a signal of both, with the axes `lean`.
inline Eigen::VectorXcd read_by_y(const ProbePoint& at, const detail::Lean& lean, const Eigen::VectorXcd& signal) {
  Eigen::VectorXcd out = Eigen::VectorXcd::Zero(signal.size());
  out.imag() = detail::later(lean.y * signal.imag() + lean.x * signal.real(), at.sensor.skew / at.dt);
  return out;
}
/// What both read.
inline Eigen::VectorXcd read_by_both(const ProbePoint& at, const Eigen::VectorXcd& signal) {
  Eigen::VectorXcd out = read_by_y(at, detail::lean(at.sensor), signal);
  out.real() = signal.real();
  return out;
}

}  // namespace whirl::identification::terms
