#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "phase.hpp"
#include "whirl/core/error.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/report/units.hpp"

namespace whirl::report {
namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

std::string_view frf_unit(FrfKind kind) {
  switch (kind) {
    case FrfKind::receptance:
      return "m/N";
    case FrfKind::mobility:
      return "m/(s N)";
    case FrfKind::accelerance:
      break;
  }
  return "m/(s² N)";
}

VectorXd magnitude(const VectorXcd& values) {
  // Zeros (0 Hz of an accelerance) have no place on a logarithmic axis: a gap.
  return values.array().abs().unaryExpr([](double v) { return v > 0 ? v : NAN; });
}

void check_size(Index size, Index expected, std::string_view what) {
  if (size != expected) {
    throw Error(fmt::format("figure: {} has {} values, expected {}", what, size, expected));
  }
}

}  // namespace

Figure frequency_response(const FrequencyResponse& response, Index channel, const VectorXcd& reconstruction,
                          const std::vector<Mode>& modes) {
  if (channel < 0 || channel >= static_cast<Index>(response.channels.size())) {
    throw Error::in_field("channel", std::to_string(channel),
                          fmt::format("0 to {}", static_cast<Index>(response.channels.size()) - 1));
  }
  const FrfChannel& c = response.channels[static_cast<std::size_t>(channel)];
  const VectorXd& f = response.frequency;
  check_size(c.value.size(), f.size(), "frequency response");
  Figure figure;
  figure.title = fmt::format("Frequency response {} / {}", c.response, c.reference);
  figure.shared_x = true;
  const Axis x{"frequency", kHertz};

  // Of another program's file neither estimator nor averages are known.
  const std::string force = c.reference.empty()                              ? ""
                            : c.reference.find("force") != std::string::npos ? " per " + c.reference
                                                                             : " per force at " + c.reference;
  const std::string made = response.averages > 0 ? fmt::format(", {}, {} average{}", to_string(response.estimator),
                                                               response.averages, response.averages == 1 ? "" : "s")
                                                 : "";
  Panel& top = figure.panel(
      fmt::format("{}{}{}", c.response, force, made), x,
      {std::string(to_string(response.kind)), {std::string(frf_unit(response.kind)), 1}, Scale::logarithmic});
  top.line("measured", f, magnitude(c.value), {.color = 7});
  if (reconstruction.size() > 0) {
    check_size(reconstruction.size(), f.size(), "reconstruction");
    top.line("reconstruction", f, magnitude(reconstruction), {.color = 1});
  }
  // Names of many modes would cover each other: then the lines speak alone.
  const bool named = modes.size() <= 6;
  for (const Mode& mode : modes) {
    top.vertical(mode.frequency.value, named ? format_number(mode.frequency.value, 4) + " Hz" : "",
                 {.color = 2, .width = 0.8, .dash = Dash::dotted});
  }
  Panel& phase = figure.panel("", x, {"phase", kDegree});
  phase.height = 100;
  phase.y.low = -std::numbers::pi;
  phase.y.high = std::numbers::pi;
  phase.line("", f, phase_with_gaps(c.value), {.color = 7});
  if (reconstruction.size() > 0) phase.line("", f, phase_with_gaps(reconstruction), {.color = 1});
  if (c.coherence.size() > 0) {
    check_size(c.coherence.size(), f.size(), "coherence");
    Panel& coherence = figure.panel("", x, {"coherence", {}});
    coherence.height = 80;
    coherence.y.low = 0;
    coherence.y.high = 1.05;
    coherence.line("", f, c.coherence, {.color = 3});
  }
  return figure;
}

