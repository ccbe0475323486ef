#pragma once
#include <array>
#include <string>
#include <vector>

#include "formats/format.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {

/// A numeric array of a MAT, HDF5 or NumPy file.
struct NamedArray {
  std::string group = {};  ///< arrays of one group share its time
  std::string name = {};
  std::string unit = {};  ///< stated beside the array; empty: perhaps behind the name
  Eigen::MatrixXd value = {};
  Eigen::MatrixXd imaginary = {};  ///< empty when real
  /// Of three dimensions, whose values stand in one column, the first index running fastest; else zeros.
  std::array<Eigen::Index, 3> sizes = {};
  double step = 0;   ///< stated beside the array, s; 0 = not stated
  double start = 0;  ///< s

  bool is_cube() const { return sizes[0] > 0; }
};

/// Arrays as signals. `t` or `time` is the time of the arrays as long as itself, `freq` their frequency; failing these
/// the scalars `dt` (s) or `fs` (Hz) of the group. The side as long as the axis runs along it, else the longest; of
/// three dimensions the others, in their order, are response and reference. Two real arrays over a frequency that are
/// named as parts (H_re and H_im, H_mag and H_phase_deg) become one complex array.
///
/// What a file of frequency responses leaves open (unit of the frequencies, which side the lines are) is taken from
/// `wanted`; an Error says what must be stated. Without `wanted` it is a finding.
void add_arrays(SignalFile& file, std::vector<NamedArray> arrays, const ResponseOptions* wanted = nullptr);

/// Values of up to three dimensions, stored with the first (`columns_first`) or the last index running fastest.
void set_values(NamedArray& array, const Eigen::VectorXd& real, const Eigen::VectorXd& imaginary,
                const std::vector<std::size_t>& shape, bool columns_first);

/// Name without unit in lower case, for the words that mean an axis or a part.
std::string word_of(const NamedArray& array);

/// `add_arrays`' first step: real and imaginary part, or magnitude and phase, of one array in two. `lines` are the
/// lengths of the frequency axes.
void join_parts(SignalFile& file, std::vector<NamedArray>& arrays, const std::vector<Eigen::Index>& lines,
                const ResponseOptions* wanted);

/// Which unit the numbers of an even axis of frequencies speak for. Steps are set as short numbers: a step of
/// 1.5707963 is 0.25 Hz in rad/s.
enum class AxisUnit { hertz, rad_s, open };
AxisUnit unit_by_numbers(const Eigen::VectorXd& values);

/// Complex signals over a uniform frequency as frequency responses; nothing when there are none. The kind is that of
/// the unit ("m/s^2/N"); without one it is that of the options, in SI. Throws Error when neither says it, and when
/// arrays over a frequency, and no record, are there that are none.
std::optional<FrequencyResponse> responses_of(const SignalFile& file, const ResponseOptions& options);

}  // namespace whirl::io
