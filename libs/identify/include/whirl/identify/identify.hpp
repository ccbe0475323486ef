#pragma once
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/identify/compare.hpp"
#include "whirl/identify/drive.hpp"
#include "whirl/identify/evidence.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/paper.hpp"
#include "whirl/identify/second_order.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/identify/validate.hpp"

namespace whirl::identification {

/// How equations are found. `automatic`: `weak` for records with beta and the motion x, y or one of them when no states
/// are asked for, else `sindy`.
enum class Method { automatic, weak, paper, consistent, second_order, sindy, drive };
/// "weak", "second-order", ...; `automatic` is "automatic".
std::string_view to_string(Method method);
/// Throws Error for another name.
Method method_of(const std::string& name);

/// sum of weight * coefficient <= limit, in SI units. A coefficient is called as in `parameters` of the model: "v':
/// x^3", with a library file its group.
struct LinearBound {
  std::vector<std::pair<std::string, double>> weights;
  double limit = 0;
  std::string text;  ///< as given, for messages
};
/// "[v': x] + 2*[v': v] <= -1", or >=: numbers, and names in brackets (library groups also without). Throws Error.
LinearBound linear_bound(const std::string& text);

/// What the equations of Method::sindy must keep. The terms are those that the records ask for; then their coefficients
/// are the most likely ones within the bounds, by the quadratic approximation of the likelihood, with intervals along
/// the active ones. Those are warnings that say what the records ask for. Not for maps, hidden states, denominators,
/// sign bounds and unrefined models: Error.
struct ModelBounds {
  std::vector<LinearBound> linear;
  /// Least rate, 1/s, at which every mode of the part linear about the origin decays; NaN: free.
  double least_decay = std::numeric_limits<double>::quiet_NaN();
  /// The model is one whose motion stays bounded from any start, with a certificate (`Trapping`). For terms up to
  /// degree 2 in the states (the default library then), without inputs. Not together with `least_decay`. Error where no
  /// such model lies near the records.
  bool trapping = false;

  bool any() const { return !linear.empty() || trapping || least_decay == least_decay; }
};

struct IdentifyOptions {
  Method method = Method::automatic;
  RotorIdentifyOptions rotor;                     ///< Method::weak
  PaperOptions paper;                             ///< Method::paper; also the regressors of `compare_methods`
  ConsistentOptions consistent;                   ///< Method::consistent
  SecondOrderOptions second_order;                ///< Method::second_order
  SindyOptions sindy;                             ///< Method::sindy; states: by default all channels that are no inputs
  std::optional<expr::CandidateLibrary> library;  ///< Method::sindy with exactly these terms
  DriveOptions drive;                             ///< Method::drive; without a part held out
  /// Share of a single record kept out of a second fit, to be predicted, 0.05 to 0.8; of several records the last is
  /// held out. 0: no second fit.
  double holdout = 0.3;
  ModelBounds bounds;
  /// Told what is done and how far it is, 0 to 1. May be empty.
  std::function<void(const std::string&, double)> progress;

