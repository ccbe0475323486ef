#pragma once
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/records/check.hpp"
#include "whirl/report/figure.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/signal/motion_quantity.hpp"
#include "whirl/signal/window.hpp"

namespace whirl::pages {

/// A record under the name it has in figures.
struct ViewedRun {
  std::string name;
  Recording record;
  std::vector<std::string> left_out = {};  ///< what its figures say is left out, one line each
};

/// A record without the readings that its check leaves out: clipped, frozen, far off the curve.
struct CleanRecord {
  Recording record;
  std::vector<std::string> left_out;  ///< one line each, the record check's
};

/// In the motions, a few bad readings in a row are replaced by the curve through their neighbours. More of them are
/// replaced by the mean, the slope and the orders of the turns about them; NaN where fewer than half of these are read
/// or the angle is not known. What is left out is a remark on the record, too.
CleanRecord without_bad_samples(Recording record);
/// The same by a check that was made, without the remark.
Recording without_bad_samples(Recording record, const records::RecordReport& report,
                              const std::optional<diagnosis::Rotation>& turning);

/// The runs that a record holds. The log of a closed loop (channels x_open and x_true) holds two, "open loop" and
/// "closed loop", both with the names x, y, beta; any other record is one run called `name`, without its bad samples.
std::vector<ViewedRun> viewed_runs(const Recording& record, const std::string& name);

/// What a figure takes from its runs. Times in s of the record, 0 or empty: chosen from the record.
struct ViewOptions {
  std::vector<std::string> channels;  ///< empty: x and y, else the motions of the record, else its first channel
  double begin = -std::numeric_limits<double>::infinity();
  double end = std::numeric_limits<double>::infinity();
  double highest_frequency = 0;          ///< Hz
  double resolution = 0;                 ///< Hz between lines
  std::optional<signal::Window> window;  ///< Hann for spectra, flat top for maps, whose reader compares amplitudes
  /// Kind of amplitudes, and their unit: one of another motion (mm/s of an acceleration) asks for its integration,
  /// exact in the vectors of an order, from `lowest_frequency` (Hz) on in samples and their spectra.
  report::AmplitudeScale scale;
  double lowest_frequency = signal::Band{}.low;
  std::vector<double> orders{1, 2};         ///< of order tracks; Bode and polar plots take the first
  double bandwidth = 0;                     ///< Hz, of the Vold-Kalman filter
  int turns = 1;                            ///< revolutions per vector of Bode and polar plots
  double slow_roll = 0;                     ///< rad/s: the mean vector below this speed is taken off
  std::vector<double> natural_frequencies;  ///< Hz, marked in maps
  report::Phase phase = report::Phase::lag;
};

/// A figure by its name on the command line.
struct View {
  const char* name;
  const char* shows;
};
std::span<const View> views();

/// Draws `what`, one of `views()`. The first of several runs is drawn grey behind the others; maps show the last run.
/// Throws Error for an unknown name, and where a run lacks a channel or a rotor angle, naming it.
report::Figure view(const std::string& what, const std::vector<ViewedRun>& runs, const ViewOptions& options = {});

/// Bode ("bode", with the passages of critical speeds marked), polar ("polar") or Nyquist ("nyquist") plot of 1X
/// vectors.
report::Figure synchronous_view(const std::string& what, std::vector<signal::SynchronousCurve> curves,
                                report::Phase phase = report::Phase::lag, const report::AmplitudeScale& scale = {});

/// The unit written as a suffix (um, mil, mm_s, in_s, m_s2, g) with its quantity. Throws Error for what is no unit of a
/// displacement, velocity or acceleration.
std::pair<Quantity, report::Unit> motion_unit(const std::string& suffix);

}  // namespace whirl::pages
