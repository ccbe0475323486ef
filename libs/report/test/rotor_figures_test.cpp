#include "whirl/report/rotor_figures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <pugixml.hpp>

#include "whirl/core/error.hpp"

namespace whirl::report {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;

/// Circular whirl of radius `radius` at 10 turns per second, 2 s at 1 kHz.
Recording circle(double radius) {
  Recording r;
  r.dt = 1e-3;
  const VectorXd beta = VectorXd::LinSpaced(2001, 0.1, 0.1 + 40 * std::numbers::pi);
  r.add("x", Quantity::displacement, radius * beta.array().cos());
  r.add("y", Quantity::displacement, radius * beta.array().sin());
  r.add("beta", Quantity::angle, beta);
  r.add("ux", Quantity::force, beta.array().cos());
  r.add("uy", Quantity::force, beta.array().sin());
  return r;
}

std::string drawn(const Figure& figure) {
  std::string svg = to_svg(figure);
  pugi::xml_document document;
  const auto result = document.load_string(svg.c_str());
  EXPECT_TRUE(result) << figure.title << ": " << result.description();
  return svg;
}

TEST(ReportRotorFigures, APolarPlotIsNotDrawnThroughBeats) {
  signal::SynchronousCurve curve;
  curve.name = "x";
  curve.speed = VectorXd::LinSpaced(40, 100, 139);
  curve.vector.resize(40);
  for (Index i = 0; i < 40; ++i) curve.vector(i) = std::polar(1e-3, (i < 20 ? 0.1 : 2.0) * static_cast<double>(i));
  const Figure figure = polar_1x({curve});
  const Series& line = figure.panels[0].series[0];
  EXPECT_EQ((line.y.array() >= 0).count(), 40);
  EXPECT_EQ(line.y.array().isNaN().count(), 19) << "every step of 115 degrees is a break";
}

TEST(ReportRotorFigures, RunsAreDrawnFromRecordings) {
  const Recording open = circle(2e-3), closed = circle(2e-4);
  const std::vector<NamedRun> runs = {{"open loop", open}, {"closed loop", closed}};
  const std::vector<Segment> segments = {{"entering", 0, 1}, {"through", 1, 2}};
  EXPECT_THAT(drawn(time_traces(runs, {"x", "y"}, segments)), HasSubstr("displacement x [mm]"));
  EXPECT_THAT(drawn(control_force(runs, 20, segments)), HasSubstr("limit"));
  EXPECT_EQ(phase_plane(runs, "x", segments).panels.size(), 2U);
  drawn(phase_plane(runs, "x", segments));
  drawn(funnel(runs));
  EXPECT_THROW((void)time_traces(runs, {"absent"}), Error);
  EXPECT_THROW((void)time_traces({}, {"x"}), Error);
  EXPECT_THROW((void)phase_plane(runs, "x", {{"after the end", 5, 6}}), Error);
}

TEST(ReportRotorFigures, KeyphasorMarksStandAtAngleZero) {
  const Recording r = circle(1e-3);
  const Figure figure = orbit({{"run", r}}, 0, 2);
  drawn(figure);
  ASSERT_EQ(figure.panels[0].series.size(), 2U);
  const Series& marks = figure.panels[0].series[1];
  ASSERT_EQ(marks.x.size(), 20);
  for (Index i = 0; i < marks.x.size(); ++i) {
    EXPECT_NEAR(marks.x(i), 1e-3, 1e-6);
    EXPECT_NEAR(marks.y(i), 0, 1e-6);
  }
}

TEST(ReportRotorFigures, PhasePlaneOfACircleHasItsSpeed) {
  const Recording r = circle(1e-3);
  const Figure figure = phase_plane({{"run", r}}, "x", {{"all", 0, 2}});
  const VectorXd& v = figure.panels[0].series[0].y;
  EXPECT_TRUE(std::isnan(v(0)));
  EXPECT_NEAR(v.segment(1, 1999).maxCoeff(), 1e-3 * 20 * std::numbers::pi, 1e-4);
}

TEST(ReportRotorFigures, DifferenceToTheModelIsStatedAsRms) {
  const Recording r = circle(1e-3);
  VectorXd model = r["x"];
  model.array() += 5e-6;
  model(3) = NAN;
  const Figure figure = measured_and_model(r, "x", model);
  drawn(figure);
  EXPECT_EQ(figure.panels[1].title, "Measured minus model: 5.00 µm rms");
  EXPECT_THROW((void)measured_and_model(r, "x", model.head(10)), Error);
}

TEST(ReportRotorFigures, ModalFiguresShowPolesAndCoherence) {
  FrequencyResponse response;
  const Index n = 400;
  response.frequency = VectorXd::LinSpaced(n, 0, 200);
  response.averages = 5;
  FrfChannel channel{"1:+X", "1:+X", Eigen::VectorXcd(n), VectorXd::Constant(n, 0.99), {}};
  for (Index i = 0; i < n; ++i) {
    const std::complex<double> s(0, 2 * std::numbers::pi * response.frequency(i));
    const double w = 2 * std::numbers::pi * 50;
    channel.value(i) = s * s / (s * s + 0.04 * w * s + w * w);
  }
  response.channels = {channel};
  Mode mode;
  mode.frequency.value = 50;
  const Figure figure = frequency_response(response, 0, channel.value, {mode});
  EXPECT_EQ(figure.panels.size(), 3U);
  const std::string svg = drawn(figure);
  EXPECT_THAT(svg, HasSubstr("50.00 Hz"));
  EXPECT_THAT(svg, HasSubstr(">180</text>"));
  EXPECT_THROW((void)frequency_response(response, 1), Error);
  EXPECT_THROW((void)frequency_response(response, 0, channel.value.head(3)), Error);
  drawn(stabilisation(response, {{4, 49, false}, {8, 50, true}}, {50}));

  StiffnessLaw law;
  law.k1.value = 5000;
  law.k2.value = 6e7;
  law.offset.value = 1e-4;
  const VectorXd d = VectorXd::LinSpaced(10, 0, 6e-3);
  const Figure stiffness = force_deflection(d, 5000 * d, law, 0.5);
  drawn(stiffness);
  const Series& fit = stiffness.panels[0].series[2];
  EXPECT_NEAR(fit.y(120), 5000 * 5.9e-3 + 6e7 * std::pow(5.9e-3, 3), 1e-9);
}

TEST(ReportRotorFigures, SpectraNameTheirAmplitude) {
  const VectorXd f = VectorXd::LinSpaced(100, 0, 99);
  const VectorXd a = 1e-4 / (1 + (f.array() - 24).square());
  EXPECT_THAT(drawn(spectrum({{"open", f, a}, {"closed", f, 0.1 * a}}, AmplitudeKind::rms, Quantity::displacement,
                             {{"1X", 24}})),
              HasSubstr("displacement, rms [mm]"));
  EXPECT_THAT(drawn(full_spectrum({{"", f.array() - 50, a}}, AmplitudeKind::peak)), HasSubstr("backward whirl"));
  const Eigen::MatrixXd map = a * VectorXd::LinSpaced(20, 1, 2).transpose();
  EXPECT_THAT(drawn(waterfall(0, 5, 99, map, AmplitudeKind::peak, VectorXd::LinSpaced(20, 150, 10))),
              HasSubstr("peak [dB]"));
  EXPECT_THAT(drawn(run_map(1, 200, 99, map, AmplitudeKind::peak, {24})), HasSubstr("24.00 Hz"));
  EXPECT_THROW((void)waterfall(0, 5, 99, map, AmplitudeKind::peak, VectorXd::Zero(3)), Error);
  EXPECT_THROW((void)waterfall(0, 5, 99, 0 * map, AmplitudeKind::peak), Error);
}

TEST(ReportRotorFigures, BodePhaseLagGrowsByHalfATurnWithoutJumps) {
  const Index n = 200;
  signal::SynchronousCurve curve{"run", VectorXd::LinSpaced(n, 10, 150), Eigen::VectorXcd(n)};
  for (Index i = 0; i < n; ++i) {
    const double speed = curve.speed(i);
    const std::complex<double> denominator(3600 - speed * speed, 6 * speed);
    // The unbalance's angle makes the phase cross the end of the branch.
    curve.vector(i) = std::polar(2e-4 * speed * speed, -2.5) / denominator;
  }
  const Figure figure = bode_1x({curve});
  drawn(figure);
  drawn(polar_1x({curve}));
  const VectorXd& phase = figure.panels[1].series[0].y;
  for (Index i = 1; i < n; ++i) EXPECT_LT(std::abs(phase(i) - phase(i - 1)), 1);
  EXPECT_NEAR(phase(n - 1) - phase(0), std::numbers::pi, 0.2);
  const VectorXd lead = bode_1x({curve}, Phase::lead).panels[1].series[0].y;
  for (Index i = 0; i < n; ++i) EXPECT_EQ(lead(i), -phase(i));
}

TEST(ReportRotorFigures, PhaseThatWindsIsShownWithinATurn) {
  const Index n = 400;
  signal::SynchronousCurve curve{"run", VectorXd::LinSpaced(n, 10, 150), Eigen::VectorXcd(n)};
  for (Index i = 0; i < n; ++i) curve.vector(i) = std::polar(1e-4, 0.05 * static_cast<double>(i));
  const Figure figure = bode_1x({curve});
  drawn(figure);
  const VectorXd& phase = figure.panels[1].series[0].y;
  Index gaps = 0;
  for (Index i = 0; i < n; ++i) {
    gaps += std::isnan(phase(i));
    if (std::isnan(phase(i))) continue;
    EXPECT_NEAR(std::remainder(phase(i) + 0.05 * static_cast<double>(i), 2 * std::numbers::pi), 0, 1e-9);
  }
  EXPECT_EQ(gaps, 3);  // 20 rad: the end of the branch is crossed three times
  EXPECT_EQ(figure.panels[1].y.high, std::numbers::pi);
}

TEST(ReportRotorFigures, SuppressionBesideThePaper) {
  const Figure figure =
      suppression({{"through the natural frequency", 6.45e-3, 0.26e-3, 96}, {"whole run", 6.45e-3, 0.47e-3}},
                  AmplitudeKind::peak_to_peak);
  const std::string svg = drawn(figure);
  EXPECT_THAT(svg, HasSubstr(">96.0</text>"));
  EXPECT_THAT(svg, HasSubstr(">92.7</text>"));
  EXPECT_THAT(svg, HasSubstr("amplitude, p-p [mm]"));
}

}  // namespace
}  // namespace whirl::report
