#pragma once
#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::testing {

/// A flexible rotor that runs up on two bearings. Nothing of libs/shaft is used: elements with linear deflection and
/// linear angle, one-point shear corrected by the bending flexibility (Hughes, The Finite Element Method, 1987, sec.
/// 5.4), lumped masses; in time the implicit midpoint rule, composed to order 4 (Yoshida,
/// Phys. Lett. A 150, 1990, 262-268).
struct RigDisc {
  double position = 0, mass = 0, transverse = 0, polar = 0;
};
struct RigBearing {
  double position = 0;
  double kx = 0, ky = 0, cx = 0, cy = 0;      ///< in the middle of the speeds, N/m, N s/m
  double kx1 = 0, ky1 = 0, cx1 = 0, cy1 = 0;  ///< change from there to the highest speed
};
struct RigMass {
  double position = 0, size = 0, angle = 0;  ///< m, kg m, rad
};
struct RigProbe {
  std::string name;
  double position = 0, angle = 0;  ///< m, rad
  std::complex<double> gain = 1, runout = 0;
};
struct ShaftRig {
  double length = 1.5, diameter = 0.05, young = 2.11e11, shear = 8.12e10, density = 7810;
  double damping_time = 0;  ///< of the material, s
  std::vector<RigDisc> discs;
  std::vector<RigBearing> bearings;
  std::vector<RigMass> masses;
  std::vector<RigProbe> probes;
  double lowest = 20, highest = 400;  ///< rad/s: between them the bearings change
  int elements = 200;
};
struct RigRun {
  double from = 20, to = 400, duration = 48, rate = 1000;
  std::vector<RigMass> added;
  double noise_db = 30;  ///< signal over noise of each channel, rms of its alternating part; infinite: none
  unsigned seed = 1;
  int steps = 4;  ///< of the integration a sample, of three parts each
};

/// Matrices of a plane, then of a few shapes of it.
class ShaftRigModel {
 public:
  explicit ShaftRigModel(const ShaftRig& rig) : rig_(rig), n_(rig.elements + 1) {
    build();
    project();
  }

  /// Speeds at which an undamped mode whirls with the shaft, bearings by the mean of their axes; rad/s.
  std::vector<double> criticals() const {
    Eigen::MatrixXd k = stiffness_, m = mass_ - gyroscopic_;
    for (std::size_t b = 0; b < rows_.size(); ++b)
      k += 0.5 * (rig_.bearings[b].kx + rig_.bearings[b].ky) * rows_[b] * rows_[b].transpose();
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(m, k);  // 1 / w^2
    std::vector<double> list;
    for (Eigen::Index i = solver.eigenvalues().size() - 1; i >= 0 && solver.eigenvalues()[i] > 0; --i)
      list.push_back(1 / std::sqrt(solver.eigenvalues()[i]));
    return list;
  }

  /// Steady motion at a station, zero-to-peak, x and y.
  Eigen::Vector2cd steady(double speed, double position, const std::vector<RigMass>& added = {}) const {
    const Eigen::VectorXd row = at(position);
    const Eigen::VectorXcd q = state(speed, added);
    const Eigen::Index r = mass_.rows();
    return {row.dot(q.head(r)), row.dot(q.tail(r))};
  }

  Recording run(const RigRun& o) const;

 private:
  void build() {
    for (int k = 0; k < n_; ++k) nodes_.push_back(rig_.length * k / rig_.elements);
    for (const RigDisc& disc : rig_.discs)  // the nearest node moves to each disc
      nodes_[static_cast<std::size_t>(std::lround(disc.position / rig_.length * rig_.elements))] = disc.position;
    const double d = rig_.diameter, nu = rig_.young / (2 * rig_.shear) - 1;
    const double area = std::numbers::pi * d * d / 4, inertia = std::numbers::pi * std::pow(d, 4) / 64;
    const double cowper = 6 * (1 + nu) / (7 + 6 * nu);
    full_k_ = full_m_ = full_g_ = Eigen::MatrixXd::Zero(2 * n_, 2 * n_);
    for (int e = 0; e < rig_.elements; ++e) {
      const double h = nodes_[static_cast<std::size_t>(e) + 1] - nodes_[static_cast<std::size_t>(e)];
      const double soft = h * h / (12 * rig_.young * inertia) + 1 / (cowper * rig_.shear * area);
      // Shear strain (w2 - w1) / h - (a1 + a2) / 2, curvature (a2 - a1) / h.
      Eigen::Vector4d shear(-1 / h, -0.5, 1 / h, -0.5), bend(0, -1 / h, 0, 1 / h);
      full_k_.block<4, 4>(2 * e, 2 * e) +=
          h / soft * shear * shear.transpose() + h * rig_.young * inertia * bend * bend.transpose();
      for (const int k : {e, e + 1}) {
        full_m_(2 * k, 2 * k) += rig_.density * area * h / 2;
        full_m_(2 * k + 1, 2 * k + 1) += rig_.density * inertia * h / 2;
        full_g_(2 * k + 1, 2 * k + 1) += rig_.density * inertia * h;
      }
    }
    shaft_k_ = full_k_;
    for (const RigDisc& disc : rig_.discs) {
      const Eigen::VectorXd w = station(disc.position, 0), a = station(disc.position, 1);
      full_m_ += disc.mass * w * w.transpose() + disc.transverse * a * a.transpose();
      full_g_ += disc.polar * a * a.transpose();
    }
  }

