#pragma once
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>

#include "whirl/core/recording.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {

/// Which rows of a file are read, and how many at once.
struct PartRows {
  Eigen::Index first = 0, end = std::numeric_limits<Eigen::Index>::max();
  Eigen::Index each = 65536;  ///< of a part; fewer where a file has many channels
};

/// Signals of a file of any length, part by part, in memory for one part.
class SignalStream {
 public:
  virtual ~SignalStream() = default;
  /// False at the end. A part is as `read_signals` gives the whole file, start of its tables included, but of every
  /// channel with the values of its rows alone. What is suspicious is said once, of the whole at the end. Throws Error
  /// as reading the whole would, and for what cannot be read in parts, before memory is taken.
  virtual bool next(SignalFile& part) = 0;
  /// Share of the rows that are read, 0 to 1.
  virtual double done() const = 0;
  /// Of all parts together; 0: not known before they are read.
  virtual Eigen::Index rows() const { return 0; }
};

/// A record of any length, part by part.
class RecordStream {
 public:
  /// `progress` is told the share that is done.
  RecordStream(std::unique_ptr<SignalStream> signals, const CsvOptions& options, Eigen::Index first,
               std::function<void(double)> progress = {});
  /// False at the end. `t0` is that of the part.
  bool next(Recording& part);
  /// Rows before the next part, and time of row 0.
  Eigen::Index row() const { return row_; }
  double start() const { return start_; }
  Eigen::Index rows() const { return signals_->rows(); }

 private:
  std::unique_ptr<SignalStream> signals_;
  CsvOptions options_;
  std::function<void(double)> progress_;
  Eigen::Index row_;
  double start_ = 0;
};

/// Opens a file of a format that can be read in parts. Throws Error for the others.
std::unique_ptr<SignalStream> open_signal_stream(const std::filesystem::path& file, const CsvOptions& options = {},
                                                 const PartRows& rows = {});
/// The same as a record. Throws Error as `read_recording`.
std::unique_ptr<RecordStream> open_record_stream(const std::filesystem::path& file, const CsvOptions& options = {},
                                                 const PartRows& rows = {}, std::function<void(double)> progress = {});

/// Rows of a file in memory: as `read_signals` and `read_recording` give the whole.
SignalFile read_signal_rows(const std::filesystem::path& file, const CsvOptions& options, const PartRows& rows);
Recording read_record_rows(const std::filesystem::path& file, const CsvOptions& options, const PartRows& rows);

/// A record that is written.
struct Converted {
  std::size_t channels = 0;
  Eigen::Index samples = 0;
  double rate = 0;
};
/// From one file to another in parts, in the format that the ending of `out` names. Throws Error in field OUT where
/// that one cannot be written in parts.
Converted convert_in_parts(const std::filesystem::path& in, const std::filesystem::path& out, const CsvOptions& options,
                           const PartRows& rows, std::function<void(double)> progress);

/// True for a file that is too large to be read at once.
bool is_large(const std::filesystem::path& file);

}  // namespace whirl::io
