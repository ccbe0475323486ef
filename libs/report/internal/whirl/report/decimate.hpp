#pragma once
#include <Eigen/Core>
#include <vector>

namespace whirl::report {

/// Indices of the samples that draw the same line as all samples when `columns` pixels cover [x_low, x_high]: first,
/// smallest, largest and last sample of each pixel column, in order. x ascends. Samples with a NaN are kept one per
/// run, so that a gap stays a gap; the neighbours of the range's ends are kept, so that the line enters and leaves the
/// plot.
std::vector<Eigen::Index> decimate_columns(const Eigen::Ref<const Eigen::VectorXd>& x,
                                           const Eigen::Ref<const Eigen::VectorXd>& y, double x_low, double x_high,
                                           int columns);

/// Smallest and largest of each of `columns` equal groups of samples, 2 x columns (row 0 smallest). NaN where a group
/// has no finite sample. Never more columns than samples.
Eigen::Matrix2Xd min_max(const Eigen::Ref<const Eigen::VectorXd>& samples, Eigen::Index columns);

}  // namespace whirl::report
