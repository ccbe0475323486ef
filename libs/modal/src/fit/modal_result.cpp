#include "modal_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "residue_fit.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;

// Frequency and damping of a pole and their derivatives by Re p and Im p.
struct Parameters {
  double frequency, damping;
  Eigen::Vector2d frequency_slope, damping_slope;
};

Parameters parameters_of(Complex p, DampingModel model) {
  const double u = p.real(), v = p.imag(), size = std::abs(p);
  if (model == DampingModel::viscous) {
    return {size / (2 * kPi),
            -u / size,
            Eigen::Vector2d(u, v) / (2 * kPi * size),
            {-v * v / std::pow(size, 3), u * v / std::pow(size, 3)}};
  }
  // -p^2 = k/m (1 + i eta)
  const double stiffness = v * v - u * u, loss = -2 * u * v, root = std::sqrt(stiffness);
  return {root / (2 * kPi),
          loss / stiffness / 2,
          Eigen::Vector2d(-u, v) / (2 * kPi * root),
          {-v / stiffness + u * loss / (stiffness * stiffness), -u / stiffness - v * loss / (stiffness * stiffness)}};
}

// Damping of structures hardly ever falls as one over the frequency; what an exponential window adds does.
void warn_of_common_decay(const Band& band, ModalModel& model) {
  if (band.decay != 0 || band.leakage_free) return;
  double slowest = INFINITY, fastest = 0, low = INFINITY, high = 0;
  int inside = 0;
  for (const Mode& mode : model.modes) {
    const double f = mode.frequency.value, decay = -mode.pole.real();
    if (f < band.low || f > band.high) continue;
    slowest = std::min(slowest, decay);
    fastest = std::max(fastest, decay);
    low = std::min(low, f);
    high = std::max(high, f);
    ++inside;
  }
  if (inside < 3 || high < 3 * low || std::log(fastest / slowest) > 0.25 * std::log(high / low)) return;
  model.summary.warn(fmt::format(
      "all {} modes decay at nearly one rate, {:.3g} to {:.3g} 1/s, as behind an exponential window that the "
      "file does not state (one that ends at {:.2g} % adds {:.3g} 1/s): if there was one, the dampings are "
      "too large; state it (whirl modes --window-end-percent)",
      inside, slowest, fastest, 100 * std::exp(-slowest / band.line_width()), slowest));
}

void warn_of_modes(const Band& band, ModalModel& model) {
  for (const Mode& mode : model.modes) {
    if (mode.frequency.value < band.low || mode.frequency.value > band.high) continue;
    if (band.leakage_free) continue;
    if (band.decay == 0 && -mode.pole.real() / band.line_width() < 3) {
      model.summary.warn(
          fmt::format("mode at {:.5g} Hz still rings at the end of a record of 1/df = {:.3g} s: leakage makes its "
                      "damping too high; use an exponential window",
                      mode.frequency.value, 1 / band.line_width()));
    }
    if (2 * mode.damping.value * mode.frequency.value < band.line_width()) {
      model.summary.warn(fmt::format("mode at {:.5g} Hz is narrower than a line: its damping is limited by resolution",
                                     mode.frequency.value));
    }
  }
  for (const Mode& mode : model.modes) {
    for (const Mode& strong : model.modes) {
      if (strong.amplitude_offset != 0.0) continue;  // its distortion is known
      const double times = std::round(mode.frequency.value / strong.frequency.value);
      const double distance = std::abs(mode.frequency.value - times * strong.frequency.value);
      if ((times == 2 || times == 3) && distance < mode.damping.value * mode.frequency.value &&
          mode.residues.norm() < 0.01 * strong.residues.norm()) {
        model.summary.warn(
            fmt::format("mode at {:.5g} Hz lies at {:g} times the far stronger one at {:.5g} Hz: it may be the "
                        "distortion of a nonlinear stiffness, not a mode",
                        mode.frequency.value, times, strong.frequency.value));
        break;
      }
    }
  }
}

// Under structural damping the natural frequency is sqrt(-Re p^2), lower by the square of the damping ratio: said where
// the FRFs do not decide and it lies outside the interval.
std::string other_damping(const Band& band, const ModalModel& model) {
  double largest = 0, at = 0;
  for (const Mode& mode : model.modes) {
    const double f = mode.frequency.value, shift = mode.damping.value * mode.damping.value;
    if (f < band.low || f > band.high || shift * f < 2 * mode.frequency.sd || shift < largest) continue;
    largest = shift;
    at = f;
  }
  if (largest == 0) return {};
  return fmt::format(
      "; taken as viscous: the residues are turned as by structural damping (or by responses that lag their force), "
      "which would lower the frequencies by up to {:.2g} % (at {:.5g} Hz), beyond the intervals",
      100 * largest, at);
}

