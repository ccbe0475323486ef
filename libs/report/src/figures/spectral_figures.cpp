#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phase.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/report/units.hpp"
#include "whirl/signal/motion_quantity.hpp"

namespace whirl::report {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

template <class Curve, class F>
void require_curves(const std::vector<Curve>& curves, F&& sizes_agree) {
  if (curves.empty()) throw Error("figure: no curve given");
  for (const Curve& c : curves) {
    if (!sizes_agree(c)) throw Error(fmt::format("figure: curve '{}' has vectors of different size", c.name));
  }
}

Axis amplitude_axis(const std::string& what, Quantity quantity, const AmplitudeScale& scale, double largest) {
  return {fmt::format("{}, {}", what, short_name(scale.kind)), scale.unit_for(quantity, largest)};
}

Figure spectra(const std::vector<SpectrumCurve>& curves, const AmplitudeScale& scale, Quantity quantity,
               std::string title) {
  require_curves(curves, [](const SpectrumCurve& c) { return c.frequency.size() == c.amplitude.size(); });
  double largest = 0;
  for (const SpectrumCurve& c : curves) {
    for (const double a : c.amplitude) largest = std::isfinite(a) ? std::max(largest, a) : largest;
  }
  if (!(largest > 0)) throw Error("figure: the signal is constant: its spectrum has nothing to draw");
  Figure figure;
  figure.title = std::move(title);
  Panel& panel = figure.panel("", {"frequency", kHertz},
                              amplitude_axis(std::string(to_string(quantity)), quantity, scale, largest));
  panel.y.scale = Scale::logarithmic;
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

/// The synchronous vectors of one figure, with what they share.
struct Vectors {
  Quantity quantity;
  std::string name;  ///< "1X amplitude"
  double largest = 0, smallest = INFINITY, factor;

  Vectors(const std::vector<signal::SynchronousCurve>& curves, const AmplitudeScale& scale)
      : factor(signal::factor_from_peak(scale.kind)) {
    require_curves(curves, [](const signal::SynchronousCurve& c) { return c.speed.size() == c.vector.size(); });
    quantity = curves.front().quantity;
    name = fmt::format("{:g}X amplitude", curves.front().order);
    for (const signal::SynchronousCurve& c : curves) {
      if (c.quantity != quantity)
        throw Error(fmt::format("figure: '{}' is a {}, '{}' a {}: channels of one quantity share a figure",
                                curves.front().name, to_string(quantity), c.name, to_string(c.quantity)));
      const double top = factor * c.vector.cwiseAbs().maxCoeff();
      largest = std::max(largest, top);
      smallest = std::min(smallest, top);
    }
  }
};

/// Amplitudes in dB below the largest, cut at -80 dB.
HeatMap decibel_map(const Eigen::MatrixXd& amplitude, const AmplitudeScale& scale, Quantity quantity) {
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
  map.color = {"re " + scale.text(largest, quantity), kDecibel};
  map.color.high = 0;
  return map;
}

}  // namespace

Figure spectrum(const std::vector<SpectrumCurve>& curves, const AmplitudeScale& scale, Quantity quantity,
                const std::vector<std::pair<std::string, double>>& marks) {
  Figure figure = spectra(curves, scale, quantity, "Spectrum");
  for (const auto& [name, frequency] : marks) figure.panels.front().vertical(frequency, name);
  return figure;
}

Figure full_spectrum(const std::vector<SpectrumCurve>& curves, const AmplitudeScale& scale, Quantity quantity) {
  Figure figure = spectra(curves, scale, quantity, "Full spectrum");
  figure.panels.front().x.label = "backward whirl ← frequency → forward whirl";
  figure.panels.front().vertical(0, "");
  return figure;
}

Figure waterfall(double time_begin, double time_end, double frequency_high, const Eigen::MatrixXd& amplitude,
                 const AmplitudeScale& scale, const VectorXd& speed, double frequency_low, Quantity quantity) {
  if (speed.size() != 0 && speed.size() != amplitude.cols()) {
    throw Error(
        fmt::format("figure: waterfall has {} columns but {} speeds: must be equal", amplitude.cols(), speed.size()));
  }
  Figure figure;
  figure.title = frequency_low < 0 ? "Waterfall of full spectra" : "Waterfall";
  Panel& panel =
      figure.panel("", {"time", kSecond}, {frequency_low < 0 ? "backward ← frequency → forward" : "frequency", kHertz});
  panel.height = frequency_low < 0 ? 380 : 280;
  HeatMap map = decibel_map(amplitude, scale, quantity);
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

Figure cascade(const VectorXd& speed, const VectorXd& frequency, const Eigen::MatrixXd& amplitude,
               const AmplitudeScale& scale, Quantity quantity) {
  if (amplitude.cols() != speed.size() || amplitude.rows() != frequency.size() || speed.size() < 2) {
    throw Error(fmt::format(
        "figure: cascade of {} x {} amplitudes with {} frequencies and {} speeds: must agree, with two speeds or more",
        amplitude.rows(), amplitude.cols(), frequency.size(), speed.size()));
  }
  Figure figure;
  figure.title = "Cascade";
  Panel& panel = figure.panel("", {"frequency", kHertz}, {"rotor speed", kRpm});
  panel.kind = Panel::Kind::projected;
  panel.z = amplitude_axis(std::string(to_string(quantity)), quantity, scale, amplitude.maxCoeff());
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
               const AmplitudeScale& scale, const std::vector<double>& natural_frequencies, Quantity quantity) {
  Figure figure;
  figure.title = "Amplitude over speed and frequency";
  Panel& panel = figure.panel("", {"rotor speed", kRpm}, {"frequency", kHertz});
  panel.height = 320;
  panel.y.low = 0;
  panel.y.high = frequency_high;
  HeatMap map = decibel_map(amplitude, scale, quantity);
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

Figure bode_1x(const std::vector<signal::SynchronousCurve>& curves, Phase convention, const AmplitudeScale& scale) {
  const Vectors all(curves, scale);
  // A run far below the other, as the closed loop below the open one, is seen on a logarithmic axis only.
  const bool wide = all.smallest > 0 && all.largest > 10 * all.smallest;
  Figure figure;
  figure.title = fmt::format("Bode plot of the {:g}X vector", curves.front().order);
  figure.shared_x = true;
  const Axis x{"rotor speed", kRpm};
  figure.panel("", x, amplitude_axis(all.name, all.quantity, scale, all.largest));
  figure.panel("", x, {phase_name(convention), kDegree});
  Panel& amplitude = figure.panels[0];
  Panel& phase = figure.panels[1];
  phase.height = 120;
  if (wide) amplitude.y.scale = Scale::logarithmic;
  amplitude.y.low = wide ? 0.05 * all.smallest : 0;
  std::vector<PhaseCurve> phases;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const signal::SynchronousCurve& c = curves[i];
    const Style style{.color = wide ? (i == 0 ? 7 : static_cast<int>(i - 1) % 6) : static_cast<int>(i) % 6};
    const VectorXd size = all.factor * c.vector.cwiseAbs();
    amplitude.line(curves.size() > 1 ? c.name : "", c.speed,
                   size.unaryExpr([&](double v) { return wide && !(v > 0) ? NAN : v; }), style);
    phases.push_back({c.speed, c.vector, style});
  }
  draw_phases(phase, phases, convention);
  return figure;
}

namespace {
constexpr double kWidestTurn = std::numbers::pi / 4;  // from one vector to the next
constexpr double kLeastStep = 0.02;                   // of the largest vector

/// From turn to turn the free vibration after a critical speed moves the vector across the figure: no path of the 1X.
bool beats(const Eigen::VectorXcd& vector, Index i, double largest) {
  return std::abs(std::arg(vector(i) * std::conj(vector(i - 1)))) > kWidestTurn &&
         std::abs(vector(i) - vector(i - 1)) > kLeastStep * largest;
}

/// The curve, with a break in the line where it beats.
Eigen::VectorXcd with_breaks(const Eigen::VectorXcd& vector, double largest) {
  std::vector<std::complex<double>> out;
  for (Index i = 0; i < vector.size(); ++i) {
    if (i > 0 && beats(vector, i, largest)) out.emplace_back(NAN, NAN);
    out.push_back(vector(i));
  }
  return Eigen::Map<Eigen::VectorXcd>(out.data(), static_cast<Index>(out.size()));
}
}  // namespace

Figure polar_1x(const std::vector<signal::SynchronousCurve>& curves, Phase phase, const AmplitudeScale& scale,
                int labels) {
  const Vectors all(curves, scale);
  Figure figure;
  figure.title = fmt::format("Polar plot of the {:g}X vector", curves.front().order);
  figure.width = 480;
  Axis radius = amplitude_axis(all.name, all.quantity, scale, all.largest);
  radius.label = fmt::format("angle = {}{}; radius = {}", phase_name(phase),
                             phase == Phase::lag ? " (against the rotation)" : "", radius.label);
  Panel& panel = figure.panel("", {}, radius);
  panel.kind = Panel::Kind::polar;
  panel.clockwise = phase == Phase::lag;
  const double sign = panel.clockwise ? -1 : 1;
  panel.height = 380;
  for (const signal::SynchronousCurve& c : curves) {
    const Eigen::VectorXcd drawn = with_breaks(c.vector, c.vector.cwiseAbs().maxCoeff());
    panel.line(curves.size() > 1 ? c.name : "", sign * drawn.array().arg(), all.factor * drawn.cwiseAbs());
  }
  // Speeds at equal steps of the way along the curve, where the reader needs them.
  const signal::SynchronousCurve& first = curves.front();
  VectorXd way = VectorXd::Zero(first.vector.size());
  const double largest = first.vector.size() > 0 ? first.vector.cwiseAbs().maxCoeff() : 0;
  for (Index i = 1; i < way.size(); ++i)
    way(i) = way(i - 1) + (beats(first.vector, i, largest) ? 0 : std::abs(first.vector(i) - first.vector(i - 1)));
  for (int k = 0; k < labels && way.size() > 0; ++k) {
    const double wanted = (k + 0.5) / labels * way(way.size() - 1);
    const Index at = std::lower_bound(way.data(), way.data() + way.size() - 1, wanted) - way.data();
    const double angle = sign * std::arg(first.vector(at)), size = all.factor * std::abs(first.vector(at));
    panel.annotate(angle, size, fmt::format("{:.0f} rpm", first.speed(at) / kRpm.factor));
    panel.scatter("", VectorXd::Constant(1, angle), VectorXd::Constant(1, size), {.color = 0});
  }
  return figure;
}

Figure nyquist_1x(const std::vector<signal::SynchronousCurve>& curves, const AmplitudeScale& scale) {
  const Vectors all(curves, scale);
  Figure figure;
  figure.title = fmt::format("Nyquist plot of the {:g}X vector", curves.front().order);
  figure.width = 480;
  Panel& panel = figure.panel("", amplitude_axis("real part", all.quantity, scale, all.largest),
                              amplitude_axis("imaginary part", all.quantity, scale, all.largest));
  panel.equal_aspect = true;
  panel.height = 380;
  panel.vertical(0, "");
  panel.horizontal(0, "");
  for (const signal::SynchronousCurve& c : curves) {
    panel.line(curves.size() > 1 ? c.name : "", all.factor * c.vector.real(), all.factor * c.vector.imag());
  }
  return figure;
}

Figure order_tracks(const VectorXd& time, const VectorXd& speed, const std::vector<double>& orders,
                    const Eigen::MatrixXcd& envelope, Quantity quantity, Phase phase, const AmplitudeScale& scale) {
  if (envelope.rows() != time.size() || speed.size() != time.size() ||
      envelope.cols() != static_cast<Index>(orders.size()) || orders.empty()) {
    throw Error("figure: order tracks need one row per time and speed and one column per order");
  }
  Figure figure;
  figure.title = "Order tracks";
  figure.shared_x = true;
  const Axis t{"time", kSecond};
  const double largest = envelope.cwiseAbs().unaryExpr([](double a) { return std::isnan(a) ? 0 : a; }).maxCoeff();
  const double factor = signal::factor_from_peak(scale.kind);
  figure.panel("", t, amplitude_axis(std::string(to_string(quantity)), quantity, scale, factor * largest));
  figure.panel("", t, {phase_name(phase), kDegree}).height = 120;
  Panel& speeds = figure.panel("", t, {"rotor speed", kRpm});
  speeds.height = 90;
  speeds.line("", time, speed, {.color = 7});
  std::vector<PhaseCurve> phases;
  for (std::size_t k = 0; k < orders.size(); ++k) {
    const auto column = static_cast<Index>(k);
    const int color = static_cast<int>(k) % 6;
    figure.panels[0].line(fmt::format("{:g}X", orders[k]), time, factor * envelope.col(column).cwiseAbs(),
                          {.color = color});
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
  Panel& amplitude = figure.panel("", {}, amplitude_axis("amplitude", Quantity::displacement, kind, open.maxCoeff()));
  amplitude.categories = names;
  amplitude.height = 190;
  amplitude.bars("without control", place, open, {.color = 7});
  amplitude.bars("with control", place, closed, {.color = 0});
  Panel& share = figure.panel("", {}, {"suppression", kPercent});
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
