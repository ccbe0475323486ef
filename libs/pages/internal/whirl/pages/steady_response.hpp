#pragma once
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/io/json.hpp"
#include "whirl/report/figure.hpp"
#include "whirl/response/continuation.hpp"
#include "whirl/response/curve_band.hpp"
#include "whirl/response/sweep_peaks.hpp"
#include "whirl/response/synchronous.hpp"

namespace whirl::pages {

using identification::DataRange;

struct SteadyOptions {
  response::CurveOptions curve;  ///< range in rad/s
  std::string input;             ///< that forces the model as amplitude * cos(Omega t); empty: the unbalance
  std::string base;        ///< coordinate along which the support moves as amplitude * cos(Omega t); no input then
  double amplitude = 0;    ///< of the input or the support, in its unit, 0 to peak
  std::string coordinate;  ///< whose amplitude is stated; empty: `base`, else the first, or the radius of a rotor
  double unbalance = 1;    ///< times the identified eccentricity
  bool isolas = false;     ///< look for closed curves apart from this one
  double peaks_to = 0;     ///< peaks of slow sweeps for 40 forcings up to this many times the stated one; 0: none
  std::vector<double> at;  ///< rad/s, within the range: speeds whose answers are listed
  std::optional<DataRange> known;  ///< of the record that the model was found from
};

/// One of the answers at a speed.
struct SteadyAnswer {
  double omega = 0;      ///< rad/s
  double amplitude = 0;  ///< as that of the curve
  bool stable = false;
};

/// Steady answers of a model over speed: the curve, those beside it, their peaks.
struct SteadyResponse {
  response::ResponseCurve curve;
  std::vector<response::ResponseCurve> branches;  ///< where a sweep from the far end begins: joined beyond the range
  std::vector<response::ResponseCurve> isolas;    ///< closed, apart from the curve
  std::optional<response::PeakCurve> peaks;       ///< over multiples of the stated forcing
  std::optional<response::CurveBand> band;        ///< over the covariance of the model; none where it states none
  std::optional<RotorModel> rotor;                ///< with the unbalance asked for, where it is one
  bool plain_rotor = false;                       ///< it has no force beyond RotorModel: its backbone is known
  std::vector<SteadyAnswer> answers;              ///< at the speeds asked for, stable or not, of all curves
  DataRange known;
  bool radius = false;   ///< amplitudes are sqrt(x^2 + y^2), m; else |q| of `coordinate`
  bool turning = false;  ///< forced by the unbalance, not by an input or the support
  std::string coordinate;
  Eigen::Index index = 0;  ///< of `coordinate` in the solutions
  Summary summary;

  double amplitude(const response::PeriodicSolution& s) const {
    return radius ? response::ResponseCurve::radius(s) : response::ResponseCurve::peak(s, index);
  }
  /// With its unit, where it has one.
  std::string amplitude_text(double amplitude) const;
};

/// Harmonic balance with arclength continuation. Warns of a range that looks like Hz, and of points beyond
/// `options.known`. Throws Error for a range that is not positive, and an input or a
/// coordinate that the model does not have.
SteadyResponse steady_response(const IdentifiedModel& model, SteadyOptions options);

/// The question whether speeds (rad/s) are in Hz, where they lie far below the critical one; else nothing.
std::string doubt_of_hertz(const std::string& what, double low, double high, double critical);

/// Amplitude and phase over speed with stability, folds, backbone and band.
report::Figure steady_figure(const SteadyResponse& found);
/// The peaks over the size of the forcing.
report::Figure steady_peak_figure(const SteadyResponse& found);
/// The points as a table that `read_bode_table` takes: rpm, amp (peak; in um for a rotor), phase_deg, and curve (0 the
/// curve, then branches and isolas), stable, extrapolated.
std::string steady_csv(const SteadyResponse& found);
/// `whirl.response/1`.
io::Json to_json(const SteadyResponse& found);

}  // namespace whirl::pages
