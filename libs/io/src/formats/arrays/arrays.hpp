#pragma once
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/format.hpp"
#include "formats/parts/rows.hpp"
#include "formats/parts/stored_numbers.hpp"
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
  double step = 0;                      ///< stated beside the array, s; 0 = not stated
  double start = 0;                     ///< s
  std::string integers = {};            ///< how messages call it, where it holds integers of 64 bits
  std::optional<PartOfAxis> part = {};  ///< a part of its rows alone is here, not in SI

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

/// Where the numbers of an array stand.
struct StoredPart {
  NumberType type = NumberType::float64;
  std::uint64_t at = 0, width = 0;  ///< first row; bytes from one to the next
  std::uint64_t offset = 0;         ///< of the number in its row
};

/// An array as it stands in a file.
struct StoredArray {
  NamedArray head = {};                        ///< without values
  std::shared_ptr<const RandomBytes> in = {};  ///< the file, or what was unpacked of it
  StoredPart real = {};
  std::optional<StoredPart> imaginary = {};
  bool big = false, columns_first = true;
  std::vector<std::size_t> shape = {};

  std::size_t size() const;
  NamedArray load() const;
  /// Rows first .. first + count along the dimension of `rows` rows, of one with two dimensions at most.
  NamedArray load(Eigen::Index first, Eigen::Index count, Eigen::Index rows) const;
};

/// The arrays of a file; `take` gets them one by one, and `file` the rest. `most_unpacked`: bytes of a packed one.
using TakeArray = std::function<void(StoredArray&&)>;
using ReadArrays = void (*)(const std::shared_ptr<const RandomBytes>& bytes, std::size_t most_unpacked,
                            SignalFile& file, const TakeArray& take);
/// All of them, as signals.
SignalFile read_arrays(const std::shared_ptr<const RandomBytes>& bytes, ReadArrays read,
                       const ResponseOptions* wanted = nullptr);
/// The arrays of the file as the channels of one record, to be read in parts.
std::unique_ptr<SignalStream> stream_arrays(const std::filesystem::path& path, ReadArrays read, const PartRows& rows);
/// How long the record is that these arrays are: as their time, failing that as the longest. Small ones beside it are
/// taken out, with a finding. Throws Error where one has so many other values that it is a record too.
Eigen::Index rows_of_record(std::vector<StoredArray>& arrays, SignalFile& file);

/// What integers of 64 bits lose, into `file.rounded`.
void note_rounding(SignalFile& file, const std::string& name, const Eigen::Ref<const Eigen::MatrixXd>& values);
/// The same as findings.
void tell_rounding(SignalFile& file);

/// Values of up to three dimensions, stored with the first (`columns_first`) or the last index running fastest.
void set_values(NamedArray& array, const Eigen::VectorXd& real, const Eigen::VectorXd& imaginary,
                const std::vector<std::size_t>& shape, bool columns_first);

/// True for a name that means the time of the arrays beside it.
bool names_time(const NamedArray& array);

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

/// A format whose files hold arrays, which begin with what `recognises`: read whole, in parts, and as responses.
template <ReadArrays Read>
Format format_of_arrays(FileFormat id, std::string_view words, std::vector<std::string_view> extensions,
                        bool (*recognises)(std::string_view head)) {
  Format f{id, words, std::move(extensions), recognises, true};
  f.read = [](const std::filesystem::path& path, const CsvOptions&) {
    return read_arrays(std::make_shared<RandomBytes>(path, kMostRead), Read);
  };
  f.stream = [](const std::filesystem::path& path, const CsvOptions&, const PartRows& rows) {
    return stream_arrays(path, Read, rows);
  };
  f.read_responses = [](const std::filesystem::path& path, const ResponseOptions& options) {
    return responses_of(read_arrays(std::make_shared<RandomBytes>(path, kMostRead), Read, &options), options);
  };
  return f;
}

}  // namespace whirl::io
