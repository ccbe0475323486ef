#include "damped_modes.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "work.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;

constexpr int kMostOrder = 20;
constexpr double kReturns = 0.15;  // of its half width, within which a pole comes back from order to order

StabilisationDiagram poles_of_all_orders(const FrequencyResponse& frf, const ModeOptions& options, int most) {
  PoleOptions all = options.poles;
  all.method = PoleMethod::plscf;
  all.max_damping = kHeaviestDamping;
  all.orders = {.low = 1, .high = most, .step = 1};
  all.bands = 1;
  return stabilisation_diagram(frf, all);
}

int most_order(const FrequencyResponse& frf, const PoleOptions& options) {
  const Band band = select_band(frf, options.band_low, options.band_high, LineWeighting::flat);
  return static_cast<int>(std::clamp<Index>(band.lines() / 8, 2, kMostOrder));
}

std::vector<Complex> poles_of(const StabilisationDiagram& diagram, int order) {
  std::vector<Complex> poles;
  for (const StabilisationPole& pole : diagram.poles)
    if (pole.order == order) poles.push_back(pole.pole);
  return poles;
}

constexpr double kFarOutside = 5;  // of the band's edges: poles beyond stand for nothing

/// Drops the poles that do not pay, the weakest first: the error that comes back with each is known before. Those that
/// do nothing at all go together.
void drop_idle(const Band& band, const ResidualTerms& terms, Refined& state) {
  const auto channels = static_cast<double>(band.channels());
  const double price = (2 * channels + 2) * std::log(2 * static_cast<double>(band.h.size()));
  while (!state.poles.empty() && !WorkLimit::over()) {
    const double variance = noise_variance(band, state.poles, terms, state.fit);
    std::vector<std::pair<double, Complex>> worth;
    for (Index k = 0; k < state.fit.rise.size(); ++k) {
      const Complex p = state.poles[static_cast<std::size_t>(k)];
      const bool lost = -p.real() > kHeaviestDamping * std::abs(p) || std::abs(p) > 2 * kPi * kFarOutside * band.high ||
                        std::abs(p) < 2 * kPi * band.low / kFarOutside;
      worth.emplace_back(lost ? 0 : state.fit.rise[k] / variance, p);
    }
    std::sort(worth.begin(), worth.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
    if (worth.front().first > price) return;
    Poles kept;
    for (std::size_t k = 1; k < worth.size(); ++k)
      if (worth[k].first > 0.1 * price) kept.push_back(worth[k].second);
    state = refine(band, kept, kept.size(), terms, 3);
  }
}

/// Poles that every order missed: of a grid of frequencies and dampings those that gain most with the other poles held
/// are refined with all of them, and stay where the description becomes shorter.
void add_missed(const Band& band, const ResidualTerms& terms, int iterations, std::size_t most, Refined& state) {
  constexpr int kFrequencies = 24, kTried = 3;
  constexpr double kDampings[] = {0.03, 0.1, 0.3};
  while (state.poles.size() < most && !WorkLimit::over()) {
    std::vector<std::pair<double, Complex>> trials;
    for (int i = 0; i <= kFrequencies; ++i) {
      for (const double zeta : kDampings) {
        const double f = band.low + (band.high - band.low) * i / kFrequencies;
        Poles more = state.poles;
        more.push_back(2 * kPi * std::max(f, 0.5 * band.high / kFrequencies) *
                       Complex(-zeta, std::sqrt(1 - zeta * zeta)));
        trials.emplace_back(fit_poles(band, more, terms, false).total(), more.back());
      }
    }
    std::sort(trials.begin(), trials.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
    bool added = false;
    for (int i = 0; i < kTried && !added && !WorkLimit::over(); ++i) {
      Poles more = state.poles;
      more.push_back(trials[static_cast<std::size_t>(i)].second);
      Refined next = refine(band, more, more.size(), terms, iterations);
      added = description_length(band, next, terms) < description_length(band, state, terms) - 1;
      if (added) state = std::move(next);
    }
    if (!added) return;
    drop_idle(band, terms, state);
  }
}

/// A pole of heavy damping inside may only stand for modes outside the band, which bend the lines as gently: one there
/// is taken instead where it describes them as well.
void move_outside(const Band& band, const ResidualTerms& terms, double usual_damping, Refined& state) {
  for (std::size_t k = 0; k < state.poles.size() && !WorkLimit::over(); ++k) {
    if (!inside(band, state.poles[k]) || -state.poles[k].real() < usual_damping * std::abs(state.poles[k])) continue;
    for (const double f : {1.1 * band.high, 1.6 * band.high, band.low / 1.3}) {
      Poles other = state.poles;
      other[k] = 2 * kPi * f * Complex(-0.01, 1);
      Refined trial = refine(band, other, other.size(), terms, 6);
      if (inside(band, trial.poles[k]) ||
          description_length(band, trial, terms) > description_length(band, state, terms))
        continue;
      state = std::move(trial);
      break;
    }
  }
}

/// As many residual terms as pay.
DampedFit with_fewer_terms(const Band& band, Refined state, const ResidualTerms& full, int iterations) {
  DampedFit best{std::move(state), full};
  double least = description_length(band, best.state, full);
  const ResidualTerms choices[] = {
      {.lower = full.lower, .upper = full.upper, .slope = false, .complex = full.complex},
      {.lower = full.lower, .upper = full.upper, .slope = false, .complex = false},
      {.lower = false, .upper = full.upper, .slope = false, .complex = false},
      {.lower = full.lower, .upper = false, .slope = false, .complex = false},
      {.lower = false, .upper = false, .slope = false, .complex = false},
  };
  const Poles start = best.state.poles;
  for (const ResidualTerms& terms : choices) {
    if (WorkLimit::over()) break;
    Refined fewer = refine(band, start, start.size(), terms, iterations);
    const double length = description_length(band, fewer, terms);
    if (length >= least) continue;
    least = length;
    best = {std::move(fewer), terms};
  }
  return best;
}

}  // namespace

bool shows_heavy_damping(const FrequencyResponse& frf, const ModeOptions& options) {
  constexpr int kOrders = 12, kInRow = 3;
  const int most = std::min(kOrders, most_order(frf, options.poles));
  const StabilisationDiagram diagram = poles_of_all_orders(frf, options, most);
  for (const StabilisationPole& pole : diagram.poles) {
    if (pole.damping() < 0.5 * options.poles.max_damping) continue;
    Complex at = pole.pole;
    int row = 0;
    for (int order = pole.order + 1; order <= most; ++order, ++row) {
      const std::vector<Complex> next = poles_of(diagram, order);
      const auto nearest = std::min_element(next.begin(), next.end(),
                                            [&](Complex a, Complex b) { return std::abs(a - at) < std::abs(b - at); });
      if (nearest == next.end() || std::abs(*nearest - at) > kReturns * -at.real()) break;
      at = *nearest;
    }
    if (row >= kInRow) return true;
  }
  return false;
}

std::optional<DampedFit> fit_damped(const FrequencyResponse& frf, const Band& full, const ModeOptions& options) {
  constexpr int kPatience = 5;   // orders without a shorter description
  constexpr double kPart = 0.1;  // of the work that is left
  WorkLimit work(kPart * WorkLimit::left());
  const ResidualTerms terms{options.residues.lower_residual, options.residues.upper_residual,
                            options.residues.upper_slope, options.residues.complex_residuals};
  const Band band = full.common_weight ? full : with_common_weight(full);
  const StabilisationDiagram diagram = poles_of_all_orders(frf, options, most_order(frf, options.poles));
  std::optional<Refined> best;
  double least = INFINITY;
  int idle = 0;
  for (const int order : diagram.orders) {
    if (WorkLimit::over()) return {};
    Poles start;
    for (const Complex p : poles_of(diagram, order))
      if (p.real() + band.decay < 0) start.push_back(p + band.decay);
    if (start.empty() || static_cast<int>(start.size()) > options.max_modes) continue;
    Refined state = refine(band, start, start.size(), terms, 4);
    drop_idle(band, terms, state);
    if (state.poles.empty()) continue;
    state = refine(band, state.poles, state.poles.size(), terms, options.max_iterations);
    const double length = description_length(band, state, terms);
    if (length < least - 1) {
      least = length;
      best = std::move(state);
      idle = 0;
    } else if (++idle > kPatience && static_cast<std::size_t>(order) > best->poles.size()) {
      break;
    }
  }
  if (!best) return {};
  add_missed(band, terms, options.max_iterations, static_cast<std::size_t>(options.max_modes), *best);
  move_outside(band, terms, options.poles.max_damping, *best);
  DampedFit fit = with_fewer_terms(band, std::move(*best), terms, options.max_iterations);
  drop_idle(band, fit.terms, fit.state);
  const Poles poles = fit.state.poles;
  fit.state = refine(full, poles, poles.size(), fit.terms, 2 * options.max_iterations);
  return fit;
}

}  // namespace whirl::modal
