#pragma once
#include <utility>
#include <vector>

#include "pulse_turns.hpp"
#include "whirl/signal/tacho_pattern.hpp"

namespace whirl::signal::detail {

/// Pulses in turns by the pattern of their marks. `mark[k]`: index into `pattern.marks`.
struct MarkedPulses {
  CountedPulses pulses;
  std::vector<std::size_t> mark;
  TachoPattern pattern;
};

/// Finds how many marks pass in a turn and where they stand:
///
///   1. Grossly uneven marks: the shortest period N of the intervals d, by the medians of
///      |log d(k+N) - 2 log d(k) + log d(k-N)|; pulses are then followed mark by mark (`follow_marks`).
///   2. Nearly even marks: pulses are counted by their common spacing (`count_turns`); N is the period of the places
///      without a pulse, else that of small deviations of the spacing, if they are beyond `quantum` and the halves of
///      the record agree.
///
/// `quantum`: steps of the times, s. Throws Error where no pattern holds, or it is not that of `known`.
MarkedPulses mark_pulses(const std::vector<double>& times, const TachoOptions& known, double quantum);

/// Grossly uneven marks: their number a turn, 2 to 12, or 0. `quantum`: steps of the times, s.
int uneven_marks(const std::vector<double>& times, double quantum);

/// First and last pulse of the longest stretch in which the intervals of a turn of `marks` are those of the turn
/// before.
std::pair<std::size_t, std::size_t> alike_turns(const std::vector<double>& times, int marks);

/// Follows `marks` marks, however they are placed, through pulses that may be lost or added.
MarkedPulses follow_marks(const std::vector<double>& times, int marks);

/// Share of lost and added pulses beyond which a pattern does not hold.
constexpr double kDamagedPulses = 0.12;

}  // namespace whirl::signal::detail
