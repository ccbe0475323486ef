#include "whirl/pages/record_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "record/record_maps.hpp"
#include "record/record_orbit.hpp"
#include "record/record_part.hpp"
#include "record/run_line.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/passages.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/diagnosis/vibration.hpp"
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
  return report::time_traces(named(runs), channels, {}, o.scale);
}

/// Spectra of the channels of one quantity.
struct QuantitySpectra {
  Quantity quantity;
  std::vector<report::SpectrumCurve> curves;
};

/// Lines up to the highest frequency. The mean is left out: it is a position or an offset, no vibration.
report::SpectrumCurve lines_of(std::string name, const signal::AmplitudeSpectrum& a, double highest) {
  std::vector<Index> kept;
  for (Index i = 0; i < a.frequency.size(); ++i) {
    if (a.frequency[i] != 0 && std::abs(a.frequency[i]) <= highest) kept.push_back(i);
  }
  return {std::move(name), a.frequency(kept), a.amplitude(kept)};
}

std::vector<std::pair<std::string, double>> order_marks(const Recording& record) {
  const auto turning = readable_rotation(record);
  if (!turning) return {};
  const double mean = turning->speed.mean();
  if (turning->speed.maxCoeff() - turning->speed.minCoeff() >= 0.02 * mean) return {};
  return {{"1X", mean / kTwoPi}, {"2X", 2 * mean / kTwoPi}};
}

Figure spectra(const std::vector<ViewedRun>& runs, const ViewOptions& o, bool full) {
  signal::SpectrumOptions s;
  s.window = o.window.value_or(signal::Window::hann);
  s.kind = o.scale.kind;
  double line = 0;
  std::vector<std::string> channels = channels_of(o, runs.front().record);
  if (full || runs.size() > 1) channels.resize(1);
  std::vector<QuantitySpectra> groups;
  for (const ViewedRun& run : runs) {
    const Recording r = in_asked_quantity(cut(run.record, o), o);
    const double highest = o.highest_frequency > 0 ? o.highest_frequency : 0.5 * r.rate();
    s.block = o.resolution > 0 ? std::min<Index>(r.size(), std::lround(r.rate() / o.resolution)) : 0;
    for (const std::string& channel : channels) {
      const auto centred = [&](const std::string& name) -> VectorXd { return r[name].array() - r[name].mean(); };
      const std::string read = full ? "x" : channel;
      const signal::AmplitudeSpectrum a = full ? signal::full_spectrum(centred("x"), centred("y"), r.dt, s)
                                               : signal::amplitude_spectrum(centred(channel), r.dt, s);
      line = a.noise_bandwidth;
      const Quantity quantity = r.at(read).quantity;
      auto group = std::ranges::find(groups, quantity, &QuantitySpectra::quantity);
      if (group == groups.end()) group = groups.insert(group, {quantity, {}});
      group->curves.push_back(lines_of(runs.size() > 1 ? run.name : full ? "" : channel, a, highest));
    }
  }
  const auto marks = order_marks(cut(runs.back().record, o));
  Figure figure;
  for (const QuantitySpectra& g : groups) {
    Figure one = full ? report::full_spectrum(g.curves, o.scale, g.quantity)
                      : report::spectrum(g.curves, o.scale, g.quantity, marks);
    if (figure.panels.empty()) {
      figure = std::move(one);
    } else {
      figure.panels.push_back(std::move(one.panels.front()));
    }
  }
  if (full) {
    for (const auto& [name, f] : marks) {
      figure.panels.front().vertical(f, "+" + name);
      figure.panels.front().vertical(-f, "−" + name);
    }
  }
  figure.panels.front().title =
      fmt::format("{} window, noise bandwidth {:.3g} Hz, without the mean", window_name(s.window), line);
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
  const std::string channel = channels_of(o, r).front();
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
  Quantity quantity = r.at(channel).quantity;
  if (const auto times = o.scale.unit ? signal::integrations(quantity, o.scale.unit->first) : std::nullopt) {
    for (std::size_t k = 0; k < o.orders.size(); ++k) {
      for (Index i = 0; i < envelope.rows(); ++i)
        envelope(i, static_cast<Index>(k)) *=
            std::pow(std::complex<double>(0, o.orders[k] * turning.speed[i]), -*times);
    }
    quantity = o.scale.unit->first;
  }
  Figure figure = report::order_tracks(time, turning.speed, o.orders, envelope, quantity, o.phase, o.scale);
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
    std::vector<std::string> channels = channels_of(o, r);
    if (runs.size() > 1) channels.resize(1);
    for (const std::string& channel : channels) {
      curves.push_back(diagnosis::shown_curve(r, turning, channel, order, o.turns, o.slow_roll));
      if (runs.size() > 1) curves.back().name = run.name;
    }
  }
  return synchronous_view(what, std::move(curves), o.phase, o.scale);
}

Figure phase_plane(const std::vector<ViewedRun>& runs, const ViewOptions& o) {
  const Recording& r = runs.back().record;
  const double begin = std::max(o.begin, r.t0), end = std::min(o.end, r.t0 + r.duration());
  return report::phase_plane(named(runs), channels_of(o, r).front(),
                             {{fmt::format("{:g} to {:g} s", begin, end), begin, end}}, o.scale);
}

}  // namespace

std::span<const View> views() { return kViews; }