  /// Deflection (0) or angle (1) at a position: linear between the nodes, the deflection with their slopes.
  Eigen::VectorXd station(double position, int what) const {
    int e = 0;
    while (e + 1 < rig_.elements && position > nodes_[static_cast<std::size_t>(e) + 1] + 1e-9) ++e;
    const double left = nodes_[static_cast<std::size_t>(e)], h = nodes_[static_cast<std::size_t>(e) + 1] - left;
    const double s = (position - left) / h;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(2 * n_);
    if (what == 1) {
      row[2 * e + 1] = 1 - s;
      row[2 * e + 3] = s;
      return row;
    }
    row[2 * e] = 1 - s;
    row[2 * e + 2] = s;
    // What linear interpolation loses by curvature: h^2 s (1 - s) / 2 of it.
    row[2 * e + 1] += h * s * (1 - s) / 2;
    row[2 * e + 3] -= h * s * (1 - s) / 2;
    return row;
  }
  Eigen::VectorXd at(double position) const { return basis_.transpose() * station(position, 0); }

  void project() {
    Eigen::MatrixXd k = full_k_;
    for (const RigBearing& b : rig_.bearings) {
      const Eigen::VectorXd row = station(b.position, 0);
      k += 0.5 * (b.kx + b.ky) * row * row.transpose();
    }
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(k, full_m_);
    constexpr int kModes = 8;
    basis_ = solver.eigenvectors().leftCols(kModes);
    // Static shapes under the forces of bearings, forces and moments of discs.
    std::vector<Eigen::VectorXd> forces;
    for (const RigBearing& b : rig_.bearings) forces.push_back(station(b.position, 0));
    for (const RigDisc& d : rig_.discs)
      for (const int what : {0, 1}) forces.push_back(station(d.position, what));
    const Eigen::LDLT<Eigen::MatrixXd> held(k);
    for (const Eigen::VectorXd& force : forces) {
      Eigen::VectorXd v = held.solve(force);
      for (int pass = 0; pass < 2; ++pass) {
        const Eigen::VectorXd pushed = full_m_ * v, along = basis_.transpose() * pushed;
        v -= basis_ * along;
      }
      basis_.conservativeResize(Eigen::NoChange, basis_.cols() + 1);
      basis_.col(basis_.cols() - 1) = v / std::sqrt(v.dot(full_m_ * v));
    }
    const auto onto = [&](const Eigen::MatrixXd& a) {
      const Eigen::MatrixXd rows = basis_.transpose() * a;
      return Eigen::MatrixXd(rows * basis_);
    };
    mass_ = onto(full_m_);
    stiffness_ = onto(full_k_);
    gyroscopic_ = onto(full_g_);
    rotating_ = rig_.damping_time * onto(shaft_k_);
    for (const RigBearing& b : rig_.bearings) rows_.push_back(at(b.position));
  }

  /// Damping and stiffness in (x, y) at a speed.
  void matrices(double speed, Eigen::MatrixXd& c, Eigen::MatrixXd& k) const {
    const Eigen::Index r = mass_.rows();
    c.setZero(2 * r, 2 * r);
    k.setZero(2 * r, 2 * r);
    c.topLeftCorner(r, r) = c.bottomRightCorner(r, r) = rotating_;
    k.topLeftCorner(r, r) = k.bottomRightCorner(r, r) = stiffness_;
    c.topRightCorner(r, r) = speed * gyroscopic_;
    c.bottomLeftCorner(r, r) = -speed * gyroscopic_;
    k.topRightCorner(r, r) = speed * rotating_;
    k.bottomLeftCorner(r, r) = -speed * rotating_;
    const double middle = (rig_.lowest + rig_.highest) / 2, part = (speed - middle) / (rig_.highest - middle);
    for (std::size_t b = 0; b < rows_.size(); ++b) {
      const RigBearing& v = rig_.bearings[b];
      const Eigen::MatrixXd p = rows_[b] * rows_[b].transpose();
      k.topLeftCorner(r, r) += (v.kx + v.kx1 * part) * p;
      k.bottomRightCorner(r, r) += (v.ky + v.ky1 * part) * p;
      c.topLeftCorner(r, r) += (v.cx + v.cx1 * part) * p;
      c.bottomRightCorner(r, r) += (v.cy + v.cy1 * part) * p;
    }
  }
  /// Complex force on x of all masses at angle zero.
  Eigen::VectorXcd masses(const std::vector<RigMass>& added) const {
    Eigen::VectorXcd u = Eigen::VectorXcd::Zero(mass_.rows());
    for (const auto* list : {&rig_.masses, &added})
      for (const RigMass& m : *list) u += std::polar(m.size, m.angle) * at(m.position);
    return u;
  }
  Eigen::VectorXcd state(double speed, const std::vector<RigMass>& added) const {
    const Eigen::Index r = mass_.rows();
    Eigen::MatrixXd c, k;
    matrices(speed, c, k);
    Eigen::MatrixXcd d = k.cast<std::complex<double>>() + std::complex<double>(0, speed) * c;
    d.topLeftCorner(r, r) -= speed * speed * mass_;
    d.bottomRightCorner(r, r) -= speed * speed * mass_;
    const Eigen::VectorXcd u = masses(added) * speed * speed;
    Eigen::VectorXcd f(2 * r);
    f << u, std::complex<double>(0, -1) * u;
    return d.partialPivLu().solve(f);
  }

