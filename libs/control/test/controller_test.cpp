#include "whirl/control/controller.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <type_traits>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/laws/lqr.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/testing/alloc_guard.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::control {
namespace {

using Complex = std::complex<double>;

using testing::design_of;

/// The design's own plant with its own delay; the reading is the state `sensor_delay` ago.
struct Plant {
  LateralModel model;
  Complex eps;
  double gain, omega = 150, t = 0;
  DiskMotion s{{2e-4, 0}, {0, 0.02}, {}};
  std::vector<Complex> forces, readings;

  explicit Plant(const ControllerDesign& d)
      : model(LateralModel::from(d.model)), eps(d.model.eps), gain(d.model.gain) {}
  Measurement read() const {
    // 0.25 ms sensor delay: 20 substeps per sample, the reading five substeps old.
    const Complex z = readings.size() < 6 ? s.z : readings[readings.size() - 6];
    Measurement m;
    m.t = t;
    m.x = z.real();
    m.y = z.imag();
    m.beta = omega * t;
    m.omega = omega;
    return m;
  }
  void advance(const Command& c) {
    forces.push_back({c.ux, c.uy});
    // 1.8 ms input delay in steps of 50 us.
    for (int i = 0; i < 20; ++i) {
      const long late = static_cast<long>(forces.size()) - 1 - (i < 16 ? 2 : 1);
      const Complex a = late >= 0 ? gain * forces[static_cast<std::size_t>(late)] : 0;
      s.d = product(eps, unbalance_per_metre(omega * t, omega, 0));
      s = predict_motion(model, s, a, omega, 50e-6);
      t += 50e-6;
      readings.push_back(s.z);
    }
  }
};

double closed_loop_peak(const ControllerDesign& d, int ticks = 3000) {
  Controller c = make_controller(d);
  Plant plant(d);
  double peak = 0;
  for (int k = 0; k < ticks; ++k) {
    const auto out = c.step(plant.read());
    EXPECT_TRUE(out) << d.law << " " << d.estimator;
    plant.advance(*out);
    if (k > ticks / 2) peak = std::max(peak, std::abs(plant.s.z));
  }
  return peak;
}

TEST(ControllerProperty, EveryLawAndEstimatorHoldsTheRotorOfItsModel) {
  // Open loop at 2 w1: about 1.33 e = 0.37 mm.
  for (const auto& law : laws()) {
    for (const char* estimator : {"lpf", "kalman", "kfe", "kfo", "eso", "red_implicit"}) {
      ControllerDesign d = design_of(law.name, estimator);
      d.parameters["predict"] = 1;
      const double peak = closed_loop_peak(d, 2000);
      EXPECT_LT(peak, 0.12e-3) << law.name << " with " << estimator;
    }
  }
}

TEST(ControllerProperty, ModelBasedPredictionLeavesAlmostNothing) {
  ControllerDesign d = design_of("lsmc", "kfe");
  d.parameters["predict"] = 1;
  d.parameters["boundary_layer"] = 0.1;
  EXPECT_LT(closed_loop_peak(d), 2e-6);
}

TEST(ControllerProperty, PhaseAdvanceMakesTheFeedforwardFit) {
  ControllerDesign d = design_of("pd", "lpf");
  d.parameters["kd"] = 30;
  const double with = closed_loop_peak(d);
  d.parameters["advance"] = 0;
  const double late = closed_loop_peak(d);
  d.feedforward = false;
  const double without = closed_loop_peak(d);
  EXPECT_LT(with, 0.1 * late);
  EXPECT_LT(late, without);
}

TEST(ControllerRealtime, NoStepAllocates) {
  {
    const testing::AllocationGuard guard;
    testing::allocate_twice();
    ASSERT_EQ(guard.count(), 2u) << "the guard does not see allocations";
  }
  for (const auto& law : laws()) {
    for (const auto& estimator : estimators()) {
      ControllerDesign d = design_of(law.name, estimator.name);
      d.parameters["predict"] = 1;
      d.parameters["runout_x_cos_1"] = 1e-5;
      Controller c = make_controller(d);
      const testing::AllocationGuard guard;
      for (int k = 0; k < 200; ++k) {
        Measurement m;
        m.x = 1e-4 * std::cos(0.1 * k);
        m.y = 1e-4 * std::sin(0.1 * k);
        m.beta = 0.1 * k;
        m.omega = 100;
        m.valid = k % 17 != 0;
        if (!c.step(m)) break;
      }
      c.reset();
      EXPECT_EQ(guard.count(), 0u) << law.name << " " << estimator.name;
    }
  }
}

// The supervision while it finds nothing, and on its way through all its steps to the trip.
TEST(ControllerRealtime, NoSupervisedStepAllocates) {
  for (const double level : {1.0, 1e-4}) {
    ControllerDesign d = design_of("tsmc", "kfe");
    d.parameters["supervise"] = d.parameters["reidentify"] = 1;
    d.parameters["watch_level"] = level;
    Controller c = make_controller(d);
    bool tripped = false;
    const testing::AllocationGuard guard;
    for (int k = 0; k < 3000; ++k) {
      Measurement m;
      m.x = 1e-3 * std::cos(0.1 * k) + (k > 1000 ? 4e-4 * std::sin(0.23 * k) : 0);
      m.y = 1e-3 * std::sin(0.1 * k);
      m.beta = 0.1 * k;
      m.omega = 100;
      m.valid = k % 17 != 0;
      tripped = !c.step(m) || tripped;
    }
    c.reset();
    EXPECT_EQ(guard.count(), 0u) << level;
    EXPECT_EQ(tripped, level < 1);
  }
}

TEST(ControllerRealtime, IsAFixedSizeValueWithANoexceptStep) {
  static_assert(std::is_trivially_copyable_v<ControllerState>);
  static_assert(std::is_trivially_destructible_v<Controller>);
  static_assert(noexcept(std::declval<Controller&>().step(Measurement{})));
  // A copy is an independent controller in the same state.
  Controller a = make_controller(design_of("tsmc", "kfe"));
  Measurement m;
  m.x = 1e-4;
  a.step(m);
  Controller b = a;
  m.x = 1.1e-4;
  const auto ua = a.step(m), ub = b.step(m);
  EXPECT_EQ(ua->ux, ub->ux);
  a.step(m);
  EXPECT_NE(a.state().estimate.v, b.state().estimate.v);
}

TEST(ControllerUnit, ResetRepeatsTheRun) {
  for (const auto& law : laws()) {
    for (const auto& estimator : estimators()) {
      Controller c = make_controller(design_of(law.name, estimator.name));
      double first[2][20];
      for (int pass = 0; pass < 2; ++pass) {
        for (int k = 0; k < 20; ++k) {
          Measurement m;
          m.x = 1e-4 + 1e-6 * k;
          m.omega = 50;
          m.beta = 0.05 * k;
          first[pass][k] = c.step(m)->ux;
        }
        c.reset();
      }
      for (int k = 0; k < 20; ++k) EXPECT_EQ(first[0][k], first[1][k]) << law.name << " " << estimator.name;
    }
  }
}

TEST(ControllerUnit, NotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Controller c = make_controller(design_of("tsmc", "lpf"));
  Measurement m;
  m.x = 1e-4;
  ASSERT_TRUE(c.step(m));
  m.x = nan;  // a lost sample: held and counted
  const auto held = c.step(m);
  ASSERT_TRUE(held);
  EXPECT_TRUE(std::isfinite(held->ux));
  EXPECT_TRUE(c.state().held);
  EXPECT_EQ(c.state().held_total, 1);
  m.x = 1e-4;
  m.beta = nan;
  const auto bad = c.step(m);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error(), Fault::not_finite);
  m.beta = 0;
  EXPECT_TRUE(c.step(m));  // latching is the loop's business, and the NaN did not enter the state
}

