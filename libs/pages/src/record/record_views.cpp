#include "whirl/pages/record_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "record/record_maps.hpp"
#include "record/record_orbit.hpp"
#include "record/record_part.hpp"
#include "run_line.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/passages.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/diagnosis/vibration_findings.hpp"
#include "whirl/io/units.hpp"
#include "whirl/signal/order.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using report::Figure;
using report::NamedRun;
constexpr double kReach = 1.25;  // bandwidths from the middle of a Vold-Kalman filter to where it lets little through

constexpr View kViews[] = {
    {"traces", "channels over time"},
    {"orbit",
     "path of the disk centre, raw and 1X, with a dot where the angle is zero; without --from and --to the turns "
     "around the largest radius"},
    {"centreline", "mean position of the shaft over each turn (shaft centreline)"},
    {"spectrum", "one-sided amplitude spectrum"},
    {"full-spectrum", "spectrum of x + i y: forward whirl at positive, backward whirl at negative frequency"},
    {"waterfall", "spectra over time as a colour map, with the 1X and 2X lines"},
    {"full-waterfall", "full spectra over time"},
    {"cascade", "spectra one behind the other at their rotor speeds"},
    {"run-map", "spectra over rotor speed as a colour map (Campbell style)"},
    {"bode", "amplitude and phase of the 1X vector against rotor speed"},
    {"polar", "the 1X vector in its plane"},
    {"nyquist", "real against imaginary part of the 1X vector"},
    {"orders", "amplitude and phase of orders followed through the run (Vold-Kalman)"},
    {"phase-plane", "displacement against velocity"},
    {"funnel", "path of the disk centre over time"},
};

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
      marks = {{"1X", mean / kTwoPi}, {"2X", 2 * mean / kTwoPi}};
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

// No amplitude where the free vibration after a passage lies in the filter of an order: it is not the order's.
Index hide_ringing(Eigen::MatrixXcd& envelope, const std::vector<double>& orders, double bandwidth, const Recording& r,
                   const diagnosis::Rotation& turning, const std::string& channel) {
  Index hidden = 0;
  const signal::SynchronousCurve curve = diagnosis::order_curve(r, turning, channel);
  for (const diagnosis::Passage& p : diagnosis::passages(curve)) {
    for (std::size_t k = 0; k < orders.size(); ++k) {
      VectorXd usual = envelope.col(static_cast<Index>(k)).cwiseAbs();
      std::nth_element(usual.begin(), usual.begin() + usual.size() / 2, usual.end());
      // The beats of 1X are shown as in the Bode plot; a small ringing does not matter.
      if (orders[k] == 1 || p.amplitude < 5 * usual[usual.size() / 2]) continue;
      for (auto i = static_cast<Index>(std::lround(curve.time[p.at] / r.dt)); i < turning.size(); ++i) {
        if (std::abs(orders[k] * turning.speed[i] - p.ringing) > kReach * kTwoPi * bandwidth) continue;
        envelope(i, static_cast<Index>(k)) = NAN;
        ++hidden;
      }
    }
  }
  return hidden;
}

// One channel with whatever tells the angle.
Recording only(const Recording& r, const std::string& channel) {
  Recording out = r;
  std::erase_if(out.channels, [&](const Channel& c) {
    const bool motion = c.quantity == Quantity::displacement || c.quantity == Quantity::velocity ||
                        c.quantity == Quantity::acceleration;
    return motion && c.name != channel;
  });
  return out;
}

Figure order_tracks(const ViewedRun& run, const ViewOptions& o) {
  const Recording r = cut(run.record, o);
  const diagnosis::Rotation turning = required_rotation(r);
  const std::string& channel = channel_of(o);
  // A quarter of the distance of two orders, so that they are told apart; 1X not slower than a passage.
  const auto chosen = [&](double least) {
    return o.bandwidth > 0 ? o.bandwidth
                           : std::clamp(std::max(0.25 * turning.speed.mean() / kTwoPi, least), 0.5, 0.05 / r.dt);
  };
  const double narrow = chosen(0), wide = chosen(4 * std::sqrt(turning.sweep_rate(r.dt) / kTwoPi));
  // An electric line in the filter of an order is not the order's.
  VectorXd samples = r[channel];
  std::string taken;
  for (const diagnosis::ElectricLine& line : diagnosis::find_vibration(only(r, channel)).electric) {
    samples = line.taken_off(samples, r.dt);
    taken += fmt::format("; electric line of {:.2f} Hz taken off", line.frequency);
  }
  const VectorXd part = samples.segment(turning.first, turning.size());
  Eigen::MatrixXcd envelope = signal::track_orders(part, turning.angle, r.dt, o.orders, {.bandwidth = narrow});
  if (wide > narrow) {
    const Eigen::MatrixXcd quick = signal::track_orders(part, turning.angle, r.dt, o.orders, {.bandwidth = wide});
    for (std::size_t k = 0; k < o.orders.size(); ++k) {
      if (o.orders[k] == 1) envelope.col(static_cast<Index>(k)) = quick.col(static_cast<Index>(k));
    }
  }
  const Index hidden = hide_ringing(envelope, o.orders, narrow, r, turning, channel);
  const VectorXd time = VectorXd::LinSpaced(part.size(), r.t0 + r.dt * static_cast<double>(turning.first),
                                            r.t0 + r.dt * static_cast<double>(turning.first + part.size() - 1));
  Figure figure = report::order_tracks(time, turning.speed, o.orders, envelope, r.at(channel).quantity, o.phase);
  figure.panels.front().title = fmt::format("{}, {}: Vold-Kalman, two poles, {:.3g} Hz{}{}", run.name, channel, narrow,
                                            wide > narrow ? fmt::format(" (1X {:.3g} Hz)", wide) : "",
                                            hidden > 0 ? "; gaps: free vibration crosses the order" : "") +
                                taken;
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
  Figure figure = synchronous_view(what, curves, o.phase);
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

Figure synchronous_view(const std::string& what, const std::vector<signal::SynchronousCurve>& curves,
                        report::Phase phase) {
  if (what == "polar" || what == "nyquist") {
    Figure plane = what == "polar" ? report::polar_1x(curves, phase) : report::nyquist_1x(curves);
    // The angle of a vector counts from the probe that measured it, wherever that stands.
    plane.panels.front().probes = {{0, "probe"}};
    plane.panels.front().rotation = true;
    return plane;
  }
  Figure figure = report::bode_1x(curves, phase);
  // The closed loop or the last of several runs is judged by its reader; the first one is the machine as it is.
  const std::vector<diagnosis::Passage> found = diagnosis::passages(curves.front());
  std::string list;
  VectorXd x(static_cast<Index>(found.size())), y(x.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    x[static_cast<Index>(k)] = found[k].speed;
    y[static_cast<Index>(k)] = found[k].amplitude;
    list += fmt::format("{}{:.0f}", k ? ", " : "", found[k].speed / kRadPerSecPerRpm);
  }
  if (x.size() > 0)
    figure.panels.front().scatter("passage of a critical speed, peak at " + list + " rpm", x, y, {.color = 6});
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
  } else if (what == "centreline") {
    figure = centreline(runs, o);
  } else if (what == "bode" || what == "polar" || what == "nyquist") {
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
  const bool one = what == "orders" || what == "phase-plane" || what.ends_with("waterfall") || what == "cascade" ||
                   what == "run-map";  // of the last run
  for (std::size_t i = one ? runs.size() - 1 : 0; i < runs.size(); ++i) figure.runs.push_back(run_line(runs[i], o));
  return figure;
}

}  // namespace whirl::pages
