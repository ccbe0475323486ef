#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phase.hpp"
#include "units.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/report/rotor_figures.hpp"

namespace whirl::report {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

std::string_view short_name(AmplitudeKind kind) {
  return kind == AmplitudeKind::peak ? "peak" : kind == AmplitudeKind::rms ? "rms" : "p-p";
}

template <class Curve, class F>
void require_curves(const std::vector<Curve>& curves, F&& sizes_agree) {
  if (curves.empty()) throw Error("figure: no curve given");
  for (const Curve& c : curves) {
    if (!sizes_agree(c)) throw Error(fmt::format("figure: curve '{}' has vectors of different size", c.name));
  }
}

Figure spectra(const std::vector<SpectrumCurve>& curves, AmplitudeKind kind, Quantity quantity, std::string title) {
  require_curves(curves, [](const SpectrumCurve& c) { return c.frequency.size() == c.amplitude.size(); });
  double largest = 0;
  for (const SpectrumCurve& c : curves) {
    for (const double a : c.amplitude) largest = std::isfinite(a) ? std::max(largest, a) : largest;
  }
  if (!(largest > 0)) throw Error("figure: the signal is constant: its spectrum has nothing to draw");
  Figure figure;
  figure.title = std::move(title);
  Panel& panel = figure.panel("", {"frequency", kHertz},
                              {fmt::format("{}, {}", to_string(quantity), short_name(kind)),
                               engineering_unit(quantity, largest), Scale::logarithmic});
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const int color = curves.size() > 1 && i == 0 ? 7 : static_cast<int>(curves.size() > 1 ? i - 1 : i) % 6;
    panel.line(curves.size() > 1 ? curves[i].name : "", curves[i].frequency,
               curves[i].amplitude.unaryExpr([](double a) { return a > 0 ? a : NAN; }), {.color = color, .width = 1});
  }
  // Below six decades there is rounding only.
  double smallest = largest;
  for (const SpectrumCurve& c : curves) {
    for (const double a : c.amplitude) smallest = a > 0 ? std::min(smallest, a) : smallest;
  }
  if (largest > 0 && smallest < 1e-6 * largest) panel.y.low = 1e-6 * largest;
  return figure;
}

/// Amplitudes in dB below the largest, cut at -80 dB.
HeatMap decibel_map(const Eigen::MatrixXd& amplitude, AmplitudeKind kind) {
  double largest = 0;
  for (Index j = 0; j < amplitude.cols(); ++j) {
    for (Index i = 0; i < amplitude.rows(); ++i) {
      if (std::isfinite(amplitude(i, j))) largest = std::max(largest, amplitude(i, j));
    }
  }
  if (!(largest > 0)) throw Error("figure: the signal is constant: its amplitude map has nothing to draw");
  HeatMap map;
  map.values =
      amplitude.unaryExpr([&](double a) { return std::isnan(a) ? a : std::max(-80.0, 20 * std::log10(a / largest)); });
  map.color = {"re " + format_amplitude(largest, kind), {"dB", 1}};
  map.color.high = 0;
  return map;
}

}  // namespace

Figure spectrum(const std::vector<SpectrumCurve>& curves, AmplitudeKind kind, Quantity quantity,
                const std::vector<std::pair<std::string, double>>& marks) {
  Figure figure = spectra(curves, kind, quantity, "Spectrum");
  for (const auto& [name, frequency] : marks) figure.panels.front().vertical(frequency, name);
  return figure;
}

Figure full_spectrum(const std::vector<SpectrumCurve>& curves, AmplitudeKind kind) {
  Figure figure = spectra(curves, kind, Quantity::displacement, "Full spectrum");
  figure.panels.front().x.label = "backward whirl ← frequency → forward whirl";
  figure.panels.front().vertical(0, "");
  return figure;
}

