#pragma once
#include <string>
#include <vector>

#include "whirl/core/modal_model.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::modal {

/// Where a record of hammer blows is cut. Times in s.
struct BlowCuts {
  double trigger = 0.2;       ///< a blow starts where the force exceeds this fraction of the record's largest force
  double pre_trigger = 0.02;  ///< kept before the trigger, for the DC; shortened when the record starts later
  double separation = 0.5;    ///< a pulse sooner than this after a blow's trigger is a rebound, not the next blow
  double duration = 0;        ///< of one blow, from its first kept sample; 0 = up to the next blow or the end
};

struct BlowWindows {
  bool force = true;    ///< 1 until the pulse has ended, then a cosine taper to 0
  double taper = 1e-3;  ///< its length, s
  double end = 1;       ///< value of the exponential window at the end of the blow, in (0, 1]; 1 = none
};

/// Blows that do not enter the average.
struct BlowExclusions {
  bool overloads = true;        ///< overloaded and damaged ones
  bool double_hits = false;     ///< those with a second hit
  bool odd = true;              ///< those that certainly disagree with most others (sign, gain, delay)
  std::vector<int> blows = {};  ///< counted from 1 over all recordings
};

/// How hammer blows are cut, windowed and averaged.
struct FrfOptions {
  FrfEstimator estimator = FrfEstimator::h1;
  double noise_ratio = 1;      ///< Hv only: response noise power / force noise power, in SI (k of the definition)
  std::string force = {};      ///< name of the force channel; empty = the only channel of quantity force
  std::string reference = {};  ///< name of the point and direction hit; empty = name of the force channel
  BlowCuts cut = {};
  BlowWindows window = {};
  double converter_range = 0;  ///< largest |value| of the force channel's converter, N; 0 = unknown
  bool repair = false;         ///< bridge single samples that look like spikes; else they are only reported
  BlowExclusions exclude = {};
  double band_drop_db = 20;  ///< the band ends where the force spectrum has dropped by this much; 0 = keep all lines
};

/// A further pulse of the hammer after the main one.
struct SecondHit {
  double time = 0;   ///< after the main peak, s
  double ratio = 0;  ///< of its peak to the main peak
};

/// What was found on one blow. Nothing is dropped silently: `used` says whether it entered the average.
struct BlowReport {
  double time = 0;         ///< of the force peak in its recording, s
  double peak = 0;         ///< N
  double pulse_width = 0;  ///< of the part above 10 % of the peak, s
  bool force_overload = false;
  std::vector<std::string> overloaded_responses;
  std::vector<SecondHit> second_hits;
  std::vector<std::string>
      disagreements;                     ///< with the other blows: reversed, another gain or unit, delayed, incoherent
  std::vector<std::string> damage = {};  ///< responses that stand still or read zero while the structure moves
  bool used = true;
};

struct BlowCheck {
  bool overload = false;
  double time = 0, peak = 0, pulse_width = 0;
  std::vector<SecondHit> second_hits;
};

/// Examines the force signal of one blow: pulse, overload (two or more equal samples at the extreme, 99.5 % of a known
/// converter range, or a flat top) and further hits, in the time domain, so that the length of the record does not
/// matter.
BlowCheck check_blow(const Eigen::Ref<const Eigen::VectorXd>& force, double dt, double converter_range = 0);

/// True when the signal stays at its extreme for two or more samples, or reaches 99.5 % of a known converter range.
bool is_overloaded(const Eigen::Ref<const Eigen::VectorXd>& x, double converter_range = 0);

/// The blows of a recording, each as a recording of its own that starts `pre_trigger` before the trigger.
std::vector<Recording> split_blows(const Recording& recording, const FrfOptions& options = {});

/// Frequency responses of every response channel to the force channel, averaged over blows.
///
/// H1 = S_af/S_ff, H2 = S_aa/S_fa, Hv = total least squares with noise_ratio k (k -> infinity gives H1, 0 gives H2).
/// The DC of each channel is removed with its pre-trigger samples only; the exponential window is the same function on
/// force and response, and its decay 1/tau is returned as `window_decay` for `fit_modes` to remove. No Hann window, no
/// separate normalisation of the channels. Coherence and variance, var|H1| = |H1|^2 (1 - gamma^2)/(2 n gamma^2), exist
/// for two or more blows only. Responses must be one quantity (displacement, velocity or acceleration), which sets the
/// kind; a channel in volts must be calibrated first. Recordings may hold one blow or several, and must share dt.
/// Throws Error for missing channels, mixed quantities or no blow; quality findings are warnings in the summary.
FrequencyResponse estimate_frf(const std::vector<Recording>& recordings, const FrfOptions& options = {},
                               std::vector<BlowReport>* reports = nullptr);

/// Joins responses to several references (hammer points), measured on the same frequency axis, in bands of their
/// own, and of the same kind.
/// Throws Error when they differ in these or a pair of response and reference comes twice.
FrequencyResponse join_references(const std::vector<FrequencyResponse>& parts);

}  // namespace whirl::modal
