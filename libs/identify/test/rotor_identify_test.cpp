#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "rotor_synthetic.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify_rotor.hpp"

namespace whirl::identification {
namespace {

using namespace testing;

TEST(IdentifyRotorReference, TargetsAtTwentyDecibels) {
  RotorModel truth = rotor_a();
  truth.offset = {7e-5, -5e-5};
  const Eigen::VectorXcd clean = motion(truth, {});
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const IdentifiedModel found = identify_rotor(recording(with_noise(clean, 20, seed), {}));
    EXPECT_EQ(found.summary.status, Status::ok) << (found.summary.warnings.empty() ? "" : found.summary.warnings[0]);
    ASSERT_TRUE(found.rotor);
    const ModelError e = model_error(*found.rotor, truth);
    EXPECT_LT(std::abs(e.k1), 0.1);
    EXPECT_LT(std::abs(e.k2), 3);
    EXPECT_LT(std::abs(e.c), 0.6);
    EXPECT_LT(std::abs(e.e), 0.5);
    EXPECT_LT(std::abs(e.phase), 0.3);
    EXPECT_LT(std::abs(found.rotor->offset - truth.offset), 4e-6);
    EXPECT_NEAR(found.summary.chi_square, 1, 0.3);
    EXPECT_NEAR(found.noise_sd, 2.2e-5, 2e-6);
    EXPECT_EQ(found.rotor_covariance.size(), 25U);
    ASSERT_EQ(found.equations.size(), 4U);
    EXPECT_EQ(found.equations[1].terms[0].function, "X1");
    EXPECT_NEAR(found.equations[1].terms[0].coefficient.value, -found.rotor->k1, 1e-9 * truth.k1);
    EXPECT_NEAR(found.parameter("e")->value, std::abs(found.rotor->eps), 1e-12);
    // What the records cannot exclude widens a parameter; the equation that is made of it says the same.
    const auto sd = [&](std::size_t equation, const char* function) {
      for (const EquationTerm& t : found.equations[equation].terms) {
        if (t.function == function) return t.coefficient.sd;
      }
      ADD_FAILURE() << function;
      return 0.0;
    };
    for (const std::size_t equation : {1U, 3U}) {
      const bool x = equation == 1;
      EXPECT_NEAR(sd(equation, x ? "X1" : "X3") / found.parameter("k1")->sd, 1, 1e-6);
      EXPECT_NEAR(sd(equation, x ? "X1*(X1^2 + X3^2)" : "X3*(X1^2 + X3^2)") / found.parameter("k2")->sd, 1, 1e-6);
      EXPECT_NEAR(sd(equation, x ? "X2" : "X4") / found.parameter("c")->sd, 1, 1e-6);
      const double re = sd(equation, x ? "X6^2*cos(X5) + X7*sin(X5)" : "X6^2*sin(X5) - X7*cos(X5)");
      const double im = sd(equation, x ? "X7*cos(X5) - X6^2*sin(X5)" : "X6^2*cos(X5) + X7*sin(X5)");
      const double e_sd = found.parameter("e")->sd, turn = std::abs(found.rotor->eps) * found.parameter("e_phase")->sd;
      EXPECT_NEAR(std::hypot(re, im) / std::hypot(e_sd, turn), 1, 0.01);
    }
  }
}

TEST(IdentifyRotorReference, AnisotropyIsFoundByOneTerm) {
  RotorModel truth = rotor_a();
  truth.k1_conj = std::polar(0.01 * truth.k1, 0.4);
  const RotorIdentification r = identify_rotor_detailed({record(with_noise(motion(truth, {}), 20, 3), {})});
  EXPECT_EQ(r.added, std::vector<std::string>{"anisotropic stiffness"});
  EXPECT_EQ(r.model.summary.status, Status::ok);
  const ModelError e = model_error(*r.model.rotor, truth);
  EXPECT_LT(std::abs(e.k1), 0.1);
  EXPECT_LT(std::abs(e.k2), 3);
  EXPECT_LT(std::abs(r.model.rotor->k1_conj - truth.k1_conj), 0.02 * std::abs(truth.k1_conj));
}

TEST(IdentifyRotorReference, SeveralRecordsShareTheRotor) {
  RotorModel truth = rotor_a(), loaded = truth;
  loaded.eps += added_mass(2.5);
  const Sweep up{0, 30, 12, 0.5, 1e-3};
  const IdentifiedModel found = identify_rotor(std::vector<Recording>{
      recording(with_noise(motion(truth, {}), 20, 1), {}), recording(with_noise(motion(loaded, {}), 20, 2), {}),
      recording(with_noise(motion(truth, up), 20, 3), up)});
  ASSERT_EQ(found.summary.status, Status::ok);
  EXPECT_NEAR(found.rotor->k2 / truth.k2, 1, 0.01);
  EXPECT_NEAR(found.parameter("e_2")->value, std::abs(loaded.eps), 0.002 * std::abs(loaded.eps));
  EXPECT_NEAR(found.parameter("e_phase_3")->value, 0.7, 0.005);
}

TEST(IdentifyRotorReference, RateErrorOfAnAssumedProfileIsRecovered) {
  const RotorModel truth = rotor_a();
  const Sweep sweep;
  RotorIdentifyOptions options;
  options.angle_source = AngleSource::profile;
  for (const double error : {-0.005, 0.002, 0.005}) {
    Sweep assumed = sweep;
    assumed.to = sweep.from + (1 + error) * (sweep.to - sweep.from);
    options.record.known_angle = assumed.angle();
    const IdentifiedModel found = identify_rotor(recording(with_noise(motion(truth, sweep), 20, 8), sweep), options);
    EXPECT_EQ(found.summary.status, Status::ok) << error << ' ' << found.summary.warnings[0];
    const ModelError e = model_error(*found.rotor, truth);
    EXPECT_LT(std::abs(e.k1), 0.1) << error;
    EXPECT_LT(std::abs(e.k2), 3) << error;
    EXPECT_LT(std::abs(e.c), 0.6) << error;
    EXPECT_LT(std::abs(e.e), 0.5) << error;
    EXPECT_LT(std::abs(e.phase), 1.0) << error;
  }
}

TEST(IdentifyRotorReference, WrongAngleIsNeverCalledOk) {
  const RotorModel truth = rotor_a();
  const Sweep sweep;
  for (const double error : {0.0005, 0.001, 0.005, 0.02}) {
    Sweep assumed = sweep;
    assumed.to = sweep.from + (1 + error) * (sweep.to - sweep.from);
    RotorIdentifyOptions options;
    options.record.known_angle = assumed.angle();
    const IdentifiedModel found = identify_rotor(recording(with_noise(motion(truth, sweep), 20, 8), sweep), options);
    EXPECT_NE(found.summary.status, Status::ok) << error;
  }
}

TEST(IdentifyRotorReference, ModesOfAHammerTestBecomeStates) {
  RotorModel truth = rotor_a();
  truth.modes = {{kTurn * 21, 0.02, 0.04 * truth.eps}, {kTurn * 33, 0.015, 0.05 * truth.eps}};
  const Sweep sweep{38, 0, 15, 0, 1e-3};
  RotorIdentifyOptions options;
  options.modal.emplace();
  for (const double f : {12.1, 16.0, 21.2, 32.8, 47.0}) {  // main, decoy, two true ones 1 % off, decoy
    Mode m;
    m.frequency = Estimate::from_sd(f, 0.1);
    m.damping = Estimate::from_sd(0.02, 0.002);
    options.modal->modes.push_back(m);
  }
  const RotorIdentification r =
      identify_rotor_detailed({record(with_noise(motion(truth, sweep), 20, 2), sweep)}, options);
  ASSERT_EQ(r.model.rotor->modes.size(), 2U) << r.model.summary.warnings[0];
  EXPECT_LT(r.chi_square_weak, 1.3);
  const ModelError e = model_error(*r.model.rotor, truth);
  EXPECT_LT(std::abs(e.k1), 0.1);
  EXPECT_LT(std::abs(e.k2), 3);
  EXPECT_LT(std::abs(e.c), 0.6);
  EXPECT_LT(std::abs(e.e), 0.5);
}

// Free coast-down with drag: the speed is no polynomial of the time, so beta'' is not constant.
TEST(IdentifyRotorReference, CoastDownWithOncePerTurnPulses) {
  const RotorModel truth = rotor_a();
  const double w = 30 * kTurn, drag = 0.12, friction = 6;
  const AngleLaw law = [=](double t) {
    const double e = std::exp(-drag * t), f = friction / drag;
    return std::array{(w + f) * (1 - e) / drag - f * t, (w + f) * e - f, -drag * (w + f) * e};
  };
  const Eigen::Index samples = 12000;
  const Sweep grid;  // for the sample time; its angle channel is replaced below
  const Recording data = recording(with_noise(motion(truth, law, 1e-3, samples), 20, 6), grid);
  for (const double jitter : {1e-5, 1e-3}) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    std::vector<double> pulses;
    double turn = 0;
    for (double t = 0; t < 12; t += 1e-5) {
      if (law(t)[0] >= turn) {
        pulses.push_back(t + jitter * normal(random));
        turn += kTurn;
      }
    }
    RotorIdentifyOptions options;
    options.record.known_angle = signal::angle_from_pulses(pulses, 1e-3, samples).angle;
    const IdentifiedModel found = identify_rotor(data, options);
    ASSERT_TRUE(found.rotor) << jitter;
    const ModelError e = model_error(*found.rotor, truth);
    EXPECT_LT(std::abs(e.k1), 0.1) << jitter;
    EXPECT_LT(std::abs(e.k2), 3) << jitter;
    EXPECT_LT(std::abs(e.c), 0.6) << jitter;
    EXPECT_LT(std::abs(e.e), 0.5) << jitter;
    EXPECT_LT(std::abs(e.phase), 1.0) << jitter;
  }
}

