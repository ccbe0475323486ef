#include "whirl/report/write_figure.hpp"

#include <fmt/format.h>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/run_program.hpp"
#include "whirl/report/terminal_plot.hpp"

namespace whirl::report {
namespace {

std::string converted(const Figure& figure, const std::filesystem::path& file, const std::string& format) {
  std::string bytes;
  const int code = io::run_program({"rsvg-convert", "--format=" + format, "--zoom=2", "--background-color=white"},
                                   to_svg(figure), &bytes);
  if (code == 127) {
    throw Error::in_file(file.string(), 0,
                         "PNG and PDF figures need the program rsvg-convert (Debian: apt install librsvg2-bin)");
  }
  // A converter that stopped halfway may still say that all is well.
  const std::string_view end = format == "png" ? std::string_view("IEND\xae\x42\x60\x82") : std::string_view("%%EOF\n");
  if (code != 0 || !bytes.ends_with(end))
    throw Error::in_file(file.string(), 0,
                         fmt::format("rsvg-convert made no complete {} (exit code {})", format, code));
  return bytes;
}

}  // namespace

void write_figure(const Figure& figure, const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  std::string text;
  if (ending == ".png" || ending == ".pdf") {
    text = converted(figure, file, ending.substr(1));
  } else if (ending == ".svg") {
    text = to_svg(figure);
  } else if (ending == ".csv") {
    text = to_csv(figure);
  } else if (ending == ".txt") {
    text = to_terminal(figure);
  } else {
    throw Error::in_file(file.string(), 0, "unknown kind of figure: must end in .svg, .png, .pdf, .csv or .txt");
  }
  io::write_text(file, text);
}

}  // namespace whirl::report
