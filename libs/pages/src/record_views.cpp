#include "whirl/pages/record_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "record_maps.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/io/units.hpp"
#include "whirl/signal/order.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using report::Figure;
using report::NamedRun;
constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kRpm = kTurn / 60;

constexpr View kViews[] = {
    {"traces", "channels over time"},
    {"orbit",
     "path of the disk centre, raw and 1X, with a dot where the angle is zero; without --from and --to ten turns "
     "around the largest radius"},
    {"spectrum", "one-sided amplitude spectrum"},
    {"full-spectrum", "spectrum of x + i y: forward whirl at positive, backward whirl at negative frequency"},
    {"waterfall", "spectra over time as a colour map, with the 1X and 2X lines"},
    {"full-waterfall", "full spectra over time"},
    {"cascade", "spectra one behind the other at their rotor speeds"},
    {"run-map", "spectra over rotor speed as a colour map (Campbell style)"},
    {"bode", "amplitude and phase of the 1X vector against rotor speed"},
    {"polar", "the 1X vector in its plane"},
    {"orders", "amplitude and phase of orders followed through the run (Vold-Kalman)"},
    {"phase-plane", "displacement against velocity"},
    {"funnel", "path of the disk centre over time"},
};

const std::string& channel_of(const ViewOptions& o) {
  static const std::string x = "x";
  return o.channels.empty() ? x : o.channels.front();
}

std::vector<NamedRun> named(const std::vector<ViewedRun>& runs) {
  std::vector<NamedRun> out;
  for (const ViewedRun& r : runs) out.push_back({r.name, r.record});
  return out;
}

// Samples between --from and --to.
Recording cut(const Recording& r, const ViewOptions& o) {
  const double n = static_cast<double>(r.size());
  const auto first = static_cast<Index>(std::clamp(std::ceil((o.begin - r.t0) / r.dt - 1e-6), 0.0, n));
  const auto end = static_cast<Index>(std::clamp(std::floor((o.end - r.t0) / r.dt + 1e-6) + 1, 0.0, n));
  if (end - first < 16) {
    throw Error(
        fmt::format("{}: {} samples between {:g} and {:g} s (the record has {:g} to {:g} s): must be 16 or more",
                    r.source, std::max<Index>(0, end - first), o.begin, o.end, r.t0, r.t0 + r.dt * (n - 1)));
  }
  Recording out;
  out.t0 = r.t0 + r.dt * static_cast<double>(first);
  out.dt = r.dt;
  out.source = r.source;
  for (const Channel& c : r.channels) out.add(c.name, c.quantity, c.samples.segment(first, end - first));
  return out;
}

Figure traces(const std::vector<ViewedRun>& runs, const ViewOptions& o) {
  std::vector<std::string> channels = o.channels;
  if (channels.empty()) {
    for (const char* name : {"x", "y", "ux", "uy"}) {
      if (std::ranges::any_of(runs, [&](const ViewedRun& r) { return r.record.has(name); }))
        channels.emplace_back(name);
    }
  }
  for (const Channel& c : runs.back().record.channels) {
    if (o.channels.empty() && channels.size() < 4 && c.quantity != Quantity::angle &&
        std::ranges::count(channels, c.name) == 0) {
      channels.push_back(c.name);
    }
  }
  return report::time_traces(named(runs), channels);
}

// x = mean + Re(Z e^{j theta}) over the part, by least squares.
std::pair<double, std::complex<double>> synchronous_fit(const Eigen::Ref<const VectorXd>& x,
                                                        const Eigen::Ref<const VectorXd>& angle) {
  Eigen::MatrixX3d a(x.size(), 3);
  a.col(0).setOnes();
  a.col(1) = angle.array().cos();
  a.col(2) = -angle.array().sin();
  const Eigen::Matrix3d normal = a.transpose() * a;
  const Eigen::Vector3d p = normal.inverse() * (a.transpose() * x);
  return {p[0], {p[1], p[2]}};
}

