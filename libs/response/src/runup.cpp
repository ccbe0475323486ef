#include "whirl/response/runup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "covariance_draws.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rotor/speed_profile.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;

constexpr double kStepsPerTurn = 60;
constexpr double kMostSteps = 1e6;

/// Steady whirl in one circle, and the torque it takes, are those of the isotropic part.
RotorModel isotropic_part(RotorModel r) {
  r.k1_conj = r.c_conj = 0;
  return r;
}

/// Fastest motion of a run: the rotation, or the free whirl.
double time_step(const RotorModel& rotor, double from, double to) {
  return kTwoPi / kStepsPerTurn / std::max({from, to, 1.5 * std::sqrt(std::max(rotor.k1, 0.0))});
}

void require_speeds(double from, double to) {
  require_range("from", from, 0, 1e6, "rad/s");
  require_range("to", to, 0, 1e6, "rad/s");
  if (from == to) throw Error("run-up: the two speeds are the same");
}

std::vector<double> rates_of(const RotorModel& rotor, const RunUpOptions& o) {
  const double span = o.to - o.from, natural = std::sqrt(std::max(rotor.k1, 0.0));
  double slow = o.slowest, fast = o.fastest;
  if (fast == 0) fast = span * natural / (2 * kTwoPi);
  // 2 rate / c^2: turns of phase lost while the transient decays.
  if (slow == 0) {
    slow = std::max(0.01 * rotor.c * rotor.c, span / (kMostSteps * time_step(rotor, o.from, o.to)));
    slow = std::min(slow, 0.1 * fast);
  }
  if (!(slow > 0) || !(fast > slow))
    throw Error(fmt::format("run-up: rates from {:g} to {:g} rad/s^2 do not ascend", slow, fast));
  std::vector<double> rates;
  for (int k = 0; k < o.rates; ++k) rates.push_back(slow * std::pow(fast / slow, double(k) / (o.rates - 1)));
  return rates;
}

/// Largest mean over a turn of what the whirl takes from the drive, per kg: e (F_x sin b - F_y cos b) / m of paper eq.
/// 5 with the force F of shaft and damping.
double reaction_of(const RotorModel& r, const rotor::Response& response, const AngleSignal& angle) {
  const auto turn = static_cast<Index>(kStepsPerTurn);
  double sum = 0, largest = 0;
  Eigen::VectorXd each(response.z.size());
  for (Index i = 0; i < response.z.size(); ++i) {
    const std::complex<double> z = response.z[i] - r.offset, dz = response.dz[i];
    const std::complex<double> force =
        (r.k1 + r.k2 * std::norm(z)) * z + r.k1_conj * std::conj(z) + r.c * dz + r.c_conj * std::conj(dz);
    const std::complex<double> arm = r.eps * std::polar(1.0, angle.beta[2 * i]);
    each[i] = force.real() * arm.imag() - force.imag() * arm.real();
    sum += each[i] - (i >= turn ? each[i - turn] : 0);
    if (i >= turn) largest = std::max(largest, sum / static_cast<double>(turn));
  }
  return largest;
}

/// The rate from which on no passage exceeds the limit, between the last rate that does and the next.
std::optional<double> slowest_safe(const RotorModel& rotor, double from, double to, double limit, const RateCurve& c) {
  const auto& p = c.passages;
  if (limit <= 0) return p.front().rate;
  std::size_t first = p.size();
  while (first > 0 && p[first - 1].peak <= limit) --first;
  if (first == p.size()) return std::nullopt;
  if (first == 0) return p.front().rate;
  double low = p[first - 1].rate, high = p[first].rate;
  while (high > 1.002 * low) {
    const double middle = std::sqrt(low * high);
    (passage(rotor, from, to, middle).peak <= limit ? high : low) = middle;
  }
  return high;
}