Figure stabilisation(const FrequencyResponse& response, const std::vector<OrderPole>& poles,
                     const std::vector<double>& chosen) {
  Figure figure;
  figure.title = "Stabilisation diagram";
  figure.shared_x = true;
  const Axis x{"frequency", kHertz};
  std::vector<double> xs[2], ys[2];
  for (const OrderPole& pole : poles) {
    xs[pole.stable].push_back(pole.frequency);
    ys[pole.stable].push_back(pole.order);
  }
  const auto vector = [](const std::vector<double>& v) {
    return VectorXd(VectorXd::Map(v.data(), static_cast<Index>(v.size())));
  };
  Panel& diagram = figure.panel("", x, {"model order", {}});
  diagram.height = 260;
  if (!xs[0].empty())
    diagram.scatter("not stable", vector(xs[0]), vector(ys[0]), {.color = 7, .mark = Mark::cross, .opacity = 0.5});
  if (!xs[1].empty()) diagram.scatter("stable", vector(xs[1]), vector(ys[1]), {.color = 0});
  VectorXd sum = VectorXd::Zero(response.frequency.size());
  for (const FrfChannel& c : response.channels) {
    check_size(c.value.size(), sum.size(), "frequency response");
    sum += c.value.array().abs().matrix();
  }
  Panel& magnitudes = figure.panel("", x,
                                   {"sum of " + std::string(to_string(response.kind)),
                                    {std::string(frf_unit(response.kind)), 1},
                                    Scale::logarithmic});
  magnitudes.height = 130;
  magnitudes.line("", response.frequency, sum.unaryExpr([](double v) { return v > 0 ? v : NAN; }), {.color = 7});
  for (Panel& panel : figure.panels) {
    for (const double f : chosen) panel.vertical(f, "", {.color = 2, .width = 0.8, .dash = Dash::dotted});
  }
  return figure;
}

Figure mode_shapes(const std::vector<std::string>& points, const Eigen::MatrixXcd& shapes,
                   const std::vector<Mode>& modes) {
  check_size(shapes.rows(), static_cast<Index>(points.size()), "mode shape");
  check_size(shapes.cols(), static_cast<Index>(modes.size()), "number of mode shapes");
  Figure figure;
  figure.title = "Mode shapes";
  figure.columns = std::clamp(static_cast<int>(24 / std::max<std::size_t>(points.size(), 1)), 1, 3);
  const VectorXd x = VectorXd::LinSpaced(shapes.rows(), 0, static_cast<double>(shapes.rows() - 1));
  for (Index k = 0; k < shapes.cols(); ++k) {
    const VectorXcd raw = shapes.col(k);
    // The sum of squares points along twice the direction of the best line.
    VectorXcd shape = raw * std::polar(1.0, -0.5 * std::arg(raw.cwiseProduct(raw).sum()));
    Index largest = 0;
    if (shape.real().cwiseAbs().maxCoeff(&largest) > 0) shape /= shape(largest).real();
    const Mode& mode = modes[static_cast<std::size_t>(k)];
    Panel& panel = figure.panel(fmt::format("{} Hz, damping {} %", format_number(mode.frequency.value, 5),
                                            format_number(100 * mode.damping.value, 3)),
                                {"", {}}, {"shape", {}});
    panel.height = 110;
    panel.categories = points;
    panel.y.low = -1.1;
    panel.y.high = 1.1;
    panel.bars(k == 0 ? "in phase" : "", x, shape.real(), {.color = 0});
    panel.bars(k == 0 ? "in quadrature" : "", x, shape.imag(), {.color = 1});
  }
  return figure;
}

Figure force_deflection(const VectorXd& deflection, const VectorXd& force, const StiffnessLaw& law, double force_sd) {
  if (deflection.size() == 0 || deflection.size() != force.size()) {
    throw Error(fmt::format("figure: {} deflections and {} forces: must be equal and not empty", deflection.size(),
                            force.size()));
  }
  Figure figure;
  figure.title = "Force against deflection";
  figure.width = 560;
  Panel& panel =
      figure.panel("", {"deflection", engineering_unit(Quantity::displacement, deflection.cwiseAbs().maxCoeff())},
                   {"force", engineering_unit(Quantity::force, force.cwiseAbs().maxCoeff())});
  panel.height = 300;
  const VectorXd d = VectorXd::LinSpaced(121, deflection.minCoeff(), deflection.maxCoeff());
  const double offset = std::isfinite(law.offset.value) ? law.offset.value : 0;
  const VectorXd from_zero = d.array() - offset;
  const VectorXd linear = law.k1.value * from_zero;
  const VectorXd fit = linear + law.k2.value * from_zero.array().cube().matrix();
  if (force_sd > 0) {
    const double half = 1.959964 * force_sd;
    panel.band("95 % of readings", d, fit.array() - half, fit.array() + half, {.color = 0});
  }
  panel.line("linear part K₁ d", d, linear, {.color = 7, .dash = Dash::dashed});
  panel.line("K₁ d + K₂ d³", d, fit, {.color = 0, .width = 1.6});
  panel.scatter("measured", deflection, force, {.color = 1});
  return figure;
}

}  // namespace whirl::report
