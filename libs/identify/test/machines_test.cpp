#include "whirl/testing/machines.hpp"

#include <gtest/gtest.h>

#include "rotor_synthetic.hpp"

namespace whirl::testing {
namespace {

// Two integrators written apart agree on the plain rotor.
TEST(MachinesProperty, PlainMachineMovesLikeThePlainRotorModel) {
  for (const unsigned seed : {1U, 2U}) {
    const DrawnMachine d = draw_machine(Oddity::none, seed);
    RotorModel m;
    m.k1 = d.machine.k;
    m.k2 = d.machine.cubic;
    m.c = d.machine.c;
    m.eps = std::polar(d.machine.e, d.machine.e_phase);
    m.offset = {d.machine.offset_x, d.machine.offset_y};
    const Eigen::VectorXcd z = motion(m, {d.run.from_hz, d.run.to_hz, d.run.seconds, d.run.beta0, d.run.dt});
    const Eigen::MatrixX2d seen = readings(d.machine, d.run);
    // From two seconds on: the starts differ by a decaying transient.
    const Eigen::Index n = z.size() - 4000;
    EXPECT_LT((seen.col(0).tail(n) - z.real().tail(n)).cwiseAbs().maxCoeff(), 1e-3 * z.cwiseAbs().maxCoeff());
    EXPECT_LT((seen.col(1).tail(n) - z.imag().tail(n)).cwiseAbs().maxCoeff(), 1e-3 * z.cwiseAbs().maxCoeff());
  }
}

// The bow's equation of the rotor at constant speed: z = (k b + e w^2) / (k - w^2 + i c w) e^{i beta}.
TEST(MachinesProperty, BowedMachineWhirlsAsTheFormulaSays) {
  DrawnMachine d = draw_machine(Oddity::bow, 3);
  d.machine.cubic = 0;
  d.machine.offset_x = d.machine.offset_y = 0;
  d.run.from_hz = d.run.to_hz = 8;
  const Eigen::MatrixX2d z = readings(d.machine, d.run);
  const double w = d.run.omega(0), t = 10;
  const Complex expected = (d.machine.k * std::polar(d.machine.bow, d.machine.bow_phase) +
                            w * w * std::polar(d.machine.e, d.machine.e_phase)) /
                           Complex(d.machine.k - w * w, d.machine.c * w) * std::polar(1.0, d.run.beta(t));
  EXPECT_LT(std::abs(Complex(z(10000, 0), z(10000, 1)) - expected), 1e-3 * std::abs(expected));
}

}  // namespace
}  // namespace whirl::testing