  ShaftRig rig_;
  int n_;
  std::vector<double> nodes_;
  Eigen::MatrixXd full_k_, full_m_, full_g_, shaft_k_, basis_;
  Eigen::MatrixXd mass_, stiffness_, gyroscopic_, rotating_;
  std::vector<Eigen::VectorXd> rows_;
};

/// Displacements of the probes, m, and the angle "beta", rad, of a run at constant acceleration that begins in the
/// steady state.
inline Recording ShaftRigModel::run(const RigRun& o) const {
  const Eigen::Index r = mass_.rows(), n = 2 * r;
  const auto samples = static_cast<Eigen::Index>(std::lround(o.duration * o.rate));
  const double h = 1 / (o.rate * o.steps), rise = (o.to - o.from) / o.duration;
  const auto angle = [&](double t) { return o.from * t + rise * t * t / 2; };
  const Eigen::VectorXcd u = masses(o.added), first = state(o.from, o.added);
  Eigen::VectorXd q = first.real(), v = (std::complex<double>(0, o.from) * first).real(), force(n), middle(n);
  const double outer = 1 / (2 - std::cbrt(2.0)), parts[] = {outer, 1 - 2 * outer};
  Eigen::MatrixXd c, k, inverse[2], mass = Eigen::MatrixXd::Zero(n, n);
  mass.topLeftCorner(r, r) = mass.bottomRightCorner(r, r) = mass_;
  Eigen::MatrixXd readings(samples, static_cast<Eigen::Index>(rig_.probes.size()));
  std::vector<Eigen::VectorXd> rows;
  for (const RigProbe& p : rig_.probes) {
    Eigen::VectorXd row(n);
    row << std::cos(p.angle) * at(p.position), std::sin(p.angle) * at(p.position);
    rows.push_back(row);
  }
  for (Eigen::Index i = 0; i < samples; ++i) {
    const double begin = static_cast<double>(i) / o.rate;
    for (std::size_t p = 0; p < rows.size(); ++p) {
      // A gain with an angle reads a little earlier or later in the turn.
      const RigProbe& probe = rig_.probes[p];
      const double speed = o.from + rise * begin, d = rows[p].dot(q), rate = rows[p].dot(v) / speed;
      const double runout = (probe.runout * std::polar(1.0, angle(begin))).real();
      readings(i, static_cast<Eigen::Index>(p)) = probe.gain.real() * d + probe.gain.imag() * rate + runout;
    }
    if (i % 8 == 0) {  // the speed changes by a ten-thousandth meanwhile
      matrices(o.from + rise * (begin + 4 / o.rate), c, k);
      for (std::size_t part = 0; part < 2; ++part)
        inverse[part] = (2 / (parts[part] * h) * mass + c + parts[part] * h / 2 * k).partialPivLu().inverse();
    }
    double t = begin;
    for (int s = 0; s < 3 * o.steps; ++s) {
      const std::size_t part = s % 3 == 1 ? 1 : 0;
      const double step = parts[part] * h, at_middle = t + step / 2, speed = o.from + rise * at_middle;
      const std::complex<double> turn = std::polar(1.0, angle(at_middle)) * std::complex<double>(speed * speed, -rise);
      force.head(r) = (u * turn).real();
      force.tail(r) = (u * turn).imag();
      middle.noalias() = 2 / step * (mass * v);
      middle.noalias() -= k * q;
      middle += force;
      force.noalias() = inverse[part] * middle;  // mean velocity of the step
      q += step * force;
      v = 2 * force - v;
      t += step;
    }
  }
  Recording record;
  record.dt = 1 / o.rate;
  record.source = "run";
  std::mt19937_64 random(o.seed);
  std::normal_distribution<double> normal;
  for (std::size_t p = 0; p < rows.size(); ++p) {
    Eigen::VectorXd x = readings.col(static_cast<Eigen::Index>(p));
    const double rms = std::sqrt(x.squaredNorm() / static_cast<double>(samples));
    if (std::isfinite(o.noise_db))
      for (double& value : x) value += rms * std::pow(10, -o.noise_db / 20) * normal(random);
    record.add(rig_.probes[p].name, Quantity::displacement, x);
  }
  Eigen::VectorXd beta(samples);
  for (Eigen::Index i = 0; i < samples; ++i) beta[i] = angle(static_cast<double>(i) / o.rate);
  record.add("beta", Quantity::angle, beta);
  return record;
}

}  // namespace whirl::testing