TEST(IdentifyRotorReference, EncoderOfAFewLinesIsEnough) {
  const RotorModel truth = rotor_a();
  Recording data = recording(with_noise(motion(truth, {}), 20, 12), {});
  for (const int lines : {256, 4096}) {
    Recording counted = data;
    const double step = kTurn / lines;
    for (double& b : counted.channels[2].samples) b = step * std::floor(b / step) - kTurn * std::floor(b / kTurn);
    RotorIdentifyOptions options;
    options.record.angle_fit.count_offset = 0.5;
    const IdentifiedModel found = identify_rotor(counted, options);
    EXPECT_EQ(found.summary.status, Status::ok) << lines;
    const ModelError e = model_error(*found.rotor, truth);
    EXPECT_LT(std::abs(e.k2), 3) << lines;
    EXPECT_LT(std::abs(e.phase), 0.3) << lines;
  }
}

TEST(IdentifyRotor, ClippedSensorIsNamed) {
  Recording data = recording(with_noise(motion(rotor_a(), {}), 30, 12), {});
  for (double& x : data.channels[0].samples) x = std::min(x, 0.9e-3);
  const IdentifiedModel found = identify_rotor(data);
  EXPECT_NE(found.summary.status, Status::ok);
  EXPECT_THAT(found.summary.warnings, ::testing::Contains(::testing::HasSubstr("range")));
}

