#include "whirl/io/outputs.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "formats/format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"
#include "whirl/io/file.hpp"

namespace whirl::io {
namespace {

namespace fs = std::filesystem;

/// Ending in lower case, without .gz.
std::string ending(fs::path path) {
  if (small_letters(path.extension().string()) == ".gz") path.replace_extension();
  return small_letters(path.extension().string());
}

std::string first_bytes(const fs::path& path) {
  try {
    ByteSource source(path);
    std::string head(8192, '\0');
    head.resize(source.read(head.data(), head.size()));
    return head;
  } catch (const Error&) {
    return "";
  }
}

std::string kind_of_json(std::string_view head) {
  const std::size_t key = head.find("\"schema\"");
  const std::size_t open = key == std::string_view::npos ? key : head.find('"', head.find(':', key));
  if (open == std::string_view::npos) return "JSON";
  const std::string_view name = head.substr(open + 1, head.find_first_of("\"/", open + 1) - open - 1);
  return std::string(name);
}

/// The first line that is not blank and no comment.
std::string_view header_of(std::string_view head) {
  while (!head.empty()) {
    const std::size_t end = std::min(head.find('\n'), head.size());
    const std::string_view line = head.substr(0, end);
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first != std::string_view::npos && line[first] != '#') return line;
    head.remove_prefix(std::min(end + 1, head.size()));
  }
  return {};
}

std::string kind_of_csv(std::string_view header) {
  if (header.find(": ") != std::string_view::npos && header.find(" [") != std::string_view::npos) return "figure data";
  header.remove_prefix(std::min(header.find_first_not_of("\" "), header.size()));
  const std::string_view name = header.substr(0, header.find_first_of("\",;\t"));
  return name == "t" || name == "time" || name.starts_with("t_") || name.starts_with("time_") ? "record" : "table";
}

struct Ending {
  std::string_view ending, kind;
};
constexpr std::array kEndings{Ending{".svg", "SVG"},      Ending{".png", "PNG"},  Ending{".pdf", "PDF"},
                              Ending{".html", "HTML"},    Ending{".htm", "HTML"}, Ending{".fmu", "zip"},
                              Ending{".toml", "settings"}};

/// Does the name end as those of the files that whirl writes?
bool is_file_name(const fs::path& path) {
  const std::string ending = path.extension().string();
  constexpr std::array<std::string_view, 4> kOthers{".json", ".csv", ".md", ".txt"};
  return std::ranges::any_of(kEndings, [&](const Ending& e) { return e.ending == ending; }) ||
         std::ranges::find(kOthers, ending) != kOthers.end();
}

/// Asks the system rather than the permission bits: read-only file systems, quotas and ACLs answer too.
void try_writing(const PlannedOutput& output) {
  const auto refuse = [&](const std::string& reason) {
    throw Error(fmt::format("{} {}: {}", output.name, output.path.string(), reason));
  };
  std::error_code ec;
  const fs::file_status status = fs::status(output.path, ec);
  if (!output.folder) {
    if (fs::is_directory(status)) refuse("is a folder; give the name of a file");
    if (fs::exists(status) && access(output.path.c_str(), W_OK) != 0)
      refuse(std::string("cannot be written: ") + std::strerror(errno));
    if (fs::exists(status) && !fs::is_regular_file(status)) return;  // a pipe or a device is written through
  } else if (fs::exists(status) && !fs::is_directory(status)) {
    refuse("is a file; give the name of a folder");
  } else if (!fs::exists(status) && is_file_name(output.path)) {
    refuse("a folder is written here, and this is the name of a file; leave out " + output.path.extension().string());
  }
  fs::path folder = output.folder ? output.path : output.path.parent_path();
  if (folder.empty()) folder = ".";
  if (output.folder) {  // it is made when it is missing
    while (!fs::exists(folder, ec) && !folder.empty()) folder = folder.parent_path();
    if (folder.empty()) folder = ".";
  } else if (!fs::exists(folder, ec)) {
    refuse(fmt::format("there is no folder {}; make it first", folder.string()));
  }
  if (!fs::is_directory(folder, ec)) refuse(folder.string() + " is no folder");
  // The name itself is tried, as far as it may be too long or hold what the file system refuses.
  const fs::path trial =
      folder / fmt::format("{}.try{}", output.folder ? std::string(".whirl") : output.path.filename().string(),
                           static_cast<long>(getpid()));
  const int file = open(trial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file < 0) refuse(std::string("cannot be written: ") + std::strerror(errno));
  close(file);
  unlink(trial.c_str());
}

void check_kind(const PlannedOutput& output) {
  const std::string there = file_kind(output.path), wanted = kind_to_write(output.path, output.kind);
  if (there.empty() || wanted.empty() || there == wanted) return;
  if (wanted == "signals" && (there == "record" || there == "table")) return;
  for (std::size_t at = 0; at < wanted.size();) {  // one of several schemas
    const std::size_t end = std::min(wanted.find('|', at), wanted.size());
    if (there == std::string_view(wanted).substr(at, end - at)) return;
    at = end + 1;
  }
  throw Error(
      fmt::format("{} {}: exists and holds something else ({}, not {}); choose another name, or --force to "
                  "replace it",
                  output.name, output.path.string(), there, wanted));
}

}  // namespace

