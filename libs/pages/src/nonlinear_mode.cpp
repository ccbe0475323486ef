#include "whirl/pages/nonlinear_mode.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/report/units.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Amplitude of the answer to a force at a speed (and at its sweep): the smallest root of the balance of the first
/// harmonic.
double answer(const response::NonlinearMode& m, const response::SteadyPoint& p, double force) {
  const double omega = p.omega, near = p.amplitude;
  const auto over = [&](double a) {
    const double w = m.frequency(a), stiff = w * w - omega * omega - 2 * omega * p.drift;
    const double loss = omega * (m.c.value + 8 / (3 * std::numbers::pi) * m.q.value * omega * a) +
                        (a > 0 ? 4 / std::numbers::pi * m.f.value / a : 0) + 2 * omega * p.growth + p.chirp;
    return a * std::hypot(stiff, loss) - force;
  };
  // The root nearest to the measured amplitude.
  double low = near, high = near;
  for (int k = 0; k < 60 && over(low) * over(high) > 0; ++k) low *= 0.97, high *= 1.03;
  if (over(low) * over(near) <= 0)
    high = near;
  else
    low = near;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (over(middle) * over(low) > 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

report::Figure decay_figure(const response::DecayCurve& curve, const response::NonlinearMode& mode,
                            const report::Unit& unit) {
  report::Figure figure;
  figure.title = "Backbone and damping";
  figure.description = "Frequency and damping ratio over the amplitude of a free decay, measured and fitted.";
  figure.shared_x = true;
  const auto n = static_cast<Index>(curve.points.size());
  VectorXd a(n), f(n), fl(n), fh(n), z(n), zl(n), zh(n);
  for (Index k = 0; k < n; ++k) {
    const response::DecayPoint& p = curve.points[static_cast<std::size_t>(k)];
    a[k] = p.amplitude;
    f[k] = p.frequency;
    fl[k] = p.frequency - 1.96 * p.frequency_sd;
    fh[k] = p.frequency + 1.96 * p.frequency_sd;
    z[k] = p.rate / p.frequency;
    zl[k] = z[k] - 1.96 * p.rate_sd / p.frequency;
    zh[k] = z[k] + 1.96 * p.rate_sd / p.frequency;
  }
  const VectorXd grid = VectorXd::LinSpaced(200, mode.lowest, mode.highest);
  const VectorXd backbone = grid.unaryExpr([&](double x) { return mode.frequency(x); });
  const VectorXd ratio = grid.unaryExpr([&](double x) { return mode.rate(x) / mode.frequency(x); });
  report::Panel& top = figure.panel("", {"amplitude, peak", unit}, {"frequency", report::kHertzOfAngular});
  top.error_bars("windows", a, f, fl, fh, {.color = 7});
  top.line("mode", grid, backbone, {.color = 0, .width = 1.8});
  report::Axis damping{"damping ratio", report::kPercentOfOne};
  damping.low = std::min(0.0, ratio.minCoeff());
  damping.high = ratio.maxCoeff();
  for (Index k = 0; k < n; ++k) {
    // The last windows, almost noise, would flatten the curve: the axis holds those known to half of the largest ratio.
    if (zh[k] - z[k] > 0.5 * ratio.maxCoeff()) continue;
    damping.low = std::min(damping.low, zl[k]);
    damping.high = std::max(damping.high, zh[k]);
  }
  const double margin = 0.05 * (damping.high - damping.low);
  damping.low -= damping.low < 0 ? margin : 0;
  damping.high += margin;
  report::Panel& low = figure.panel("", {"amplitude, peak", unit}, damping);
  low.error_bars("", a, z, zl, zh, {.color = 7});
  low.line("", grid, ratio, {.color = 0, .width = 1.8});
  return figure;
}

report::Figure steady_figure(const std::vector<response::SteadyPoint>& points, const response::NonlinearMode& mode,
                             double gain) {
  report::Figure figure;
  figure.title = "Steady sine";
  figure.description = "Measured amplitude and phase over frequency at every force level, and the fitted mode.";
  figure.shared_x = true;
  report::Panel& top = figure.panel("", {"frequency", report::kHertzOfAngular}, {"amplitude, peak", {}});
  std::vector<double> levels;
  const auto level = [](const response::SteadyPoint& p) { return p.level > 0 ? p.level : p.force; };
  // Records of one level never agree to the last digit.
  const auto same = [](double a, double b) { return std::abs(a - b) <= 0.02 * b; };
  for (const response::SteadyPoint& p : points)
    if (std::none_of(levels.begin(), levels.end(), [&](double l) { return same(level(p), l); }))
      levels.push_back(level(p));
  std::sort(levels.begin(), levels.end());
  std::vector<std::pair<VectorXd, VectorXd>> phases;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    std::vector<double> w, a, model, phase;
    for (const response::SteadyPoint& p : points) {
      if (!same(level(p), levels[k])) continue;
      w.push_back(p.omega);
      a.push_back(p.amplitude);
      // An answer far above its resonance stays at half a turn behind.
      phase.push_back(p.phase > std::numbers::pi / 2 ? p.phase - 2 * std::numbers::pi : p.phase);
      model.push_back(answer(mode, p, gain * p.force));
    }
    const auto of = [](const std::vector<double>& v) {
      return VectorXd(Eigen::Map<const VectorXd>(v.data(), static_cast<Index>(v.size())));
    };
    const int color = static_cast<int>(k % 6);
    top.scatter(fmt::format("force {:.4g} N (peak)", levels[k]), of(w), of(a),
                {.color = color, .mark = report::Mark::circle});
    top.scatter(k == 0 ? "mode" : "", of(w), of(model), {.color = color, .mark = report::Mark::cross});
    phases.emplace_back(of(w), of(phase));
  }
  report::show_y_as(figure.panels.front(), Quantity::displacement);
  report::Panel& low = figure.panel("", {"frequency", report::kHertzOfAngular}, {"phase lead", report::kDegree});
  for (std::size_t k = 0; k < phases.size(); ++k)
    low.scatter("", phases[k].first, phases[k].second,
                {.color = static_cast<int>(k % 6), .mark = report::Mark::circle});
  return figure;
}

io::Json to_json(const response::NonlinearMode& mode, const response::DecayCurve& curve, const Estimate& gain) {
  io::Json out = io::start_document("whirl.decay", 1);
  io::Json points = io::Json::array();
  for (const response::DecayPoint& p : curve.points)
    points.push(io::Json::object()
                    .set("time", p.time)
                    .set("amplitude", p.amplitude)
                    .set("omega", p.frequency)
                    .set("omega_sd", p.frequency_sd)
                    .set("rate", p.rate)
                    .set("rate_sd", p.rate_sd));
  if (!curve.points.empty()) out.set("from", curve.from).set("to", curve.to).set("noise", curve.noise);
  out.set("points", std::move(points));
  using io::to_json;
  for (const auto& [name, e, unit] : {std::tuple{"k1", &mode.k1, "1/s^2"},
                                      {"k3", &mode.k3, "1/(m^2 s^2)"},
                                      {"k5", &mode.k5, "1/(m^4 s^2)"},
                                      {"c", &mode.c, "1/s"},
                                      {"q", &mode.q, "1/m"},
                                      {"f", &mode.f, "m/s^2"}})
    out.set(name, to_json(*e, unit));
  if (std::isfinite(gain.value)) out.set("gain", to_json(gain, ""));
  out.set("lowest", mode.lowest).set("highest", mode.highest);
  out.set("frequency_spread", mode.frequency_spread).set("rate_spread", mode.rate_spread);
  return out.set("summary", io::to_json(mode.summary));
}

}  // namespace whirl::pages
