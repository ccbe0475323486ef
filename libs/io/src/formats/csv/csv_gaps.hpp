#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::io::detail {

/// Takes channels sampled at increasing, uneven times `t` onto an even grid.
///
/// Where the times lie on a grid with holes, within `allowed_share` of a step and `rounding` (s), samples stay as they
/// are. Otherwise every sample is moved to the instant next to it (signal::onto_even_grid); an angle loses its wraps.
/// Holes (more than two missing samples, far beyond the spread of the steps) become NaN; shorter ones are bridged. Sets
/// t0, dt and the samples of `record`, whose channels go with `t`, and says what was done, in one sentence. Throws
/// Error with the line of `stream` where less than a tenth of the grid would hold samples (one wrong time stamp must
/// not ask for any amount of memory), and where more than 15 % of the samples are missing in short holes.
std::string take_to_even_grid(const CsvStream& stream, const Eigen::VectorXd& t, double allowed_share, double rounding,
                              Recording& record);

}  // namespace whirl::io::detail
