#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/report/units.hpp"

namespace whirl::report {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

void require_runs(const std::vector<NamedRun>& runs) {
  if (runs.empty()) throw Error("figure: no run given");
}

/// Grey for the reference, then the palette.
Style style_of(std::size_t run, std::size_t runs, double width = 1.0) {
  return {.color = runs > 1 && run == 0 ? 7 : static_cast<int>(runs > 1 ? run - 1 : run) % 6, .width = width};
}

double largest(const std::vector<NamedRun>& runs, const std::string& channel) {
  double value = 0;
  for (const NamedRun& run : runs) {
    if (run.recording.has(channel)) value = std::max(value, run.recording[channel].cwiseAbs().maxCoeff());
  }
  return value;
}

Axis axis_of(const std::vector<NamedRun>& runs, const std::string& channel, const AmplitudeScale& scale) {
  // Without the channel in any run, at() says so for the last.
  const auto with = std::ranges::find_if(runs, [&](const NamedRun& run) { return run.recording.has(channel); });
  const Channel& first = (with == runs.end() ? runs.back() : *with).recording.at(channel);
  return {fmt::format("{} {}", to_string(first.quantity), channel),
          scale.unit_for(first.quantity, largest(runs, channel))};
}

void add_segments(Panel& panel, const std::vector<Segment>& segments) {
  constexpr int kColors[] = {7, 4, 1, 2};
  for (std::size_t i = 0; i < segments.size(); ++i) {
    panel.span(segments[i].begin, segments[i].end, segments[i].name, kColors[i % 4]);
  }
}

/// Samples with begin <= t <= end.
std::pair<Index, Index> part(const Recording& r, double begin, double end) {
  const Index from = std::clamp<Index>(static_cast<Index>(std::ceil((begin - r.t0) / r.dt - 1e-6)), 0, r.size());
  const Index to = std::clamp<Index>(static_cast<Index>(std::floor((end - r.t0) / r.dt + 1e-6)) + 1, from, r.size());
  return {from, to - from};
}

VectorXd rate_of(const Recording& r, const std::string& channel) {
  if (r.has("d" + channel)) return r["d" + channel];
  const VectorXd& x = r[channel];
  VectorXd rate = VectorXd::Constant(x.size(), NAN);
  for (Index i = 1; i + 1 < x.size(); ++i) rate(i) = (x(i + 1) - x(i - 1)) / (2 * r.dt);
  return rate;
}

}  // namespace

Figure time_traces(const std::vector<NamedRun>& runs, const std::vector<std::string>& channels,
                   const std::vector<Segment>& segments, const AmplitudeScale& scale) {
  require_runs(runs);
  Figure figure;
  figure.title = "Time traces";
  figure.shared_x = true;
  for (const std::string& channel : channels) {
    Panel& panel = figure.panel("", {"time", kSecond}, axis_of(runs, channel, scale));
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const Recording& r = runs[i].recording;
      if (r.has(channel))
        panel.line(runs.size() > 1 ? runs[i].name : "", r.times(), r[channel], style_of(i, runs.size()));
    }
    add_segments(panel, segments);
  }
  return figure;
}

namespace {

/// What the runs measure along x; `figure` needs it along x and y alike.
Quantity quantity_of_plane(const std::vector<NamedRun>& runs) {
  const Recording& r = runs.back().recording;
  const Quantity x = r.at("x").quantity, y = r.at("y").quantity;
  if (x != y)
    throw Error(fmt::format("{}: x is a {}, y a {}: a path needs one quantity in both directions", r.source,
                            to_string(x), to_string(y)));
  return x;
}

}  // namespace

Figure radius(const std::vector<NamedRun>& runs, const std::vector<Segment>& segments, double interval) {
  require_runs(runs);
  Figure figure;
  figure.title = "Radius";
  const double size = std::max(largest(runs, "x"), largest(runs, "y"));
  Panel& panel = figure.panel("", {"time", kSecond},
                              {"radius, peak", engineering_unit(quantity_of_plane(runs), size), Scale::logarithmic});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Recording& r = runs[i].recording;
    const Index block = std::max<Index>(1, std::lround(interval / r.dt)), blocks = r.size() / block;
    VectorXd time(blocks), top(blocks);
    for (Index k = 0; k < blocks; ++k) {
      time(k) = r.t0 + r.dt * (static_cast<double>(k * block) + 0.5 * static_cast<double>(block));
      top(k) = (r["x"].segment(k * block, block).array().square() + r["y"].segment(k * block, block).array().square())
                   .sqrt()
                   .maxCoeff();
      if (!(top(k) > 0)) top(k) = NAN;
    }
    panel.line(runs[i].name, time, top, style_of(i, runs.size()));
  }
  add_segments(panel, segments);
  return figure;
}

Figure control_force(const std::vector<NamedRun>& runs, double limit, const std::vector<Segment>& segments) {
  Figure figure = time_traces(runs, {"ux", "uy"}, segments);
  figure.title = "Control force";
  for (Panel& panel : figure.panels) {
    panel.height = 150;
    if (limit <= 0) continue;
    panel.horizontal(limit, "limit");
    panel.horizontal(-limit, "");
  }
  return figure;
}

