#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/io/signals.hpp"

namespace whirl::io {

/// One column of an ASAM ODS file (AoLocalColumn). Values in the unit of the file.
struct AtfxColumn {
  std::string name = {};
  std::string unit = {};  ///< name of the unit of its measurement quantity; may be empty
  long submatrix = 0;     ///< id of the table it belongs to
  bool independent = false;
  bool implicit = false;  ///< generated from parameters, not stored
  bool complex = false;
  Eigen::VectorXcd value = {};         ///< numbers; imaginary part zero when not complex
  std::vector<std::string> text = {};  ///< strings and times; empty for numbers

  Eigen::Index size() const { return text.empty() ? value.size() : static_cast<Eigen::Index>(text.size()); }
};

struct AtfxFile {
  std::string source = {};
  std::vector<AtfxColumn> columns = {};
  std::vector<std::string> warnings = {};
};

/// Gives the bytes of a binary part by its file name, as written in the file. Throws Error when it is absent.
using AtfxComponents = std::function<std::string(const std::string&)>;

/// Reads every column of an ATFX file (ASAM ODS, XML): inline values, binary parts beside the file (little and big
/// endian, blocked and strided), implicit columns. Element names are free in that format and are found by their base
/// types. Throws Error naming the file and the byte, column or missing binary part.
AtfxFile read_atfx(const std::filesystem::path& path);
AtfxFile parse_atfx(std::string_view bytes, std::string_view name, const AtfxComponents& components);

/// The numeric columns as signals, a table per submatrix, in SI where the unit is known. The independent column of a
/// table is its abscissa when it is a time or a frequency.
SignalFile signals_from_atfx(const AtfxFile& file);

}  // namespace whirl::io
