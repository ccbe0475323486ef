#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

// The one way of every file of whirl to the disk, behind ByteSink and write_text() (file.hpp): written beside, flushed
// to the disk and renamed, so that a name shows either what was there before or everything, also after a full disk, a
// kill or the loss of power. Symbolic links are followed: the file they name is replaced. An existing file keeps its
// permissions and must be writable. What is no regular file (a pipe, a device, /dev/stdout, /dev/fd/N) is written
// through and never replaced. Interrupted and short writes go on. Errors name the file and the reason.

namespace whirl::io {

/// Where a file belongs that is read while it is written: links followed. Throws Error when a pipe, a device or a
/// folder stands there, or a file that may not be written.
std::filesystem::path regular_target(const std::filesystem::path& path);

/// One writer at a time of a file that a program reads, changes and writes again: two would each lose what the other
/// added. Held until it is destroyed, or the process ends in whatever way. A file that is not there needs none.
class WriterLock {
 public:
  /// Throws Error when another WriterLock, of any process, holds the file.
  explicit WriterLock(const std::filesystem::path& path);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  int descriptor_ = -1;
};

/// A file that grows while something is watched, such as a record: readable at every moment, never in the place of
/// another file. What append() gives stands in it whole or, when the disk is full, not at all.
class GrowingFile {
 public:
  GrowingFile() = default;
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;
  /// Keeps `reserve` bytes of the disk for the file from the start, where the file system can. Throws Error when a file
  /// has the name, or it cannot be made.
  void create(const std::filesystem::path& path, std::size_t reserve = 0);
  /// Throws Error naming the file and the reason; the file then ends where it did before.
  void append(std::string_view bytes);
  /// To the disk, and closed. Throws Error when that fails.
  void close();
  bool is_open() const { return descriptor_ >= 0; }

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uintmax_t size_ = 0;
};

/// Makes a folder and those above it. Throws Error naming it.
void make_folder(const std::filesystem::path& folder);

/// A file in a folder; its name may hold folders.
struct FileText {
  std::string name, text;
};
/// Files that belong together, such as a result and its figures: all are on the disk before the first one gets its
/// name, so that a full disk changes none of them. While it lives, what this thread writes through ByteSink and
/// write_text() waits beside its name for commit(); without commit() all of it is removed. What is no regular file is
/// written through as ever. A group within another hands its files to that one.
class OutputGroup {
 public:
  OutputGroup();
  ~OutputGroup();
  OutputGroup(const OutputGroup&) = delete;
  OutputGroup& operator=(const OutputGroup&) = delete;
  /// Gives every file its name. Throws Error naming the first that cannot have it; those before it have theirs.
  void commit();

  struct State;

 private:
  std::unique_ptr<State> state_;
};

/// Writes files as one OutputGroup. Folders are made, and removed again when that fails. Returns the paths.
std::vector<std::filesystem::path> write_files(const std::filesystem::path& folder, const std::vector<FileText>& files);

}  // namespace whirl::io
