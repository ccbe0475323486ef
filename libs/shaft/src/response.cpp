#include "whirl/shaft/response.hpp"

#include <cmath>
#include <limits>

#include "synchronous_solution.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

constexpr double kStandardGravity = 9.80665;  // m/s^2
constexpr Complex kQuarter{0, 1};

}  // namespace

VectorXcd synchronous_solution(const System& s, double speed) {
  const Index n = s.size();
  const VectorXcd force = speed * speed * s.unbalance + s.bow;
  VectorXcd q(2 * n);
  if (s.isotropic(speed)) {
    const Equations<MatrixXcd> e = circular_equations(s, speed);
    const MatrixXcd dynamic = e.stiffness - speed * speed * e.mass + kQuarter * speed * e.damping;
    q.head(n) = Eigen::PartialPivLU<MatrixXcd>(dynamic).solve(force);
    q.tail(n) = -kQuarter * q.head(n);
    return q;
  }
  // Re(f e^{i theta}) along x is Im(f e^{i theta}) = Re(-i f e^{i theta}) along y.
  VectorXcd both(2 * n);
  both << force, -kQuarter * force;
  const Equations<MatrixXd> e = plane_equations(s, speed);
  MatrixXcd dynamic(2 * n, 2 * n);
  dynamic.real() = e.stiffness - speed * speed * e.mass;
  dynamic.imag() = speed * e.damping;
  return Eigen::PartialPivLU<MatrixXcd>(dynamic).solve(both);
}

namespace {

/// A magnet whose bias stiffness lets the rotor fall holds it, under control, where its probe reads zero.
void hold_at_magnets(System& s) {
  const double rigid = 1e3 * s.stiffness.diagonal().maxCoeff();
  for (Attachment& a : s.supports) {
    const Eigen::Matrix2d pull = a.law.at(0).stiffness;
    if (a.law.constant() && pull.trace() < 0) a.law.stiffness = {pull * (rigid / pull.trace())};
  }
}

}  // namespace

Sag static_sag(const System& system) {
  Sag sag;
  if (system.free > 0) return sag;
  System s = system;
  if (Eigen::LLT<MatrixXd>(plane_equations(s, 0).stiffness).info() != Eigen::Success) hold_at_magnets(s);
  const Index n = s.size();
  VectorXd load = VectorXd::Zero(2 * n);
  if (!s.vertical) load.tail(n) = -kStandardGravity * s.weight;
  const VectorXd q = Eigen::PartialPivLU<MatrixXd>(plane_equations(s, 0).stiffness).solve(load);
  if (!q.allFinite()) throw Error("the rotor is held nowhere: it has no deflection at rest");
  sag.x = s.deflection * q.head(n);
  sag.y = s.deflection * q.tail(n);
  for (const Attachment& a : s.supports)
    sag.reactions.emplace_back(-a.law.at(0).stiffness * Eigen::Vector2d(a.row.dot(q.head(n)), a.row.dot(q.tail(n))));
  return sag;
}

Orbit orbit(Complex x, Complex y) {
  const Complex forward = (x + kQuarter * y) / 2.0, backward = std::conj(x - kQuarter * y) / 2.0;
  Orbit o;
  o.major = std::abs(forward) + std::abs(backward);
  o.minor = std::abs(forward) - std::abs(backward);
  if (forward != 0.0 && backward != 0.0) o.angle = std::remainder(std::arg(forward) + std::arg(backward), kTwoPi) / 2;
  return o;
}

Complex probe_reading(Complex x, Complex y, double angle) { return std::cos(angle) * x + std::sin(angle) * y; }

Response unbalance_response(const System& s, const std::vector<double>& speeds) {
  Response r;
  r.speeds = speeds;
  const Index n = s.size(), count = static_cast<Index>(speeds.size());
  r.x = r.y = MatrixXcd(s.deflection.rows(), count);
  r.body_x = r.body_y = MatrixXcd(s.bodies.rows(), count);
  for (Index k = 0; k < count; ++k) {
    const double speed = speeds[static_cast<std::size_t>(k)];
    if (!(speed >= 0)) throw Error::in_field("speed", std::to_string(speed), "0 and above");
    const VectorXcd q = synchronous_solution(s, speed);
    r.x.col(k) = s.deflection * q.head(n);
    r.y.col(k) = s.deflection * q.tail(n);
    r.body_x.col(k) = s.bodies * q.head(n);
    r.body_y.col(k) = s.bodies * q.tail(n);
  }
  return r;
}

namespace {

/// Speed at which the curve falls to `level` from index `from` in steps of `step`; NaN when it does not.
double falls_to(const std::vector<double>& speeds, const Eigen::Ref<const VectorXd>& a, Index from, Index step,
                double level) {
  for (Index k = from; k + step >= 0 && k + step < a.size(); k += step) {
    if (a[k + step] > a[k]) break;  // another peak begins
    if (a[k + step] > level) continue;
    const double part = (a[k] - level) / (a[k] - a[k + step]);
    const double here = speeds[static_cast<std::size_t>(k)], next = speeds[static_cast<std::size_t>(k + step)];
    return here + part * (next - here);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

std::vector<Peak> peaks(const std::vector<double>& speeds, const Eigen::Ref<const VectorXd>& a) {
  std::vector<Peak> list;
  for (Index k = 1; k + 1 < a.size(); ++k) {
    if (!(a[k] > a[k - 1] && a[k] >= a[k + 1])) continue;
    const auto i = static_cast<std::size_t>(k);
    // Newton's parabola through the three points.
    const double left = speeds[i - 1], middle = speeds[i], right = speeds[i + 1];
    const double rise = (a[k] - a[k - 1]) / (middle - left), fall = (a[k + 1] - a[k]) / (right - middle);
    const double bend = (fall - rise) / (right - left);
    Peak p;
    p.speed = bend < 0 ? (left + middle) / 2 - rise / (2 * bend) : middle;
    p.amplitude = a[k - 1] + rise * (p.speed - left) + bend * (p.speed - left) * (p.speed - middle);
    const double level = p.amplitude / std::sqrt(2.0);
    p.amplification = p.speed / (falls_to(speeds, a, k, 1, level) - falls_to(speeds, a, k, -1, level));
    list.push_back(p);
  }
  return list;
}

}  // namespace whirl::shaft
