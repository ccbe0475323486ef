#pragma once
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "../../apps/whirl/program.hpp"
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

/// Whether calls of the program start the program that was built, rather than its code in a child of this process:
/// under a sanitizer, which looks at the end of a process too; where $WHIRL_TEST_STARTS is set; where this process has
/// several threads, of which a child has one.
inline bool starts_the_program() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return true;
#else
  return std::getenv("WHIRL_TEST_STARTS") != nullptr || std::filesystem::hard_link_count("/proc/self/task") != 3;
#endif
}

/// The words of a call as the shell would take them; none where it has more to do than to remove quotes.
inline std::optional<std::vector<std::string>> plain_words(const std::string& call) {
  std::vector<std::string> words;
  bool inside = false;  // of a word
  char quote = 0;
  for (const char c : call) {
    if (quote == 0 && (c == ' ' || c == '\t')) {
      inside = false;
      continue;
    }
    const std::string special = quote == 0 ? "|&;<>()$`\\*?[]#~\n" : quote == '"' ? "$`\\" : "";
    if (special.find(c) != std::string::npos) return {};
    if (!inside) words.emplace_back();
    inside = true;
    if (quote == 0 && (c == '"' || c == '\''))
      quote = c;
    else if (c == quote)
      quote = 0;
    else
      words.back() += c;
  }
  if (quote != 0) return {};
  return words;
}

/// Calls the program in a child of this process, in a folder, with its output in files of the folder. The start of the
/// program costs thirty times as much. Returns the status that waitpid gives.
inline int in_a_child(const std::filesystem::path& folder, std::vector<std::string> words) {
  words.insert(words.begin(), program());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::fflush(nullptr);  // or the child would print it again
  const pid_t child = fork();
  if (child < 0) std::abort();
  if (child == 0) {
    const auto put = [](int at, const char* name, int how) {
      const int file = open(name, how, 0666);
      if (file < 0 || dup2(file, at) < 0) _exit(127);
      close(file);
    };
    if (chdir(folder.c_str()) != 0) _exit(127);
    put(0, "/dev/null", O_RDONLY);
    put(1, "stdout.txt", O_WRONLY | O_CREAT | O_TRUNC);
    put(2, "stderr.txt", O_WRONLY | O_CREAT | O_TRUNC);
    // An exception that leaves it ends the child, as it would end the program.
    const int code = [&]() noexcept { return app::program(static_cast<int>(words.size()), arguments.data()); }();
    std::fflush(nullptr);
    _exit(code);  // what the test put up is the parent's to remove
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
  }
  return status;
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

  /// Runs `whirl ARGUMENTS` in the folder: in a child of this process, or through the shell where the words need it.
  Outcome whirl(const std::string& arguments) const {
    const auto words = plain_words(arguments);
    if (starts_the_program() || !words) return shell("'" + program() + "' " + arguments);
    return outcome(in_a_child(path_, *words));
  }
  /// Runs a line of the shell in the folder.
  Outcome shell(const std::string& line) const {
    const std::string command = "cd '" + path_.string() + "' && " + line + " >stdout.txt 2>stderr.txt </dev/null";
    return outcome(std::system(command.c_str()));
  }

 private:
  Outcome outcome(int status) const {
    Outcome outcome;
    outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    outcome.out = slurp(path_ / "stdout.txt");
    outcome.err = slurp(path_ / "stderr.txt");
    return outcome;
  }
  std::filesystem::path path_;
};

}  // namespace whirl::testing
