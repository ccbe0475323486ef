#include "whirl/io/run_program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "whirl/core/error.hpp"

extern char** environ;

namespace whirl::io {
namespace {

/// A file in memory: needs no disk that could be full.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("whirl", MFD_CLOEXEC)) {
    if (descriptor_ < 0) throw Error(std::string("no memory for another program's data: ") + std::strerror(errno));
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  int descriptor() const { return descriptor_; }
  void fill(const std::string& text) {
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t n = pwrite(descriptor_, text.data() + done, text.size() - done, static_cast<off_t>(done));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) throw Error("no memory for another program's data");
      done += static_cast<std::size_t>(n);
    }
  }
  std::string text() const {
    std::string out(static_cast<std::size_t>(std::max<off_t>(lseek(descriptor_, 0, SEEK_END), 0)), '\0');
    for (std::size_t done = 0; done < out.size();) {
      const ssize_t n = pread(descriptor_, out.data() + done, out.size() - done, static_cast<off_t>(done));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) throw Error("the output of another program cannot be read");
      done += static_cast<std::size_t>(n);
    }
    return out;
  }

 private:
  int descriptor_;
};

}  // namespace

int run_program(const std::vector<std::string>& arguments, const std::string& input_text, std::string* output) {
  MemoryFile input, printed;
  input.fill(input_text);
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input.descriptor(), STDIN_FILENO);
  if (output != nullptr) {
    posix_spawn_file_actions_adddup2(&actions, printed.descriptor(), STDOUT_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  }
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  if (failed != 0) return 127;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (output != nullptr) *output = printed.text();
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace whirl::io
