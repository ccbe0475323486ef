#include "element.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>

#include "whirl/core/angles.hpp"

namespace whirl::shaft {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double shear_coefficient(const Shear& shear, double poisson, double bore_ratio) {
  const double nu = poisson, b2 = bore_ratio * bore_ratio, s = (1 + b2) * (1 + b2);
  switch (shear.model) {
    case ShearModel::hutchinson:
      return 6 * (1 + nu) * (1 + nu) * s / ((7 + 12 * nu + 4 * nu * nu) * s + 4 * (5 + 6 * nu + 2 * nu * nu) * b2);
    case ShearModel::cowper:
      return 6 * (1 + nu) * s / ((7 + 6 * nu) * s + (20 + 12 * nu) * b2);
    case ShearModel::number:
      return shear.coefficient;
    case ShearModel::none:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

namespace {

// Gauss-Legendre on [0, 1], exact for polynomials of degree 11: a tapered section has I(z) of degree 4 times 6.
constexpr int kGaussPoints = 6;
constexpr std::array kGaussAt{0.033765242898423975, 0.16939530676686776, 0.38069040695840156,
                              0.6193095930415985,   0.8306046932331322,  0.966234757101576};
constexpr std::array kGaussWeight{0.08566224618958487, 0.1803807865240692, 0.2339569672863457,
                                  0.2339569672863457,  0.1803807865240692, 0.08566224618958487};

/// Values at one point of the element of deflection w, its slope, section angle psi and its slope; shear strain is
/// w' - psi. The first four functions are Hermite's without shear strain. Two inner ones vanish at both ends and
/// complete the deflection to all cubics and the angle to all quadratics with a shear strain linear along the element:
///     psi = 6 s (1 - s), strain = -1;     psi = 0, strain = 1 - 2 s.
struct ShapeValues {
  Eigen::Matrix<double, 6, 1> w, w_slope, psi, psi_slope, strain;
};

ShapeValues shape_values(double s, double length) {
  ShapeValues v;
  const double l = length, s2 = s * s, s3 = s2 * s;
  v.w << 1 - 3 * s2 + 2 * s3, l * (s - 2 * s2 + s3), 3 * s2 - 2 * s3, l * (s3 - s2), -l * s * (1 - s) * (1 - 2 * s),
      l * s * (1 - s);
  v.psi << (6 * s2 - 6 * s) / l, 1 - 4 * s + 3 * s2, (6 * s - 6 * s2) / l, 3 * s2 - 2 * s, 6 * s * (1 - s), 0;
  v.psi_slope << (12 * s - 6) / (l * l), (6 * s - 4) / l, (6 - 12 * s) / (l * l), (6 * s - 2) / l, 6 * (1 - 2 * s) / l,
      0;
  v.strain << 0, 0, 0, 0, -1, 1 - 2 * s;
  v.w_slope = v.psi + v.strain;
  return v;
}

/// Without its inner coordinates, which follow the ends as at rest: q_inner = -K_ii^-1 K_ie q_ends.
Element condensed(const Element& e) {
  MatrixXd follow = MatrixXd::Zero(6, 4);
  follow.topRows(4).setIdentity();
  const Eigen::Matrix2d inner = e.stiffness.bottomRightCorner<2, 2>();
  follow.bottomRows(2) = -inner.inverse() * e.stiffness.bottomLeftCorner<2, 4>();
  const auto onto = [&](const MatrixXd& a) { return MatrixXd(follow.transpose() * a * follow); };
  return {onto(e.stiffness), onto(e.mass), onto(e.gyroscopic), onto(e.geometric), follow.transpose() * e.load};
}

}  // namespace

EndSlopes end_slopes(double length, bool right, Eigen::Index coordinates) {
  const ShapeValues v = shape_values(right ? 1 : 0, length);
  return {v.w_slope.head(coordinates), v.psi_slope.head(coordinates)};
}

Element make_element(const ElementShape& shape, const Material& material, const Shear& shear, ElementKind kind) {
  const bool stiff = shear.model == ShearModel::none;
  const int n = stiff ? 4 : 6;
  Element e{MatrixXd::Zero(n, n), MatrixXd::Zero(n, n), MatrixXd::Zero(n, n), MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  for (std::size_t g = 0; g < kGaussPoints; ++g) {
    const double s = kGaussAt[g], step = kGaussWeight[g] * shape.length;
    const double outer = shape.outer_left + s * (shape.outer_right - shape.outer_left);
    const double inner = shape.inner_left + s * (shape.inner_right - shape.inner_left);
    const double area = kPi / 4 * (outer * outer - inner * inner);
    const double moment = kPi / 64 * (std::pow(outer, 4) - std::pow(inner, 4));
    const ShapeValues v = shape_values(s, shape.length);
    const auto square = [n](const auto& a) { return MatrixXd(a.head(n) * a.head(n).transpose()); };
    e.stiffness += step * material.youngs_modulus * moment * square(v.psi_slope);
    if (!stiff) {
      const double k = shear_coefficient(shear, material.poisson(), inner / outer);
      e.stiffness += step * k * material.shear_modulus * area * square(v.strain);
    }
    const MatrixXd rotary = step * material.density * moment * square(v.psi);
    e.mass += step * material.density * area * square(v.w) + rotary;
    e.gyroscopic += 2 * rotary;
    e.geometric += step * square(v.w_slope);
    e.load += step * v.w.head(n);
  }
  return stiff || kind == ElementKind::internal_node ? e : condensed(e);
}

}  // namespace whirl::shaft
