#include "whirl/identify/rotor_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problem/one_axis.hpp"
#include "problem/record_noise.hpp"
#include "rules/rules.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/motion_quantity.hpp"

namespace whirl::identification {
namespace {

double standard_deviation(const Eigen::VectorXd& v) { return std::sqrt((v.array() - v.mean()).square().mean()); }

void check_contents(RotorRecord& r, const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  Summary& s = r.summary;
  if (r.size() < 1000) s.fail(fmt::format("the record has {} samples; at least 1000 are needed", r.size()));
  if (r.turns() < 5)
    s.fail(fmt::format("the rotor turns {:.2g} times in the record; at least 5 turns are needed", r.turns()));
  const double sx = standard_deviation(x), sy = standard_deviation(y);
  for (const auto& [name, sd, noise, axis] :
       {std::tuple("x", sx, r.noise_x, Axes::x), std::tuple("y", sy, r.noise_y, Axes::y)}) {
    if (r.one_axis() && r.axes != axis) continue;
    if (sd <= 1e-12) {
      s.fail(fmt::format(
          "channel {} is constant: the sensor sees no motion; leave the channel out to identify from the other alone",
          name));
    } else if (sd * sd < rules::kMostlyNoise * noise * noise) {
      s.fail(fmt::format("channel {0} is mostly noise: rms {1:.3g} {3}, noise {2:.3g} {3}", name, sd, noise,
                         si_unit(r.quantity)));
    }
  }
  if (!r.one_axis() && sx > 1e-12 && sy > 1e-12) {
    const double correlation = ((x.array() - x.mean()) * (y.array() - y.mean())).mean() / (sx * sy);
    if (std::abs(correlation) > rules::kSameSignal)
      s.fail("channels x and y carry the same signal: both directions are needed");
  }
  if (r.speed_high() - r.speed_low() < rules::kSpeedRange * r.speed_high()) {
    s.fail(fmt::format("the speed stays between {:.1f} and {:.1f} Hz: a run-up or run-down is needed",
                       r.speed_low() / kTwoPi, r.speed_high() / kTwoPi));
  }
  const double per_turn = kTwoPi / (r.speed_high() * r.dt);
  if (per_turn < 8) {
    s.fail(fmt::format("{:.1f} samples per turn at the top speed; at least 8 are needed", per_turn));
  }
}

/// The one quantity of the axes that are measured.
Quantity measured_quantity(const Recording& recording, const RotorRecordOptions& options, const RotorRecord& r) {
  std::optional<Quantity> first;
  for (const std::string& name : {options.x, options.y}) {
    if (r.one_axis() && !recording.has(name)) continue;
    const Quantity quantity = recording.at(name).quantity;
    const bool motion = signal::integrations(quantity, Quantity::displacement).has_value();
    if (!motion || (!options.any_motion && quantity != Quantity::displacement)) {
      throw Error::in_field(fmt::format("channel {}", name), to_string(quantity),
                            motion ? std::string("displacement of the shaft: this method takes nothing else")
                                   : fmt::format("displacement: name the column {0}_mm or {0}_um", name));
    }
    if (first && *first != quantity) {
      throw Error::in_field(
          fmt::format("channel {}", name), to_string(quantity),
          fmt::format("{}, as {} is: both directions read one quantity", to_string(*first), options.x));
    }
    first = quantity;
  }
  return *first;
}

}  // namespace

double RotorRecord::turns() const {
  return angle.beta.size() ? (angle.beta.maxCoeff() - angle.beta.minCoeff()) / kTwoPi : 0.0;
}
double RotorRecord::speed_low() const { return angle.omega.size() ? angle.omega.cwiseAbs().minCoeff() : 0.0; }
double RotorRecord::speed_high() const { return angle.omega.size() ? angle.omega.cwiseAbs().maxCoeff() : 0.0; }

double RotorRecord::noise_gain(double omega) const {
  if (colour.size() == 0) return 1;
  std::complex<double> s = 1;
  for (Eigen::Index k = 0; k < colour.size(); ++k)
    s -= colour[k] * std::polar(1.0, -omega * dt * static_cast<double>(k + 1));
  return 1 / std::norm(s);
}

double RotorRecord::noise_power() const {
  if (colour.size() == 0) return 1;
  constexpr int kLines = 1024;
  double sum = 0;
  for (int k = 0; k < kLines; ++k) sum += noise_gain(0.5 * kTwoPi / dt * (k + 0.5) / kLines);
  return sum / kLines;
}

double RotorRecord::noise_sd() const {
  return one_axis() ? (axes == Axes::x ? noise_x : noise_y) : std::sqrt(0.5 * noise_variance());
}

RotorRecord rotor_record(const Recording& recording, const RotorRecordOptions& options) {
  RotorRecord r;
  r.axes = detail::measured_axes(recording, options, r.summary);
  records::RecordReport report;
  if (options.check) {
    records::CheckOptions what;
    what.x = options.x;
    what.y = options.y;
    what.angle = options.angle;
    report = records::check(recording, what);
  } else {
    recording.check();
  }
  r.source = recording.source;
  r.dt = recording.dt;
  r.t0 = recording.t0;
  r.quantity = measured_quantity(recording, options, r);
  r.z.setZero(recording.size());
  if (r.axes != Axes::y) r.z.real() = recording[options.x];
  if (r.axes != Axes::x) r.z.imag() = recording[options.y];
  if (r.size() < 16)
    throw Error(fmt::format("{}{} samples: at least 16 are needed",
                            recording.source.empty() ? "" : recording.source + ": ", r.size()));
  if (options.known_angle) {
    r.angle = *options.known_angle;
    if (r.angle.samples() != r.size()) {
      throw Error::in_field("known_angle", fmt::format("{} samples", r.angle.samples()),
                            fmt::format("as long as the record, {} samples", r.size()));
    }
  } else {
    const Channel& channel = recording.at(options.angle);
    if (channel.quantity != Quantity::angle) {
      throw Error::in_field(
          fmt::format("channel {}", options.angle), to_string(channel.quantity),
          fmt::format("angle: name the column {0}_rad, {0}_deg or {0}_rev; a speed is no angle", options.angle));
    }
    const signal::AngleFit fit = signal::angle_from_encoder(channel.samples, recording.dt, options.angle_fit);
    r.angle = fit.angle;
    if (options.angle_fit.count_offset == 0) r.angle_step = fit.resolution;
    r.summary.take(fit.summary);
  }
  if (options.sensor_delay != 0) {
    const double d = options.sensor_delay;
    require_range("sensor_delay", d, -0.1, 0.1, "s");
    r.angle.beta -= d * r.angle.omega - (0.5 * d * d) * r.angle.alpha;
    r.angle.omega -= d * r.angle.alpha;
  }
  detail::take_findings(report, options, r);
  detail::measure_noise(options, r);
  detail::fill_unseen_axis(r);
  check_contents(r, r.z.real(), r.z.imag());
  return r;
}

}  // namespace whirl::identification
