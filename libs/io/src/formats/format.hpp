#pragma once
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "whirl/core/modal_model.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/record_stream.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {

/// All that the rest of the tree asks of one file format. A null function: the format has no such thing.
struct Format {
  FileFormat id;
  std::string_view words;                    ///< in messages, e.g. "WAV"
  std::vector<std::string_view> extensions;  ///< the first is the one that messages name
  /// By the first bytes of the content (64 KB at most), whatever the name says.
  bool (*recognises)(std::string_view head);
  bool magic = false;  ///< the first bytes leave no doubt
  SignalFile (*read)(const std::filesystem::path& path, const CsvOptions& options) = nullptr;
  void (*write)(const std::filesystem::path& path, const Recording& recording) = nullptr;
  std::string_view missing = {};  ///< what a missing value becomes there; empty: it cannot be written
  /// The same of a record in parts: its first part, which is read, and what follows; `rows` of all together.
  void (*write_parts)(const std::filesystem::path& path, const Recording& first, RecordStream& rest,
                      Eigen::Index rows) = nullptr;
  /// Nothing when the file holds none. The options are used where the file does not say it.
  std::optional<FrequencyResponse> (*read_responses)(const std::filesystem::path& path,
                                                     const ResponseOptions& options) = nullptr;
  void (*write_responses)(const std::filesystem::path& path, const FrequencyResponse& frf) = nullptr;
  /// The file in parts: of a RowReader (parts/rows.hpp), where its rows can be found without reading those before.
  std::unique_ptr<SignalStream> (*stream)(const std::filesystem::path& path, const CsvOptions& options,
                                          const PartRows& rows) = nullptr;
};

/// One function per format, in the format's own source, listed in formats.cpp.
Format hdf5_format();
Format mat_format();
Format mat4_format();
Format numpy_format();
Format tdms_format();
Format wav_format();
Format lvm_format();
Format json_format();
Format atfx_format();
Format uff_format();
Format csv_format();

/// Words of the signal format that the ending names, or that a magic number at the start shows; empty: none.
std::string_view words_of_ending(std::string_view ending);
std::string_view words_of_magic(std::string_view head);

/// Motion that a response of this kind has, and back; nothing for what is no motion.
Quantity motion_of(FrfKind kind);
std::optional<FrfKind> kind_of_motion(Quantity motion);

/// Content of a text file without byte order mark and leading blanks.
std::string_view without_blanks(std::string_view head);

bool reads_in_parts(const std::filesystem::path& path);

/// Bytes of the largest file that is read at once.
constexpr std::uint64_t kMostRead = std::uint64_t{1} << 30;

std::unique_ptr<SignalStream> stream_csv(const std::filesystem::path& path, const CsvOptions& options,
                                         const PartRows& rows);
/// `Recording::check`, where missing values (NaN) may stand.
void check_with_gaps(const Recording& recording);
/// As `write_csv` in SI, a missing value (NaN) as an empty cell.
void write_csv_with_gaps(const std::filesystem::path& path, const Recording& record);
void write_csv_parts(const std::filesystem::path& path, const Recording& first, RecordStream& rest, Eigen::Index rows);

}  // namespace whirl::io
