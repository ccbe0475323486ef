#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {

/// How the file is written. Found from its first lines; said by `whirl info`.
struct CsvDialect {
  char delimiter = ',';  ///< `,`, `;` or tab
  char decimal = '.';    ///< `,` only together with `;` or tab
  bool byte_order_mark = false;
  bool carriage_return = false;  ///< lines end with CR LF
  bool trailing_delimiter = false;
  bool compressed = false;  ///< gzip
};
std::string to_string(const CsvDialect& dialect);

/// Options of `read_csv`, `read_table` and `CsvStream`.
struct CsvOptions {
  /// Sample rate, Hz, for files without a time column (`--rate`). Given both, the time column must agree with
  /// it.
  std::optional<double> rate{};
  /// Columns to read and how to call them: "x_mm" takes the column with that header; "V1:u_V" takes the
  /// column headed `V1` as u in volts; "V1:x_mm*0.125" its values times 0.125 as x in mm; "Probe 1:x" the column headed
  /// "Probe 1 [mm]" as x in its own unit; "2:y_V" the second column (files without a header need numbers). Empty: every
  /// column.
  std::vector<std::string> columns{};
  /// Names that must be present; one with a unit ("force_N") must be of that quantity, in whatever unit.
  std::vector<std::string> required{};
  /// Line of the header, from 1, for files that begin with lines about the measurement (`--header-line`); 0: the first
  /// that is neither blank nor a comment.
  long header_line = 0;
  std::optional<char> decimal{};  ///< `.` or `,`; empty: found from the file
  /// Largest distance of a time stamp from the uniform grid, in steps; the rounding of the written time comes
  /// on top.
  double time_tolerance = 0.05;
  Eigen::Index min_samples = 2;
  bool refuse_constant = false;  ///< a channel that never changes is an error
  /// `read_csv` only: lets gaps through instead of refusing them. An empty cell, NaN or NA becomes NaN, lines left out
  /// of an even time become NaN, uneven times are taken onto an even grid; what was done to the time is a remark.
  bool gaps = false;
};

/// One column in the file.
struct CsvColumn {
  std::string header;  ///< as in the file
  std::string name;    ///< without unit
  const UnitSuffix* unit = nullptr;
  double factor = 1;  ///< of the values in the file
};

/// A CSV file block by block, in constant memory, for files larger than memory. Values are in SI.
///
/// Every problem is an Error that names file, line, column, the value and what is allowed: unknown unit,
/// missing or duplicated column, a value that is empty, no number, NaN or infinite, ragged lines, empty lines
/// inside the data.
class CsvStream {
 public:
  explicit CsvStream(const std::filesystem::path& path, const CsvOptions& options = {});
  /// From memory (plain or gzip); the bytes must outlive the stream. `name` stands in messages.
  CsvStream(std::string_view bytes, std::string name, const CsvOptions& options = {});
  ~CsvStream();
  CsvStream(CsvStream&&) noexcept;

  const std::string& source() const;
  /// `decimal` and `trailing_delimiter` are final after the first block.
  const CsvDialect& dialect() const;
  const std::vector<CsvColumn>& columns() const;
  /// Line of row `row` of the file (row 0 is the first data line).
  long line_of(Eigen::Index row) const;
  /// Fills the first rows of `block` (its row count is the most that is taken; one column per entry of
  /// `columns()`) and returns their number; 0 at the end of the file.
  Eigen::Index next(Eigen::Ref<Eigen::MatrixXd> block);
  /// Index of the time column (`t` or `time`) in `columns()`; -1 when there is none.
  int time_column() const;
  /// Largest number of decimals written in the time column so far; -1 when a time was written with an
  /// exponent.
  int time_decimals() const;
  /// Bytes of the file that are read, as they stand there.
  std::uint64_t bytes_read() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Signals with a common uniform time from a CSV file whose header is `name_unit,...`, e.g.
/// `t_s,x_mm,y_mm,beta_rad`, or as instruments write it: `Time [s]`, `x (mm)`, `x / mm`, or names with a line of units
/// below. `t` or `time` is the time column, in an instrument's file also a first column in units of time. `.gz` is read
/// directly. The record is in SI, its source the path. Errors: those of CsvStream, and a time that is not uniform, no
/// time and no rate, too few samples.
Recording read_csv(const std::filesystem::path& path, const CsvOptions& options = {}, CsvDialect* dialect = nullptr);
Recording parse_csv(std::string_view bytes, std::string_view name, const CsvOptions& options = {});

/// Columns of numbers without a common time: force-deflection (`deflection_mm,force_N`), Bode
/// (`rpm,amp_um,phase_deg`), frequency tables (`freq_hz,H1_re,H1_im`). A column headed `rpm` is called
/// "speed", one headed `hz` "freq". Names ending in `_re` and `_im` hold complex parts and keep their name:
/// as written, in the unit that the reader of the table knows.
struct Table {
  std::string source;
  std::vector<Channel> columns;
  long first_line = 2;  ///< line of row 0 in the file

  Eigen::Index rows() const { return columns.empty() ? 0 : columns.front().samples.size(); }
  const Channel* find(std::string_view name) const;
  /// The named column; throws Error listing those present when it is absent.
  const Channel& at(std::string_view name) const;
  const Eigen::VectorXd& operator[](std::string_view name) const { return at(name).samples; }
  /// The named column, which must be of this quantity; throws Error that says what it is and what is allowed.
  const Eigen::VectorXd& in(std::string_view name, Quantity quantity) const;
};
Table read_table(const std::filesystem::path& path, const CsvOptions& options = {});
Table parse_table(std::string_view bytes, std::string_view name, const CsvOptions& options = {});

/// Options of `write_csv`.
struct CsvWriteOptions {
  /// Columns with their unit, e.g. {"x_mm", "beta_deg", "t_ms"}; channels not listed are written in SI.
  std::vector<std::string> units{};
  bool time = true;  ///< first column `t_s`
};

/// Writes the record with every digit needed to read the same doubles back (exactly so in SI). `.gz`
/// compresses.
void write_csv(const std::filesystem::path& path, const Recording& record, const CsvWriteOptions& options = {});
void write_csv(const std::filesystem::path& path, const Table& table, const CsvWriteOptions& options = {});

}  // namespace whirl::io
