#include <cmath>

#include "normal.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/rig/virtual_rig.hpp"

namespace whirl::rig {

namespace {

void add_noise(Eigen::VectorXd& x, double snr_db, Normal& normal) {
  const double mean = x.mean();
  const double sd = std::sqrt((x.array() - mean).square().mean()) * std::pow(10.0, -snr_db / 20);
  for (double& v : x) v += sd * normal();
}

}  // namespace

OpenLoopRecord record_open_loop(const RigParameters& parameters, const RigRun& run, std::optional<double> snr_db) {
  RigParameters p = parameters;
  if (snr_db) p.laser.noise = 0;
  VirtualRig rig(p, run);
  const RigTruth truth(rig);
  const Eigen::Index n = rig.ticks();
  Eigen::MatrixXd measured(n, 3), real(n, 7);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Measurement m = rig.read();
    const rotor::AngleState a = truth.angle();
    measured.row(k) << m.x, m.y, m.beta;
    real.row(k) << truth.z().real(), truth.z().imag(), truth.dz().real(), truth.dz().imag(), a.beta, a.omega, a.alpha;
    rig.write({});
    rig.advance();
  }
  Eigen::VectorXd x = measured.col(0), y = measured.col(1);
  if (snr_db) {
    Normal normal(run.seed);
    add_noise(x, *snr_db, normal);
    add_noise(y, *snr_db, normal);
  }
  OpenLoopRecord out;
  out.measured.dt = out.truth.dt = 1 / p.timing.rate;
  out.measured.source = "simulated rig";
  out.truth.source = "simulated rig, truth";
  out.measured.add("x", Quantity::displacement, std::move(x));
  out.measured.add("y", Quantity::displacement, std::move(y));
  out.measured.add("beta", Quantity::angle, measured.col(2));
  out.truth.add("x", Quantity::displacement, real.col(0));
  out.truth.add("y", Quantity::displacement, real.col(1));
  out.truth.add("dx", Quantity::velocity, real.col(2));
  out.truth.add("dy", Quantity::velocity, real.col(3));
  out.truth.add("beta", Quantity::angle, real.col(4));
  out.truth.add("omega", Quantity::angular_velocity, real.col(5));
  out.truth.add("alpha", Quantity::angular_acceleration, real.col(6));
  return out;
}

}  // namespace whirl::rig