/// What a probe adds to the motion and how late it is, with the true motion delayed by interpolation in the angle's
/// time.
TEST(IdentifyRotorReference, SensorDelayAndRunoutAreFoundBesideTheUnbalance) {
  const RotorModel truth = rotor_a();
  // A finer record, so that a delay of half a millisecond is a whole number of its samples.
  Sweep fine;
  fine.dt = 5e-4;
  const Eigen::VectorXcd all = motion(truth, fine);
  const AngleSignal angle = fine.angle();
  const Sweep sweep;
  Eigen::VectorXcd z(sweep.samples());
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const Eigen::Index late = std::max<Eigen::Index>(0, 2 * i - 1);
    const double b = angle.beta[2 * late];
    z[i] = all[late] + 3e-5 * std::polar(1.0, b + 0.4) + Complex(1e-5 * std::cos(2 * b), 0);
  }
  const Recording data = recording(with_noise(z, 40, 4), sweep);
  const auto check = [&](const RotorIdentification& r) {
    const ModelError e = model_error(*r.model.rotor, truth);
    EXPECT_LT(std::abs(e.k1), 0.02);
    EXPECT_LT(std::abs(e.k2), 0.5);
    EXPECT_LT(std::abs(e.c), 0.2);
    EXPECT_LT(std::abs(e.e), 0.2);
    EXPECT_LT(std::abs(e.phase), 0.3);
    EXPECT_LT(r.chi_square_weak, 1.3);
    EXPECT_EQ(r.active.probes.runout_harmonics, 2);
    EXPECT_NEAR(r.model.parameter("runout1+_re")->value, 3e-5 * std::cos(0.4), 1e-6);
    EXPECT_NEAR(r.model.parameter("runout2-_re")->value, 0.5e-5, 1e-6);
  };
  RotorIdentification found = identify_rotor_detailed({rotor_record(data)});
  check(found);
  EXPECT_NEAR(found.fit.delay, 5e-4, 5e-5);
  EXPECT_EQ(found.model.summary.status, Status::warning);  // a delay that was not given is always named
  RotorRecordOptions options;
  options.sensor_delay = 5e-4;
  found = identify_rotor_detailed({rotor_record(data, options)});
  check(found);
  EXPECT_FALSE(found.active.clock.delay);
  EXPECT_EQ(found.model.summary.status, Status::ok);
}