Figure orbit(const std::vector<ViewedRun>& runs, const ViewOptions& o) {
  double begin = o.begin, end = o.end;
  const Recording& last = runs.back().record;
  if (!std::isfinite(begin) && !std::isfinite(end)) {
    begin = last.t0;
    end = last.t0 + last.duration();
    if (const auto turning = diagnosis::rotation_of(last)) {
      Index top = 0;
      (last["x"].cwiseAbs2() + last["y"].cwiseAbs2()).maxCoeff(&top);
      const Index at = std::clamp<Index>(top - turning->first, 0, turning->size() - 1);
      const double half = 5 * kTurn / std::max(turning->speed[at], 0.05 * turning->highest_speed());
      begin = std::max(begin, last.t0 + last.dt * static_cast<double>(top) - half);
      end = std::min(end, last.t0 + last.dt * static_cast<double>(top) + half);
    }
  }
  std::vector<Recording> parts;
  std::vector<NamedRun> part_names;
  ViewOptions range = o;
  range.begin = begin, range.end = end;
  for (const ViewedRun& r : runs) parts.push_back(cut(r.record, range));
  for (std::size_t i = 0; i < runs.size(); ++i)
    part_names.push_back({runs.size() > 1 ? runs[i].name : "unfiltered", parts[i]});
  Figure figure = report::orbit(part_names, parts.back().t0, parts.back().t0 + parts.back().duration());
  const auto turning = diagnosis::rotation_of(last);
  if (!turning) return figure;
  const Index first =
      std::max<Index>(turning->first, static_cast<Index>(std::lround((parts.back().t0 - last.t0) / last.dt)));
  const Index count = std::min<Index>(turning->first + turning->size() - first, parts.back().size());
  if (count < 16 || turning->angle[first - turning->first + count - 1] - turning->angle[first - turning->first] < kTurn)
    return figure;
  const auto angle = turning->angle.segment(first - turning->first, count);
  const auto [cx, zx] = synchronous_fit(last["x"].segment(first, count), angle);
  const auto [cy, zy] = synchronous_fit(last["y"].segment(first, count), angle);
  const VectorXd theta = VectorXd::LinSpaced(181, 0, kTurn);
  const auto path = [&](double c, std::complex<double> z) -> VectorXd {
    return theta.unaryExpr([&](double t) { return c + (z * std::polar(1.0, t)).real(); });
  };
  report::Panel& panel = figure.panels.front();
  panel.line("1X", path(cx, zx), path(cy, zy), {.color = 1, .width = 1.6});
  panel.scatter("", VectorXd::Constant(1, cx + zx.real()), VectorXd::Constant(1, cy + zy.real()), {.color = 1});
  const signal::OrbitEllipse e = signal::orbit_ellipse(zx, zy);
  panel.title += fmt::format(", 1X {} whirl, {} by {}", e.area >= 0 ? "forward" : "backward",
                             report::format_amplitude(e.semi_major, AmplitudeKind::peak),
                             report::format_amplitude(e.semi_minor, AmplitudeKind::peak));
  return figure;
}