Figure orbit(const std::vector<NamedRun>& runs, double begin, double end, const AmplitudeScale& scale) {
  require_runs(runs);
  Figure figure;
  figure.title = "Orbit";
  figure.width = 460;
  const double size = std::max(largest(runs, "x"), largest(runs, "y"));
  const Unit unit = scale.unit_for(quantity_of_plane(runs), size);
  Panel& panel = figure.panel(fmt::format("{:g} to {:g} s", begin, end), {"x", unit}, {"y", unit});
  panel.equal_aspect = true;
  panel.height = 380;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Recording& r = runs[i].recording;
    const auto [from, count] = part(r, begin, end);
    const VectorXd x = r["x"].segment(from, count), y = r["y"].segment(from, count);
    const Style style = style_of(i, runs.size());
    panel.line(runs[i].name, x, y, style);
    if (!r.has("beta")) continue;
    std::vector<double> mark_x, mark_y;
    const VectorXd beta = r["beta"].segment(from, count);
    for (Index k = 1; k < count; ++k) {
      const double turn = std::floor(beta(k) / kTwoPi);
      const double part_of_step = (turn * kTwoPi - beta(k - 1)) / (beta(k) - beta(k - 1));
      if (turn == std::floor(beta(k - 1) / kTwoPi) || !(part_of_step >= 0 && part_of_step <= 1)) continue;
      mark_x.push_back(x(k - 1) + part_of_step * (x(k) - x(k - 1)));
      mark_y.push_back(y(k - 1) + part_of_step * (y(k) - y(k - 1)));
    }
    panel.scatter("", VectorXd::Map(mark_x.data(), static_cast<Index>(mark_x.size())),
                  VectorXd::Map(mark_y.data(), static_cast<Index>(mark_y.size())), {.color = style.color});
  }
  return figure;
}

Figure phase_plane(const std::vector<NamedRun>& runs, const std::string& channel, const std::vector<Segment>& segments,
                   const AmplitudeScale& scale) {
  require_runs(runs);
  Figure figure;
  figure.title = "Phase plane";
  figure.columns = segments.size() > 1 ? 2 : 1;
  const Recording& last = runs.back().recording;
  const Quantity quantity = last.at(channel).quantity;
  if (quantity != Quantity::displacement && quantity != Quantity::velocity)
    throw Error(fmt::format("{}: '{}' is a {}: a phase plane needs a displacement or a velocity", last.source, channel,
                            to_string(quantity)));
  const Quantity rate = quantity == Quantity::displacement ? Quantity::velocity : Quantity::acceleration;
  for (const Segment& segment : segments) {
    double size = 0, speed = 0;
    Panel panel;
    panel.title = segment.name;
    panel.height = 260;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const Recording& r = runs[i].recording;
      const auto [from, count] = part(r, segment.begin, segment.end);
      if (count == 0) continue;
      const VectorXd x = r[channel].segment(from, count), v = rate_of(r, channel).segment(from, count);
      size = std::max(size, x.cwiseAbs().maxCoeff());
      for (const double value : v) speed = std::isfinite(value) ? std::max(speed, std::abs(value)) : speed;
      panel.line(runs.size() > 1 ? runs[i].name : "", x, v, style_of(i, runs.size(), 0.7));
    }
    if (panel.series.empty()) {
      throw Error(fmt::format("figure: no run has samples in segment '{}' ({:g} to {:g} s)", segment.name,
                              segment.begin, segment.end));
    }
    panel.x = {fmt::format("{} {}", to_string(quantity), channel), scale.unit_for(quantity, size)};
    panel.y = {std::string(to_string(rate)), scale.unit_for(rate, speed)};
    figure.panels.push_back(std::move(panel));
  }
  return figure;
}

Figure funnel(const std::vector<NamedRun>& runs, const AmplitudeScale& scale) {
  require_runs(runs);
  Figure figure;
  figure.title = "Path of the disk centre over time";
  const Unit unit = scale.unit_for(quantity_of_plane(runs), std::max(largest(runs, "x"), largest(runs, "y")));
  Panel& panel = figure.panel("", {"time", kSecond}, {"y", unit});
  panel.kind = Panel::Kind::projected;
  panel.z = {"x", unit};
  panel.height = 340;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Recording& r = runs[i].recording;
    panel.line3(runs[i].name, r.times(), r["y"], r["x"], style_of(i, runs.size(), 0.6));
  }
  return figure;
}

Figure measured_and_model(const Recording& measured, const std::string& channel, const VectorXd& model) {
  const Channel& c = measured.at(channel);
  if (model.size() != c.samples.size()) {
    throw Error(fmt::format("figure: model has {} values, channel '{}' has {}: must be equal", model.size(), channel,
                            c.samples.size()));
  }
  const VectorXd difference = c.samples - model;
  double sum = 0, biggest = 0;
  Index count = 0;
  for (const double d : difference) {
    if (!std::isfinite(d)) continue;
    sum += d * d;
    biggest = std::max(biggest, std::abs(d));
    ++count;
  }
  const double rms = count > 0 ? std::sqrt(sum / static_cast<double>(count)) : NAN;
  Figure figure;
  figure.title = "Measured and model";
  figure.shared_x = true;
  const VectorXd t = measured.times();
  Panel& top = figure.panel("", {"time", kSecond},
                            {fmt::format("{} {}", to_string(c.quantity), channel),
                             engineering_unit(c.quantity, c.samples.cwiseAbs().maxCoeff())});
  top.line("measured", t, c.samples, {.color = 7});
  top.line("model, free run", t, model, {.color = 0, .opacity = 0.85});
  Panel& bottom = figure.panel("Measured minus model: " + format_amplitude(rms, AmplitudeKind::rms, c.quantity),
                               {"time", kSecond}, {"difference", engineering_unit(c.quantity, biggest)});
  bottom.height = 110;
  bottom.line("", t, difference, {.color = 1, .width = 0.8});
  return figure;
}

}  // namespace whirl::report
