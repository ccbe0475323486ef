#pragma once
#include <string>
#include <vector>

#include "whirl/core/modal_model.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::modal {

/// How the responses to forces that act all the time are estimated.
struct ShakerOptions {
  std::vector<std::string> forces = {};  ///< names of the force channels; empty = all of quantity force
  std::string reference = {};            ///< point and direction of the only force; empty = name of its channel
  /// Motion taken as the input instead of a force (transmissibility); the responses must be of its quantity. Its point
  /// is held in the modes of such a set.
  std::string base = {};
  /// Hz between lines; 0 = the finest that leaves ten degrees of freedom a line for the noise, 8192 lines at most. A
  /// periodic force sets its own.
  double resolution = 0;
  double band_drop_db = 20;  ///< the band ends where a force has dropped by this much; 0 = keep all lines
};

/// Whether forces act all the time (shakers) in the records and not in blows: more than one is named, or one is above a
/// twentieth of its peak for more than 8 % of the record. `forces`: names of the channels; empty = those of quantity
/// force. Throws Error where some records hold blows and others do not.
bool excited_by_shakers(const std::vector<Recording>& recordings, const std::vector<std::string>& forces = {});

/// Frequency responses of every response channel to every force channel, from records in which shakers act: random,
/// burst random, swept sine, periodic random, one force or several at once that are not the same signal.
///
/// Local polynomial method (Pintelon and Schoukens, System Identification, 2nd ed., 2012, ch. 7): over the lines of one
/// step of the frequency axis, response = sum of G_j force_j + T with G_j and T of order two in frequency; T is what
/// the beginning and the end of the record leave, so that there is no window and no leakage. The steps share no lines:
/// the estimates are independent. A force that repeats itself (two periods at least) is seen at its harmonics alone;
/// there T comes from the lines between them. Variance from what the lines leave. `coherence` is that of the response
/// with all forces together (multiple coherence). Noise of the force is taken for nothing (as in H1).
///
/// Records may differ in length and must share dt and the names of their channels; stretches in
/// which a response stands still are left out, and so are responses cut off at their limits, each with a warning.
/// Throws Error for missing channels, mixed quantities, a record too short, or forces that cannot be told apart or have
/// no power on most lines of their band (stepped sine).
FrequencyResponse estimate_shaker_frf(const std::vector<Recording>& recordings, const ShakerOptions& options = {});

}  // namespace whirl::modal