RateCurve rate_curve(const RotorModel& rotor, double from, double to, const RunUpOptions& o) {
  RateCurve curve;
  for (const double rate : rates_of(rotor, o)) curve.passages.push_back(passage(rotor, from, to, rate));
  const auto& p = curve.passages;
  curve.slow_peak = slow_run(rotor, from, to).peak;
  const RotorModel isotropic = isotropic_part(rotor);
  double ends = 0;
  for (const double omega : {from, to})
    ends = std::max(ends, seen_radius(isotropic, synchronous_answers(isotropic, omega).front()));
  double least = p.back().peak;
  for (const Passage& each : p) least = std::min(least, each.peak);
  const double floor = 1.05 * std::max(ends, least);
  for (auto each = p.rbegin(); each != p.rend() && each->peak <= floor; ++each) curve.fastest_useful = each->rate;
  for (std::size_t k = 1; k < p.size(); ++k) {
    const double slope = std::abs(std::log(p[k].peak / p[k - 1].peak) / std::log(p[k].rate / p[k - 1].rate));
    if (slope > curve.sensitivity) {
      curve.sensitivity = slope;
      curve.sensitive_rate = std::sqrt(p[k].rate * p[k - 1].rate);
    }
  }
  curve.slowest_safe = slowest_safe(rotor, from, to, o.limit, curve);
  return curve;
}

}  // namespace

SlowRun slow_run(const RotorModel& any, double from, double to, int steps) {
  require_speeds(from, to);
  const RotorModel rotor = isotropic_part(any);
  SlowRun run;
  for (int k = 0; k <= steps; ++k) {
    std::vector<SynchronousPoint> answers = synchronous_answers(rotor, from + (to - from) * k / steps);
    std::erase_if(answers, [](const SynchronousPoint& p) { return !p.stable && p.radius > 0; });
    if (answers.empty()) continue;
    const double before = run.points.empty() ? 0 : run.points.back().radius;
    const auto next = std::min_element(answers.begin(), answers.end(), [&](const auto& a, const auto& b) {
      return std::abs(a.radius - before) < std::abs(b.radius - before);
    });
    // Two points of one branch are close; a fold leaves the other branch alone.
    if (!run.points.empty() && answers.size() == 1 &&
        std::abs(next->radius - before) > 0.2 * std::max(before, next->radius))
      run.jumps.push_back(run.points.size());
    run.points.push_back(*next);
    if (const double radius = seen_radius(rotor, *next); radius > run.peak) {
      run.peak = radius;
      run.peak_speed = next->omega;
    }
  }
  if (run.points.empty()) throw Error("run-up: the rotor has no stable answer in the range");
  return run;
}

Passage passage(const RotorModel& rotor, double from, double to, double rate) {
  require_speeds(from, to);
  if (!(rate > 0)) throw Error::in_field("rate", fmt::format("{:g} rad/s^2", rate), "> 0");
  RotorModel main = rotor;
  main.modes.clear();
  rotor::SpeedProfile profile;
  profile.omega_start = from;
  profile.omega_end = to;
  profile.ramp_time = std::abs(to - from) / rate;
  const double dt = time_step(rotor, from, to);
  profile.dwell_end = rotor.c > 0 ? std::min(4 / rotor.c, 0.5 * profile.ramp_time) : 0;
  if (profile.duration() / dt > 10 * kMostSteps)
    throw Error(fmt::format("run-up: {:g} rad/s^2 is too slow to be simulated ({:.0f} s)", rate, profile.duration()));
  const AngleSignal angle = rotor::angle_signal(profile, dt);
  const rotor::Response response = rotor::simulate(rotor, angle);
  Passage p{rate};
  Index at = 0;
  p.peak = (response.z.array() - rotor.offset).abs().maxCoeff(&at);
  p.peak_speed = angle.omega[2 * at];
  // The drive feels the whirl of the main mode: what the others take is not known from their motion.
  p.reaction = reaction_of(main, rotor.modes.empty() ? response : rotor::simulate(main, angle), angle);
  if (!std::isfinite(p.peak)) throw Error("run-up: the motion diverges; the model is not stable over the range");
  return p;
}

