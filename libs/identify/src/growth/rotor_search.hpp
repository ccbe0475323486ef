#pragma once
#include <cmath>
#include <optional>
#include <stop_token>

#include "growth/fit_memory.hpp"
#include "growth/rotor_candidates.hpp"
#include "rules/rules.hpp"

/// The search for the terms of a rotor model.
namespace whirl::identification::detail {

/// What is tried beside the usual terms and the modes of the hammer test.
enum class Beside {
  nothing,
  modes,       ///< forced modes of any frequency
  rare_terms,  ///< entries with TermEntry::rare
  no_search,   ///< the model that is given is fitted as it is
};

/// Output-error fit from the start given, then the forward score test: the most significant candidate is taken up and
/// all is refined and simulated again, until none reaches the threshold. A term that the trajectory does not confirm by
/// a likelihood ratio of the same size is refused. When the first fit fails its summary says why. `unwanted`: nobody
/// asks for the result any more, and the search ends where it is.
class RotorSearch {
 public:
  RotorSearch(const std::vector<RotorRecord>& records, const RotorModel& start,
              std::vector<std::complex<double>> start_eps, const OutputErrorOptions& active,
              const RotorIdentifyOptions& options, FitMemory& memory, Beside beside = Beside::nothing, double delay = 0,
              std::stop_token unwanted = {});

  bool usable() const { return fit_.summary.status != Status::unusable; }
  /// Chi-square of the weak equations or of the trajectory, the larger; infinite where there is no model.
  double misfit() const;
  /// Takes out terms that stood in for others, and seeks models that the records cannot tell from this one.
  GrownRotor finish() &&;

 private:
  using Complex = std::complex<double>;
  struct Taken {
    TermId term;
    std::string label;
    Start before;  // the fit without it
  };
  struct Near {
    TermId taken, other;  // term taken, term that did nearly as well
    Start with;           // the fit with that one
  };

  struct Tried {
    TermId term;
    Growth with;
    double chi_square = 0, surprise = 0;
    Start found = {};
  };
  struct Trial {
    OutputErrorFit fit = {};
    double before = 0;  // price of the short fits that it began with
  };
  struct Trials {
    std::vector<Tried> tried = {};
    std::optional<OutputErrorFit> best = {};
    std::size_t chosen = 0;  // the one that `best` is of
  };

  // Fits.
  OutputErrorFit fit(const Growth& g) const { return fit(g, eps_); }
  OutputErrorFit fit(const Growth& g, const std::vector<Complex>& start_eps) const;
  OutputErrorFit fit_to_the_end(const Growth& g, OutputErrorFit found, double target) const;
  OutputErrorFit fit_from_either(const Growth& g, const Start& before) const;
  Trial fit_about_instant(Growth g, const ScoreCandidate& candidate) const;
  Trial trial_of(const Growth& with, const TermId& term, const ScoreTest& score) const;
  double gain(const OutputErrorFit& smaller, const OutputErrorFit& larger) const;
  double plausible_gain(const OutputErrorFit& smaller, const OutputErrorFit& larger) const;
  void settle();
  void keep_grid();
  void refine_grid();

  // Evidence for what is missing.
  ScoreTest test();
  ScoreTest test_on_weak_rows();
  std::optional<ScoreCandidate> best_instant(const TermEntry& entry, std::vector<double> instants) const;
  void find_instants(ScoreTest& test);
  void warn_of_missing(const ScoreTest& test);

  // Steps of the search.
  bool step();
  Trials try_each(const std::vector<TermId>& terms, const ScoreTest& score);
  void try_at_one_instant(Trials& trials);
  void take(Trials& trials, std::size_t k, OutputErrorFit&& trial) const;
  void take_up(Trials&& trials);
  void try_bow();
  void count(const OutputErrorFit& trial, const Growth& growth, double before = 0);
  bool spent() const;
  bool gives_up();
  double lead(const ScoreTest& score) const;
  bool explains_enough(const OutputErrorFit& larger) const;

  // The model found.
  bool spent_at_end() const;
  bool beyond_doubt(const Growth& less) const;
  void prune();
  void find_others();
  void find_second_kind();

  const std::vector<RotorRecord>& records_;
  const RotorIdentifyOptions& options_;
  FitMemory& memory_;
  const std::stop_token unwanted_;
  bool rare_;         // rare terms are tried as the others are
  const bool given_;  // the model stays as it is given
  const bool modes_;  // modes of any frequency are among the candidates
  Growth growth_;
  std::vector<Complex> eps_;
  ScoreTestOptions score_;
  double values_ = 0;    // real readings
  int most_ = 1;         // trial fits side by side: each holds the motions of all records
  double grid_for_ = 0;  // chi-square of the fit that chose the grid
  double tried_ = 0;     // steps of trial fits since the rest was halved
  double tried_in_all_ = 0;
  double searched_ = 0;       // of these, when the search ended
  double at_gain_ = 0;        // and when a term last took a fifth of the rest
  double halved_ = INFINITY;  // misfit that began them
  double last_ = INFINITY;    // misfit of the step before
  OutputErrorFit fit_;
  GrownRotor grown_;
  std::vector<Taken> taken_;
  std::vector<Near> near_;
  std::vector<TermId> refused_;
};

/// Forces of that kind begin at an instant as the weak equations say.
void begin_at(std::vector<RotorTerm>& terms, const ScoreCandidate& found, double instant);
/// What a fit cost, in steps of a fit with no more forces than a rotor has and one Runge-Kutta step a sample.
double price(const OutputErrorFit& fit, const Growth& growth);
/// Whether a fit ended by its limit of steps.
bool ran_out(const OutputErrorFit& fit, const Growth& growth);
/// Whether the model has more forces beyond RotorModel than one record can carry.
bool too_many(const Growth& growth);

}  // namespace whirl::identification::detail
