#pragma once
#include <cmath>
#include <string>

#include "whirl/core/summary.hpp"
#include "whirl/identify/evidence.hpp"

namespace whirl::identification::detail {

/// The verdict on a model by its free runs, the same for every kind of model.
///
/// `unexplained`: what free runs leave of the motion beyond the noise, both rms. Unusable from 15 % on (or where it is
/// not a number); `run` begins the sentence ("the model leaves"), `cause` says what may be wrong. False when unusable.
bool judge_unexplained(double unexplained, const std::string& run, const std::string& cause, Summary& summary);
/// Warns of a residual that is larger than the noise: chi-square above 1.3. `consequence` ends the sentence. `share`:
/// what is left beyond the noise, by the motion, both rms; NaN: not known. True when it warned.
bool judge_chi_square(double chi_square, const std::string& consequence, Summary& summary, double share = NAN);
/// The verdict by a part of the records that a model of the rest predicts. Unusable where runs diverge or leave half of
/// the motion unexplained beyond the noise; a warning and no trust from twice the noise and 2 % of the motion on;
/// neither where the intervals of the rest hold the error; a warning where there is no prediction. A part that hardly
/// moves, or whose motion the rest leaves open by a quarter, tests nothing, which the trust says.
void judge_held_out(const HeldOut& held, Summary& summary);
/// Takes the trust from a model whose residual is far larger than the noise: chi-square above 2, unless what is left is
/// known to be less than a thousandth of the motion; above 4 always.
void judge_remaining(Summary& summary);
/// What the model may be trusted for, unless it is unusable.
void set_trust(const std::string& sentence, Summary& summary);

}  // namespace whirl::identification::detail
