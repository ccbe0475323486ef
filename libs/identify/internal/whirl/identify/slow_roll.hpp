#pragma once
#include <complex>
#include <vector>

#include "whirl/identify/identify.hpp"

namespace whirl::identification {

/// What the probes read of a shaft that hardly turns: vectors that turn with the angle, runout of the track and bow of
/// the shaft together.
struct SlowRoll {
  std::vector<std::complex<double>> vectors;  ///< of e^{i beta}, e^{-i beta}, e^{2 i beta}, e^{-2 i beta}, ..., m
  double sd = 0;                              ///< of each part of a vector, m
  double speed = 0;                           ///< largest speed of the record, rad/s
};

/// How the vector at order 1 is read.
enum class SlowRollMeaning {
  unknown,  ///< runout or bow: the interval of e covers both
  runout,   ///< of the probe's track; the shaft is straight
  bow,      ///< of the shaft; the track is true (burnished, or measured on a second probe plane)
};
/// "unknown", "runout" or "bow"; throws Error for another name.
SlowRollMeaning slow_roll_meaning(const std::string& name);

/// Least squares of mean, drift and the orders 1 .. `harmonics`, forward and backward, on a record at slow roll.
/// Throws Error for missing channels or a record of fewer than 2 turns.
SlowRoll measure_slow_roll(const Recording& record, const RotorRecordOptions& options = {}, int harmonics = 3);

/// The readings of x and y without the slow-roll vectors.
Recording without_slow_roll(const Recording& record, const SlowRoll& roll, const RotorRecordOptions& options = {});

/// `identify` by Method::weak after vector subtraction of the slow roll, as laboratories do it. The motion that the
/// unbalance causes at the speed of the slow roll itself is taken off the vectors by the model found, and the records
/// are identified again. The vectors stand in the parameters as runout1+_re ... , so that `validate` reads them in.
///
/// e drives the motion without the slow roll, which is what a shop balances. A bow b turns with the unbalance e of the
/// mass and drives that motion like e + b (1 - i c / omega): SlowRollMeaning::bow gives e of the mass,
/// SlowRollMeaning::unknown an interval that covers both. Throws Error for other methods.
Identification identify_with_slow_roll(const std::vector<Recording>& records, const Recording& slow,
                                       const IdentifyOptions& options, SlowRollMeaning meaning);

}  // namespace whirl::identification