Figure waterfall(double time_begin, double time_end, double frequency_high, const Eigen::MatrixXd& amplitude,
                 AmplitudeKind kind, const VectorXd& speed, double frequency_low) {
  if (speed.size() != 0 && speed.size() != amplitude.cols()) {
    throw Error(
        fmt::format("figure: waterfall has {} columns but {} speeds: must be equal", amplitude.cols(), speed.size()));
  }
  Figure figure;
  figure.title = frequency_low < 0 ? "Waterfall of full spectra" : "Waterfall";
  Panel& panel = figure.panel("", {"time", {"s", 1}},
                              {frequency_low < 0 ? "backward ← frequency → forward" : "frequency", kHertz});
  panel.height = frequency_low < 0 ? 380 : 280;
  HeatMap map = decibel_map(amplitude, kind);
  map.x_low = time_begin;
  map.x_high = time_end;
  map.y_low = frequency_low;
  map.y_high = frequency_high;
  panel.heat_maps.push_back(std::move(map));
  if (speed.size() > 0) {
    panel.y.low = frequency_low;
    panel.y.high = frequency_high;
    const VectorXd time = VectorXd::LinSpaced(speed.size(), time_begin, time_end);
    for (const int order : {1, 2, -1, -2}) {
      if (order < 0 && !(frequency_low < 0)) continue;
      const VectorXd f = (order * speed / kTwoPi).unaryExpr([&](double v) {
        return v < frequency_low || v > frequency_high ? NAN : v;
      });
      panel.line(order > 0 ? fmt::format("{}X", order) : "", time, f,
                 {.color = std::abs(order) == 1 ? 1 : 4, .width = 1.2, .dash = Dash::dashed});
    }
  }
  return figure;
}

Figure cascade(const VectorXd& speed, const VectorXd& frequency, const Eigen::MatrixXd& amplitude, AmplitudeKind kind) {
  if (amplitude.cols() != speed.size() || amplitude.rows() != frequency.size() || speed.size() < 2) {
    throw Error(fmt::format(
        "figure: cascade of {} x {} amplitudes with {} frequencies and {} speeds: must agree, with two speeds or more",
        amplitude.rows(), amplitude.cols(), frequency.size(), speed.size()));
  }
  Figure figure;
  figure.title = "Cascade";
  Panel& panel = figure.panel("", {"frequency", kHertz}, {"rotor speed", kRpm});
  panel.kind = Panel::Kind::projected;
  panel.z = {fmt::format("amplitude, {}", short_name(kind)),
             engineering_unit(Quantity::displacement, amplitude.maxCoeff())};
  panel.height = 420;
  for (Index j = 0; j < speed.size(); ++j) {
    panel.line3("", frequency, VectorXd::Constant(frequency.size(), speed[j]), amplitude.col(j),
                {.color = 0, .width = 0.7});
  }
  for (const int order : {1, 2}) {
    const VectorXd f =
        (order * speed / kTwoPi).unaryExpr([&](double v) { return v > frequency[frequency.size() - 1] ? NAN : v; });
    panel.line3(fmt::format("{}X", order), f, speed, VectorXd::Zero(speed.size()),
                {.color = order == 1 ? 1 : 4, .width = 1.2, .dash = Dash::dashed});
  }
  return figure;
}

Figure run_map(double speed_low, double speed_high, double frequency_high, const Eigen::MatrixXd& amplitude,
               AmplitudeKind kind, const std::vector<double>& natural_frequencies) {
  Figure figure;
  figure.title = "Amplitude over speed and frequency";
  Panel& panel = figure.panel("", {"rotor speed", kRpm}, {"frequency", kHertz});
  panel.height = 320;
  panel.y.low = 0;
  panel.y.high = frequency_high;
  HeatMap map = decibel_map(amplitude, kind);
  map.x_low = speed_low;
  map.x_high = speed_high;
  map.y_high = frequency_high;
  panel.heat_maps.push_back(std::move(map));
  const Eigen::Vector2d ends(speed_low, speed_high);
  constexpr int kColors[] = {1, 4, 5};
  for (int order = 1; order <= 3; ++order) {
    panel.line(fmt::format("{}X", order), ends, order * ends / kTwoPi,
               {.color = kColors[order - 1], .width = 1.2, .dash = order == 1 ? Dash::solid : Dash::dashed});
  }
  for (const double f : natural_frequencies) {
    panel.horizontal(f, format_number(f, 4) + " Hz", {.color = 3, .width = 1, .dash = Dash::dotted});
  }
  return figure;
}

