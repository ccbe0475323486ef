#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace whirl::io {

/// What an existing file holds, by its content: the schema of a JSON result without its version ("whirl.model"), or
/// "record" (CSV with a time column), "figure data" (CSV behind a figure), "table" (other CSV), "SVG", "PNG", "PDF",
/// "HTML", "HDF5", "WAV", "MAT", "universal file", "LVM", "ATFX", "zip", "JSON", "settings" (TOML), "text".
/// Empty for a file that is absent, empty or unreadable.
std::string file_kind(const std::filesystem::path& path);

/// What a new file of this name will hold, in the same words. `kind` is a schema (JSON whatever the name; several apart
/// by |), or "record", "table", "figure" or "signals" (a record or frequency responses), which the ending makes into a
/// format: a figure is "SVG" in plot.svg and "figure data" in plot.csv. Any other kind, or none, gives way to an ending
/// that is known.
std::string kind_to_write(const std::filesystem::path& path, const std::string& kind);

/// A file that a command is going to write.
struct PlannedOutput {
  std::string name;  ///< of the flag, for messages
  std::filesystem::path path;
  std::string kind;     ///< as `kind_to_write` takes it; empty: by the ending
  bool folder = false;  ///< a folder for files whose names the command chooses
};

/// Are these the same file: by name, through symbolic links, or as hard links of each other? Also for files that do
/// not exist yet.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Call before computing. Throws Error when an output is one of the inputs or another output (under any name), when it
/// cannot be written (the folder is missing or refuses a new file, the path is a folder or a device), or when an
/// existing file is of another kind and `force` is not set. Writes nothing that stays.
void check_outputs(const std::vector<std::filesystem::path>& inputs, const std::vector<PlannedOutput>& outputs,
                   bool force);

}  // namespace whirl::io
