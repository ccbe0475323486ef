#include "amplitude.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace whirl::modal {
namespace {

using Eigen::Index;
using Complex = std::complex<double>;

// Of the description length: gained by the first term, lost by one in place of a free pole.
constexpr double kAdded = 40, kInPlace = 30;
constexpr std::size_t kParents = 3;
constexpr int kSearchIterations = 12;

Eigen::RowVectorXcd residues_of(const Refined& state, std::size_t pole) {
  const auto row = 2 * static_cast<Index>(pole);
  return state.fit.residues.row(row).cast<Complex>() + Complex(0, 1) * state.fit.residues.row(row + 1).cast<Complex>();
}

// Without a free pole; what is tied to it goes too.
Refined without(const Refined& state, std::size_t pole) {
  Refined result;
  result.started = state.started - (pole < state.started ? 1 : 0);
  for (std::size_t k = 0; k < state.free(); ++k) {
    if (k != pole) result.poles.push_back(state.poles[k]);
  }
  for (Tie tie : state.ties) {
    if (tie.parent == pole || tie.other == pole) continue;
    tie.parent -= tie.parent > pole ? 1 : 0;
    tie.other -= tie.other > pole ? 1 : 0;
    result.ties.push_back(tie);
  }
  for (const Tie& tie : result.ties) result.poles.push_back(tie.of(result.poles));
  return result;
}

Refined with(const Refined& state, const Tie& tie) {
  Refined result;
  result.started = state.started;
  result.poles = state.poles;
  result.ties = state.ties;
  result.ties.push_back(tie);
  result.poles.push_back(tie.of(result.poles));
  return result;
}

/// What stays the same over one search for terms.
struct AmplitudeSearch {
  const Band& band;
  const ResidualTerms& terms;
  double lines;  ///< that count as one in every comparison
  double max_damping;

  /// Noise variances that a term costs.
  double needed = std::log(2 * static_cast<double>(band.h.size())) * 2 * static_cast<double>(band.channels());