TEST(ControllerUnit, LostSamplesAreHeldThenFault) {
  ControllerDesign d = design_of("pd", "lpf");
  d.parameters["stale_limit"] = 5;
  Controller c = make_controller(d);
  Measurement m;
  m.x = 1e-4;
  c.step(m);
  m.valid = false;
  m.x = 12.5e-3;
  for (int k = 0; k < 5; ++k) ASSERT_TRUE(c.step(m)) << k;
  const auto stale = c.step(m);
  ASSERT_FALSE(stale);
  EXPECT_EQ(stale.error(), Fault::stale_sensor);
}

TEST(ControllerUnit, ImplausibleJumpIsHeldAndReacquired) {
  Controller c = make_controller(design_of("pd", "lpf"));
  Measurement m;
  m.x = 1e-4;
  c.step(m);
  m.x = 5e-3;  // 2 mm per sample are plausible
  c.step(m);
  EXPECT_TRUE(c.state().held);
  c.step(m);
  EXPECT_TRUE(c.state().held);
  c.step(m);
  EXPECT_FALSE(c.state().held);
}

TEST(ControllerUnit, SaturationIsReportedAndEntersThePrediction) {
  ControllerDesign d = design_of("pd", "kfe");
  d.parameters["kp"] = 1e6;
  d.parameters["predict"] = 1;
  d.force_limit = 3;
  Controller c = make_controller(d);
  Measurement m;
  m.x = 1e-3;
  const auto out = c.step(m);
  ASSERT_TRUE(out);
  EXPECT_EQ(std::abs(out->ux), 3);
  EXPECT_TRUE(c.state().saturated);
  EXPECT_GT(std::abs(c.state().requested.real()), 3);
  EXPECT_EQ(c.state().applied.real(), out->ux);
  // The force that was sent, not the one asked for, moves the estimate.
  Controller e = c;
  e.applied({0, 0});
  for (int k = 0; k < 4; ++k) c.step(m), e.step(m);
  EXPECT_NE(c.state().estimate.v, e.state().estimate.v);
}

