#pragma once
#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "whirl/core/modal_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/core/stiffness_law.hpp"
#include "whirl/report/amplitude_scale.hpp"
#include "whirl/report/figure.hpp"
#include "whirl/signal/synchronous_curve.hpp"

namespace whirl::report {

/// The figures of a rotor's life, made from values of `core`. Each returns a Figure that the caller may still change
/// (size, title, more lines). All vectors SI; speeds rad/s, shown in rpm. Units of motions are those of `scale`.

/// A recording under the name it has in the legend. The first run of a list is drawn grey behind the others: the open
/// loop, or the reference.
struct NamedRun {
  std::string name;
  const Recording& recording;
};

/// A part of a run.
struct Segment {
  std::string name;
  double begin = 0, end = 0;  ///< s
};

/// One panel per channel over one time axis (paper Figs. 19, 21, 24), segments shaded. A run without the channel is
/// left out of its panel; throws Error when no run has it.
Figure time_traces(const std::vector<NamedRun>& runs, const std::vector<std::string>& channels,
                   const std::vector<Segment>& segments = {}, const AmplitudeScale& scale = {});

/// Largest radius sqrt(x^2 + y^2) of each `interval` (s) on a logarithmic axis, where runs of very different size are
/// both seen.
Figure radius(const std::vector<NamedRun>& runs, const std::vector<Segment>& segments = {}, double interval = 0.05);

/// Channels "ux", "uy" in newtons with their limit (paper Figs. 20, 22); limit 0 draws none.
Figure control_force(const std::vector<NamedRun>& runs, double limit, const std::vector<Segment>& segments = {});

/// Path of the disk centre (channels "x", "y") between two times, equal scales. With a channel "beta", a dot at each
/// full turn (keyphasor mark).
Figure orbit(const std::vector<NamedRun>& runs, double begin, double end, const AmplitudeScale& scale = {});

/// `channel` (displacement or velocity) against its rate, one panel per segment (paper Figs. 25-28). The rate is the
/// channel "d<channel>" when the recording has it, otherwise the central difference of two samples, which a noisy
/// record blurs.
Figure phase_plane(const std::vector<NamedRun>& runs, const std::string& channel, const std::vector<Segment>& segments,
                   const AmplitudeScale& scale = {});

/// Path in (time, y, x): the funnel of paper Fig. 23.
Figure funnel(const std::vector<NamedRun>& runs, const AmplitudeScale& scale = {});

/// A channel as measured and as the model runs free, with the difference below (paper Figs. 7-13). `model` has one
/// value per sample of the recording (NaN: not simulated). The rms difference stands in the panel's title.
Figure measured_and_model(const Recording& measured, const std::string& channel, const Eigen::VectorXd& model);

/// Readings of a stiffness test with the fitted law (paper Fig. 4). With `force_sd` > 0 (scatter of a reading, N) the
/// band that holds 95 % of readings.
Figure force_deflection(const Eigen::VectorXd& deflection, const Eigen::VectorXd& force, const StiffnessLaw& law,
                        double force_sd = 0);

/// Magnitude, phase and, where known, coherence of one channel (paper Fig. 6). `reconstruction` is the fitted response
/// on the same frequency axis or empty; modes are marked at their frequencies.
Figure frequency_response(const FrequencyResponse& response, Eigen::Index channel,
                          const Eigen::VectorXcd& reconstruction = {}, const std::vector<Mode>& modes = {});

/// One pole of a stabilisation diagram.
struct OrderPole {
  int order = 0;
  double frequency = 0;  ///< Hz
  bool stable = false;
};
/// Poles by model order over the summed magnitude of all channels; chosen frequencies (Hz) are marked.
Figure stabilisation(const FrequencyResponse& response, const std::vector<OrderPole>& poles,
                     const std::vector<double>& chosen = {});

/// One panel per mode: the shape (column of `shapes`, one row per entry of `points`) turned to its best real line and
/// scaled to a largest value of 1, its parts in phase and in quadrature as bars. Frequency and damping from `modes`.
Figure mode_shapes(const std::vector<std::string>& points, const Eigen::MatrixXcd& shapes,
                   const std::vector<Mode>& modes);

/// A spectrum under its name.
struct SpectrumCurve {
  std::string name;
  Eigen::VectorXd frequency;  ///< Hz; also negative (backward whirl) in a full spectrum
  Eigen::VectorXd amplitude;
};
/// One-sided spectra on a logarithmic amplitude axis, amplitudes of the kind of `scale`; `marks` (name, Hz) as vertical
/// lines.
Figure spectrum(const std::vector<SpectrumCurve>& curves, const AmplitudeScale& scale,
                Quantity quantity = Quantity::displacement,
                const std::vector<std::pair<std::string, double>>& marks = {});
/// Full spectrum of an orbit: forward whirl at positive, backward at negative frequency.
Figure full_spectrum(const std::vector<SpectrumCurve>& curves, const AmplitudeScale& scale,
                     Quantity quantity = Quantity::displacement);

/// Amplitudes over time and frequency as a colour map in dB below the largest: row = frequency, column = time. `speed`
/// (rad/s per column, may be empty) draws the 1X and 2X lines. A negative `frequency_low` (Hz, first row) is a map of
/// full spectra: backward whirl below zero.
Figure waterfall(double time_begin, double time_end, double frequency_high, const Eigen::MatrixXd& amplitude,
                 const AmplitudeScale& scale, const Eigen::VectorXd& speed = {}, double frequency_low = 0,
                 Quantity quantity = Quantity::displacement);

/// Spectra one behind the other at their rotor speeds (one column of `amplitude` per entry of `speed`, rad/s), rows
/// over `frequency` (Hz); 1X and 2X on the floor.
Figure cascade(const Eigen::VectorXd& speed, const Eigen::VectorXd& frequency, const Eigen::MatrixXd& amplitude,
               const AmplitudeScale& scale, Quantity quantity = Quantity::displacement);

/// Amplitudes over rotor speed and frequency (interference diagram from records): orders 1X, 2X, 3X as lines, natural
/// frequencies (Hz) as horizontal lines.
Figure run_map(double speed_low, double speed_high, double frequency_high, const Eigen::MatrixXd& amplitude,
               const AmplitudeScale& scale, const std::vector<double>& natural_frequencies = {},
               Quantity quantity = Quantity::displacement);

/// How a phase is counted. Lag, the industry's way: the angle by which the mark's passage precedes the peak, against
/// the rotation; lead is its negative, the argument of Z in x(t) = Re(Z exp(j beta)).
enum class Phase { lag, lead };

/// The curves of one figure share quantity and order; it states their amplitudes as `scale` says.
/// Bode plot: amplitude and phase of the synchronous vector against rpm.
Figure bode_1x(const std::vector<signal::SynchronousCurve>& curves, Phase phase = Phase::lag,
               const AmplitudeScale& scale = {});
/// Polar plot of the synchronous vector, `labels` speeds written beside the first curve. A lag is counted clockwise, a
/// lead counter-clockwise, so that a vector points the same way with either.
Figure polar_1x(const std::vector<signal::SynchronousCurve>& curves, Phase phase = Phase::lag,
                const AmplitudeScale& scale = {}, int labels = 6);
/// Nyquist plot: imaginary against real part of the synchronous vector (positive phase leads), equal scales.
Figure nyquist_1x(const std::vector<signal::SynchronousCurve>& curves, const AmplitudeScale& scale = {});

/// Amplitude and phase of orders followed through a run, with the speed below: one column of `envelope` (peak) per
/// order, one row per entry of `time` (s) and `speed` (rad/s).
Figure order_tracks(const Eigen::VectorXd& time, const Eigen::VectorXd& speed, const std::vector<double>& orders,
                    const Eigen::MatrixXcd& envelope, Quantity quantity = Quantity::displacement,
                    Phase phase = Phase::lag, const AmplitudeScale& scale = {});

/// One row of a suppression table.
struct Suppression {
  std::string name;                                                 ///< e.g. "through the natural frequency"
  double open = 0;                                                  ///< amplitude without control, m
  double closed = 0;                                                ///< with control, m
  double paper_percent = std::numeric_limits<double>::quiet_NaN();  ///< printed by the paper, or NaN
};
/// Amplitudes without and with control, and suppression 100 (1 - closed/open) beside the paper's value (Table 4).
Figure suppression(const std::vector<Suppression>& rows, AmplitudeKind kind);

}  // namespace whirl::report
