#include "record/record_orbit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "record/record_maps.hpp"
#include "record/record_part.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/signal/motion_quantity.hpp"
#include "whirl/signal/order.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using report::Figure;
constexpr Index kCentrelineTurns = 8;
constexpr double kAgree = 0.1;  // of the largest vector: 1X vectors of one orbit

// The 1X vectors of both probes, turn by turn.
struct Turns {
  signal::SynchronousCurve x, y;
  VectorXd radius2;  // of the major axes, squared, up to a factor

  Turns(const Recording& r, const diagnosis::Rotation& turning, const ViewOptions& o)
      : x(diagnosis::order_curve(r, turning, "x", 1, o.turns, o.slow_roll)),
        y(diagnosis::order_curve(r, turning, "y", 1, o.turns, o.slow_roll)),
        radius2(x.vector.cwiseAbs2() + y.vector.cwiseAbs2()) {}

  Index largest() const {
    Index top = 0;
    radius2.maxCoeff(&top);
    return top;
  }
  bool agrees(Index i, Index with) const {
    const double apart = std::norm(x.vector[i] - x.vector[with]) + std::norm(y.vector[i] - y.vector[with]);
    return apart < kAgree * kAgree * radius2[with];
  }
};

// Begin and end of the turns around the largest one whose vectors agree with it: three to ten.
std::pair<double, double> around_the_largest(const Turns& turns) {
  const Index top = turns.largest(), last = turns.x.time.size() - 1;
  Index from = top, to = top;
  const auto fits = [&](Index i) { return to - from < 2 || (to - from < 9 && turns.agrees(i, top)); };
  for (bool grows = true; grows;) {
    grows = false;
    if (from > 0 && fits(from - 1)) --from, grows = true;
    if (to < last && fits(to + 1)) ++to, grows = true;
  }
  const double half_turn = 0.5 * kTwoPi / turns.x.speed[top];
  return {turns.x.time[from] - half_turn, turns.x.time[to] + half_turn};
}

// Weights 1 - cos: neither a vibration of whole turns nor its growth moves the mean.
double weighted_mean(const Eigen::Ref<const VectorXd>& samples) {
  const Index n = samples.size();
  const VectorXd weight =
      1 - (VectorXd::LinSpaced(n, 0.5, static_cast<double>(n) - 0.5) * kTwoPi / static_cast<double>(n)).array().cos();
  return weight.dot(samples) / weight.sum();
}

double mean_between(const Recording& r, const std::string& channel, double begin, double end) {
  const auto first = std::clamp<Index>(std::lround(begin / r.dt), 0, r.size() - 1);
  const auto last = std::clamp<Index>(std::lround(end / r.dt), first + 1, r.size());
  return weighted_mean(r[channel].segment(first, last - first));
}

void draw_ellipse(report::Panel& panel, const Recording& part, const Turns& turns,
                  const report::AmplitudeScale& scale) {
  const Index top = turns.largest(), n = turns.x.time.size();
  bool one = true;
  for (Index i = 0; i < n && one; ++i) one = turns.agrees(i, top);
  const std::complex<double> x = one ? turns.x.vector.mean() : turns.x.vector[top];
  const std::complex<double> y = one ? turns.y.vector.mean() : turns.y.vector[top];
  const double turn = kTwoPi / turns.x.speed[top];
  const double begin = one ? 0 : turns.x.time[top] - turn, end = one ? part.duration() : turns.x.time[top] + turn;
  const double cx = mean_between(part, "x", begin, end), cy = mean_between(part, "y", begin, end);
  const VectorXd theta = VectorXd::LinSpaced(181, 0, kTwoPi);
  const auto path = [&](double c, std::complex<double> z) -> VectorXd {
    return theta.unaryExpr([&](double t) { return c + (z * std::polar(1.0, t)).real(); });
  };
  panel.line("1X", path(cx, x), path(cy, y), {.color = 1, .width = 1.6});
  panel.scatter("", VectorXd::Constant(1, cx + x.real()), VectorXd::Constant(1, cy + y.real()), {.color = 1});
  const double factor = signal::factor_from_peak(scale.kind);
  const signal::OrbitEllipse e = signal::orbit_ellipse(x, y);
  const double speed = (one ? turns.x.speed.mean() : turns.x.speed[top]) / kRadPerSecPerRpm;
  panel.title = fmt::format("1X at {:.0f} rpm{}: {}, {} by {}", speed, one ? "" : ", one turn",
                            e.area >= 0 ? "forward" : "backward", scale.text(factor * e.semi_major, turns.x.quantity),
                            scale.text(factor * e.semi_minor, turns.x.quantity));
}

}  // namespace

std::vector<report::Probe> shaft_probes() { return {{0, "x probe"}, {kTwoPi / 4, "y probe"}}; }

