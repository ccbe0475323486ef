// Order-based modal analysis of a run-up.
#include "whirl/modal/order_modes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "responses.hpp"
#include "usable_record.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

/// Vectors of every order and channel on lines of equal steps in speed.
struct OrderCurves {
  VectorXd speed;                 // rad/s
  std::vector<MatrixXcd> vector;  // per order: lines x channels
};

struct Run {
  VectorXd angle, speed, rate;
  Index first = 0, count = 0;  // samples whose speed goes one way
};

// Speed and its rate from the angle: parabolas through it over a tenth of the record's turns, at most ten of them.
Run run_of(const Recording& recording) {
  const Channel* angle = nullptr;
  for (const Channel& c : recording.channels) {
    if (c.quantity == Quantity::angle) angle = &c;
  }
  if (angle == nullptr)
    throw Error(
        fmt::format("{}: no channel with the rotor's angle (beta_rad), which orders are counted by", recording.source));
  Run run{angle->samples, VectorXd::Zero(recording.size()), VectorXd::Zero(recording.size())};
  const Index n = recording.size();
  const double turns = std::abs(run.angle[n - 1] - run.angle[0]) / (2 * kPi);
  if (!(turns >= 40))
    throw Error(fmt::format("{}: {:.3g} turns of the rotor: must be 40 at least", recording.source, turns));
  const auto half =
      static_cast<Index>(std::max(4.0, static_cast<double>(n) / turns * std::clamp(0.05 * turns, 2.0, 5.0)));
  // Normal equations of a parabola on a symmetric stencil.
  double s2 = 0, s4 = 0;
  for (Index k = -half; k <= half; ++k) {
    const double t = static_cast<double>(k) * recording.dt;
    s2 += t * t;
    s4 += t * t * t * t;
  }
  const double s0 = static_cast<double>(2 * half + 1), determinant = s0 * s4 - s2 * s2;
  for (Index i = half; i + half < n; ++i) {
    double b0 = 0, b1 = 0, b2 = 0;
    for (Index k = -half; k <= half; ++k) {
      const double t = static_cast<double>(k) * recording.dt, y = run.angle[i + k] - run.angle[i];
      b0 += y;
      b1 += t * y;
      b2 += t * t * y;
    }
    run.speed[i] = b1 / s2;
    run.rate[i] = 2 * (s0 * b2 - s2 * b0) / determinant;
  }
  run.first = half;
  run.count = n - 2 * half;
  if (run.speed.segment(run.first, run.count).mean() < 0) {
    run.angle = -run.angle;
    run.speed = -run.speed;
    run.rate = -run.rate;
  }
  return run;
}

OrderCurves order_curves(const MatrixXd& y, const Run& run, double dt, int orders, const std::string& source) {
  const VectorXd speed = run.speed.segment(run.first, run.count);
  const double low = std::max(speed.minCoeff(), 0.02 * speed.maxCoeff()), high = speed.maxCoeff();
  if (!(high > 1.1 * low))
    throw Error(fmt::format("{}: the speed goes from {:.4g} to {:.4g} Hz: must change by a tenth at least", source,
                            low / (2 * kPi), high / (2 * kPi)));
  // Lines of three turns on average and no finer than the time a line lasts can tell.
  const double turns = speed.sum() * dt / (2 * kPi);
  const auto lines = static_cast<Index>(std::clamp(turns / 3, 12.0, 3000.0));
  const double step = (high - low) / static_cast<double>(lines);
  std::vector<std::vector<Index>> members(static_cast<std::size_t>(lines));
  for (Index i = 0; i < speed.size(); ++i) {
    const auto line = static_cast<Index>((speed[i] - low) / step);
    if (speed[i] >= low && line < lines) members[static_cast<std::size_t>(line)].push_back(run.first + i);
  }
  // Orders above those asked for are fitted along, so that they do not pass for noise.
  const int fitted = orders + 2;
  const Index columns = 1 + 4 * fitted;
  OrderCurves curves;
  curves.speed.resize(lines);
  curves.vector.assign(static_cast<std::size_t>(orders), MatrixXcd::Zero(lines, y.cols()));
  for (Index line = 0; line < lines; ++line) {
    const auto& at = members[static_cast<std::size_t>(line)];
    const double centre = low + (static_cast<double>(line) + 0.5) * step;
    const auto n = static_cast<Index>(at.size());
    if (n < 2 * columns)
      throw Error(fmt::format("{}: {} samples about {:.4g} Hz of speed: too few for {} orders", source, n,
                              centre / (2 * kPi), orders));
    MatrixXd a(n, columns), b(n, y.cols());
    for (Index i = 0; i < n; ++i) {
      const Index k = at[static_cast<std::size_t>(i)];
      const double off = (run.speed[k] - centre) / step;
      a(i, 0) = 1;
      for (int order = 1; order <= fitted; ++order) {
        const double c = std::cos(order * run.angle[k]), s = -std::sin(order * run.angle[k]);
        a.row(i).segment<4>(1 + 4 * (order - 1)) << c, s, off * c, off * s;
      }
      b.row(i) = y.row(k);
    }
    const Eigen::LDLT<MatrixXd> normal(MatrixXd(a.transpose() * a));
    const MatrixXd x = normal.solve(a.transpose() * b);
    curves.speed[line] = centre;
    for (int order = 0; order < orders; ++order) {
      const Index c = 1 + 4 * order;
      curves.vector[static_cast<std::size_t>(order)].row(line) =
          x.row(c).cast<Complex>() + Complex(0, 1) * x.row(c + 1).cast<Complex>();
    }
  }
  return curves;
}