TEST(ControllerUnit, InputGainIsCarried) {
  ControllerDesign d = design_of("tsmc", "lpf");
  d.force_limit = 0;
  Measurement m;
  m.x = 1e-4;
  const double force = make_controller(d).step(m)->ux;
  d.model.gain *= 2;
  EXPECT_DOUBLE_EQ(make_controller(d).step(m)->ux, force / 2);
}

TEST(ControllerUnit, CancelFractionActsOnTheLinearStiffnessOnly) {
  ControllerDesign d = design_of("lsmc", "lpf");
  d.feedforward = false;
  Measurement m;
  m.x = 1e-3;
  const double all = make_controller(d).step(m)->ux;
  d.parameters["cancel"] = 0.75;
  const double part = make_controller(d).step(m)->ux;
  EXPECT_NEAR(all - part, 0.25 * 5700 * 1e-3 * 1.5, 1e-12);
}

TEST(ControllerUnit, BadDesignsAreRefusedWithTheField) {
  const auto message = [](const ControllerDesign& d) -> std::string {
    try {
      make_controller(d);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  ControllerDesign d = design_of("tsmc", "lpf");
  d.parameters["exponent"] = 0.4;
  EXPECT_NE(message(d).find("exponent"), std::string::npos);
  d = design_of("tsmc", "lpf");
  d.parameters["surfce_gain"] = 3;
  EXPECT_NE(message(d).find("surfce_gain"), std::string::npos);
  d = design_of("tsm", "lpf");
  EXPECT_NE(message(d).find("tsmc"), std::string::npos);
  d = design_of("tsmc", "lfp");
  EXPECT_NE(message(d).find("kalman"), std::string::npos);
  d = design_of("tsmc", "lpf");
  d.model.gain = 0;
  EXPECT_NE(message(d).find("gain"), std::string::npos);
  d = design_of("nftsmc", "lpf");
  d.parameters["fast_exponent"] = 1.1;
  EXPECT_NE(message(d).find("1/exponent"), std::string::npos);
  d = design_of("tsmc", "lpf");
  d.delay = 0.1;
  EXPECT_NE(message(d).find("delay"), std::string::npos);
  d = design_of("pd", "lpf");
  d.parameters["sensor_delay"] = 0.01;
  EXPECT_NE(message(d).find("sensor_delay"), std::string::npos);
}

TEST(ControllerUnit, DefaultsMeetTheDelayRulesAndWarningsSayWhenNot) {
  ControllerDesign d = design_of("tsmc", "lpf");
  d.parameters["exponent"] = 0.6;
  d.parameters["surface_gain"] = 20;
  EXPECT_TRUE(design_warnings(d).empty());
  EXPECT_NEAR(resolve_parameters(d)["boundary_layer"], 6.75e-3 * 3, 1e-12);
  d.parameters["boundary_layer"] = 0.01;
  EXPECT_EQ(design_warnings(d).size(), 1u);
}

TEST(LqrReference, EqualsTheRegulatorWithDelayStates) {
  const double h = 1e-3, k1 = 5700, c = 1;
  const LqrGains g = lqr_gains(k1, c, h, 1e-3, 0.05, 3);
  EXPECT_LT(g.residual, 1e-10);
  EXPECT_LT(g.spectral_radius, 1);
  // Two whole samples of input delay as states: the optimal gain is the same gain on the predicted state.
  const double w = std::sqrt(k1 - 0.25 * c * c), decay = std::exp(-0.5 * c * h);
  Eigen::Matrix2d a0;
  a0 << std::cos(w * h) + 0.5 * c / w * std::sin(w * h), std::sin(w * h) / w, -k1 / w * std::sin(w * h),
      std::cos(w * h) - 0.5 * c / w * std::sin(w * h);
  a0 *= decay;
  Eigen::Matrix2d f;
  f << 0, 1, -k1, -c;
  const Eigen::Vector2d b0 = f.inverse() * (a0 - Eigen::Matrix2d::Identity()) * Eigen::Vector2d(0, 1);
  Eigen::Matrix4d a = Eigen::Matrix4d::Zero();
  a.topLeftCorner<2, 2>() = a0;
  a.block<2, 1>(0, 2) = b0;
  a(2, 3) = 1;
  const Eigen::Vector4d b(0, 0, 0, 1);
  Eigen::Matrix4d q = Eigen::Matrix4d::Zero(), p;
  q(0, 0) = 1e6;
  q(1, 1) = 400;
  p = q;
  const double r = 1.0 / 9;
  Eigen::RowVector4d gain;
  for (int i = 0; i < 20000; ++i) {
    gain = (b.transpose() * p * a) / (r + b.dot(p * b));
    p = (q + a.transpose() * p * (a - b * gain)).eval();
  }
  const Eigen::RowVector2d base(g.kp, g.kd);
  Eigen::RowVector4d expected;
  expected << base * a0 * a0, base * a0 * b0, base * b0;
  EXPECT_LT((gain - expected).norm(), 1e-6 * expected.norm());
}

TEST(RunoutReference, SlowRollIsFittedAndRemoved) {
  Runout truth;
  truth.x_cos[0] = 12e-6, truth.x_sin[1] = -5e-6, truth.y_sin[0] = 11e-6, truth.y_cos[2] = 3e-6;
  Recording slow;
  slow.dt = 1e-3;
  slow.source = "slow roll";
  const int n = 3000;
  Eigen::VectorXd x(n), y(n), beta(n);
  for (int i = 0; i < n; ++i) {
    beta(i) = 5 * i * slow.dt;
    const Complex r = truth.at(beta(i));
    x(i) = 1e-4 + r.real();
    y(i) = r.imag();
  }
  slow.add("x", Quantity::displacement, x);
  slow.add("y", Quantity::displacement, y);
  slow.add("beta", Quantity::angle, beta);
  const Runout fit = estimate_runout(slow);
  for (double b : {0.0, 1.0, 2.5, 4.0}) EXPECT_LT(std::abs(fit.at(b) - truth.at(b)), 1e-12);

  ControllerDesign d = design_of("pd", "difference");
  d.parameters.merge(runout_parameters(fit));
  Controller c = make_controller(d);
  Measurement m;
  m.beta = 1.2;
  m.x = truth.at(1.2).real() + 5e-5;
  m.y = truth.at(1.2).imag();
  c.step(m);
  EXPECT_LT(std::abs(c.state().measured - 5e-5), 1e-12);

  slow.channels[2].samples *= 0.1;
  EXPECT_THROW(estimate_runout(slow), Error);
}

}  // namespace
}  // namespace whirl::control