std::string file_kind(const fs::path& path) {
  std::error_code ec;
  if (!fs::is_regular_file(path, ec)) return "";
  const std::string head = first_bytes(path);
  std::string_view text = head;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.empty()) return "";
  for (const auto& [magic, kind] :
       {std::pair<std::string_view, std::string_view>{"\x89PNG", "PNG"}, {"%PDF", "PDF"}, {"PK\x03\x04", "zip"}}) {
    if (text.starts_with(magic)) return std::string(kind);
  }
  if (const std::string_view words = words_of_magic(text); !words.empty()) return std::string(words);
  const std::size_t first = std::min(text.find_first_not_of(" \t\r\n"), text.size());
  const std::string_view plain = text.substr(first);
  if (plain.starts_with("{") || plain.starts_with("[{")) return kind_of_json(plain);
  if (plain.starts_with("-1\n") || plain.starts_with("-1\r") || plain.starts_with("-1 ")) return "universal file";
  const std::string start = small_letters(std::string(plain.substr(0, 1024)));
  if (start.find("<svg") != std::string::npos) return "SVG";
  if (start.starts_with("<!doctype html") || start.starts_with("<html")) return "HTML";
  if (start.find("application_context") != std::string::npos || start.find("<atfx_file") != std::string::npos)
    return "ATFX";
  const std::string end = ending(path);
  if (end == ".toml") return "settings";
  if (end == ".csv") return kind_of_csv(header_of(text));
  return "text";
}

std::string kind_to_write(const fs::path& path, const std::string& kind) {
  if (kind.starts_with("whirl.")) return kind;  // JSON whatever its name
  const std::string end = ending(path);
  if (end == ".csv") return kind == "figure" ? "figure data" : kind;
  if (end == ".json" && kind == "signals") return "whirl.frf";
  for (const Ending& e : kEndings) {
    if (end == e.ending) return std::string(e.kind);
  }
  if (const std::string_view words = words_of_ending(end);
      !words.empty() && end != ".txt" && end != ".tsv" && end != ".json")
    return std::string(words);
  if (kind == "record" || kind == "table" || kind == "figure" || kind == "signals") return "text";
  return kind;
}

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code ec;
  if (fs::exists(a, ec) && fs::exists(b, ec)) return fs::equivalent(a, b, ec);
  const fs::path pa = fs::weakly_canonical(fs::absolute(a, ec), ec), pb = fs::weakly_canonical(fs::absolute(b, ec), ec);
  return !pa.empty() && pa == pb;
}

void check_outputs(const std::vector<fs::path>& inputs, const std::vector<PlannedOutput>& outputs, bool force) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const PlannedOutput& output = outputs[i];
    if (!output.folder) {
      for (const fs::path& input : inputs) {
        if (same_file(output.path, input)) {
          throw Error(fmt::format("{} {}: is the input {}, which would be lost; choose another name", output.name,
                                  output.path.string(), input.string()));
        }
      }
      for (std::size_t j = 0; j < i; ++j) {
        if (!outputs[j].folder && same_file(output.path, outputs[j].path)) {
          throw Error(fmt::format("{} {}: is written by {} too; choose another name", output.name, output.path.string(),
                                  outputs[j].name));
        }
      }
    }
    try_writing(output);
    if (!force && !output.folder) check_kind(output);
  }
}

}  // namespace whirl::io
