#include "whirl/modal/fit_modes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "amplitude.hpp"
#include "damped_modes.hpp"
#include "damping_evidence.hpp"
#include "fit/scatter/scatter_evidence.hpp"
#include "modal_result.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/modal/hann_window.hpp"
#include "work.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;

// Poles outside the band, where residual terms alone leave structure of modes that are not in it: as many as the
// evidence holds.
void add_residual_modes(const Band& band, Refined& state, const ResidualTerms& terms, const ModeOptions& options) {
  if (state.fit.total() / freedom(band, state.poles, terms) <= least_variance(band)) return;
  for (const double times : {1.1, 1.4, 2.0, 3.0}) {
    if (WorkLimit::over()) return;
    const double f = times * band.high;
    Poles more = state.poles;
    more.insert(more.begin() + static_cast<std::ptrdiff_t>(state.started), 2 * kPi * f * Complex(-0.01, 1));
    // Where it stands nearly right it gains most of what it can: without any sign of that, it is not refined.
    const double needed = std::log(2.0 * static_cast<double>(band.h.size())) * 2 * static_cast<double>(band.channels());
    const double gain = state.fit.total() - fit_poles(band, more, terms, false).total();
    if (gain < 0.2 * needed * noise_variance(band, state.poles, terms, state.fit)) continue;
    Refined next = refine(band, more, state.started + 1, terms, options.max_iterations);
    const Complex added = next.poles[state.started];
    // One that ran into the band with the damping of no mode takes the place of what is not modelled there.
    const auto wild = [&](Complex p) { return inside(band, p) && -p.real() > options.poles.max_damping * std::abs(p); };
    if (inside(band, added) || !(std::abs(added) / (2 * kPi) < 5 * band.high) ||
        std::any_of(next.poles.begin(), next.poles.end(), wild))
      continue;
    if (description_length(band, next, terms, state.correlated) <
        description_length(band, state, terms, state.correlated))
      state = std::move(next);
  }
}

constexpr double kStructured = 1.5;  // lines that hang together: more than chance

// A pole costs two parameters per channel and two of its own, each half the logarithm of the data: a tenth above that,
// it is taken. Few data say little of what chance and small model errors can do.
double least_gain(const Band& band) {
  if (band.guessed_weight && !band.common_weight) return 25;  // the noise itself is only guessed
  const auto channels = static_cast<double>(band.channels());
  return std::clamp(1.1 * std::log(2.0 * static_cast<double>(band.h.size())) * (1 + 1 / channels), 14.0, 25.0);
}

// Where nothing but noise is left, poles too weak to pay by description length but above what noise does by chance. Not
// where the blows' own scatter is known: that may be drift, which single poles of the FRFs stand for.
Refined with_weak_poles(const Band& band, const Refined& state, const ResidualTerms& terms,
                        const ModeOptions& options) {
  ModeOptions weak = options;
  weak.search_gain = chance_gain(independent_channels(band, state.residual));
  if (!options.search || band.noise_floor > 0 || !state.ties.empty() || state.poles.empty() ||
      state.correlated > kStructured || weak.search_gain >= options.search_gain ||
      (band.guessed_weight && !band.common_weight))
    return state;
  Refined more = fit_white(band, Band{}, state.poles, terms, weak);
  more.started = std::min(state.started, more.poles.size());
  return more.correlated > kStructured ? state : more;
}

Solution solution_of(const Band& band, const Refined& state, const ResidualTerms& terms, bool refined) {
  Solution solution{state.poles,      state.fit.residues, state.residual, {}, state.ties,
                    state.correlated, state.converged,    terms,          {}, {}};
  if (refined && !state.poles.empty()) {
    solution.covariance.push_back(covariance_of(band, state, terms, state.correlated));
    if (noise_variance(band, state.poles, terms, state.fit) > least_variance(band))
      solution.covariance.push_back(line_covariance(band, state, terms, state.correlated));
    if (state.truncation.size() > 0) {
      for (Eigen::MatrixXd& covariance : solution.covariance) covariance.diagonal() += state.truncation.cwiseAbs2();
    }
  }
  return solution;
}

