#pragma once
#include <dlfcn.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace whirl::testing {

/// A folder of its own, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "whirl-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << text;
  }

 private:
  std::filesystem::path path_;
};

/// Exit code and everything a shell command printed; run in `folder`.
struct ShellResult {
  int exit_code = -1;
  std::string text;
};
inline ShellResult shell(const std::filesystem::path& folder, const std::string& command) {
  const std::filesystem::path log = folder / "shell.log";
  const int status =
      std::system(("cd '" + folder.string() + "' && (" + command + ") >'" + log.string() + "' 2>&1").c_str());
  std::ifstream in(log);
  std::ostringstream text;
  text << in.rdbuf();
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), text.str()};
}
inline bool has_program(const std::string& name) {
  return std::system(("command -v " + name + " >/dev/null 2>&1").c_str()) == 0;
}

/// What exported C must pass on the way to a shared library.
inline constexpr const char* kStrictC99 =
    "-std=c99 -O2 -ffp-contract=off -Wall -Wextra -Wconversion -Wshadow -pedantic -Werror";
/// The same without optimisation, in a third of the time: where nothing but the numbers is looked at.
inline constexpr const char* kQuickC99 =
    "-std=c99 -O0 -ffp-contract=off -Wall -Wextra -Wconversion -Wshadow -pedantic -Werror";

/// A shared library opened for its functions; closed at the end.
class SharedLibrary {
 public:
  explicit SharedLibrary(const std::filesystem::path& path) : handle_(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    if (handle_ == nullptr) throw std::runtime_error(dlerror());
  }
  ~SharedLibrary() { dlclose(handle_); }
  SharedLibrary(const SharedLibrary&) = delete;
  SharedLibrary& operator=(const SharedLibrary&) = delete;
  template <class Function>
  Function* get(const std::string& name) const {
    void* symbol = dlsym(handle_, name.c_str());
    if (symbol == nullptr) throw std::runtime_error(name + " is not exported");
    return reinterpret_cast<Function*>(symbol);
  }
  bool has(const std::string& name) const { return dlsym(handle_, name.c_str()) != nullptr; }

 private:
  void* handle_;
};

}  // namespace whirl::testing
