#pragma once
#include <filesystem>
#include <memory>

#include "whirl/core/recording.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::io {

/// A record of any length, part by part (65536 samples; the last may be shorter).
class RecordStream {
 public:
  virtual ~RecordStream() = default;
  /// False at the end. Throws Error where the times leave the uniform grid of the first part.
  virtual bool next(Recording& part) = 0;
};

/// Opens a CSV or HDF5 file. Throws Error for other formats, and as `read_recording`.
std::unique_ptr<RecordStream> open_record_stream(const std::filesystem::path& file, const CsvOptions& options = {});

}  // namespace whirl::io
