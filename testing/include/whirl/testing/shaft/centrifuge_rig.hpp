#pragma once
#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::testing {

/// A loaded laboratory centrifuge that spins up: motor, armature and bowl as rigid parts, the spindle as a massless
/// beam with bending and shear between armature and hub (its mass half at each end). Nothing of libs/shaft is used.
/// Coordinates x + i y and slope of each part; implicit midpoint rule.
struct CentrifugeRig {
  double mount_stiffness = 6e4, mount_damping = 60;  ///< of each of the two mount planes
  double load = 0;                                   ///< ring of tubes at the buckets, kg
  double size = 0, angle = 0;                        ///< imbalance kg m, rad
  double gain = 1, axis = 0;                         ///< of the accelerometer: factor, angle of its axis, rad
  double noise_density = 0;                          ///< m/s^2 per root of Hz, white
  double drift = 0;                                  ///< m/s^2, rms of the slow drift: a first-order lag of 0.1 Hz
  double joint_damping = 0.1;
  double hold = 17, ramp = 1, from = 3, hold_seconds = 20;  ///< rad/s, rad/s^2, rad/s, s
  double rate = 500;                                        ///< samples a second
  unsigned seed = 1;
};

class CentrifugeRigModel {
 public:
  explicit CentrifugeRigModel(const CentrifugeRig& rig) : rig_(rig) { build(); }

  /// Channels "housing" (m/s^2) and "beta" (rad).
  Recording run() const;

 private:
  // Coordinates: motor u, slope; armature u, slope; bowl u, slope; u at the centre of mass of each.
  enum { kMotor = 0, kArmature = 2, kBowl = 4, kSize = 6 };

  void build() {
    const double pi = std::numbers::pi, rho = 7800, young = 2.1e11, shear = 8.1e10;
    const double d = 0.012, length = 0.14, thick = 0.05;
    Eigen::MatrixXd& m = mass_;
    m = gyro_ = stiffness_ = damping_ = joint_ = Eigen::MatrixXd::Zero(kSize, kSize);
    m(kMotor, kMotor) = 5;
    m(kMotor + 1, kMotor + 1) = 0.026;
    // Armature: disc of 1 kg and the thick shaft of 200 mm, both about 100 mm.
    const double core = rho * pi / 4 * thick * thick * 0.2;
    m(kArmature, kArmature) = 1 + core;
    m(kArmature + 1, kArmature + 1) = 0.004 + core * (3 * thick * thick / 4 + 0.2 * 0.2) / 12;
    gyro_(kArmature + 1, kArmature + 1) = 0.004 + core * thick * thick / 8;
    // Bowl of 8 kg at 380 mm, hub section at 350 mm, tubes at 360 mm: one rigid part about the bowl's centre.
    const double hub = rho * pi / 4 * thick * thick * 0.02, tubes = 0.09 * 0.09 * rig_.load;
    m(kBowl + 1, kBowl + 1) = 0.055 + hub * (3 * thick * thick / 4 + 0.02 * 0.02) / 12 + tubes / 2;
    gyro_(kBowl + 1, kBowl + 1) = 0.085 + hub * thick * thick / 8 + tubes;
    add_mass(8, kBowl, 0);
    add_mass(hub, kBowl, -0.03);
    add_mass(rig_.load, kBowl, -0.02);
    const double half = rho * pi / 4 * d * d * length / 2;
    add_mass(half, kArmature, 0.1);
    add_mass(half, kBowl, -0.04);
    for (const double z : {-0.1, 0.1}) {  // mounts on the motor, bearings between it and the armature
      const Eigen::VectorXd mount = point(kMotor, z);
      stiffness_ += rig_.mount_stiffness * mount * mount.transpose();
      damping_ += rig_.mount_damping * mount * mount.transpose();
    }
    for (const double z : {-0.08, 0.08}) {
      const Eigen::VectorXd bearing = point(kMotor, z) - point(kArmature, z);
      stiffness_ += 5e7 * bearing * bearing.transpose();
    }
    // Spindle: the hub relative to the tangent of the armature's end, by forces and moments there.
    const double inertia = pi / 64 * std::pow(d, 4), area = pi / 4 * d * d, nu = young / (2 * shear) - 1;
    const double k = 6 * (1 + nu) * (1 + nu) / (7 + 12 * nu + 4 * nu * nu);
    Eigen::Matrix2d flexibility;
    flexibility << std::pow(length, 3) / (3 * young * inertia) + length / (k * shear * area),
        length * length / (2 * young * inertia), length * length / (2 * young * inertia), length / (young * inertia);
    Eigen::MatrixXd relative(2, kSize);
    relative.row(0) = (point(kBowl, -0.04) - point(kArmature, 0.1 + length)).transpose();
    relative.row(1) =
        (Eigen::VectorXd::Unit(kSize, kBowl + 1) - Eigen::VectorXd::Unit(kSize, kArmature + 1)).transpose();
    const Eigen::MatrixXd forces = relative.transpose() * flexibility.inverse();
    stiffness_ += forces * relative;
    joint_ = rig_.joint_damping * relative.row(1).transpose() * relative.row(1);
  }
  static Eigen::VectorXd point(int part, double above) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(kSize);
    row[part] = 1;
    row[part + 1] = above;
    return row;
  }
  void add_mass(double kg, int part, double above) {
    const Eigen::VectorXd row = point(part, above);
    mass_ += kg * row * row.transpose();
  }

  CentrifugeRig rig_;
  Eigen::MatrixXd mass_, gyro_, stiffness_, damping_, joint_;
};

