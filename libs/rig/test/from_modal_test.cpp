#include "whirl/rig/from_modal.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::rig {
namespace {

Mode mode(double frequency, double zeta, double modal_mass) {
  const double w = 2 * M_PI * frequency, wd = w * std::sqrt(1 - zeta * zeta);
  Mode m;
  m.pole = {-zeta * w, wd};
  m.residues = Eigen::VectorXcd::Constant(1, std::complex<double>(0, -1 / (2 * modal_mass * wd)));
  return m;
}

TEST(RigFromModalReference, FindsTheRigItsFrequencyResponseCameFrom) {
  // The poles and residues of the default rig's x axis, with its partner on the other axis.
  const RigParameters truth;
  ModalModel modal;
  const double f = truth.natural_frequency() / (2 * M_PI);
  modal.modes = {mode(f, 0.0066, 1.5), mode(1.02 * f, 0.0066, 60)};
  for (const RigMode& m : truth.modes)
    modal.modes.push_back(mode(m.frequency, m.damping_ratio, m.sensor_sign * 1.5 / m.participation));
  const RigParameters p = rig_from_modal(modal);
  EXPECT_NEAR(p.rotor.mass, 1.5, 1e-9);
  EXPECT_NEAR(p.rotor.stiffness, 8500, 1e-6);
  EXPECT_NEAR(p.rotor.damping, 2 * 0.0066 * truth.natural_frequency() * 1.5, 1e-9);
  ASSERT_EQ(p.modes.size(), truth.modes.size());
  for (std::size_t i = 0; i < p.modes.size(); ++i) {
    EXPECT_NEAR(p.modes[i].frequency, truth.modes[i].frequency, 1e-9);
    EXPECT_NEAR(p.modes[i].damping_ratio, truth.modes[i].damping_ratio, 1e-12);
    EXPECT_NEAR(p.modes[i].participation, truth.modes[i].participation, 1e-12);
    EXPECT_EQ(p.modes[i].sensor_sign, truth.modes[i].sensor_sign);
  }
  EXPECT_EQ(p.rotor.cubic, truth.rotor.cubic);
}

TEST(RigFromModal, RejectsMissingChannelsAndMasslessModes) {
  ModalModel modal;
  EXPECT_THROW(rig_from_modal(modal), Error);
  modal.modes = {mode(12, 0.01, -1)};
  EXPECT_THROW(rig_from_modal(modal), Error);
  EXPECT_THROW(rig_from_modal(modal, 3), Error);
}

}  // namespace
}  // namespace whirl::rig
