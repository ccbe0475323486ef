#include "fit/scatter/scatter_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;

// The lines about a pole, with what the poles far from it and the residual terms explain taken out. `near`: the poles
// of the window.
Band window_of(const Band& band, const Refined& state, bool hysteretic, Complex centre, Poles& near) {
  constexpr std::ptrdiff_t kNeighbours = 6;  // fewer widths where many poles stand close: their tails are taken out
  double reach = 0;
  for (const double widths : {15.0, 10.0, 6.0}) {
    reach = widths * -centre.real() + 20 * 2 * kPi * band.line_width();
    const auto within = [&](Complex p) { return std::abs(p.imag() - centre.imag()) < reach; };
    if (std::count_if(state.poles.begin(), state.poles.end(), within) <= kNeighbours) break;
  }
  Index first = 0, last = band.lines() - 1;
  while (first < last && band.omega[first] < centre.imag() - reach) ++first;
  while (last > first && band.omega[last] > centre.imag() + reach) --last;
  const Index lines = last - first + 1;
  Band window = band;
  window.omega = band.omega.segment(first, lines);
  window.weight = band.weight.middleRows(first, lines);
  window.low = window.omega[0] / (2 * kPi);
  window.high = window.omega[lines - 1] / (2 * kPi);
  std::vector<Index> rows;
  for (std::size_t k = 0; k < state.poles.size(); ++k) {
    if (!inside(window, state.poles[k])) continue;
    near.push_back(state.poles[k]);
    rows.push_back(2 * static_cast<Index>(k));
    rows.push_back(2 * static_cast<Index>(k) + 1);
  }
  const ResidualTerms none{.lower = false, .upper = false, .slope = false, .complex = false, .hysteretic = hysteretic};
  PoleFit part;
  part.residues = state.fit.residues(rows, Eigen::all);
  window.h = Eigen::MatrixXcd::Zero(lines, band.channels());
  window.energy = -1;
  window.h = state.residual.middleRows(first, lines) - residual_of(window, near, none, part);
  window.energy = (window.h.array().abs2() * window.weight.array().square()).sum();
  return window;
}

}  // namespace

bool is_one_mode(const Band& band, const ScatterFit& fit, std::size_t pole) {
  const auto row = 2 * static_cast<Index>(pole);
  Eigen::MatrixXcd residues(band.grid.rows(), band.grid.cols());
  for (Index o = 0; o < residues.rows(); ++o) {
    for (Index r = 0; r < residues.cols(); ++r) {
      const int c = band.grid(o, r);
      residues(o, r) = {fit.residues(row, c), fit.residues(row + 1, c)};
    }
  }
  const Eigen::VectorXd sizes = Eigen::JacobiSVD<Eigen::MatrixXcd>(residues).singularValues();
  return sizes.size() < 2 || sizes[1] < 0.6 * sizes[0];
}

std::size_t nearest(const Poles& poles, Complex p) {
  const auto closer = [&](Complex a, Complex b) { return std::abs(a - p) < std::abs(b - p); };
  return static_cast<std::size_t>(std::min_element(poles.begin(), poles.end(), closer) - poles.begin());
}

namespace {

// True when the lines about a pole are described better by one pole that differs between FRFs than by what the white
// fit put there. `other`: a close neighbour that may only split it, else the pole itself.
bool prefers_scatter(const Band& band, const Refined& state, const ResidualTerms& terms, Complex pole, Complex other,
                     const ModeOptions& options) {
  Poles near;
  const Band window = window_of(band, state, terms.hysteretic, pole, near);
  if (window.lines() < 20 || near.empty()) return false;
  const ResidualTerms local{
      .lower = false, .upper = true, .slope = true, .complex = true, .hysteretic = terms.hysteretic};
  const Refined white = refine(window, near, near.size(), local, 4);
  if (other != pole) std::erase(near, other);
  const double white_length = description_length(window, white.fit, white.poles.size(), local);
  const ScatterFit scatter = fit_scatter(window, near, local,
                                         {.search_gain = options.search_gain,
                                          .max_damping = options.poles.max_damping,
                                          .give_up = white_length + kHopeless});
  if (scatter.poles.empty()) return false;
  const std::size_t at = nearest(scatter.poles, pole);
  const double width = -scatter.poles[at].real(), spread = scatter.spread(static_cast<Index>(at), 1);
  // Peaks further apart than they are wide may be two modes, each seen by its own FRFs; hardly three and more.
  const bool two_modes = spread > 2.25 * width * width && white.poles.size() < 3;
  if (two_modes || !is_one_mode(band, scatter, at)) return false;
  // Several windows are looked at, and what far poles leave in them is taken as known: only a clear gain counts.
  // More where the weights are guessed: their error also differs between FRFs.
  const double clear = band.guessed_weight && !band.common_weight ? 250 : 60;
  return description_length(window, scatter, local) <
         description_length(window, white.fit, white.poles.size(), local, scatter.correlated) - clear;
}

}  // namespace

bool may_scatter(const Band& band, const Refined& state, const ResidualTerms& terms, const ModeOptions& options) {
  if (band.channels() < 3 || state.poles.empty()) return false;
  if (noise_variance(band, state.poles, terms, state.fit) <= least_variance(band)) return false;
  const double data = 2 * static_cast<double>(band.lines());
  const double freedom_left = static_cast<double>(band.channels() - 1), least = least_variance(band);
  struct Suspect {
    double strength;
    Complex pole, other;
  };
  std::vector<Suspect> suspects;
  for (std::size_t k = 0; k < state.poles.size(); ++k) {
    const Complex p = state.poles[k];
    if (!inside(band, p)) continue;
    double worst = 0;
    for (Index i = 2 * static_cast<Index>(k); i < 2 * static_cast<Index>(k) + 2; ++i) {
      double sum = 0;
      for (Index c = 0; c < band.channels(); ++c) {
        const double variance =
            std::max(state.fit.cost[c] / (data - static_cast<double>(state.fit.residues.rows())), least);
        sum += std::pow(state.fit.channel_score(i, c), 2) /
               (variance * std::max(1e-300, state.fit.channel_information(i, c)));
      }
      worst = std::max(worst, (sum - freedom_left) / std::sqrt(2 * freedom_left));
    }
    if (worst > 5) suspects.push_back({worst, p, p});
    for (std::size_t other = 0; other < state.poles.size(); ++other) {
      const Complex q = state.poles[other];
      const double distance = std::abs(p - q) / -(p.real() + q.real());
      // The weaker of two goes.
      if (other != k && distance < 1 &&
          state.fit.rise[static_cast<Index>(k)] >= state.fit.rise[static_cast<Index>(other)])
        suspects.push_back({3 / distance, p, q});
    }
  }
  std::sort(suspects.begin(), suspects.end(), [](const auto& a, const auto& b) { return a.strength > b.strength; });
  if (suspects.size() > 4) suspects.resize(4);
  return std::any_of(suspects.begin(), suspects.end(),
                     [&](const Suspect& s) { return prefers_scatter(band, state, terms, s.pole, s.other, options); });
}

}  // namespace whirl::modal