  /// The method that `records` of these channels get; never `automatic`.
  Method chosen(const Recording& like) const;
};

/// Amplitudes and speeds that records of a rotor covered: beyond them a model extrapolates.
struct DataRange {
  double amplitude = std::numeric_limits<double>::infinity();      ///< m peak, radius about the mean
  double low = 0, high = std::numeric_limits<double>::infinity();  ///< rotor speed, rad/s
  /// 5 % beyond the speeds count as held: those of the records are means, a run ends a little inside what was asked
  /// for.
  bool holds(double a, double omega) const { return a <= amplitude && omega >= 0.95 * low && omega <= 1.05 * high; }
  /// What of a motion up to the radius `a` (m) between the speeds `from` and `to` (rad/s) is extrapolation; empty:
  /// nothing.
  std::string beyond(double a, double from, double to) const;
};
/// Of records with x, y and beta. A single reading apart from both its neighbours counts as they do; the speeds are
/// means over fiftieths of a record, so that an encoder's steps do not count. Infinite amplitude where x is a velocity
/// or an acceleration.
DataRange data_range(const std::vector<Recording>& records);

/// Certificate that every motion of a quadratic model ends within a ball (Schlegel and Noack 2015, J. Fluid Mech. 765):
/// the energy E = sum weights_i (x_i - shift_i)^2 / 2 falls wherever sqrt(2 E) > radius.
struct Trapping {
  std::vector<std::string> states;
  std::vector<double> shift;    ///< units of the states
  std::vector<double> weights;  ///< > 0; 1 unless the records ask for others
  double eigenvalue = 0;        ///< < 0, 1/s: largest of the symmetric part of the slope about the shift
  double radius = 0;            ///< in the norm of the weights
};

/// What speaks for a model beside its own summary.
struct Evidence {
  HeldOut held_out;
  /// Resonances of a rotor that the records without the part held out do not pass (held_out_cannot_check): there the
  /// part held out is no evidence.
  std::vector<Finding> not_shown;
  std::vector<CollinearGroup> collinear;
  std::vector<BoundOutcome> bounds;      ///< one per sign bound and term
  std::vector<std::string> assumptions;  ///< what is taken for granted where a channel is missing; of a rotor
  std::optional<DataRange> range;        ///< of a rotor seen by two probes
  std::optional<Trapping> trapping;      ///< where it was asked for; of the model as it is, by evaluating it
};

/// A model and what speaks for and against it.
struct Identification {
  IdentifiedModel model;
  Evidence evidence;
  Summary summary;  ///< the verdict on the model by all evidence; the same as model.summary

  /// May the numbers be used, if only with the stated warnings?
  bool usable() const { return summary.status != Status::unusable; }
};

/// Equations of motion from records of a rotor or of any system: the call behind `whirl identify`.
///
/// Fits the model to all records, then, unless `holdout` is 0, fits a second one without the part held out and predicts
/// that part by it. A rotor's run is predicted from its own initial state, another record's with its own unbalance
/// (2 numbers) too. Missing half of its motion makes the summary unusable, twice the noise takes the trust. Throws
/// Error for missing channels, options out of range, or several records for a method that takes one.
Identification identify(const std::vector<Recording>& records, const IdentifyOptions& options = {});
inline Identification identify(const Recording& record, const IdentifyOptions& options = {}) {
  return identify(std::vector<Recording>{record}, options);
}

/// Gives the next part of a record; false at its end.
using NextPart = std::function<bool(Recording&)>;

/// The same by Method::sindy for one record of any length in bounded memory, read twice: `open` begins it anew.
/// `source` names it. Options of the sought system may depend on the first part: `sindy_of`.
Identification identify_stream(const std::function<NextPart()>& open, const std::string& source,
                               const std::function<SindyOptions(const Recording& first)>& sindy_of,
                               const IdentifyOptions& options = {});

/// One line of a comparison of methods.
struct MethodRow {
  ComparedFit fit;
  HeldOut held_out;
};
struct MethodComparison {
  std::string what;  ///< what was held out
  std::vector<MethodRow> rows;
  Summary summary;  ///< unusable when no method predicts the part held out better than its mean does
};
/// Every regression method on one record, its library and its held-out part, and the methods of whirl that need no
/// choice of regressor. Throws Error for Method::second_order and for several rotor records.
MethodComparison compare_methods(const std::vector<Recording>& records, const IdentifyOptions& options = {});

/// Scores of a model on data not used for it; `what` describes them. A prediction that cannot be made has its reason.
HeldOut predict_held_out(const IdentifiedModel& model, const Recording& test, std::string what, bool rotor,
                         const ValidateOptions& options = {});
/// Largest nrmse of the scores; infinite when a run diverges.
double worst_nrmse(const std::vector<StateScore>& scores);

}  // namespace whirl::identification
