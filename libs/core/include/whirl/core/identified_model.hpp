#pragma once
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/quantity.hpp"
#include "whirl/core/rotor_model.hpp"
#include "whirl/core/summary.hpp"

namespace whirl {

/// One kept term of an identified equation.
struct EquationTerm {
  std::string function;  ///< as parsed by `expr`, in the states and inputs of the model, e.g. "X6^2*cos(X5)"
  Estimate coefficient;
  std::string unit;  ///< unit of the coefficient
};

/// lhs = sum of coefficient * function.
struct Equation {
  std::string lhs;  ///< e.g. "X2'"
  std::vector<EquationTerm> terms;
};

/// What an input does between its samples. `band_limited`: a signal without content above half the sample rate, as an
/// anti-aliasing filter leaves it; `zero`: constant until the next sample, as a D/A converter puts it out; `first`:
/// straight lines from sample to sample.
enum class Hold { band_limited, zero, first };
std::string_view to_string(Hold hold);
/// "zero", "first" or "band-limited"; throws Error for another name.
Hold hold_of(std::string_view name);

/// How an input channel reaches the system.
struct InputTiming {
  std::string input;
  Hold hold = Hold::band_limited;
  Estimate dead_time;  ///< s: the system feels at t what the channel says at t - dead_time
};

/// A reading of the records beside the one that the model has.
struct Alternative {
  std::string reading;  ///< e.g. "cubic springs along the axes"
  /// Probability of this reading over that of the model's, by the records and what is known of such machines; 1:
  /// nothing decides between them; NaN: not known.
  double odds = std::numeric_limits<double>::quiet_NaN();
  /// The parameters with other values than in the model, by their names, SI; those that the model lacks are added.
  std::vector<std::pair<std::string, Estimate>> parameters = {};
  std::vector<double> rotor_covariance = {};  ///< as in IdentifiedModel; empty: not known
};

/// What the records cannot tell apart.
struct Ambiguity {
  std::string readings;     ///< e.g. "runout of the probe's track, or a bow of the shaft"
  std::string consequence;  ///< which parameters differ, and how much
  std::string experiment;   ///< what would decide
  std::vector<Alternative> alternatives = {};
  /// Intervals and rotor_covariance of the model cover the alternatives. False: the alternative is another kind of
  /// force, which no interval of the model's own parameters covers.
  bool covered = true;
};

/// Equations of motion found from records.
///
/// Rotor models use the states of paper eq. 22: X1 = x, X2 = x', X3 = y, X4 = y', X5 = beta, X6 = beta'
/// (and X7 = beta'' where the angle is prescribed). SI units.
struct IdentifiedModel {
  std::string method;               ///< "paper", "weak", ...
  std::vector<std::string> states;  ///< names used in `equations`, in order
  std::vector<std::string> inputs;  ///< names of prescribed signals used in `equations`
  std::vector<Equation> equations;
  std::vector<InputTiming> timing;  ///< of inputs that are not band-limited signals without dead time
  std::vector<std::pair<std::string, Estimate>> parameters;  ///< physical parameters: k1, k2, c, e, e_phase, ...
  std::optional<RotorModel> rotor;                           ///< the same as a rotor, when the model has that form
  /// Covariance of (k1, k2, c, eps_re, eps_im), row-major 5 x 5; empty when not known. Used to draw rotors for
  /// robustness.
  std::vector<double> rotor_covariance;
  /// Covariance of `parameters` in their order, row-major; empty when not known.
  std::vector<double> parameter_covariance;
  double sample_time = 0;  ///< of the training record, s
  /// What the x and y of a rotor's records are: displacement, velocity or acceleration. The equations are those of the
  /// displacement all the same.
  Quantity quantity = Quantity::displacement;
  double noise_sd = 0;  ///< noise of x and y estimated on the training record, rms, SI unit of `quantity`
  /// Correlation of a state's noise from one sample to the next (first-order autoregressive), where it is not white.
  std::vector<std::pair<std::string, double>> noise_correlation;
  std::vector<Ambiguity> ambiguities;  ///< what its records cannot tell apart
  Summary summary;
  Provenance provenance;

  const Estimate* parameter(const std::string& name) const;
  double noise_correlation_of(const std::string& state) const;  ///< 0: white
};

}  // namespace whirl
