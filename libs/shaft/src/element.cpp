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

/// What an element is deformed by: (w2 - w1 - l psi1) / l and psi2 - psi1, of its ends. A stiffness built from these
/// gives no force for a motion as a rigid body, to rounding of the force itself; in the coordinates of the ends that is
/// the difference of numbers that grow with l^-3, which a short element would lose.
Eigen::Matrix<double, 2, 4> deformation(double length) {
  Eigen::Matrix<double, 2, 4> b;
  b << -1 / length, -1, 1 / length, 0, 0, -1, 0, 1;
  return b;
}
/// Slope of the section angle and shear strain at a point, over the two deformations and the two inner coordinates.
Eigen::Vector4d bending(double s, double length) {
  return Eigen::Vector4d((6 - 12 * s), (6 * s - 2), 6 * (1 - 2 * s), 0) / length;
}
Eigen::Vector4d shearing(double s) { return {0, 0, -1, 1 - 2 * s}; }

/// Slopes at an end, over the ends and the inner coordinates that the element has.
EndSlopes slopes_at(double s, double length, const MatrixXd& turn) {
  const ShapeValues v = shape_values(s, length);
  const Eigen::Index n = turn.rows();
  return {turn.transpose() * v.w_slope.head(n), turn.transpose() * v.psi_slope.head(n)};
}

}  // namespace

Element make_element(const ElementShape& shape, const Material& material, const Shear& shear, ElementKind kind) {
  const bool stiff = shear.model == ShearModel::none;
  const int n = stiff ? 4 : 6;
  Eigen::Matrix4d stiffness = Eigen::Matrix4d::Zero();
  Element e{MatrixXd::Zero(n, n),
            MatrixXd::Zero(n, n),
            MatrixXd::Zero(n, n),
            MatrixXd::Zero(n, n),
            VectorXd::Zero(n),
            {},
            {}};
  for (std::size_t g = 0; g < kGaussPoints; ++g) {
    const double s = kGaussAt[g], step = kGaussWeight[g] * shape.length;
    const double outer = shape.outer_left + s * (shape.outer_right - shape.outer_left);
    const double inner = shape.inner_left + s * (shape.inner_right - shape.inner_left);
    const double area = kPi / 4 * (outer * outer - inner * inner);
    const double moment = kPi / 64 * (std::pow(outer, 4) - std::pow(inner, 4));
    const ShapeValues v = shape_values(s, shape.length);
    const auto square = [n](const auto& a) { return MatrixXd(a.head(n) * a.head(n).transpose()); };
    const Eigen::Vector4d bent = bending(s, shape.length), sheared = shearing(s);
    stiffness += step * material.youngs_modulus * moment * bent * bent.transpose();
    if (!stiff) {
      const double k = shear_coefficient(shear, material.poisson(), inner / outer);
      stiffness += step * k * material.shear_modulus * area * sheared * sheared.transpose();
    }
    const MatrixXd rotary = step * material.density * moment * square(v.psi);
    e.mass += step * material.density * area * square(v.w) + rotary;
    e.gyroscopic += 2 * rotary;
    e.geometric += step * square(v.w_slope);
    e.load += step * v.w.head(n);
  }
  // Inner coordinates count from where they follow the deformation at rest, -K_ii^-1 K_id d: the ends then have the
  // stiffness of a shaft with shear strain, GA/l and not EI/l^3, and a short element hides nothing of its neighbours.
  const Eigen::Matrix<double, 2, 4> ends = deformation(shape.length);
  Eigen::Matrix2d of_ends = stiffness.topLeftCorner<2, 2>();
  MatrixXd turn = MatrixXd::Identity(n, n);
  if (!stiff) {
    const Eigen::Matrix2d follow = -stiffness.bottomRightCorner<2, 2>().inverse() * stiffness.bottomLeftCorner<2, 2>();
    of_ends += stiffness.topRightCorner<2, 2>() * follow;
    turn.bottomLeftCorner<2, 4>() = follow * ends;
    e.stiffness.bottomRightCorner<2, 2>() = stiffness.bottomRightCorner<2, 2>();
  }
  e.stiffness.topLeftCorner<4, 4>() = ends.transpose() * of_ends * ends;
  const int kept = kind == ElementKind::internal_node ? n : 4;
  const auto onto = [&](const MatrixXd& a) {
    return MatrixXd((turn.transpose() * a * turn).topLeftCorner(kept, kept));
  };
  return {e.stiffness.topLeftCorner(kept, kept),
          onto(e.mass),
          onto(e.gyroscopic),
          onto(e.geometric),
          (turn.transpose() * e.load).head(kept),
          slopes_at(0, shape.length, turn.leftCols(kept)),
          slopes_at(1, shape.length, turn.leftCols(kept))};
}

}  // namespace whirl::shaft
