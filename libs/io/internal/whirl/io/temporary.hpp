#pragma once
#include <filesystem>
#include <string_view>

namespace whirl::io {

/// A folder of its own below the system's folder for temporary files, removed with everything in it at the end of its
/// life, and also when a signal ends the program (clean_up_on_signals()).
class TemporaryFolder {
 public:
  /// `purpose`: a short word for its name. Throws Error naming the path when it cannot be made.
  explicit TemporaryFolder(std::string_view purpose);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int slot_;
};

/// Lets SIGINT, SIGTERM and SIGHUP remove what is only half written, and temporary folders, before they end the program
/// as they do by default. To be called once, by the program; a handler set later takes its place.
void clean_up_on_signals();

}  // namespace whirl::io