Figure spectra(const std::vector<ViewedRun>& runs, const ViewOptions& o, bool full) {
  signal::SpectrumOptions s;
  s.window = o.window.value_or(signal::Window::hann);
  s.kind = o.kind;
  std::vector<report::SpectrumCurve> curves;
  double line = 0;
  std::vector<std::string> channels{channel_of(o)};
  if (!full && runs.size() == 1) channels = o.channels;
  if (channels.empty()) {
    for (const char* name : {"x", "y"}) {
      if (runs.front().record.has(name)) channels.emplace_back(name);
    }
    if (channels.empty()) channels.push_back(runs.front().record.channels.front().name);
  }
  Quantity quantity = Quantity::displacement;
  for (const ViewedRun& run : runs) {
    const Recording r = cut(run.record, o);
    s.block = o.resolution > 0 ? std::min<Index>(r.size(), std::lround(r.rate() / o.resolution)) : 0;
    for (const std::string& channel : channels) {
      const signal::AmplitudeSpectrum a =
          full ? signal::full_spectrum(r["x"], r["y"], r.dt, s) : signal::amplitude_spectrum(r[channel], r.dt, s);
      if (!full) quantity = r.at(channel).quantity;
      line = a.noise_bandwidth;
      const double highest = o.highest_frequency > 0 ? o.highest_frequency : 0.5 * r.rate();
      Index from = 0, to = a.frequency.size();
      while (from < to && a.frequency[from] < -highest) ++from;
      while (to > from && a.frequency[to - 1] > highest) --to;
      curves.push_back({runs.size() > 1 ? run.name
                        : full          ? ""
                                        : channel,
                        a.frequency.segment(from, to - from), a.amplitude.segment(from, to - from)});
      if (full) break;
    }
  }
  std::vector<std::pair<std::string, double>> marks;
  if (const auto turning = diagnosis::rotation_of(cut(runs.back().record, o))) {
    const double mean = turning->speed.mean();
    if (turning->speed.maxCoeff() - turning->speed.minCoeff() < 0.02 * mean)
      marks = {{"1X", mean / kTurn}, {"2X", 2 * mean / kTurn}};
  }
  Figure figure = full ? report::full_spectrum(curves, o.kind) : report::spectrum(curves, o.kind, quantity, marks);
  if (full) {
    for (const auto& [name, f] : marks) {
      figure.panels.front().vertical(f, "+" + name);
      figure.panels.front().vertical(-f, "−" + name);
    }
  }
  figure.panels.front().title = fmt::format("{} window, noise bandwidth {:.3g} Hz", window_name(s.window), line);
  return figure;
}

Figure order_tracks(const ViewedRun& run, const ViewOptions& o) {
  const Recording r = cut(run.record, o);
  const diagnosis::Rotation turning = required_rotation(r);
  const std::string& channel = channel_of(o);
  // A quarter of the lowest distance of two orders, so that they are told apart, but not faster than they change.
  const double bandwidth =
      o.bandwidth > 0 ? o.bandwidth : std::clamp(0.25 * turning.speed.mean() / kTurn, 0.5, 0.05 / r.dt);
  const VectorXd part = r[channel].segment(turning.first, turning.size());
  signal::VoldKalmanOptions filter;
  filter.bandwidth = bandwidth;
  const Eigen::MatrixXcd envelope = signal::track_orders(part, turning.angle, r.dt, o.orders, filter);
  const VectorXd time = VectorXd::LinSpaced(part.size(), r.t0 + r.dt * static_cast<double>(turning.first),
                                            r.t0 + r.dt * static_cast<double>(turning.first + part.size() - 1));
  Figure figure = report::order_tracks(time, turning.speed, o.orders, envelope, r.at(channel).quantity);
  figure.panels.front().title = fmt::format("{}: Vold-Kalman, two poles, {:.3g} Hz", channel, bandwidth);
  return figure;
}

Figure synchronous(const std::string& what, const std::vector<ViewedRun>& runs, const ViewOptions& o) {
  std::vector<signal::SynchronousCurve> curves;
  const double order = o.orders.empty() ? 1 : o.orders.front();
  for (const ViewedRun& run : runs) {
    const Recording r = cut(run.record, o);
    const diagnosis::Rotation turning = required_rotation(r);
    std::vector<std::string> channels{channel_of(o)};
    if (o.channels.empty() && runs.size() == 1 && r.has("y")) channels.emplace_back("y");
    for (const std::string& channel : channels) {
      curves.push_back(diagnosis::order_curve(r, turning, channel, order, o.turns, o.slow_roll));
      if (runs.size() > 1) curves.back().name = run.name;
    }
  }
  Figure figure = synchronous_view(what, curves);
  if (order != 1) {
    for (report::Panel& p : figure.panels) {
      const auto at = p.y.label.find("1X");
      if (at != std::string::npos) p.y.label.replace(at, 2, fmt::format("{:g}X", order));
    }
  }
  return figure;
}

