#pragma once
#include <string>
#include <vector>

#include "whirl/io/signals.hpp"

namespace whirl::io {

/// A numeric array of a MAT or HDF5 file.
struct NamedArray {
  std::string group = {};  ///< arrays of one group share its time
  std::string name = {};
  std::string unit = {};  ///< stated beside the array; empty: perhaps behind the name
  Eigen::MatrixXd value = {};
  Eigen::MatrixXd imaginary = {};  ///< empty when real
  double step = 0;                 ///< stated beside the array, s; 0 = not stated
  double start = 0;                ///< s
};

/// Arrays as signals. `t` or `time` is the time of the arrays as long as itself, `freq` their frequency; failing these
/// the scalars `dt` (s) or `fs` (Hz) of the group. The longer side of a matrix runs along the abscissa.
void add_arrays(SignalFile& file, const std::vector<NamedArray>& arrays);

}  // namespace whirl::io
