#include "damping_evidence.hpp"

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <vector>

namespace whirl::modal {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;

constexpr double kSure = 4;  // standard deviations from viscous
/// From structural, in damping ratios: what neighbours and modes outside the band bend, and what is too far however
/// wide the interval.
constexpr double kNear = 0.1, kFar = 0.5;
/// Phase at the last line, rad, of sensors and filters that are not quite alike (one standard deviation).
constexpr double kLag = 0.03, kNoLag = 1e-6;

/// How far the residues of one mode are turned against those of a real shape, in damping ratios: 0 where the damping is
/// viscous, 1 where it is structural.
struct Turn {
  double value, variance;
  double lag;  ///< what a delay adds that turns the last line by one radian
};

std::vector<Turn> turns_of(const Band& band, const Refined& state, const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd channel_weight = band.weight.colwise().squaredNorm();
  std::vector<Turn> turns;
  for (std::size_t k = 0; k < state.free(); ++k) {
    const Complex p = state.poles[k];
    const double f = std::abs(p) / (2 * std::numbers::pi), zeta = -p.real() / std::abs(p);
    if (f < band.low || f > band.high) continue;
    const auto row = 2 * static_cast<Index>(k);
    Complex doubled = 0;  // the square does not know the sign of r
    double sum = 0, squares = 0;
    for (Index c = 0; c < band.channels(); ++c) {
      const Complex turned = Complex(0, 1) * Complex(state.fit.residues(row, c), state.fit.residues(row + 1, c));
      const double w = channel_weight[c] * std::norm(turned);
      doubled += channel_weight[c] * turned * turned;
      sum += w;
      squares += w * w;
    }
    if (!(sum > 0) || !(zeta > 0)) continue;
    const double scatter = (1 - std::abs(doubled) / sum) / 2 * squares / (sum * sum);
    const double pole = covariance(row + 1, row + 1) / (2 * std::pow(band.decay - p.real(), 2));
    turns.push_back({-std::arg(doubled) / 2 / zeta, (pole + scatter) / (zeta * zeta),
                     p.imag() / band.omega[band.lines() - 1] / zeta});
  }
  return turns;
}

// Least squares for the turn common to all modes and a delay between force and response, of which no more is known than
// its size `lag`.
bool is_structural(const std::vector<Turn>& turns, double lag) {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  information(1, 1) = 1 / (lag * lag);
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (const Turn& turn : turns) {
    const Eigen::Vector2d row(1, turn.lag);
    information += row * row.transpose() / turn.variance;
    right += row * turn.value / turn.variance;
  }
  const Eigen::Matrix2d covariance = information.inverse();
  const Eigen::Vector2d found = covariance * right;
  double spread = std::pow(found[1] / lag, 2);
  for (const Turn& turn : turns) spread += std::pow(turn.value - found[0] - turn.lag * found[1], 2) / turn.variance;
  const double left = static_cast<double>(turns.size()) - 1;
  const double sd = std::sqrt(std::max(1.0, left > 0 ? spread / left : 1.0) * covariance(0, 0));
  return found[0] > kSure * sd && std::abs(found[0] - 1) < std::min(3 * sd + kNear, kFar);
}

}  // namespace

DampingEvidence damping_evidence(const Band& band, const Refined& state, const ResidualTerms& terms) {
  if (state.free() == 0) return DampingEvidence::viscous;
  const std::vector<Turn> turns = turns_of(band, state, covariance_of(band, state, terms, state.correlated));
  if (turns.empty()) return DampingEvidence::viscous;
  if (is_structural(turns, kLag)) return DampingEvidence::structural;
  return is_structural(turns, kNoLag) ? DampingEvidence::open : DampingEvidence::viscous;
}

}  // namespace whirl::modal
