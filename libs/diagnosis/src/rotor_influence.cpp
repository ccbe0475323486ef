#include "whirl/diagnosis/rotor_influence.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::diagnosis {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;

constexpr double kBent = 0.2;  // share of a coefficient that the cubic stiffness may move unsaid

}  // namespace

Eigen::VectorXcd rotor_influence(const RotorModel& rotor, const RotorReadings& r) {
  if (!(r.mass > 0)) throw Error::in_field("mass", fmt::format("{:g} kg", r.mass), "positive");
  if (!(r.radius > 0)) throw Error::in_field("radius", fmt::format("{:g} m", r.radius), "positive");
  if (r.speed.size() != r.probe.size())
    throw Error(fmt::format("influence of a rotor: {} speeds and {} probes", r.speed.size(), r.probe.size()));
  constexpr Complex i(0, 1);
  const Complex eccentricity = std::polar(r.radius / r.mass, r.mark);  // of one kilogram at the zero of the masses
  Eigen::VectorXcd out(static_cast<Index>(r.speed.size()));
  for (std::size_t m = 0; m < r.speed.size(); ++m) {
    const double w = r.speed[m];
    if (!(w > 0)) throw Error::in_field("speed", fmt::format("{:g} rad/s", w), "positive");
    // Of e^{i beta}: d A + u conj(B) = eps w^2; the conjugate of that of e^{-i beta}: d conj(B) + v A = 0.
    const Complex d = rotor.k1 - w * w + i * rotor.c * w, u = rotor.k1_conj + i * w * rotor.c_conj,
                  v = std::conj(rotor.k1_conj) + i * w * std::conj(rotor.c_conj);
    const Complex forward = eccentricity * w * w / (d - u * v / d), backward = -v / d * forward;
    out[static_cast<Index>(m)] = forward * std::polar(1.0, -r.probe[m]) + backward * std::polar(1.0, r.probe[m]);
  }
  return out;
}

InfluencePrior rotor_prior(const RotorModel& rotor, const std::vector<double>& covariance, const RotorReadings& r,
                           double common, double each, Summary& warnings, int draws, unsigned seed) {
  const Eigen::VectorXcd mean = rotor_influence(rotor, r);
  std::vector<int> speed(r.speed.size());
  for (std::size_t m = 0; m < speed.size(); ++m)
    for (std::size_t k = 0; k <= m; ++k)
      if (r.speed[k] == r.speed[m]) {
        speed[m] = static_cast<int>(k);
        break;
      }
  InfluencePrior prior = relative_prior(mean, common, each, speed);
  for (std::size_t m = 0; m < r.speed.size(); ++m) {
    const double w = r.speed[m], linear = std::abs(Complex(rotor.k1 - w * w, rotor.c * w)),
                 bent = std::abs(rotor.k2) * r.amplitude * r.amplitude;
    if (bent > kBent * linear) {
      warnings.warn(fmt::format(
          "at {:.0f} rpm the nonlinear stiffness moves the influence of the model by some {:.0f} % at {:.3g} mm: a "
          "correction is right only once the motion is small",
          w * 30 / std::numbers::pi, std::min(999.0, 100 * bent / linear), 1e3 * r.amplitude));
      break;
    }
  }
  if (covariance.size() != 25) return prior;
  const Eigen::Map<const Eigen::Matrix<double, 5, 5, Eigen::RowMajor>> all(covariance.data());
  Eigen::Matrix2d of_k_and_c;
  of_k_and_c << all(0, 0), all(0, 2), all(2, 0), all(2, 2);
  if (!of_k_and_c.allFinite() || !(of_k_and_c.trace() > 0)) return prior;
  const Eigen::LDLT<Eigen::Matrix2d> split(of_k_and_c);
  const Eigen::Matrix2d root = split.transpositionsP().transpose() * Eigen::Matrix2d(split.matrixL()) *
                               Eigen::Matrix2d(split.vectorD().cwiseMax(0).cwiseSqrt().asDiagonal());
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXcd spread = Eigen::MatrixXcd::Zero(mean.size(), mean.size());
  for (int k = 0; k < draws; ++k) {
    const double first = normal(random), second = normal(random);
    const Eigen::Vector2d step = root * Eigen::Vector2d(first, second);
    RotorModel drawn = rotor;
    drawn.k1 = std::max(0.01 * rotor.k1, rotor.k1 + step[0]);
    drawn.c = std::max(0.01 * rotor.c, rotor.c + step[1]);
    const Eigen::VectorXcd apart = rotor_influence(drawn, r) - mean;
    spread += apart * apart.adjoint() / draws;
  }
  prior.covariance += spread;
  return prior;
}

}  // namespace whirl::diagnosis
