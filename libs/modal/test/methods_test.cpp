// The methods beside pLSCF, shapes and checks.
#include <gtest/gtest.h>

#include <numbers>

#include "synthetic.hpp"
#include "whirl/core/error.hpp"
#include "whirl/modal/checks.hpp"
#include "whirl/modal/fdd.hpp"
#include "whirl/modal/fit_modes.hpp"

namespace {
using Complex = std::complex<double>;
using whirl::testing::make_synthetic;
using whirl::testing::score;

TEST(ModesProperty, EveryMethodFindsTheModesOfAFewQuietFrfs) {
  for (const auto method : {whirl::modal::PoleMethod::plscf, whirl::modal::PoleMethod::lsce,
                            whirl::modal::PoleMethod::era, whirl::modal::PoleMethod::rfp}) {
    whirl::testing::SyntheticOptions synthetic;
    synthetic.modes = 6;
    synthetic.doublets = 0;
    synthetic.low = 5;
    synthetic.high = 200;
    synthetic.line = 0.25;
    synthetic.responses = method == whirl::modal::PoleMethod::rfp ? 1 : 3;
    synthetic.references = method == whirl::modal::PoleMethod::rfp ? 1 : 2;
    synthetic.damping_low = 0.005;
    synthetic.noise = 1e-3;
    const auto data = make_synthetic(synthetic);
    whirl::modal::ModeOptions options;
    options.poles.method = method;
    options.search = options.refine = false;  // what the method alone gives
    options.poles.frequency_tolerance = 0.01;
    options.poles.damping_tolerance = 0.3;
    options.poles.presence = 0.4;
    const auto model = whirl::modal::fit_modes(data.frf, options);
    EXPECT_EQ(score(data.poles, model).frequency, 6) << static_cast<int>(method);
  }
}

TEST(ModesReference, ComplexityOfAShapeIsThatOfItsPhases) {
  const Eigen::VectorXcd line = Complex(0.6, 0.8) * Eigen::Vector3d(1, -2, 0.5).cast<Complex>();
  EXPECT_NEAR(whirl::modal::mode_complexity(line).mpc, 1, 1e-12);
  EXPECT_NEAR(whirl::modal::mode_complexity(line).mpd, 0, 1e-7);
  const Eigen::VectorXcd travelling =
      (Eigen::VectorXcd(2) << Complex(1, 0), Complex(0, 1)).finished();  // forward whirl
  EXPECT_NEAR(whirl::modal::mode_complexity(travelling).mpc, 0, 1e-12);
  const Eigen::VectorXcd bent = (Eigen::VectorXcd(2) << Complex(1, 0.1), Complex(1, -0.1)).finished();
  EXPECT_NEAR(whirl::modal::mode_complexity(bent).mpd, std::atan(0.1), 1e-9);
}

TEST(ModesProperty, ReciprocityAndDrivePointsOfAPassiveStructureHold) {
  // Two points, both hit and measured.
  whirl::FrequencyResponse frf;
  frf.kind = whirl::FrfKind::receptance;
  frf.frequency = Eigen::VectorXd::LinSpaced(400, 0, 100);
  const double shape[2][2] = {{1, 0.6}, {0.5, -0.9}};
  const Complex poles[2] = {{-1, 150}, {-2, 370}};
  const char* names[] = {"1:+X", "2:+X"};
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      whirl::FrfChannel channel{names[i], names[j], Eigen::VectorXcd::Zero(400), {}, {}};
      for (Eigen::Index l = 0; l < 400; ++l) {
        const Complex s(0, 2 * std::numbers::pi * frf.frequency[l]);
        for (int k = 0; k < 2; ++k)
          channel.value[l] += shape[k][i] * shape[k][j] / ((s - poles[k]) * (s - std::conj(poles[k])));
      }
      frf.channels.push_back(channel);
    }
  }
  auto pairs = whirl::modal::check_reciprocity(frf);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_NEAR(pairs[0].difference, 0, 1e-12);
  auto model = whirl::modal::fit_modes(frf);
  ASSERT_EQ(model.modes.size(), 2u);
  for (const auto& point : whirl::modal::check_drive_points(model))
    EXPECT_TRUE(point.wrong_modes.empty()) << point.point;
  const auto shapes = whirl::modal::mode_shapes(model);
  EXPECT_EQ(shapes.points.size(), 2u);
  EXPECT_NEAR((shapes.value(1, 1) / shapes.value(0, 1)).real(), -0.9 / 0.5, 1e-4);
  frf.channels[1].value *= 1.2;  // one sensor off
  EXPECT_NEAR(whirl::modal::check_reciprocity(frf)[0].difference, 0.2 / 1.1, 1e-9);
  frf.channels[0].value *= -1;  // a sensor turned round
  model = whirl::modal::fit_modes(frf);
  EXPECT_EQ(whirl::modal::check_drive_points(model).at(0).wrong_modes.size(), model.modes.size());
}

