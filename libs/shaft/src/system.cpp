#include "whirl/shaft/system.hpp"

#include <algorithm>
#include <cmath>

namespace whirl::shaft {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Complex = std::complex<double>;

namespace {

/// [[a, b], [-b, a]]: the same in every direction.
bool alike(const Matrix2d& m) {
  const double size = 1e-12 * m.cwiseAbs().maxCoeff();
  return std::abs(m(0, 0) - m(1, 1)) <= size && std::abs(m(0, 1) + m(1, 0)) <= size;
}
/// On x + i y: a x + b y + i (-b x + a y) = (a - i b)(x + i y).
Complex joined(const Matrix2d& m) { return {m(0, 0), -m(0, 1)}; }

void add_planes(MatrixXd& full, const MatrixXd& product, const Matrix2d& m) {
  const Index n = product.rows();
  for (Index i = 0; i < 2; ++i)
    for (Index j = 0; j < 2; ++j)
      if (m(i, j) != 0) full.block(i * n, j * n, n, n) += m(i, j) * product;
}

}  // namespace

Index System::node_at(double position) const {
  Index best = 0;
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (std::abs(nodes[k] - position) < std::abs(nodes[static_cast<std::size_t>(best)] - position))
      best = static_cast<Index>(k);
  return best;
}

bool System::isotropic(double speed) const {
  return std::all_of(supports.begin(), supports.end(), [speed](const Attachment& a) {
    const SupportLaw::Values v = a.law.at(speed);
    return alike(v.stiffness) && alike(v.damping) && alike(v.mass);
  });
}

bool System::constant() const {
  return std::all_of(supports.begin(), supports.end(), [](const Attachment& a) { return a.law.constant(); });
}

Equations<MatrixXd> plane_equations(const System& s, double speed) {
  const Index n = s.size();
  Equations<MatrixXd> e{MatrixXd::Zero(2 * n, 2 * n), MatrixXd::Zero(2 * n, 2 * n), MatrixXd::Zero(2 * n, 2 * n)};
  for (const Index at : {Index{0}, n}) {
    e.mass.block(at, at, n, n) = s.mass;
    e.damping.block(at, at, n, n) = s.rotating;
    e.stiffness.block(at, at, n, n) = s.stiffness;
  }
  // -i Omega A (q_x + i q_y): + Omega A q_y in x, - Omega A q_x in y.
  e.damping.topRightCorner(n, n) = speed * s.gyroscopic;
  e.damping.bottomLeftCorner(n, n) = -speed * s.gyroscopic;
  e.stiffness.topRightCorner(n, n) = speed * s.rotating;
  e.stiffness.bottomLeftCorner(n, n) = -speed * s.rotating;
  for (const Attachment& a : s.supports) {
    const SupportLaw::Values v = a.law.at(speed);
    const MatrixXd product = a.row * a.row.transpose();
    add_planes(e.stiffness, product, v.stiffness);
    add_planes(e.damping, product, v.damping);
    add_planes(e.mass, product, v.mass);
    if (a.tilt.size() == 0) continue;
    const MatrixXd tilt = a.tilt * a.tilt.transpose();
    add_planes(e.stiffness, tilt, a.tilt_stiffness * Matrix2d::Identity());
    add_planes(e.damping, tilt, a.tilt_damping * Matrix2d::Identity());
  }
  return e;
}

Equations<MatrixXcd> circular_equations(const System& s, double speed) {
  const Complex turning(0, -speed);
  Equations<MatrixXcd> e{s.mass.cast<Complex>(), s.rotating + turning * s.gyroscopic,
                         s.stiffness + turning * s.rotating};
  for (const Attachment& a : s.supports) {
    const SupportLaw::Values v = a.law.at(speed);
    const MatrixXcd product = (a.row * a.row.transpose()).cast<Complex>();
    e.stiffness += joined(v.stiffness) * product;
    e.damping += joined(v.damping) * product;
    e.mass += joined(v.mass) * product;
    if (a.tilt.size() == 0) continue;
    const MatrixXcd tilt = (a.tilt * a.tilt.transpose()).cast<Complex>();
    e.stiffness += a.tilt_stiffness * tilt;
    e.damping += a.tilt_damping * tilt;
  }
  return e;
}

}  // namespace whirl::shaft
