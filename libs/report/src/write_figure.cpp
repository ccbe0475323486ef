#include "whirl/report/write_figure.hpp"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "whirl/core/error.hpp"
#include "whirl/report/terminal_plot.hpp"

extern char** environ;

namespace whirl::report {

int run_program(const std::vector<std::string>& arguments, const std::string& input_text) {
  std::FILE* input = std::tmpfile();
  if (input == nullptr) throw Error("no temporary file can be made");
  std::fwrite(input_text.data(), 1, input_text.size(), input);
  std::rewind(input);
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, fileno(input), STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", 1 /* O_WRONLY */, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", 1, 0);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  if (failed == 0) waitpid(child, &status, 0);
  std::fclose(input);
  if (failed != 0) return 127;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

void write_figure(const Figure& figure, const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  if (ending == ".png" || ending == ".pdf") {
    const std::string svg = to_svg(figure);
    const int code = run_program({"rsvg-convert", "--format=" + ending.substr(1), "--zoom=2",
                                  "--background-color=white", "--output", file.string()},
                                 svg);
    if (code == 127) {
      throw Error::in_file(file.string(), 0,
                           "PNG and PDF figures need the program rsvg-convert (Debian: apt install librsvg2-bin)");
    }
    if (code != 0) throw Error::in_file(file.string(), 0, "cannot be written (does the folder exist?)");
    return;
  }
  std::string text;
  if (ending == ".svg") {
    text = to_svg(figure);
  } else if (ending == ".csv") {
    text = to_csv(figure);
  } else if (ending == ".txt") {
    text = to_terminal(figure);
  } else {
    throw Error::in_file(file.string(), 0, "unknown kind of figure: must end in .svg, .png, .pdf, .csv or .txt");
  }
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw Error::in_file(file.string(), 0, "cannot be written (does the folder exist?)");
}

}  // namespace whirl::report