Solution solution_of(ScatterFit fit, const ResidualTerms& terms) {
  Solution solution{std::move(fit.poles),
                    std::move(fit.residues),
                    std::move(fit.residual),
                    {std::move(fit.covariance)},
                    {},
                    fit.correlated,
                    true,
                    terms,
                    std::move(fit.local),
                    std::move(fit.spread)};
  solution.frequency_scatter = fit.frequency_scatter;
  solution.damping_scatter = fit.damping_scatter;
  return solution;
}

// What the weights add to a description length: with it, fits of the same data under other weights compare.
double weight_length(const Band& band) { return -4 * band.weight.array().log().sum(); }

constexpr double kWhitePart = 0.3;

Solution solve(const Band& band, const Band& equal, const Poles& start, ResidualTerms terms,
               const ModeOptions& options) {
  Refined state;
  bool cut = false;  // FRFs that disagree take ever more common poles; scatter needs its part of the work
  {
    WorkLimit part(kWhitePart * WorkLimit::left());
    state = fit_white(band, equal, start, terms, options);
    if (options.search) add_residual_modes(band, state, terms, options);
    cut = part.stopped();
  }
  // Before all else: what structural damping leaves of a viscous fit passes for scatter and for further modes.
  const DampingEvidence damping = damping_evidence(band, state, terms);
  if (options.damping == DampingChoice::hysteretic ||
      (options.damping == DampingChoice::automatic && damping == DampingEvidence::structural)) {
    terms.hysteretic = true;
    state = fit_white(band, equal, state.poles, terms, options);
  }
  const Refined white = state;  // of equal poles and no amplitude: the start of all others
  if (options.amplitude && !cut) state = with_amplitude(band, white, terms, options);
  if (options.scatter && band.channels() >= 3 && (cut || may_scatter(band, white, terms, options))) {
    // The diagram's poles and what the search found apart from them; what splits a peak stays out.
    Poles from = start;
    for (const Complex p : white.poles) {
      const auto splits = [&](Complex q) { return std::abs(p - q) < -4 * (p.real() + q.real()); };
      if (!inside(band, p) || std::none_of(start.begin(), start.end(), splits)) from.push_back(p);
    }
    ScatterFit scatter = fit_scatter(band, from, terms,
                                     {.search_gain = options.search_gain,
                                      .max_damping = options.poles.max_damping,
                                      .max_modes = options.max_modes,
                                      .give_up = description_length(band, state, terms, 1) + kHopeless});
    // Two poles of the white fit that became one which is no mode of its own.
    const bool hides = std::any_of(white.poles.begin(), white.poles.end(), [&](Complex p) {
      const std::size_t k = scatter.poles.empty() ? 0 : nearest(scatter.poles, p);
      const auto same = [&](Complex q) { return !scatter.poles.empty() && nearest(scatter.poles, q) == k; };
      return inside(band, p) && std::count_if(white.poles.begin(), white.poles.end(), same) > 1 &&
             !is_one_mode(band, scatter, k);
    });
    if (!scatter.poles.empty() && !hides &&
        description_length(band, scatter, terms) < description_length(band, state, terms, scatter.correlated)) {
      const double length = description_length(band, scatter, terms) + weight_length(band);
      Solution solution = solution_of(std::move(scatter), terms);
      solution.length = length;
      return solution;
    }
  }
  if (cut) WorkLimit::stop();
  state = with_weak_poles(band, state, terms, options);
  Solution solution = solution_of(band, state, terms, true);
  solution.length = description_length(band, state, terms, 1) + weight_length(band);
  solution.damping_open = damping != DampingEvidence::viscous && !terms.hysteretic;
  return solution;
}

}  // namespace