  // Poles that stood for what modes outside the band do may run off into what is no mode: then they go.
  Refined refined(Refined start) const {
    for (int round = 0; round < 4; ++round) {
      Refined next = refine(band, start.poles, start.started, terms, kSearchIterations, start.ties);
      std::size_t wild = 0;
      const auto is_wild = [&](Complex p) { return -p.real() > max_damping * std::abs(p); };
      while (wild < next.free() && !is_wild(next.poles[wild])) ++wild;
      if (wild == next.free()) return next;
      start = without(next, wild);
    }
    return refine(band, start.poles, start.started, terms, kSearchIterations, start.ties);
  }
  // Where the poles stand the further ones already gain a good part of what they can.
  bool gains(const Refined& state, const Refined& more) const {
    const double gain = state.fit.total() - fit_poles(band, more.poles, terms, false).total();
    return gain > 0.3 * needed * noise_variance(band, state.poles, terms, state.fit);
  }
  double length(const Refined& state) const { return description_length(band, state, terms, lines); }
  bool better(const Refined& next, const Refined& state, double by) const { return length(next) < length(state) - by; }
};

// The term's residues are to be a fixed, not too large part of the mode's own in every FRF.
bool in_proportion(const Refined& state, std::size_t parent) {
  const Eigen::RowVectorXcd own = residues_of(state, parent);
  for (std::size_t i = 0; i < state.ties.size(); ++i) {
    if (state.ties[i].parent != parent || state.ties[i].turn != 1 || state.ties[i].other != parent) continue;
    const Eigen::RowVectorXcd term = residues_of(state, state.free() + i);
    const double product = std::norm(own.conjugate().cwiseProduct(term).sum());
    if (term.norm() > own.norm() || product < 0.8 * own.squaredNorm() * term.squaredNorm()) return false;
  }
  return true;
}

// Height of the peak. (What comes back when a pole is left out says little where another can take its place.)
double strength(const Refined& state, std::size_t pole) {
  return residues_of(state, pole).norm() / -state.poles[pole].real();
}

// Weaker poles close to the parent, which may only split its peak.
std::vector<std::size_t> neighbours(const Refined& state, std::size_t parent) {
  std::vector<std::size_t> close;
  const Complex p = state.poles[parent];
  for (std::size_t k = 0; k < state.free(); ++k) {
    if (k != parent && std::abs(state.poles[k] - p) < 8 * -p.real() && strength(state, k) < strength(state, parent))
      close.push_back(k);
  }
  return close;
}

std::size_t nearest_mode(const Refined& state, Complex mode) {
  const auto closer = [&](Complex a, Complex b) { return std::abs(a - mode) < std::abs(b - mode); };
  const auto end = state.poles.begin() + static_cast<std::ptrdiff_t>(state.free());
  return static_cast<std::size_t>(std::min_element(state.poles.begin(), end, closer) - state.poles.begin());
}

// A mode's own term of that power of its amplitude; 3, 5.
Tie own(std::size_t mode, double power) { return {mode, power, 1, mode, 0, 0}; }

// The terms that may still come: powers of the strong mode's amplitude, and what its motion does to a weak mode beside
// it, whose pole changes with the strong one's amplitude and is mirrored at twice its frequency.
std::vector<Tie> missing_terms(const Refined& state, std::size_t strong) {
  std::vector<Tie> terms{own(strong, 3)};
  const auto present = [&](const Tie& t) {
    return std::any_of(state.ties.begin(), state.ties.end(), [&](const Tie& s) {
      return s.parent == t.parent && s.other == t.other && s.decay == t.decay && s.turn == t.turn;
    });
  };
  if (present(terms.front())) {
    terms.push_back(own(strong, 5));
    for (const std::size_t weak : neighbours(state, strong)) {
      terms.push_back({weak, 1, 1, strong, 2, 0});
      terms.push_back({weak, 1, -1, strong, 2, 2});
    }
  }
  std::erase_if(terms, present);
  return terms;
}

// Poles that change with the amplitude: terms are added one by one as long as the evidence holds them.
void add_shift(const AmplitudeSearch& search, Refined& state, Complex mode) {
  for (int round = 0; round < 8; ++round) {
    const std::size_t parent = nearest_mode(state, mode);
    mode = state.poles[parent];
    double least = search.length(state);
    std::optional<Refined> best;
    const auto consider = [&](const Refined& from, double clear) {
      Refined next = search.refined(from);
      const double length = search.length(next) + clear;
      if (length >= least || !in_proportion(next, nearest_mode(next, mode))) return;
      least = length;
      best = std::move(next);
    };
    for (const Tie& term : missing_terms(state, parent)) {
      const Refined start = with(state, term);
      const bool first = term.parent == term.other && term.decay == 3;
      // A free pole may have taken the term's place: then nothing needs to be gained.
      for (const std::size_t other : neighbours(state, parent)) {
        if (other == term.parent || std::abs(state.poles[other] - start.poles.back()) > -start.poles.back().real())
          continue;
        const Refined replaced = without(start, other);
        // Where it stands just there it can hardly be anything else.
        const bool there = std::abs(state.poles[other] - start.poles.back()) < -state.poles[parent].real();
        const double clear = there ? -4 * kInPlace : -kInPlace;
        consider(replaced, clear);
        if (first) consider(with(replaced, own(parent - (other < parent ? 1 : 0), 5)), clear);
      }
      if (search.gains(state, start)) consider(start, first ? kAdded : 0);
    }
    if (!best) break;
    state = std::move(*best);
  }
}

// Poles at twice or three times a mode whose pole changes with the amplitude, weaker than it by far: tied to it. At the
// start of the ringing they stand at the multiple of the shifted pole, for which a second term is.
void tie_harmonics(const AmplitudeSearch& search, Refined& state) {
  std::vector<Complex> parents;
  for (const Tie& tie : state.ties) {
    if (tie.turn == 1 && tie.decay == 3) parents.push_back(state.poles[tie.parent]);
  }
  for (const Complex parent : parents) {
    for (const double times : {2.0, 3.0}) {
      for (std::size_t k = state.free(); k-- > 0;) {
        if (k >= state.free()) continue;  // a refinement may have dropped several
        const std::size_t mode = nearest_mode(state, parent);
        if (std::abs(state.poles[k] - times * parent) > -2 * times * parent.real() ||
            residues_of(state, k).norm() > 0.1 * residues_of(state, mode).norm())
          continue;
        const std::size_t left = mode - (k < mode ? 1 : 0);
        const Refined one = search.refined(with(without(state, k), {left, times, times, left, 0, 0}));
        if (!search.better(state, one, kInPlace)) {
          state = one;
          continue;
        }
        Refined two = search.refined(with(one, {left, times + 2, times, left, 0, 0}));
        // One close enough to be nothing else goes whatever the terms left out there cost.
        const bool close = std::abs(state.poles[k].imag() - times * parent.imag()) < -times * parent.real();
        if (close || !search.better(state, two, kInPlace)) state = std::move(two);
      }
    }
  }
}

// Poles of the search that the terms now make needless.
void drop_needless(const AmplitudeSearch& search, Refined& state) {
  for (std::size_t k = state.free(); k-- > state.started;) {
    if (k >= state.free()) continue;  // a refinement may have dropped several
    Refined next = search.refined(without(state, k));
    if (search.better(next, state, 0)) state = std::move(next);
  }
}

// What each of the next terms, which the evidence does not hold, would change: the error of stopping here. Of modes
// that show no term at all only where one gains something.
Eigen::VectorXd truncation_of(const AmplitudeSearch& search, const Refined& state, const std::vector<Complex>& modes) {
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(2 * static_cast<Index>(state.free()));
  for (const Complex mode : modes) {
    const std::size_t k = nearest_mode(state, mode);
    for (const Tie& term : missing_terms(state, k)) {
      const Refined start = with(state, term);
      if (term.parent == k && term.decay == 3 && !search.gains(state, start)) continue;
      const Refined next = search.refined(start);
      if (next.free() != state.free()) continue;
      for (std::size_t i = 0; i < state.free(); ++i) {
        const Complex change = next.poles[i] - state.poles[i];
        // Where the further term is too much, the poles run off.
        if (std::abs(change) > -state.poles[i].real()) continue;
        const auto at = 2 * static_cast<Index>(i);
        largest[at] = std::max(largest[at], std::abs(change.real()));
        largest[at + 1] = std::max(largest[at + 1], std::abs(change.imag()));
      }
    }
  }
  return largest;
}

}  // namespace

Refined with_amplitude(const Band& band, const Refined& white, const ResidualTerms& terms, const ModeOptions& options) {
  if (terms.hysteretic || white.poles.empty()) return white;
  if (noise_variance(band, white.poles, terms, white.fit) <= least_variance(band)) return white;
  const AmplitudeSearch search{
      .band = band, .terms = terms, .lines = white.correlated, .max_damping = options.poles.max_damping};
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < white.poles.size(); ++k) {
    if (inside(band, white.poles[k])) order.push_back(k);
  }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return strength(white, a) > strength(white, b); });
  if (order.size() > kParents) order.resize(kParents);
  Refined state = white;
  std::vector<Complex> modes;
  for (const std::size_t k : order) {
    add_shift(search, state, white.poles[k]);
    modes.push_back(white.poles[k]);
  }
  if (!state.ties.empty()) {
    tie_harmonics(search, state);
    if (options.search) drop_needless(search, state);
  }
  state.truncation = truncation_of(search, state, modes);
  return state;
}

}  // namespace whirl::modal