RunUpPlan plan_run_up(const RotorModel& rotor, const RunUpOptions& o) {
  require_speeds(o.from, o.to);
  if (!(o.to > o.from)) throw Error("run-up: the range is given from the low speed to the high one");
  require_range("limit", o.limit, 0, 1, "m");
  require_range("rates", o.rates, 3, 1000);
  return {rate_curve(rotor, o.from, o.to, o), rate_curve(rotor, o.to, o.from, o)};
}

PeakBand passage_band(const RotorModel& rotor, const std::vector<double>& covariance, double from, double to,
                      double rate, int draws, unsigned seed) {
  std::vector<double> peaks;
  CovarianceDraws draw(rotor, covariance, seed);
  require_range("draws", draws, 20, 1e5);
  for (int k = 0; k < draws; ++k) peaks.push_back(passage(draw(), from, to, rate).peak);
  std::sort(peaks.begin(), peaks.end());
  const auto quantile = [&](double q) { return peaks[static_cast<std::size_t>(std::lround(q * (draws - 1)))]; };
  return {quantile(0.025), quantile(0.975)};
}

double whirl_torque(const RotorModel& rotor, double mass, const SynchronousPoint& answer) {
  return mass * rotor.c * answer.omega * answer.radius * answer.radius;
}

StallLimit stall_limit(const RotorModel& rotor, double mass, const rotor::TorqueModel& friction, double from,
                       double to) {
  rotor::TorqueModel resisting = friction;
  resisting.motor = resisting.motor_slope = 0;
  StallLimit limit;
  for (const SynchronousPoint& p : slow_run(rotor, from, to).points) {
    const double needed = whirl_torque(rotor, mass, p) - resisting.torque(p.omega);
    if (needed > limit.torque) limit = {needed, p.omega};
  }
  return limit;
}

DrivenRunUp driven_run_up(const RotorModel& rotor, double mass, double inertia, const rotor::TorqueModel& torque,
                          double from, double to, double longest) {
  require_speeds(from, to);
  for (const auto& [name, value] : {std::pair{"mass", mass}, {"inertia", inertia}, {"longest", longest}})
    if (!(value > 0)) throw Error::in_field(name, fmt::format("{:g}", value), "> 0");
  const double e = std::abs(rotor.eps);
  rotor::UnbalancedDisk disk;
  disk.mass = mass;
  disk.inertia = inertia + mass * e * e;
  disk.stiffness = mass * rotor.k1;
  disk.cubic = mass * rotor.k2;
  disk.damping_x = disk.damping_y = mass * rotor.c;
  disk.eccentricity = e;
  disk.phase = std::arg(rotor.eps);
  const rotor::WhirlState whirl = rotor::steady_whirl(isotropic_part(rotor), from);
  rotor::DiskState state{whirl.z.real(), whirl.dz.real(), whirl.z.imag(), whirl.dz.imag(), 0, from};
  const double dt = time_step(rotor, from, to);
  DrivenRunUp run;
  while (run.seconds < longest && !run.reached) {
    const Index samples = 2001;
    const rotor::DrivenResponse part = rotor::simulate_driven(disk, torque, state, dt, samples);
    for (Index k = 0; k < samples; ++k) {
      const double radius = std::abs(part.lateral.z[k]), omega = part.angle.omega[2 * k];
      if (!std::isfinite(radius)) throw Error("run-up: the motion diverges");
      if (radius > run.peak) run.peak = radius, run.peak_speed = omega;
      run.final_speed = omega;
      if (omega >= to) {
        run.reached = true;
        run.seconds += static_cast<double>(k) * dt;
        return run;
      }
    }
    const Index last = samples - 1;
    const auto z = part.lateral.z[last], dz = part.lateral.dz[last];
    state = {z.real(), dz.real(), z.imag(), dz.imag(), part.angle.beta[2 * last], part.angle.omega[2 * last]};
    run.seconds += static_cast<double>(last) * dt;
  }
  return run;
}

}  // namespace whirl::response