TEST(IdentifyRotorReference, AModeNobodyListedIsFoundByItsFrequency) {
  RotorModel truth = rotor_a();
  truth.modes = {{kTurn * 21, 0.02, 0.03 * truth.eps}};
  const RotorIdentification r = identify_rotor_detailed({record(with_noise(motion(truth, {}), 20, 3), {})});
  ASSERT_EQ(r.model.rotor->modes.size(), 1U);
  EXPECT_EQ(r.added.size(), 1U);
  EXPECT_NEAR(r.model.rotor->modes[0].omega / kTurn, 21, 0.1);
  EXPECT_NEAR(std::abs(r.model.rotor->modes[0].participation), 0.03 * std::abs(truth.eps), 0.003 * std::abs(truth.eps));
  EXPECT_LT(r.chi_square_weak, 1.3);
  const ModelError e = model_error(*r.model.rotor, truth);
  EXPECT_LT(std::abs(e.k2), 3);
  EXPECT_LT(std::abs(e.phase), 0.3);
}

Recording broken(const std::function<void(Recording&)>& change) {
  Recording r = recording(with_noise(motion(rotor_a(), {}), 20, 1), {});
  change(r);
  return r;
}

TEST(IdentifyRotor, IllPosedInputIsUnusableWithAReason) {
  const auto unusable = [](const Recording& r, const std::string& words) {
    const IdentifiedModel m = identify_rotor(r);
    EXPECT_EQ(m.summary.status, Status::unusable) << words;
    EXPECT_THAT(m.summary.warnings, ::testing::Contains(::testing::HasSubstr(words)));
  };
  unusable(broken([](Recording& r) { r.channels[0].samples.setConstant(1e-3); }), "constant");
  unusable(broken([](Recording& r) { r.channels[1].samples.setZero(); }), "constant");
  unusable(broken([](Recording& r) { r.channels[1].samples = r.channels[0].samples; }), "same signal");
  unusable(broken([](Recording& r) {
             for (Channel& c : r.channels) c.samples = c.samples.head(800).eval();
           }),
           "samples");
  unusable(broken([](Recording& r) {
             for (Channel& c : r.channels) c.samples = c.samples.tail(1200).eval();
           }),
           "turns");
  const Sweep constant{20, 20, 12, 0, 1e-3};
  unusable(recording(with_noise(motion(rotor_a(), constant), 20, 1), constant), "speed stays");
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, 1e-4);
  unusable(broken([&](Recording& r) {
             for (int k = 0; k < 2; ++k) {
               for (double& v : r.channels[static_cast<std::size_t>(k)].samples) v = normal(random);
             }
           }),
           "noise");
}

TEST(IdentifyRotor, DataThatDoNotFollowARotorAreNotCalledOk) {
  // x and y exchanged: the whirl runs against the rotation.
  const IdentifiedModel swapped =
      identify_rotor(broken([](Recording& r) { std::swap(r.channels[0].samples, r.channels[1].samples); }));
  EXPECT_EQ(swapped.summary.status, Status::unusable);
  // Angle running at half the speed.
  const IdentifiedModel half = identify_rotor(broken([](Recording& r) { r.channels[2].samples *= 0.5; }));
  EXPECT_EQ(half.summary.status, Status::unusable);
}

TEST(IdentifyRotor, BadUseIsAnError) {
  EXPECT_THROW(identify_rotor(std::vector<Recording>{}), Error);
  EXPECT_THROW(identify_rotor(broken([](Recording& r) { r.channels.pop_back(); })), Error);
  EXPECT_THROW(identify_rotor(broken([](Recording& r) { r.channels[0].quantity = Quantity::voltage; })), Error);
  RotorIdentifyOptions options;
  options.profile_degree = 1;
  EXPECT_THROW(identify_rotor(broken([](Recording&) {}), options), Error);
}

}  // namespace
}  // namespace whirl::identification
