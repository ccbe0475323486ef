#pragma once
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

#include "../cli/program.hpp"
#include "whirl/testing/loop/await.hpp"

namespace whirl::testing {

/// `whirl ARGUMENTS` in the background of a folder, with the address of its page; ended with this object.
class LiveProgram {
 public:
  LiveProgram(const Folder& folder, const std::string& arguments) : folder_(folder) {
    const std::string command = "cd '" + (folder / "").string() + "' && exec '" + program() + "' " + arguments +
                                " >live.out 2>live.err </dev/null";
    pid_ = fork();
    if (pid_ == 0) {
      execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    (void)await([&] {
      const std::string text = slurp(folder / "live.err");
      const std::size_t at = text.find("http://"), end = text.find("  (Ctrl-C");
      if (at != std::string::npos && end != std::string::npos) url_ = text.substr(at, end - at);
      return !url_.empty() || !running();
    });
  }
  ~LiveProgram() { stop(); }
  LiveProgram(const LiveProgram&) = delete;
  LiveProgram& operator=(const LiveProgram&) = delete;

  const std::string& url() const { return url_; }  ///< with the token
  std::string page() const { return url_.substr(0, url_.find('#')); }
  std::string host() const { return page().substr(7, page().size() - 8); }
  bool running() {
    if (pid_ > 0 && waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = -1;
    return pid_ > 0;
  }
  /// Asks it to end as Ctrl-C does; its exit code.
  int stop() {
    if (running()) {
      kill(pid_, SIGINT);
      waitpid(pid_, &status_, 0);
      pid_ = -1;
    }
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }
  std::string out() const { return slurp(folder_ / "live.out"); }

 private:
  const Folder& folder_;
  pid_t pid_ = -1;
  int status_ = 0;
  std::string url_;
};

}  // namespace whirl::testing