constexpr double kTaper = 0.07;  // of the run at either end

// The run is cut off in the middle of motion: both ends are faded, and the speeds passed there left out of the band.
double taper_at(double part) {
  const double from_end = std::min(part, 1 - part);
  return from_end < kTaper ? 0.5 - 0.5 * std::cos(kPi * from_end / kTaper) : 1.0;
}

// Lowest and highest speed that no taper reaches.
std::pair<double, double> whole_speeds(const Run& run, const std::vector<Index>& at) {
  const auto n = static_cast<double>(at.back() - at.front());
  double slow = INFINITY, fast = 0;
  for (const Index i : at) {
    const double part = static_cast<double>(i - at.front()) / n;
    if (part < kTaper || part > 1 - kTaper) continue;
    slow = std::min(slow, run.speed[i]);
    fast = std::max(fast, run.speed[i]);
  }
  return {slow, fast};
}

// Motion and force of one order as they ran in time, one over the other in frequency: exact however fast the sweep, as
// long as the lines of speed resolve how the order changes. The force goes with this power of the speed; that of an
// unbalance has its tangential part.
FrequencyResponse response_of(const OrderCurves& curves, const Run& run, double dt, int order, int power, FrfKind kind,
                              const std::vector<std::string>& names) {
  const Index lines = curves.speed.size();
  const double low = curves.speed[0], high = curves.speed[lines - 1],
               step = (high - low) / static_cast<double>(lines - 1);
  std::vector<Index> at;  // samples within the lines
  for (Index i = run.first; i < run.first + run.count; ++i) {
    if (run.speed[i] >= low && run.speed[i] <= high) at.push_back(i);
  }
  const Index m = signal::fast_fft_length(at.back() - at.front() + 1);
  VectorXd force = VectorXd::Zero(m);
  MatrixXd motion = MatrixXd::Zero(m, static_cast<Index>(names.size()));
  const MatrixXcd& vector = curves.vector[static_cast<std::size_t>(order - 1)];
  for (const Index i : at) {
    const Index k = i - at.front();
    const double place = (run.speed[i] - low) / step;
    const Index line = std::min(lines - 2, static_cast<Index>(place));
    const Complex turned = std::polar(1.0, order * run.angle[i]);
    const double size = std::pow(run.speed[i] / high, power);
    const Complex tangential = power == 2 ? Complex(0, -run.rate[i] / (high * high)) : Complex(0);
    const double taper = taper_at(static_cast<double>(k) / static_cast<double>(at.back() - at.front()));
    force[k] = taper * ((size + tangential) * turned).real();
    const double part = place - static_cast<double>(line);
    motion.row(k) = taper * (((1 - part) * vector.row(line) + part * vector.row(line + 1)) * turned).real();
  }
  const VectorXcd below = signal::real_fft(force);
  const double df = 1 / (dt * static_cast<double>(m));
  const auto [slow, fast] = whole_speeds(run, at);
  const auto first = static_cast<Index>(std::ceil(order * slow / (2 * kPi) / df));
  const auto last = static_cast<Index>(std::floor(order * fast / (2 * kPi) / df));
  FrequencyResponse frf;
  frf.kind = kind;
  const Index count = std::max<Index>(0, last - first + 1);
  frf.frequency = VectorXd::LinSpaced(count, static_cast<double>(first), static_cast<double>(last)) * df;
  for (std::size_t c = 0; c < names.size(); ++c) {
    const VectorXcd above = signal::real_fft(motion.col(static_cast<Index>(c)).eval());
    const VectorXcd value = above.segment(first, count).cwiseQuotient(below.segment(first, count));
    // What a sweep leaves grows with the response, and the largest resonance leaves some everywhere.
    const VectorXd error = 0.01 * value.cwiseAbs().cwiseMax(0.02 * value.cwiseAbs().maxCoeff());
    frf.channels.push_back({names[c], fmt::format("{}X", order), value, {}, error.cwiseAbs2()});
  }
  return frf;
}

