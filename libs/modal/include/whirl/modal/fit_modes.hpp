#pragma once
#include "whirl/modal/poles.hpp"
#include "whirl/modal/residues.hpp"

namespace whirl::modal {

/// Damping of the modes: viscous, hysteretic (structural), or viscous unless the residues are turned as by structural
/// damping, certainly (see `damping_evidence.hpp`).
enum class DampingChoice { automatic, viscous, hysteretic };

struct ModeOptions {
  PoleOptions poles;        ///< band, weighting and orders of the start
  ResidueOptions residues;  ///< which residuals; its band and weighting follow `poles`
  bool refine = true;       ///< Gauss-Newton on all poles; gives the covariance
  int max_iterations = 12;  ///< of one refinement
  bool search = true;       ///< look in what is left for weak modes that no order showed
  /// Least energy of a pole over that of noise in the same directions; 0 = by description length, 14 to 25 for many to
  /// few FRFs.
  double search_gain = 0;
  int max_modes = 200;
  /// Hz; where not empty, these modes and no others: the poles of the diagram nearest to them are refined as they are.
  std::vector<double> select = {};
  bool amplitude =
      true;  ///< let poles depend on the amplitude of the ringing after a blow where the evidence asks for it
  bool scatter = true;  ///< let the poles differ between FRFs where the evidence asks for it
  DampingChoice damping = DampingChoice::automatic;
  /// Take off a Hann window that the file does not state where the lines show it; not with `select`, not without
  /// `refine`.
  bool find_hann_window = true;
};

/// Modes of a set of FRFs, from the lines to poles, residues and residuals with their uncertainty.
///
/// Dead channels are left out with a warning. pLSCF start, automatic selection, Gauss-Newton by variable projection
/// over the poles alone, then search of the residual for modes that were missed. Frequencies and damping are those of
/// the structure: the decay of an exponential window is removed (`damping_through_window` gives what was seen).
/// Standard deviations come from the scatter about the model; where that scatter is structured over several lines or
/// common to several FRFs they are widened accordingly. Where single FRFs show their own poles (roving sensors,
/// warming), every FRF gets its own and the modes are their means, with the scatter stated (mixed-effects model, chosen
/// by description length). A mode that the data do not support is dropped; one narrower than a line, or whose ringing
/// does not fit the record, is warned about. Modes up to 30 % outside the band may be present: they stand for what the
/// residuals cannot, and their damping means little.
///
/// Where modes above half of `PoleOptions::max_damping` come back from order to order, damping ratios up to 0.7 are
/// looked for by model order (`fit/damped_modes.hpp`). A set that the model does not suit ends at a limit of work, some
/// 10 s of one core (finding `work_limit`): modes may then be missing or stand twice.
///
/// Lines averaged from random force through a Hann window show each narrow peak as several. Where most modes stand so
/// close, the window is taken off (`without_hann_window`) and the modes are found anew; they stand, with a warning,
/// where a third of the modes or more go and what is left explains the lines as measured nearly as well. Then the
/// `window_decay` of the model is that of `without_hann_window(frf)`, not that of `frf`.
ModalModel fit_modes(const FrequencyResponse& frf, const ModeOptions& options = {});

/// The responses without those that are zero (or 1e-9 of the others) on every line, which no fit can use; `names` of
/// those left out. Throws Error when none remains.
FrequencyResponse without_dead_channels(const FrequencyResponse& frf, std::vector<std::string>& names);

/// Damping ratio of the mode as it appears behind an exponential window of this decay, 1/s.
double damping_through_window(const Mode& mode, double window_decay);

}  // namespace whirl::modal
