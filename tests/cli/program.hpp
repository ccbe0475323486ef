#pragma once
#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "whirl/testing/paths.hpp"

namespace whirl::testing {

/// What one call of the program did.
struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

inline std::string slurp(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// A folder of its own, removed at the end.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "whirl-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }

  /// Runs `whirl ARGUMENTS` in the folder, through the shell.
  Outcome whirl(const std::string& arguments) const { return shell("'" + program() + "' " + arguments); }
  /// Runs a line of the shell in the folder.
  Outcome shell(const std::string& line) const {
    const std::string command = "cd '" + path_.string() + "' && " + line + " >stdout.txt 2>stderr.txt </dev/null";
    const int status = std::system(command.c_str());
    Outcome outcome;
    outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    outcome.out = slurp(path_ / "stdout.txt");
    outcome.err = slurp(path_ / "stderr.txt");
    return outcome;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace whirl::testing