// The tied poles are no modes: the residues of those that share a mode's frequency are its own at small motion.
void add_amplitude(const Solution& solution, const ResidueFit& residues, const std::vector<std::size_t>& order,
                   ModalModel& model) {
  for (std::size_t i = 0; i < solution.ties.size(); ++i) {
    const Tie& tie = solution.ties[i];
    const std::size_t pole = order.size() + i;
    const auto mode = static_cast<std::size_t>(std::find(order.begin(), order.end(), tie.parent) - order.begin());
    model.amplitude.push_back(
        {mode, tie.decay, tie.turn, solution.poles[pole], residues.residues.row(static_cast<Index>(pole)).transpose()});
    if (tie.turn == 1) model.modes[mode].residues += model.amplitude.back().residues;
  }
  for (const AmplitudeTerm& term : model.amplitude) {
    if (term.turn != 1) continue;
    Mode& mode = model.modes[term.mode];
    const Complex part = mode.residues.dot(term.residues) / mode.residues.squaredNorm();
    mode.amplitude_offset += part * (term.pole - mode.pole);
  }
}

}  // namespace

ModalModel to_model(const FrequencyResponse& frf, const Band& band, const Solution& solution) {
  ModalModel model;
  model.damping_model = solution.terms.hysteretic ? DampingModel::hysteretic : DampingModel::viscous;
  std::vector<std::size_t> order(solution.poles.size() - solution.ties.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](auto a, auto b) { return std::abs(solution.poles[a]) < std::abs(solution.poles[b]); });
  ResidueFit residues = unpack_residues(band, solution.terms, solution.residues);
  set_errors(band, solution.residual, residues);
  for (std::size_t i : order) {
    const Complex p = solution.poles[i];
    const auto at = static_cast<Index>(i);
    Mode mode;
    mode.pole = p;
    mode.residues = residues.residues.row(at).transpose();
    const Parameters values = parameters_of(p, model.damping_model);
    mode.frequency.value = values.frequency;
    mode.damping.value = values.damping;
    double frequency_variance = 0, damping_variance = 0;
    for (const Eigen::MatrixXd& covariance : solution.covariance) {
      const Eigen::Matrix2d c = covariance.block<2, 2>(2 * at, 2 * at);
      frequency_variance = std::max(frequency_variance, values.frequency_slope.dot(c * values.frequency_slope));
      damping_variance = std::max(damping_variance, values.damping_slope.dot(c * values.damping_slope));
    }
    if (!solution.covariance.empty()) {
      mode.frequency = Estimate::from_sd(values.frequency, std::sqrt(frequency_variance));
      mode.damping = Estimate::from_sd(values.damping, std::sqrt(damping_variance));
    }
    if (!solution.local.empty()) {
      mode.offsets.resize(band.channels());
      for (Index c = 0; c < band.channels(); ++c) mode.offsets[c] = solution.local[static_cast<std::size_t>(c)][i] - p;
      mode.frequency_scatter = std::sqrt(solution.spread(at, 1)) / std::abs(p);
      mode.damping_scatter = std::sqrt(solution.spread(at, 0)) / std::abs(p);
    }
    model.modes.push_back(std::move(mode));
  }
  add_amplitude(solution, residues, order, model);
  model.frequency_scatter = solution.frequency_scatter;
  model.damping_scatter = solution.damping_scatter;
  model.lower = residues.lower;
  model.upper = residues.upper;
  model.upper_slope = residues.upper_slope;
  model.kind = frf.kind;
  model.band_low = band.low;
  model.band_high = band.high;
  model.window_decay = band.decay;
  model.reconstruction_error = residues.reconstruction_error;
  model.noise_floor = band.noise_floor;
  for (const auto& channel : frf.channels) {
    model.responses.push_back(channel.response);
    model.references.push_back(channel.reference);
  }
  warn_of_modes(band, model);
  warn_of_common_decay(band, model);
  if (!solution.converged) model.summary.warn("refinement of the poles has not converged");
  const auto inside = std::count_if(model.modes.begin(), model.modes.end(), [&](const Mode& mode) {
    return mode.frequency.value >= band.low && mode.frequency.value <= band.high;
  });
  if (inside == 0) {
    model.summary.fail(model.modes.empty()
                           ? "no mode found in the band"
                           : "no mode in the band: those listed lie outside and represent what the residuals cannot");
  }
  if (solution.correlated > 3) {
    model.summary.warn(fmt::format("the model leaves structure over about {:.0f} lines: error bars are widened for it",
                                   solution.correlated));
  }
  model.summary.residual = model.reconstruction_error;
  model.summary.trust = fmt::format(
      "{} between {:.4g} and {:.4g} Hz, reconstruction within {:.3g} %{}", counted(inside, "mode"), band.low, band.high,
      100 * model.reconstruction_error,
      model.frequency_scatter > 0
          ? fmt::format("; frequencies differ by {:.2g} % (one sd) between FRFs", 100 * model.frequency_scatter)
          : "");
  if (model.damping_model == DampingModel::hysteretic)
    model.summary.trust += "; the damping is structural (hysteretic), the ratio shown half the loss factor";
  if (solution.damping_open) model.summary.trust += other_damping(band, model);
  model.provenance.version = version();
  return model;
}

}  // namespace whirl::modal