Figure bode_1x(const std::vector<signal::SynchronousCurve>& curves, Phase convention) {
  require_curves(curves, [](const signal::SynchronousCurve& c) { return c.speed.size() == c.vector.size(); });
  double largest = 0, smallest = INFINITY;
  for (const signal::SynchronousCurve& c : curves) {
    const double top = c.vector.cwiseAbs().maxCoeff();
    largest = std::max(largest, top);
    smallest = std::min(smallest, top);
  }
  // A run far below the other, as the closed loop below the open one, is seen on a logarithmic axis only.
  const bool wide = smallest > 0 && largest > 10 * smallest;
  Figure figure;
  figure.title = "Bode plot of the 1X vector";
  figure.shared_x = true;
  const Axis x{"rotor speed", kRpm};
  figure.panel("", x,
               {"1X amplitude, peak", engineering_unit(Quantity::displacement, largest),
                wide ? Scale::logarithmic : Scale::linear});
  figure.panel("", x, {phase_name(convention), kDegree});
  Panel& amplitude = figure.panels[0];
  Panel& phase = figure.panels[1];
  phase.height = 120;
  amplitude.y.low = wide ? 0.05 * smallest : 0;
  std::vector<PhaseCurve> phases;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const signal::SynchronousCurve& c = curves[i];
    const Style style{.color = wide ? (i == 0 ? 7 : static_cast<int>(i - 1) % 6) : static_cast<int>(i) % 6};
    amplitude.line(curves.size() > 1 ? c.name : "", c.speed,
                   c.vector.cwiseAbs().unaryExpr([&](double v) { return wide && !(v > 0) ? NAN : v; }), style);
    phases.push_back({c.speed, c.vector, style});
  }
  draw_phases(phase, phases, convention);
  return figure;
}

Figure polar_1x(const std::vector<signal::SynchronousCurve>& curves, Phase phase, int labels) {
  require_curves(curves, [](const signal::SynchronousCurve& c) { return c.speed.size() == c.vector.size(); });
  double largest = 0;
  for (const signal::SynchronousCurve& c : curves) largest = std::max(largest, c.vector.cwiseAbs().maxCoeff());
  Figure figure;
  figure.title = "Polar plot of the 1X vector";
  figure.width = 480;
  Panel& panel = figure.panel("", {},
                              {fmt::format("angle = {}{}; radius = 1X amplitude, peak", phase_name(phase),
                                           phase == Phase::lag ? " (against the rotation)" : ""),
                               engineering_unit(Quantity::displacement, largest)});
  panel.kind = Panel::Kind::polar;
  panel.clockwise = phase == Phase::lag;
  const double sign = panel.clockwise ? -1 : 1;
  panel.height = 380;
  for (const signal::SynchronousCurve& c : curves) {
    panel.line(curves.size() > 1 ? c.name : "", sign * c.vector.array().arg(), c.vector.cwiseAbs());
  }
  // Speeds at equal steps of the way along the curve, where the reader needs them.
  const signal::SynchronousCurve& first = curves.front();
  VectorXd way = VectorXd::Zero(first.vector.size());
  for (Index i = 1; i < way.size(); ++i) way(i) = way(i - 1) + std::abs(first.vector(i) - first.vector(i - 1));
  for (int k = 0; k < labels && way.size() > 0; ++k) {
    const double wanted = (k + 0.5) / labels * way(way.size() - 1);
    const Index at = std::lower_bound(way.data(), way.data() + way.size() - 1, wanted) - way.data();
    panel.annotate(sign * std::arg(first.vector(at)), std::abs(first.vector(at)),
                   fmt::format("{:.0f} rpm", first.speed(at) / kRpm.factor));
    panel.scatter("", VectorXd::Constant(1, sign * std::arg(first.vector(at))),
                  VectorXd::Constant(1, std::abs(first.vector(at))), {.color = 0});
  }
  return figure;
}

