#pragma once
#include <Eigen/Core>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/regression/regression.hpp"

namespace whirl::identification {

/// A coefficient that may not have the other sign.
struct SignBound {
  std::string equation;  ///< left-hand side, "v'", or its state, "v"; empty: every equation that has the term
  std::string function;  ///< a candidate term
  int sign = 1;          ///< +1: coefficient >= 0, -1: <= 0
};

/// What became of the bound of one term.
struct BoundOutcome {
  std::string equation, function;
  int sign = 1;
  bool kept = false;  ///< the term is in the model, with an interval that ends at 0 at the latest
  bool active =
      false;  ///< held at 0: without the bound the term would be there with the other sign. It has no interval
  double unbounded = std::numeric_limits<double>::quiet_NaN();  ///< that coefficient when active, to first order
  double t = std::numeric_limits<double>::quiet_NaN();          ///< and its coefficient / sd
};

/// What holds for single equations.
struct EquationOptions {
  std::map<std::string, std::vector<std::string>> library_of = {};  ///< own candidate terms, by lhs, e.g. "v'"
  std::vector<Equation> known = {};  ///< equations with given coefficients, kept as they are, e.g. x' = v
  std::vector<SignBound> signs =
      {};  ///< bounds of coefficients; Error on a term that is no candidate, and in fit_library
  /// Candidate terms of denominators beside the 1: rational right-hand sides N / (1 + sum d g) (fit_rational).
  std::vector<std::string> denominators = {};
};

/// Limits of the search for terms.
struct TermSearchOptions {
  double window = 0;          ///< half-width of the test functions, s; 0: from the record's own time scale
  double t_value = 4;         ///< terms with a smaller |coefficient / sd| go
  double least_share = 1e-4;  ///< and those with a smaller |coefficient| rms(term) / rms(lhs)
  int max_passes = 500;  ///< of the refinement over its free runs; beyond, the search for terms ends (see fit_sindy)
};

/// What inputs do between their samples, and after how many seconds the system feels them; inputs that are not here: by
/// evidence (see fit_sindy). Not for maps, and only with `refine`.
struct TimingOptions {
  std::map<std::string, Hold> hold = {};
  std::map<std::string, double> dead_time = {};
  bool find = true;  ///< false: inputs that are not above are band-limited without dead time
};

struct SindyOptions {
  std::vector<std::string> states;  ///< measured channels whose equations are sought
  std::vector<std::string> inputs;  ///< channels that drive them
  int order = 1;                    ///< 2: the channels are displacements, x'' = f(x, x', u); velocities are not needed
  bool discrete = false;            ///< maps: x[k+1] = f(x, u)
  /// Candidate terms as text in states (and their rates, order 2), inputs and t; empty: all monomials up to degree 3
  /// (2 when there are more than 3 variables).
  std::vector<std::string> library;
  EquationOptions equations = {};
  TermSearchOptions search = {};
  bool refine = true;  ///< multiple-shooting refinement with pruning and score test; false: weak form only
  regression::SolveOptions solver = {.method = "best_subset"};  ///< of the weak form
  TimingOptions timing = {};
  /// States without a channel that may be added, at most; only on evidence of the part held out (fit_hidden).
  int hidden = 0;
  /// Correlation of a state's noise from one sample to the next, in [0, 1); empty: found where white noise does not
  /// explain the records. Not for maps, and only with `refine`.
  std::map<std::string, double> noise_correlation = {};
};

/// Sparse identification of x' = f(x, u) with one setting for clean and noisy records.
///
/// 1. Noise sd of every channel from sixth differences; noise above 0.1 % is smoothed by a spline that leaves just that
///    residual (only inside the candidate terms; the left-hand side stays raw).
/// 2. Weak form, -int phi' x dt = sum xi int phi f(x) dt, phi = (1 - s^2)^6 (Messenger and Bortz 2021): no derivative
/// of
///    data. Half-width T = 1 / w_c, w_c = rms(x') / rms(x). Sparse regression of every equation by `solver`.
/// 3. Output-error refinement of all equations together on free runs of about one period 2 pi / w_c with free starts
///    (multiple shooting; chaos cannot grow over so short a run), then on longer ones while these still follow: unlike
///    the columns of a regression, its residual is white when the model is right, so terms may be tested. Terms below
///    `search.t_value` or `least_share` are dropped, absent candidates with a score of at least t_value^2 are added,
///    until neither changes; then every other support on the regression's path that is no larger is tried in its place
///    and kept when it lowers the criterion of the free runs. So are the best supports that lack one of the model's
///    terms, sought exactly in the information matrix of the score test; those within 10 of the criterion (odds of 150
///    to 1) are a warning: the records cannot tell the terms.
///
/// The search takes some 30 to 100 passes over the free runs; where it has not come to an end after `max_passes` the
/// model is unusable (terms still coming and going: a signal that something outside drives was taken for a state, or a
/// term is missing) or, when only the trial of other supports was cut short, carries a warning.
///
/// Inputs: the lag at which the weak form leaves the least tells whether the record has a dead time or a hold. Where it
/// does, terms are sought with the inputs moved by that lag, then coefficients and dead time are fitted together on
/// free runs for each hold (steps end where a held input switches), the best is taken, and terms that are no longer
/// needed go. It stays with band-limited inputs without dead time unless the likelihood says otherwise. See
/// `model.timing`.
///
/// Noise: white, unless free runs then leave more than it, and with noise that is correlated from one sample to the
/// next (first-order autoregressive) their residuals are new in every sample (Box and Pierce's test of 12 lags) and of
/// the size that the records' own sixth differences give. See `model.noise_correlation`.
///
/// Several records are fitted together; NaN marks a gap. The result's equations use the channel names; its `parameters`
/// are the estimated coefficients, named "v': x^3", with `parameter_covariance` after refinement; `noise_sd` is the
/// mean over channels; summary.chi_square is the refined residual variance over the estimated noise variance (NaN where
/// the noise is below 1e-6 of the signal). Status unusable with the reason, and no equations, when a channel is
/// constant, the same as another one, mostly noise or of a size whose powers leave the range of doubles; unusable also
/// when free runs of the model diverge, are followed for less than a quarter of a characteristic period, or leave 15 %
/// of the motion unexplained (maps and unrefined models: 50 % of a left-hand side); the reason names the state that the
/// regression explains least. Throws Error on unknown channels, or fewer than 50 usable samples.
///
/// With `signs` every step takes only coefficients within their bounds (regression: the constrained minimum;
/// refinement: a term that crosses its bound leaves, an absent one comes only with its own sign), and the model has a
/// warning for every active one. `bounds`: what became of each.
IdentifiedModel fit_sindy(const std::vector<Recording>& records, const SindyOptions& options,
                          std::vector<BoundOutcome>* bounds = nullptr);

/// The same for records larger than memory, part by part (parts of some 10^4 to 10^5 samples lose little at their
/// ends). Held in memory: the sums over rows and at most 400000 samples, evenly spread, for the refinement. Time scale
/// and channels are judged on the first part.
class SindyStream {
 public:
  explicit SindyStream(const SindyOptions& options);
  ~SindyStream();
  /// The next part; one of fewer than 25 samples adds nothing.
  void add(const Recording& part);
  /// Model of the parts so far; more may follow.
  IdentifiedModel fit(std::vector<BoundOutcome>* bounds = nullptr) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Rates (or next values) of the model's states at every sample of a record that has all inputs and displacements:
/// states as measured; a state x' without a channel as `smoothed_states` gives it.
Eigen::MatrixXd predict(const IdentifiedModel& model, const Recording& record);
/// States of the model at every sample of a record (maps: as measured), smoothed by a spline that leaves the noise; a
/// state x' without a channel is the rate of channel x.
Eigen::MatrixXd smoothed_states(const CompiledModel& model, const Recording& record);
/// Free run over the record from its first sample; inputs from its channels. The start is read from the states smoothed
/// by a spline that leaves the noise; rates of an order-2 model are the spline's.
ModelRun simulate(const IdentifiedModel& model, const Recording& record);

/// Free run against measurement on one state, in its unit.
struct StateScore {
  std::string state;
  double rmse = 0;   ///< rms; infinite when a run diverges
  double nrmse = 0;  ///< rmse / rms(y - mean y): 0 perfect, 1 no better than the mean
  double noise = 0;  ///< noise sd of the channel: the floor of rmse
  double band = 0;   ///< rms that noise and the model's intervals account for at 95 %, of a rotor; 0 or NaN: not known
};
/// Scores of every measured state, free runs restarted every `horizon` seconds (0: never). A run of a differential
/// equation starts where its first characteristic period fits best, a map from the measured values.
std::vector<StateScore> score(const IdentifiedModel& model, const Recording& record, double horizon = 0);
/// 2 pi rms(x - mean) / rms(x') of the fastest state, s: the horizon over which chaos hardly grows.
double characteristic_period(const Recording& record, const std::vector<std::string>& states);

}  // namespace whirl::identification