TEST(ModesReference, ModesOfTwoTestsAreMatchedByShapeNotByOrder) {
  const auto model = [](std::vector<double> hz, std::vector<Eigen::Vector2cd> shapes) {
    whirl::ModalModel m;
    m.responses = {"1:+X", "2:+X"};
    m.references = {"1:+X", "1:+X"};
    for (std::size_t k = 0; k < hz.size(); ++k) m.modes.push_back({{hz[k], 0, 0, 0}, {0.01, 0, 0, 0}, {}, shapes[k]});
    return m;
  };
  const Eigen::Vector2cd in_phase(1, 0.6), against(Complex(0, 0.5), Complex(0, -0.9));
  const whirl::ModalModel before = model({10, 10.2, 40}, {in_phase, against, in_phase});
  whirl::ModalModel after = model({10.1, 10.3}, {2 * against, in_phase});
  const auto matches = whirl::modal::match_modes(before, after);
  ASSERT_EQ(matches.size(), 2u) << "no mode near 40 Hz";
  EXPECT_EQ(matches[0].second, 1u);
  EXPECT_NEAR(matches[0].frequency_change, 0.03, 1e-12);
  EXPECT_NEAR(matches[0].mac, 1, 1e-12);
  EXPECT_EQ(matches[1].second, 0u);
  after.responses[1] = "3:+X";
  EXPECT_THROW(whirl::modal::match_modes(before, after), whirl::Error);
}

TEST(ModesReference, AmbientRecordGivesFrequencyDampingAndShape) {
  // Two modes of two channels under white noise, exact discretisation.
  const double f[] = {7, 19}, zeta[] = {0.02, 0.012};
  const double shape[2][2] = {{1, 0.7}, {-0.6, 1}};
  whirl::Recording record;
  record.dt = 0.01;
  const Eigen::Index n = 120000;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n), y = x;
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 2; ++k) {
    const double w = 2 * std::numbers::pi * f[k];
    const Complex p = w * Complex(-zeta[k], std::sqrt(1 - zeta[k] * zeta[k])), e = std::exp(p * record.dt);
    Complex q = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      q = e * q + normal(random);
      x[i] += shape[k][0] * q.imag();
      y[i] += shape[k][1] * q.imag();
    }
  }
  record.add("x", whirl::Quantity::displacement, x);
  record.add("y", whirl::Quantity::displacement, y);
  const auto found = whirl::modal::decompose_ambient(record, {.line = 0.05});
  ASSERT_EQ(found.modes.size(), 2u);
  for (int k = 0; k < 2; ++k) {
    const auto& mode = found.modes[static_cast<std::size_t>(k)];
    EXPECT_NEAR(mode.frequency, f[k], 0.005 * f[k]);
    EXPECT_NEAR(mode.damping, zeta[k], 0.25 * zeta[k]);
    EXPECT_NEAR((mode.shape[1] / mode.shape[0]).real(), shape[k][1] / shape[k][0], 0.1);
  }
  EXPECT_THROW(whirl::modal::decompose_ambient(record, {.line = 1e-3}), whirl::Error);
}

}  // namespace
