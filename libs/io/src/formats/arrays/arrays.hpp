#pragma once
#include <optional>
#include <string>
#include <vector>

#include "formats/format.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {

/// A numeric array of a MAT or HDF5 file.
struct NamedArray {
  std::string group = {};  ///< arrays of one group share its time
  std::string name = {};
  std::string unit = {};  ///< stated beside the array; empty: perhaps behind the name
  Eigen::MatrixXd value = {};
  Eigen::MatrixXd imaginary = {};  ///< empty when real
  Eigen::Index inner = 0;          ///< of three dimensions: columns are pairs, the second of so many; else 0
  double step = 0;                 ///< stated beside the array, s; 0 = not stated
  double start = 0;                ///< s
};

/// Arrays as signals. `t` or `time` is the time of the arrays as long as itself, `freq` their frequency; failing these
/// the scalars `dt` (s) or `fs` (Hz) of the group. The longer side of a matrix runs along the abscissa.
void add_arrays(SignalFile& file, const std::vector<NamedArray>& arrays);

/// Values of up to three dimensions, stored with the first (`columns_first`) or the last index running fastest. Of
/// three the longest runs along the abscissa; the others, in their order, are response and reference.
void set_values(NamedArray& array, const Eigen::VectorXd& real, const Eigen::VectorXd& imaginary,
                const std::vector<std::size_t>& shape, bool columns_first);

/// Complex signals over a uniform frequency as frequency responses; nothing when there are none. The kind is that of
/// the unit ("m/s^2/N"); without one it is `kind`, in SI. Throws Error when neither says it.
std::optional<FrequencyResponse> responses_of(const SignalFile& file, std::optional<FrfKind> kind);

/// `Format::read_responses` of a format whose `read` gives arrays.
template <Format (*format)()>
std::optional<FrequencyResponse> responses_of_file(const std::filesystem::path& path, std::optional<FrfKind> kind) {
  return responses_of(format().read(path, {}), kind);
}

}  // namespace whirl::io