Figure nyquist_1x(const std::vector<signal::SynchronousCurve>& curves) {
  require_curves(curves, [](const signal::SynchronousCurve& c) { return c.speed.size() == c.vector.size(); });
  double largest = 0;
  for (const signal::SynchronousCurve& c : curves) largest = std::max(largest, c.vector.cwiseAbs().maxCoeff());
  Figure figure;
  figure.title = "Nyquist plot of the 1X vector";
  figure.width = 480;
  const Unit unit = engineering_unit(Quantity::displacement, largest);
  Panel& panel = figure.panel("", {"real part, peak", unit}, {"imaginary part, peak", unit});
  panel.equal_aspect = true;
  panel.height = 380;
  panel.vertical(0, "");
  panel.horizontal(0, "");
  for (const signal::SynchronousCurve& c : curves) {
    panel.line(curves.size() > 1 ? c.name : "", c.vector.real(), c.vector.imag());
  }
  return figure;
}

Figure order_tracks(const VectorXd& time, const VectorXd& speed, const std::vector<double>& orders,
                    const Eigen::MatrixXcd& envelope, Quantity quantity, Phase phase) {
  if (envelope.rows() != time.size() || speed.size() != time.size() ||
      envelope.cols() != static_cast<Index>(orders.size()) || orders.empty()) {
    throw Error("figure: order tracks need one row per time and speed and one column per order");
  }
  Figure figure;
  figure.title = "Order tracks";
  figure.shared_x = true;
  const Axis t{"time", {"s", 1}};
  const double largest = envelope.cwiseAbs().unaryExpr([](double a) { return std::isnan(a) ? 0 : a; }).maxCoeff();
  figure.panel("", t, {fmt::format("{}, peak", to_string(quantity)), engineering_unit(quantity, largest)});
  figure.panel("", t, {phase_name(phase), kDegree}).height = 120;
  Panel& speeds = figure.panel("", t, {"rotor speed", kRpm});
  speeds.height = 90;
  speeds.line("", time, speed, {.color = 7});
  std::vector<PhaseCurve> phases;
  for (std::size_t k = 0; k < orders.size(); ++k) {
    const auto column = static_cast<Index>(k);
    const int color = static_cast<int>(k) % 6;
    figure.panels[0].line(fmt::format("{:g}X", orders[k]), time, envelope.col(column).cwiseAbs(), {.color = color});
    phases.push_back({time, envelope.col(column), {.color = color, .width = 0.8}, 0.005 * largest});
  }
  draw_phases(figure.panels[1], phases, phase);
  figure.panels[0].y.low = 0;
  return figure;
}

Figure suppression(const std::vector<Suppression>& rows, AmplitudeKind kind) {
  if (rows.empty()) throw Error("figure: no suppression given");
  const auto n = static_cast<Index>(rows.size());
  VectorXd open(n), closed(n), percent(n), paper(n);
  std::vector<std::string> names;
  for (Index i = 0; i < n; ++i) {
    const Suppression& row = rows[static_cast<std::size_t>(i)];
    open(i) = row.open;
    closed(i) = row.closed;
    percent(i) = 100 * (1 - row.closed / row.open);
    paper(i) = row.paper_percent;
    names.push_back(row.name);
  }
  const VectorXd place = VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1));
  Figure figure;
  figure.title = "Suppression";
  Panel& amplitude = figure.panel(
      "", {},
      {fmt::format("amplitude, {}", short_name(kind)), engineering_unit(Quantity::displacement, open.maxCoeff())});
  amplitude.categories = names;
  amplitude.height = 190;
  amplitude.bars("without control", place, open, {.color = 7});
  amplitude.bars("with control", place, closed, {.color = 0});
  Panel& share = figure.panel("", {}, {"suppression", {"%", 1}});
  share.categories = names;
  share.height = 190;
  share.y.high = 112;
  share.bars("this run", place, percent, {.color = 0});
  const bool any_paper = (paper.array() == paper.array()).any();
  if (any_paper) share.bars("paper", place, paper, {.color = 4});
  const double step = any_paper ? 0.185 : 0;
  for (Index i = 0; i < n; ++i) {
    if (std::isfinite(percent(i)))
      share.annotate(place(i) - step, std::max(0.0, percent(i)), format_fixed(percent(i), 1), true);
    if (std::isfinite(paper(i)))
      share.annotate(place(i) + step, std::max(0.0, paper(i)), format_fixed(paper(i), 1), true);
  }
  return figure;
}

}  // namespace whirl::report