Figure phase_plane(const std::vector<ViewedRun>& runs, const ViewOptions& o) {
  const Recording& r = runs.back().record;
  const double begin = std::max(o.begin, r.t0), end = std::min(o.end, r.t0 + r.duration());
  return report::phase_plane(named(runs), channel_of(o), {{fmt::format("{:g} to {:g} s", begin, end), begin, end}});
}

}  // namespace

std::span<const View> views() { return kViews; }

std::vector<ViewedRun> viewed_runs(const Recording& record, const std::string& name) {
  if (!record.has("x_open") || !record.has("x_true")) return {{name, record}};
  const auto part = [&](const std::vector<std::pair<const char*, const char*>>& channels) {
    Recording r;
    r.t0 = record.t0;
    r.dt = record.dt;
    r.source = record.source;
    for (const auto& [from, to] : channels) {
      if (record.has(from)) r.add(to, record.at(from).quantity, record[from]);
    }
    return r;
  };
  return {{"open loop", part({{"x_open", "x"}, {"y_open", "y"}, {"beta", "beta"}, {"omega", "omega"}})},
          {"closed loop", part({{"x_true", "x"},
                                {"y_true", "y"},
                                {"vx_est", "dx"},
                                {"vy_est", "dy"},
                                {"ux", "ux"},
                                {"uy", "uy"},
                                {"s_x", "s_x"},
                                {"s_y", "s_y"},
                                {"beta", "beta"},
                                {"omega", "omega"}})}};
}

Figure synchronous_view(const std::string& what, const std::vector<signal::SynchronousCurve>& curves) {
  if (what == "polar") return report::polar_1x(curves);
  Figure figure = report::bode_1x(curves);
  const signal::SynchronousCurve& c = curves.front();
  const VectorXd amplitude = c.vector.cwiseAbs();
  std::string list;
  const std::vector<Index> tops = diagnosis::maxima(amplitude);
  VectorXd x(static_cast<Index>(tops.size())), y(x.size());
  for (std::size_t k = 0; k < tops.size(); ++k) {
    x[static_cast<Index>(k)] = c.speed[tops[k]];
    y[static_cast<Index>(k)] = amplitude[tops[k]];
    if (k < 12) list += fmt::format("{}{:.0f}", k ? ", " : "", c.speed[tops[k]] / kRpm);
  }
  if (x.size() > 0) figure.panels.front().scatter("maxima at " + list + " rpm", x, y, {.color = 6});
  return figure;
}

Figure view(const std::string& what, const std::vector<ViewedRun>& runs, const ViewOptions& o) {
  if (runs.empty()) throw Error("figure: no run given");
  Figure figure;
  if (what == "traces") {
    std::vector<ViewedRun> parts;
    for (const ViewedRun& r : runs) parts.push_back({r.name, cut(r.record, o)});
    figure = traces(parts, o);
  } else if (what == "orbit") {
    figure = orbit(runs, o);
  } else if (what == "spectrum" || what == "full-spectrum") {
    figure = spectra(runs, o, what == "full-spectrum");
  } else if (what == "bode" || what == "polar") {
    figure = synchronous(what, runs, o);
  } else if (what == "orders") {
    figure = order_tracks(runs.back(), o);
  } else if (what == "phase-plane") {
    figure = phase_plane(runs, o);
  } else if (what == "funnel") {
    std::vector<ViewedRun> parts;
    for (const ViewedRun& r : runs) parts.push_back({r.name, cut(r.record, o)});
    figure = report::funnel(named(parts));
  } else if (what == "waterfall" || what == "full-waterfall" || what == "cascade" || what == "run-map") {
    figure = map_view(what, cut(runs.back().record, o), channel_of(o), o);
  } else {
    std::vector<std::string> names;
    for (const View& v : kViews) names.emplace_back(v.name);
    const std::string near = io::nearest(what, names);
    throw Error(fmt::format("--what {}: must be one of {}{}", what, fmt::join(names, ", "),
                            near.empty() ? "" : "; did you mean '" + near + "'?"));
  }
  return figure;
}

}  // namespace whirl::pages