inline Recording CentrifugeRigModel::run() const {
  using Complex = std::complex<double>;
  constexpr int kSteps = 4;
  const double ramp_time = (rig_.hold - rig_.from) / rig_.ramp, h = 1 / (rig_.rate * kSteps);
  const auto samples = static_cast<Eigen::Index>((ramp_time + rig_.hold_seconds) * rig_.rate);
  const auto speed = [&](double t) { return t < ramp_time ? rig_.from + rig_.ramp * t : rig_.hold; };
  const auto turned = [&](double t) {
    const double r = std::min(t, ramp_time);
    return rig_.from * r + rig_.ramp * r * r / 2 + rig_.hold * (t - r);
  };
  Eigen::VectorXcd q = Eigen::VectorXcd::Zero(kSize), v = q;
  const Eigen::VectorXcd force = std::polar(rig_.size, rig_.angle) * point(kBowl, -0.02).cast<Complex>();
  const Eigen::VectorXd place = point(kMotor, 0.1);
  std::mt19937_64 random(rig_.seed);
  std::normal_distribution<double> normal;
  const double sd = rig_.noise_density * std::sqrt(rig_.rate / 2),
               lag = std::exp(-2 * std::numbers::pi * 0.1 / rig_.rate);
  double slow = rig_.drift * normal(random);
  Eigen::VectorXd reading(samples), beta(samples);
  Eigen::PartialPivLU<Eigen::MatrixXcd> solver;
  Eigen::MatrixXcd c, k;
  for (Eigen::Index i = 0; i < samples; ++i) {
    const double begin = static_cast<double>(i) / rig_.rate;
    if (i % 16 == 0) {
      const double w = speed(begin + 8 / rig_.rate);
      c = (damping_ + joint_).cast<Complex>() - Complex(0, w) * gyro_;
      k = stiffness_.cast<Complex>() - Complex(0, w) * joint_;
      solver.compute(2 / h * mass_.cast<Complex>() + c + h / 2 * k);
    }
    Complex acceleration = 0, tilt = 0;
    for (int s = 0; s < kSteps; ++s) {
      const double middle = begin + (s + 0.5) * h, w = speed(middle), rise = middle < ramp_time ? rig_.ramp : 0;
      const Eigen::VectorXcd f = Complex(w * w, -rise) * std::polar(1.0, turned(middle)) * force;
      const Eigen::VectorXcd right = 2 / h * (mass_ * v) - k * q + f;
      const Eigen::VectorXcd mean = solver.solve(right);
      if (s == 0) {  // at the middle of this step, which is when the angle is taken too
        acceleration = 2 / h * place.cast<Complex>().dot(mean - v);
        tilt = q[kMotor + 1] + h / 2 * mean[kMotor + 1];
      }
      q += h * mean;
      v = 2 * mean - v;
    }
    const Complex measured = (acceleration - 9.80665 * tilt) * std::polar(1.0, -rig_.axis);
    slow = lag * slow + std::sqrt(1 - lag * lag) * rig_.drift * normal(random);
    reading[i] = rig_.gain * measured.real() + sd * normal(random) + slow;
    beta[i] = turned(begin + h / 2);
  }
  Recording record;
  record.dt = 1 / rig_.rate;
  record.source = "spin-up";
  record.add("housing", Quantity::acceleration, reading);
  record.add("beta", Quantity::angle, beta);
  return record;
}

/// A loading drawn for a check: 0 to 12 g at 90 mm, any angle, on a machine within the tolerances of the template
/// (mounts 10 % and 50 %, gain 3 %, axis 2 degrees, tubes to 0.4 kg), with the noise of a 1 g MEMS accelerometer:
/// 110 ug per root of Hz (as of the ADXL103), and a drift of 0.2 mg.
inline CentrifugeRig make_loading(unsigned seed) {
  std::mt19937_64 random(6271ull * seed + 5);
  const auto even = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  CentrifugeRig rig;
  rig.size = even(0, 0.012) * 0.09;
  rig.angle = even(-std::numbers::pi, std::numbers::pi);
  rig.mount_stiffness *= even(0.9, 1.1);
  rig.mount_damping *= even(0.5, 1.5);
  rig.load = even(0, 0.4);
  rig.gain = even(0.97, 1.03);
  rig.axis = even(-2, 2) * std::numbers::pi / 180;
  rig.noise_density = 110e-6 * 9.80665;
  rig.drift = 0.2e-3 * 9.80665;
  rig.seed = seed + 1000000;
  return rig;
}

}  // namespace whirl::testing
