// FRFs averaged from random force through Hann windows, as analysers write them.
#include "whirl/modal/hann_window.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "synthetic.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/modal/windowed_random.hpp"

namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using whirl::testing::error_of;
using whirl::testing::make_random_test;
using whirl::testing::RandomTest;
using whirl::testing::RandomTestOptions;
using whirl::testing::score;
using Complex = std::complex<double>;

std::vector<Complex> poles_of(const RandomTest& test) {
  std::vector<Complex> poles;
  for (std::size_t i = 0; i < test.frequency.size(); ++i) {
    const double zeta = test.damping[i];
    poles.push_back(2 * whirl::kPi * test.frequency[i] * Complex(-zeta, std::sqrt(1 - zeta * zeta)));
  }
  return poles;
}

// Closed form: the impulse response of one mode times the window's autocorrelation, both summed up in small steps, in;
// its pole on the line s = sigma + j omega out.
TEST(HannWindow, IsExchangedForAnExponentialOne) {
  constexpr int kLines = 400, kSteps = 8192;
  const double df = 0.25, block = 1 / df;
  const Complex pole = 2 * whirl::kPi * Complex(-1.1 * df, 201.3 * df);
  std::vector<double> seen(kSteps);
  for (int lag = 0; lag < kSteps; ++lag) {
    for (int i = lag; i < kSteps; ++i) {
      const auto hann = [](int at) { return std::pow(std::sin(whirl::kPi * at / kSteps), 2); };
      seen[static_cast<std::size_t>(lag)] += hann(i) * hann(i - lag);
    }
  }
  whirl::FrequencyResponse frf;
  frf.kind = whirl::FrfKind::receptance;
  frf.frequency = Eigen::VectorXd::LinSpaced(kLines, df, kLines * df);
  frf.channels.push_back({"p", "h", Eigen::VectorXcd::Zero(kLines), {}, {}});
  for (int k = 0; k < kLines; ++k) {
    for (int i = 0; i < kSteps; ++i) {
      const double t = block * i / kSteps, weight = i == 0 ? 0.5 : 1;
      frf.channels[0].value[k] += weight * seen[static_cast<std::size_t>(i)] / seen[0] * block / kSteps *
                                  std::exp((pole - Complex(0, 2 * whirl::kPi * frf.frequency[k])) * t);
    }
  }
  const whirl::FrequencyResponse without = whirl::modal::without_hann_window(frf);
  ASSERT_GT(without.window_decay, 0);
  const double peak = 1 / std::abs(pole.real() - without.window_decay);
  for (Eigen::Index k = 0; k < without.frequency.size(); ++k) {
    const Complex s(without.window_decay, 2 * whirl::kPi * without.frequency[k]);
    EXPECT_LT(std::abs(without.channels[0].value[k] - 1.0 / (s - pole)), 2e-3 * peak) << without.frequency[k];
  }
}

TEST(HannWindowProperty, ThatIsNotStatedIsFoundAndTakenOff) {
  int modes = 0, extra = 0, frequency = 0, damping = 0;
  for (unsigned seed = 8101; seed <= 8106; ++seed) {
    const RandomTest test = make_random_test({.seed = seed});
    const whirl::ModalModel model = whirl::modal::fit_modes(test.frf);
    EXPECT_THAT(model.summary.warnings, Contains(HasSubstr("Hann window"))) << seed;
    const auto s = score(poles_of(test), model);
    modes += s.frequency;
    extra += s.extra;
    frequency += s.covered_frequency;
    damping += s.covered_damping;
  }
  EXPECT_EQ(modes, 36);
  EXPECT_EQ(extra, 0);
  EXPECT_GE(frequency, 32);
  EXPECT_GE(damping, 31);
}

// Pairs of modes stand as close as the halves of a peak that a window has split.
TEST(HannWindowProperty, PairsOfModesWithoutAWindowAreNotTakenForOne) {
  for (unsigned seed = 8201; seed <= 8204; ++seed) {
    const RandomTest test = make_random_test({.references = 1, .doublet = 1, .hann = false, .seed = seed});
    const whirl::ModalModel model = whirl::modal::fit_modes(test.frf);
    EXPECT_TRUE(whirl::modal::looks_split(test.frf, model)) << seed;
    EXPECT_THAT(model.summary.warnings, Not(Contains(HasSubstr("Hann window")))) << seed;
    EXPECT_GE(score(poles_of(test), model).frequency, 11) << seed;
  }
}

TEST(HannWindow, IsRefusedWhereItCannotBeTakenOff) {
  RandomTest test = make_random_test({.modes = 1, .responses = 1, .references = 1, .blocks = 9});
  whirl::FrequencyResponse stated = test.frf;
  stated.window_decay = 1;
  EXPECT_THAT(error_of([&] { whirl::modal::without_hann_window(stated); }), HasSubstr("exponential window"));
  whirl::FrequencyResponse hole = test.frf;
  hole.channels[0].value[5] = NAN;
  EXPECT_THAT(error_of([&] { whirl::modal::without_hann_window(hole); }), HasSubstr("p0/h0"));
  whirl::FrequencyResponse few = test.frf;
  few.frequency.conservativeResize(63);
  few.channels[0].value.conservativeResize(63);
  EXPECT_THAT(error_of([&] { whirl::modal::without_hann_window(few); }), HasSubstr("64 lines"));
}

}  // namespace