std::vector<ViewedRun> viewed_runs(const Recording& record, const std::string& name) {
  if (!record.has("x_open") || !record.has("x_true")) {
    CleanRecord clean = without_bad_samples(record);
    return {{name, std::move(clean.record), std::move(clean.left_out)}};
  }
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

std::pair<Quantity, report::Unit> motion_unit(const std::string& suffix) {
  const io::UnitSuffix* unit = io::find_unit(suffix);
  if (unit == nullptr || !signal::integrations(unit->quantity, unit->quantity))
    throw Error::in_field(
        "--unit", suffix,
        fmt::format("{}, {} or {}", io::allowed_units(Quantity::displacement), io::allowed_units(Quantity::velocity),
                    io::allowed_units(Quantity::acceleration)));
  std::string symbol;
  for (const char c : suffix) symbol += c == '_' ? std::string("/") : c == '2' ? std::string("²") : std::string(1, c);
  return {unit->quantity, {suffix == "um" ? "µm" : symbol, unit->to_si(1)}};
}

Figure synchronous_view(const std::string& what, std::vector<signal::SynchronousCurve> curves, report::Phase phase,
                        const report::AmplitudeScale& scale) {
  if (scale.unit) {
    for (signal::SynchronousCurve& c : curves) c = signal::in_quantity(std::move(c), scale.unit->first);
  }
  if (what == "polar" || what == "nyquist") {
    Figure plane = what == "polar" ? report::polar_1x(curves, phase, scale) : report::nyquist_1x(curves, scale);
    // The angle of a vector counts from the probe that measured it, wherever that stands.
    plane.panels.front().probes = {{0, "probe"}};
    plane.panels.front().rotation = true;
    return plane;
  }
  Figure figure = report::bode_1x(curves, phase, scale);
  // The closed loop or the last of several runs is judged by its reader; the first one is the machine as it is.
  const std::vector<diagnosis::Passage> found = diagnosis::passages(curves.front());
  std::string list;
  VectorXd x(static_cast<Index>(found.size())), y(x.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    x[static_cast<Index>(k)] = found[k].speed;
    y[static_cast<Index>(k)] = signal::factor_from_peak(scale.kind) * found[k].amplitude;
    list += fmt::format("{}{:.0f}", k ? ", " : "", found[k].speed / kRadPerSecPerRpm);
  }
  if (x.size() > 0)
    figure.panels.front().scatter("passage of a critical speed, peak at " + list + " rpm", x, y, {.color = 6});
  return figure;
}

namespace {

/// Vectors of turns leave out those with missing readings; everything else has straight lines there.
std::vector<ViewedRun> whole_runs(std::vector<ViewedRun> runs) {
  for (ViewedRun& run : runs) run.record = with_straight_lines(std::move(run.record));
  return runs;
}

bool has_gaps(const std::vector<ViewedRun>& runs) {
  return std::ranges::any_of(runs, [](const ViewedRun& run) {
    return std::ranges::any_of(run.record.channels, [](const Channel& c) { return c.samples.hasNaN(); });
  });
}

}  // namespace

Figure view(const std::string& what, const std::vector<ViewedRun>& runs, const ViewOptions& o) {
  if (runs.empty()) throw Error("figure: no run given");
  if (what != "bode" && what != "polar" && what != "nyquist" && has_gaps(runs)) return view(what, whole_runs(runs), o);
  Figure figure;
  const bool vectors = what == "bode" || what == "polar" || what == "nyquist" || what == "orders";
  const auto parts = [&] {
    std::vector<ViewedRun> out;
    for (const ViewedRun& r : runs) out.push_back({r.name, in_asked_quantity(cut(r.record, o), o)});
    return out;
  };
  if (what == "traces") {
    figure = traces(parts(), o);
  } else if (what == "orbit") {
    std::vector<ViewedRun> converted;
    for (const ViewedRun& r : runs) converted.push_back({r.name, in_asked_quantity(r.record, o)});
    figure = orbit(converted, o);
  } else if (what == "spectrum" || what == "full-spectrum") {
    figure = spectra(runs, o, what == "full-spectrum");
  } else if (what == "centreline") {
    if (o.scale.unit && o.scale.unit->first != runs.back().record.at("x").quantity)
      throw Error(fmt::format("centreline: a mean position has the quantity of its probe, {}; it is not integrated",
                              to_string(runs.back().record.at("x").quantity)));
    figure = centreline(runs, o);
  } else if (what == "bode" || what == "polar" || what == "nyquist") {
    figure = synchronous(what, runs, o);
  } else if (what == "orders") {
    figure = order_tracks(runs.back(), o);
  } else if (what == "phase-plane") {
    figure = phase_plane(parts(), o);
  } else if (what == "funnel") {
    figure = report::funnel(named(parts()), o.scale);
  } else if (what == "waterfall" || what == "full-waterfall" || what == "cascade" || what == "run-map") {
    const Recording r = in_asked_quantity(cut(runs.back().record, o), o);
    figure = map_view(what, r, channels_of(o, r).front(), o);
  } else {
    std::vector<std::string> names;
    for (const View& v : kViews) names.emplace_back(v.name);
    const std::string near = io::nearest(what, names);
    throw Error(fmt::format("--what {}: must be one of {}{}", what, fmt::join(names, ", "),
                            near.empty() ? "" : "; did you mean '" + near + "'?"));
  }
  const bool one = what == "orders" || what == "phase-plane" || what.ends_with("waterfall") || what == "cascade" ||
                   what == "run-map";  // of the last run
  for (std::size_t i = one ? runs.size() - 1 : 0; i < runs.size(); ++i) {
    figure.runs.push_back(run_line(runs[i], o));
    for (const std::string& said : runs[i].left_out) figure.runs.push_back(said);
    for (const std::string& name : vectors ? std::vector<std::string>{} : channels_of(o, runs[i].record)) {
      const Channel* channel = runs[i].record.find(name);
      const std::string said = channel != nullptr ? integration_text(*channel, o) : "";
      if (!said.empty()) figure.runs.push_back(said);
    }
  }
  return figure;
}

}  // namespace whirl::pages