namespace {

// The diagram's poles nearest to the frequencies asked for: stable ones first, of the higher orders the median.
Poles pick(const StabilisationDiagram& diagram, const std::vector<double>& frequencies, double decay) {
  constexpr double kReachOfHand = 0.02;
  Poles picked;
  for (const double f : frequencies) {
    require_range("--select", f, 1e-9, 1e9, "Hz");
    const StabilisationPole* nearest = nullptr;
    double best = kReachOfHand;
    for (const StabilisationPole& pole : diagram.poles) {
      const double distance = std::abs(pole.frequency() / f - 1) + (pole.stable() ? 0 : kReachOfHand / 2);
      const Complex p = pole.pole + decay;
      if (distance >= best || !(p.real() < 0) || std::find(picked.begin(), picked.end(), p) != picked.end()) continue;
      best = distance;
      nearest = &pole;
    }
    if (nearest == nullptr)
      throw Error(
          fmt::format("--select {:g} Hz: no pole of any order lies within {:g} % of it", f, 100 * kReachOfHand));
    picked.push_back(nearest->pole + decay);
  }
  return picked;
}

}  // namespace

FrequencyResponse without_dead_channels(const FrequencyResponse& frf, std::vector<std::string>& names) {
  double largest = 0;
  for (const FrfChannel& channel : frf.channels) largest = std::max(largest, channel.value.norm());
  FrequencyResponse alive = frf;
  std::erase_if(alive.channels, [&](const FrfChannel& channel) {
    const bool dead = channel.value.allFinite() && channel.value.norm() <= 1e-9 * largest;
    if (dead) names.push_back(channel.response + "/" + channel.reference);
    return dead;
  });
  if (alive.channels.empty()) throw Error("every frequency response is zero: no channel measured anything");
  return alive;
}

namespace {

// Where modes of heavy damping show, they are fitted by model order. What that leaves unexplained may be scatter, an
// amplitude or a loss factor: then the usual fit is tried too, and the shorter description stays. Modes that overlap by
// several widths show in no diagram: what the usual fit leaves of them is fitted by model order as well. That a
// measured structure also leaves, by its amplitude or its windows, and more poles always shorten its description: modes
// that no diagram shows are taken only where they leave nothing.
Solution solve_any_damping(const FrequencyResponse& frf, const Band& band, const Band& equal, const Poles& start,
                           const ResidualTerms& terms, const ModeOptions& options) {
  if (options.damping == DampingChoice::hysteretic) return solve(band, equal, start, terms, options);
  std::optional<Solution> usual;
  if (!shows_heavy_damping(frf, options)) {
    usual = solve(band, equal, start, terms, options);
    if (usual->correlated <= kStructured) return *usual;
  }
  std::optional<DampedFit> damped = fit_damped(frf, band, options);
  const auto heavy = [&](Complex p) {
    return inside(band, p) && -p.real() > 0.5 * options.poles.max_damping * std::abs(p);
  };
  const bool fits = damped && std::any_of(damped->state.poles.begin(), damped->state.poles.end(), heavy) &&
                    (!usual || damped->state.correlated <= kStructured);
  Solution solution;
  if (fits) {
    solution = solution_of(band, damped->state, damped->terms, true);
    solution.length = description_length(band, damped->state, damped->terms, 1) + weight_length(band);
    if (!usual && damped->state.correlated <= kStructured) return solution;
  }
  if (!usual) usual = solve(band, equal, start, terms, options);
  return fits && solution.length <= usual->length ? solution : *usual;
}

ModalModel fit_lines(const FrequencyResponse& measured, const ModeOptions& asked) {
  std::vector<std::string> dead;
  const FrequencyResponse frf = without_dead_channels(measured, dead);
  ModeOptions options = asked;
  const Band band = select_band(frf, options.poles.band_low, options.poles.band_high, options.poles.weighting);
  if (options.search_gain == 0) options.search_gain = least_gain(band);
  const ResidualTerms terms{options.residues.lower_residual, options.residues.upper_residual,
                            options.residues.upper_slope, options.residues.complex_residuals};
  StabilisationDiagram diagram = stabilisation_diagram(frf, options.poles);
  Poles start;
  for (const auto& cluster : select_poles(diagram, options.poles)) {
    const Complex p = cluster.pole + band.decay;
    if (p.real() < 0) start.push_back(p);
  }
  Band equal;
  Solution solution;
  if (!options.select.empty()) {
    start = pick(diagram, options.select, band.decay);
    Refined state = refine(band, start, start.size(), terms, options.refine ? options.max_iterations : 0);
    state.converged = state.converged || !options.refine;
    solution = solution_of(band, state, terms, options.refine);
  } else if (options.refine) {
    equal = band.common_weight ? Band{}
                               : select_band(frf, options.poles.band_low, options.poles.band_high, LineWeighting::flat);
    solution = solve_any_damping(frf, band, equal, start, terms, options);
  } else {
    Refined state{start, fit_poles(band, start, terms, true), true};
    state.residual = residual_of(band, start, terms, state.fit);
    solution = solution_of(band, state, terms, false);
  }
  const bool measured_weight = !band.guessed_weight && !band.common_weight;
  if (options.refine && options.select.empty() && measured_weight &&
      asked.poles.weighting == LineWeighting::automatic && solution.correlated > kStructured) {
    // What the blows differ by may be no noise of single lines but the structure itself, which warms or loosens from
    // blow to blow: then every FRF has poles of its own, and the noise beside it is even.
    Solution other = solve(equal, Band{}, start, terms, options);
    if (other.length < solution.length) {
      ModalModel model = to_model(frf, equal, other);
      for (const std::string& name : dead) model.summary.warn("channel " + name + " is zero on every line: left out");
      return model;
    }
  }
  if (band.guessed_weight && !band.common_weight && solution.correlated > 5) {
    // The scatter between lines said that the noise grows with |H|, but structure that the model leaves outweighs it.
    // Then the peaks, where the model is best, should count for most.
    ModeOptions flat = asked;
    flat.poles.weighting = LineWeighting::flat;
    return fit_lines(measured, flat);
  }
  ModalModel model = to_model(frf, band, solution);
  for (const std::string& name : dead) model.summary.warn("channel " + name + " is zero on every line: left out");
  return model;
}

std::ptrdiff_t modes_inside(const ModalModel& model) {
  return std::count_if(model.modes.begin(), model.modes.end(), [&](const Mode& mode) {
    return mode.frequency.value >= model.band_low && mode.frequency.value <= model.band_high;
  });
}

}  // namespace