void join(const Mode& mode, OperationalModes& result) {
  OperationalMode found;
  found.frequency = mode.frequency;
  found.damping = mode.damping;
  found.shape = mode.residues;
  Index largest = 0;
  found.shape.cwiseAbs().maxCoeff(&largest);
  found.shape /= found.shape[largest];
  found.orders = 1;
  for (OperationalMode& other : result.modes) {
    const double apart = std::abs(other.frequency.value - found.frequency.value);
    const double width = std::min(other.damping.value, found.damping.value) * found.frequency.value;
    if (apart > std::max(0.5 * width, 3 * std::hypot(other.frequency.sd, found.frequency.sd))) continue;
    if (found.shape.size() > 1 && mac(other.shape, found.shape) < 0.8) continue;
    const auto mean = [](const Estimate& x, const Estimate& z) {
      const double wx = 1 / (x.sd * x.sd), wz = 1 / (z.sd * z.sd);
      return Estimate::from_sd((wx * x.value + wz * z.value) / (wx + wz), 1 / std::sqrt(wx + wz));
    };
    other.frequency = mean(other.frequency, found.frequency);
    other.damping = mean(other.damping, found.damping);
    ++other.orders;
    return;
  }
  result.modes.push_back(std::move(found));
}

}  // namespace

OperationalModes identify_orders(const Recording& given, const OrderOptions& options) {
  given.check();
  require_range("orders", options.orders, 1, 20);
  OperationalModes result;
  const Recording recording = usable_record(given, result.summary);
  const MatrixXd y = responses_of(recording, result);
  const Quantity quantity = recording.at(result.channels.front()).quantity;
  const FrfKind kind = quantity == Quantity::acceleration ? FrfKind::accelerance
                       : quantity == Quantity::velocity   ? FrfKind::mobility
                                                          : FrfKind::receptance;
  const Run run = run_of(recording);
  const OrderCurves curves = order_curves(y, run, recording.dt, options.orders, recording.source);
  for (int order = 1; order <= options.orders; ++order) {
    ModeOptions fit;
    fit.amplitude = false;  // no free ringing
    fit.scatter = false;    // all channels see one run
    const auto curve = [&](int power) {
      return response_of(curves, run, recording.dt, order, power, kind, result.channels);
    };
    const FrequencyResponse unbalance = curve(2);
    if (unbalance.frequency.size() < 50) continue;
    const double low = unbalance.frequency[0], high = unbalance.frequency.tail<1>()[0];
    fit.poles.band_low = std::max(options.band_low, low);
    fit.poles.band_high = options.band_high > 0 ? std::min(options.band_high, high) : high;
    if (!(fit.poles.band_high > 1.05 * fit.poles.band_low)) continue;
    ModalModel model = fit_modes(unbalance, fit);
    if (order > 1) {
      ModalModel constant = fit_modes(curve(0), fit);
      if (constant.reconstruction_error < model.reconstruction_error) model = std::move(constant);
    }
    for (const Mode& mode : model.modes) {
      if (mode.frequency.value < fit.poles.band_low || mode.frequency.value > fit.poles.band_high) continue;
      join(mode, result);
    }
  }
  std::sort(result.modes.begin(), result.modes.end(),
            [](const auto& a, const auto& b) { return a.frequency.value < b.frequency.value; });
  if (result.modes.empty()) result.summary.fail("no order passes a mode");
  result.summary.trust =
      fmt::format("{} from {} over {:.4g} to {:.4g} Hz of speed", counted(result.modes.size(), "mode"),
                  counted(options.orders, "order"), curves.speed[0] / (2 * kPi), curves.speed.tail<1>()[0] / (2 * kPi));
  return result;
}

}  // namespace whirl::modal
