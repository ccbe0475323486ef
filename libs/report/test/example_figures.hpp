#pragma once
#include <cmath>

#include "whirl/report/figure.hpp"

namespace whirl::report::testing {

inline const Unit kMm{"mm", 1e-3};
inline const Unit kSecond{"s", 1};

/// A run-down like trace: 15 000 samples, one resonance.
inline Figure long_trace() {
  const Eigen::Index n = 15000;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(n, 0, 15);
  Eigen::VectorXd x(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double from_peak = t(i) - 8;
    x(i) = 3.25e-3 / (1 + from_peak * from_peak) * std::cos(300 * t(i) - 10 * t(i) * t(i));
  }
  Figure figure;
  figure.title = "Run-down";
  Panel& p = figure.panel("X", {"time", kSecond}, {"displacement", kMm});
  p.line("open loop", t, x);
  p.span(6.5, 9.5, "segment 3");
  p.vertical(8, "critical speed");
  return figure;
}

/// One of each kind of series and panel, small.
inline Figure one_of_each() {
  Figure figure;
  figure.title = "Every kind of panel <&>";
  figure.description = "Lines, bars, bands, a heat map, an orbit, a polar plot and a projection";
  figure.columns = 2;
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(9, -2e-3, 2e-3);
  const Eigen::VectorXd f = 5000 * x + 2e8 * x.array().cube().matrix();
  Panel& law = figure.panel("Force & deflection", {"deflection", kMm}, {"force", {"N", 1}});
  law.band("95 % interval", x, f.array() - 1, f.array() + 1, {.color = 0});
  law.line("fit", x, f, {.color = 0});
  law.error_bars("measured", x, f, f.array() - 0.7, f.array() + 0.7, {.color = 1});
  law.horizontal(5, "limit");
  law.annotate(0, 0, "origin");
  Panel& bars = figure.panel("Bars", {}, {"suppression", {"%", 1}});
  bars.categories = {"entering", "through the critical speed"};
  bars.bars("paper", Eigen::Vector2d(0, 1), Eigen::Vector2d(91, 96));
  bars.bars("rig", Eigen::Vector2d(0, 1), Eigen::Vector2d(88, 95));
  Panel& map = figure.panel("Waterfall", {"time", kSecond}, {"frequency", {"Hz", 1}});
  HeatMap heat;
  heat.values =
      Eigen::MatrixXd::NullaryExpr(6, 8, [](Eigen::Index i, Eigen::Index j) { return 1e-6 * double(1 + i * j); });
  heat.values(0, 0) = NAN;
  heat.x_high = 1;
  heat.y_high = 50;
  heat.color = {"amplitude, peak", {"µm", 1e-6}};
  map.heat_maps.push_back(heat);
  const Eigen::VectorXd angle = Eigen::VectorXd::LinSpaced(25, 0, 6);
  Panel& orbit = figure.panel("Orbit", {"x", kMm}, {"y", kMm});
  orbit.equal_aspect = true;
  orbit.line("orbit", 1e-3 * angle.array().cos(), 2e-3 * angle.array().sin());
  Panel& polar = figure.panel("Polar", {}, {"1X amplitude, peak", kMm});
  polar.kind = Panel::Kind::polar;
  polar.line("1X", -0.5 * angle, 1e-4 * angle, {.mark = Mark::circle});
  Panel& funnel = figure.panel("Projection", {"time", kSecond}, {"y", kMm});
  funnel.kind = Panel::Kind::projected;
  funnel.z = {"x", kMm};
  funnel.line3("run", angle, 1e-3 * angle.array().cos(), 1e-3 * angle.array().sin());
  Panel& log =
      figure.panel("Density", {"frequency", {"Hz", 1}, Scale::logarithmic}, {"PSD", {"m²/Hz", 1}, Scale::logarithmic});
  log.step("hold", Eigen::VectorXd::LinSpaced(5, 1, 100), Eigen::VectorXd::LinSpaced(5, 1e-9, 1e-5));
  Panel& stems = figure.panel("Orders", {"order", {}}, {"amplitude, rms", {"µm", 1e-6}});
  stems.stem("orders", Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(2e-5, 4e-6, 1e-6), {.mark = Mark::diamond});
  stems.scatter("limit", Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(3e-5, 3e-5, 3e-5), {.mark = Mark::cross});
  return figure;
}

}  // namespace whirl::report::testing
