#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "whirl/rt/loop_sample.hpp"

namespace whirl::rt {

/// What stands in the head of a recording.
struct RecordingHead {
  double sample_time = 1e-3;                               ///< s
  std::vector<std::pair<std::string, std::string>> texts;  ///< name and text: controller, settings, command line
};

/// Something that happened once.
struct LoopEvent {
  std::int64_t tick = 0;
  double t = 0;      ///< s
  std::string text;  ///< at most 119 bytes are kept
};

/// Recording of a loop in HDF5: datasets `cycles` (one row per cycle, fields of LoopSample) and `events`, the head as
/// attributes. Made for the death of the program at any instant: the file appears under its name only when it can be
/// opened, and is written in HDF5's single-writer mode, in which what is on disk is readable after every write. Rows
/// appended since the last flush may be lost, never those before it. A flush reaches the disk itself; room on the disk
/// is taken ahead, so that a full disk ends a file that can be read. Not for the real-time thread.
class LoopRecorder {
 public:
  /// `flush_interval` in s. Throws Error naming the file.
  LoopRecorder(const std::filesystem::path& path, const RecordingHead& head, double flush_interval = 0.5);
  ~LoopRecorder();
  LoopRecorder(const LoopRecorder&) = delete;
  LoopRecorder& operator=(const LoopRecorder&) = delete;

  /// None of these throws: the loop goes on when its recording cannot. After the first failure nothing more is written,
  /// `failure()` says why, and every row that is not in the file counts as lost.
  void append(const LoopSample& sample);
  void event(const LoopEvent& event);
  void flush();
  /// The end of the recording, as the destructor; apart, so that its failure can be told.
  void close();
  long rows() const;                   ///< recorded
  long lost() const;                   ///< not recorded
  const std::string& failure() const;  ///< empty: none

 private:
  struct State;
  std::unique_ptr<State> state_;
  bool closed_ = false;
};

/// A recording, whole or cut off by a kill.
struct LoopRecord {
  RecordingHead head;
  std::vector<LoopSample> cycles;
  std::vector<LoopEvent> events;
  bool closed = false;  ///< its writer came to the end

  const std::string* text(const std::string& name) const;  ///< of the head; null when absent
};
/// Throws Error naming the file when it is no recording.
LoopRecord read_loop_record(const std::filesystem::path& path);

}  // namespace whirl::rt