namespace {

ModalModel fit_with_hann_window(const FrequencyResponse& frf, const ModeOptions& options) {
  ModalModel model = fit_lines(frf, options);
  if (!options.find_hann_window || !options.refine || !options.select.empty() || !looks_split(frf, model)) return model;
  const FrequencyResponse without = without_hann_window(frf);
  ModalModel other = fit_lines(without, options);
  const auto before = modes_inside(model), after = modes_inside(other);
  // Where there was no window, what takes it off distorts: no mode goes and the error is many times as large.
  if (after == 0 || static_cast<double>(after) > 0.7 * static_cast<double>(before) ||
      error_through_hann_window(frf, without, other) > 8 * model.reconstruction_error + 0.01)
    return model;
  other.summary.warn(
      fmt::format("the lines look averaged from random force through a Hann window, which the file does not state: it "
                  "is taken off. "
                  "With it {} modes would be listed instead of {}, their dampings too large",
                  before, after));
  return other;
}

}  // namespace

ModalModel fit_modes(const FrequencyResponse& frf, const ModeOptions& options) {
  WorkLimit work(kMostWork);
  ModalModel model = fit_with_hann_window(frf, options);
  if (work.stopped()) {
    model.summary.add({FindingCode::work_limit,
                       Consequence::warning,
                       {{"operations", work.spent()}},
                       fmt::format("{} FRFs of {} lines", frf.channels.size(), frf.frequency.size())});
  }
  return model;
}

double damping_through_window(const Mode& mode, double window_decay) {
  return (window_decay - mode.pole.real()) / std::abs(mode.pole - window_decay);
}

}  // namespace whirl::modal
