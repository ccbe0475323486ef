#include "whirl/modal/residues.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "pole_fit.hpp"
#include "residue_fit.hpp"
#include "whirl/core/error.hpp"

namespace whirl::modal {

using Complex = std::complex<double>;

ResidueFit unpack_residues(const Band& band, const ResidualTerms& terms, const Eigen::MatrixXd& parameters) {
  const Eigen::Index n = (parameters.rows() - terms.count()) / 2;
  ResidueFit result;
  result.residues.resize(n, band.channels());
  for (Eigen::Index k = 0; k < n; ++k) {
    result.residues.row(k).real() = parameters.row(2 * k);
    result.residues.row(k).imag() = parameters.row(2 * k + 1);
  }
  // The columns were written in w / top, see Columns.
  const double top2 = std::pow(band.omega[band.lines() - 1], 2);
  Eigen::Index row = 2 * n;
  result.lower = result.upper = result.upper_slope = Eigen::VectorXcd::Zero(band.channels());
  const auto take = [&](bool present, double scale, Eigen::VectorXcd& term) {
    if (!present) return;
    term.real() = scale * parameters.row(row++).transpose();
    if (terms.complex) term.imag() = scale * parameters.row(row++).transpose();
  };
  take(terms.lower, top2, result.lower);
  take(terms.upper, 1, result.upper);
  take(terms.slope, 1 / top2, result.upper_slope);
  return result;
}

void set_errors(const Band& band, const Eigen::MatrixXcd& residual, ResidueFit& result) {
  result.channel_error = residual.colwise().norm().cwiseQuotient(band.h.colwise().norm()).transpose();
  result.reconstruction_error = residual.norm() / band.h.norm();
}

ResidueFit fit_residues(const FrequencyResponse& frf, const std::vector<Complex>& poles,
                        const ResidueOptions& options) {
  const Band band = select_band(frf, options.band_low, options.band_high, options.weighting);
  for (const Complex pole : poles) {
    if (!(pole.real() < 0) || !(pole.imag() > 0) || !std::isfinite(std::abs(pole))) {
      throw Error(fmt::format("pole {:g}{:+g}j rad/s: must have a negative real and a positive imaginary part",
                              pole.real(), pole.imag()));
    }
  }
  const ResidualTerms terms{options.lower_residual, options.upper_residual, options.upper_slope,
                            options.complex_residuals};
  if (2 * band.lines() < 2 * static_cast<Eigen::Index>(poles.size()) + terms.count()) {
    throw Error(fmt::format("{} poles on {} lines: too few lines", poles.size(), band.lines()));
  }
  const PoleFit fit = fit_poles(band, poles, terms, false);
  ResidueFit result = unpack_residues(band, terms, fit.residues);
  set_errors(band, residual_of(band, poles, terms, fit), result);
  return result;
}

Eigen::VectorXcd synthesise(const ModalModel& model, Eigen::Index channel,
                            const Eigen::Ref<const Eigen::VectorXd>& frequency, FrfKind kind, double window_decay) {
  if (channel < 0 || channel >= model.lower.size()) {
    throw Error(fmt::format("channel {} of a modal model: must be between 0 and {}", channel, model.lower.size() - 1));
  }
  Eigen::VectorXcd h(frequency.size());
  for (Eigen::Index i = 0; i < frequency.size(); ++i) {
    const Complex s(window_decay, 2 * std::numbers::pi * frequency[i]);
    Complex sum = model.upper[channel];
    if (s != Complex(0)) sum += model.lower[channel] / (s * s);
    if (model.upper_slope.size() > 0) sum += model.upper_slope[channel] * s * s;
    for (const Mode& mode : model.modes) {
      const Complex a = mode.residues[channel];
      const Complex p = mode.offsets.size() > channel ? mode.pole + mode.offsets[channel] : mode.pole;
      sum += model.damping_model == DampingModel::hysteretic ? a / (s - p) - a / (s + p)
                                                             : a / (s - p) + std::conj(a) / (s - std::conj(p));
    }
    for (const AmplitudeTerm& term : model.amplitude) {
      const Complex a = term.residues[channel], p = term.pole;
      sum += a / (s - p) + std::conj(a) / (s - std::conj(p));
      if (term.turn != 1) continue;
      const Complex small = model.modes[term.mode].pole;
      sum -= a / (s - small) + std::conj(a) / (s - std::conj(small));
    }
    h[i] = sum * std::pow(s, static_cast<int>(kind));
  }
  return h;
}

}  // namespace whirl::modal