Figure orbit(const std::vector<ViewedRun>& runs, const ViewOptions& o) {
  ViewOptions range = o;
  const Recording& last = runs.back().record;
  const bool chosen = std::isfinite(o.begin) || std::isfinite(o.end);
  if (!chosen) {
    range.begin = last.t0;
    range.end = last.t0 + last.duration();
    if (const auto turning = diagnosis::rotation_of(last)) {
      const double offset = last.t0 + last.dt * static_cast<double>(turning->first);
      const auto [begin, end] = around_the_largest(Turns(last, *turning, o));
      range.begin = std::max(range.begin, offset + begin);
      range.end = std::min(range.end, offset + end);
    }
  }
  std::vector<Recording> parts;
  std::vector<report::NamedRun> part_names;
  for (const ViewedRun& r : runs) parts.push_back(cut(r.record, range));
  for (std::size_t i = 0; i < runs.size(); ++i)
    part_names.push_back({runs.size() > 1
                              ? runs[i].name
                              : fmt::format("{:.4g} to {:.4g} s", parts[i].t0, parts[i].t0 + parts[i].duration()),
                          parts[i]});
  const Recording& part = parts.back();
  Figure figure = report::orbit(part_names, part.t0, part.t0 + part.duration(), o.scale);
  figure.panels.front().probes = shaft_probes();
  const auto turning = diagnosis::rotation_of(last);
  if (!turning) return figure;
  figure.panels.front().rotation = true;
  // The angle of the whole record: a short part alone does not give it well.
  const Index cut_at = std::lround((part.t0 - last.t0) / last.dt);
  const Index first = std::max(turning->first, cut_at);
  const Index end = std::min(turning->first + turning->size(), cut_at + part.size());
  if (end - first < 16) return figure;
  diagnosis::Rotation here;
  here.first = first - cut_at;
  here.angle = turning->angle.segment(first - turning->first, end - first);
  here.speed = turning->speed.segment(first - turning->first, end - first);
  const auto whole_turns = std::floor(here.angle[here.size() - 1] / kTwoPi) - std::ceil(here.angle[0] / kTwoPi);
  if (whole_turns >= o.turns) draw_ellipse(figure.panels.front(), part, Turns(part, here, o), o.scale);
  return figure;
}

Figure centreline(const std::vector<ViewedRun>& runs, const ViewOptions& o) {
  Figure figure;
  figure.title = "Shaft centreline";
  figure.width = 460;
  struct Line {
    VectorXd x, y, speed;
  };
  std::vector<Line> lines;
  double size = 0;
  for (const ViewedRun& run : runs) {
    const Recording r = cut(run.record, o);
    const diagnosis::Rotation turning = required_rotation(r);
    const auto mean_of = [&](const char* channel) {
      const signal::AngularSignal a =
          signal::resample_in_angle(r[channel].segment(turning.first, turning.size()), turning.angle, r.dt);
      const Index block = std::min(kCentrelineTurns, a.turns()) * a.per_turn;
      VectorXd mean(a.turns() - block / a.per_turn + 1);
      for (Index k = 0; k < mean.size(); ++k) mean[k] = weighted_mean(a.samples.segment(k * a.per_turn, block));
      return VectorXd(mean.array() - mean[0]);
    };
    Line line{mean_of("x"), mean_of("y"), diagnosis::order_curve(r, turning, "x").speed};
    line.speed = line.speed.segment((line.speed.size() - line.x.size()) / 2, line.x.size()).eval();
    size = std::max({size, line.x.cwiseAbs().maxCoeff(), line.y.cwiseAbs().maxCoeff()});
    lines.push_back(std::move(line));
  }
  const report::Unit unit = o.scale.unit_for(runs.back().record.at("x").quantity, size);
  report::Panel& panel = figure.panel(fmt::format("mean position over {} turns, from the first", kCentrelineTurns),
                                      {"x", unit}, {"y", unit});
  panel.equal_aspect = true;
  panel.height = 380;
  panel.probes = shaft_probes();
  panel.rotation = true;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    panel.line(lines.size() > 1 ? runs[k].name : "", lines[k].x, lines[k].y,
               {.color = lines.size() > 1 && k == 0 ? 7 : static_cast<int>(k) % 6, .width = 1});
  }
  const Line& shown = lines.back();
  constexpr int kLabels = 5;
  for (int k = 0; k < kLabels; ++k) {
    const Index at = k * (shown.x.size() - 1) / (kLabels - 1);
    panel.annotate(shown.x[at], shown.y[at], fmt::format("{:.0f} rpm", shown.speed[at] / kRadPerSecPerRpm));
    panel.scatter("", shown.x.segment(at, 1), shown.y.segment(at, 1), {.color = 6});
  }
  return figure;
}

}  // namespace whirl::pages
