#pragma once
#include <Eigen/Core>

#include "whirl/core/recording.hpp"
#include "whirl/identify/rotor_record.hpp"

namespace whirl::identification::detail {

/// Which of x and y a record has, by RotorRecordOptions::one_axis; one alone is said in the summary.
Axes measured_axes(const Recording& recording, const RotorRecordOptions& options, Summary& summary);

/// The axis that is not measured: the motion of an isotropic rotor that whirls with its rotation is the analytic signal
/// of the one that is. Where the start of a fit comes from; its samples are not usable.
void fill_unseen_axis(RotorRecord& record);

/// State of the unseen axis at sample 0 where a circular whirl has it, and how far it may lie from there (free
/// vibration): a tenth of a percent of the motion to all of it. Neither can be seen but through the cubic spring.
struct UnseenStart {
  double place = 0, rate = 0;        ///< m, m/s
  double place_sd = 0, rate_sd = 0;  ///< m, m/s
};
UnseenStart unseen_start(const RotorRecord& record);

}  // namespace whirl::identification::detail
