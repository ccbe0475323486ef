#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::io {

/// One channel of a file of any format. SI when `quantity` is known, else in the unit of the file.
struct Signal {
  std::string name = {};
  std::string unit = {};  ///< as the file writes it; empty when it states none
  std::optional<Quantity> quantity = {};
  Eigen::VectorXd value = {};
  Eigen::VectorXd imaginary = {};  ///< empty when real
};

/// Channels over one abscissa.
struct SignalTable {
  std::string name = {};
  std::optional<Quantity> abscissa = {};  ///< time or frequency; nothing: rows are only counted
  double start = 0, step = 0;             ///< of the abscissa, SI; step 0 when it is not uniform or not stated
  Eigen::VectorXd x = {};                 ///< abscissa when it is not uniform, SI
  std::vector<Signal> signals = {};

  Eigen::Index rows() const { return signals.empty() ? 0 : signals.front().value.size(); }
};

/// Integers of 2^53 or more, whose last digits a double does not hold.
struct RoundedIntegers {
  std::string name;
  Eigen::Index count = 0, of = 0;
};

/// What a file of any format holds.
struct SignalFile {
  std::string source = {};
  std::string format = {};  ///< in words, e.g. "universal file"
  std::vector<SignalTable> tables = {};
  std::vector<std::string> contents = {};     ///< what is there beside signals, e.g. "74 nodes"
  std::vector<std::string> findings = {};     ///< what is suspicious, one sentence each
  std::vector<RoundedIntegers> rounded = {};  ///< of a part of a file; of a whole one they are among the findings
};

enum class FileFormat { csv, uff, atfx, mat, mat4, hdf5, numpy, tdms, wav, lvm, json };
/// The format of a file by its first bytes, whatever its name says; what is none of the others is taken for CSV.
FileFormat file_format(const std::filesystem::path& path);

/// Reads any format: CSV, UFF, ATFX, MAT (v5 and v7.3), HDF5, WAV, LVM. The format is found from the first bytes, not
/// from the name; a name that says otherwise is a finding. Of `options`, `rate` is used where the file states no time,
/// and the rest for CSV alone. Throws Error naming the file and the line or byte.
SignalFile read_signals(const std::filesystem::path& path, const CsvOptions& options = {});

/// The time signals of one table, in SI. `options.columns` selects and renames: "x" or "x_mm" takes that channel,
/// "V1:u_V" takes V1 as u in volts, "2:acc_g" the second channel; "1:force_N*250" multiplies by a calibration first (a
/// WAV file holds parts of its full scale). Throws Error when the times differ, are not uniform or not stated (and no
/// `options.rate`), or a channel has no known unit and none is given.
Recording recording_of(const SignalFile& file, const CsvOptions& options = {});

/// A record from a file of any format: `read_csv` for CSV, `recording_of` for all others.
Recording read_recording(const std::filesystem::path& path, const CsvOptions& options = {});

/// The bytes of one format each. `name` stands in messages; no more is allocated than the bytes can hold.
SignalFile parse_mat(std::string_view bytes, std::string_view name);
SignalFile parse_hdf5(std::string_view bytes, std::string_view name);
SignalFile parse_wav(std::string_view bytes, std::string_view name);
SignalFile parse_lvm(std::string_view bytes, std::string_view name);

/// Samples first .. first + count of every channel of an HDF5 or MAT v7.3 file, for files larger than memory: fewer at
/// the end, no table for a single one or none. All channels must have one length.
SignalFile read_hdf5_rows(const std::filesystem::path& path, Eigen::Index first, Eigen::Index count);

/// Writes the record in SI. MAT v5, HDF5 and LVM: names with the unit behind, as in CSV, and the time column t_s. WAV:
/// 64-bit floating point, values as they are, names in the comment.
void write_mat(const std::filesystem::path& path, const Recording& recording);
void write_hdf5(const std::filesystem::path& path, const Recording& recording);
void write_wav(const std::filesystem::path& path, const Recording& recording);
void write_lvm(const std::filesystem::path& path, const Recording& recording);

/// The unit written in the ways of other programs, "m/s^2", "(m/s2)", "Volts", as one of ours; null when it is none.
const UnitSuffix* unit_from_label(std::string_view label);

/// A signal converted to SI by its unit label, or, without one, by the unit behind its name (x_mm).
Signal make_signal(std::string name, std::string_view unit_label, Eigen::VectorXd value);

/// Adds a signal to the table of `file` that has the same abscissa and rows as `like`, or to a new one.
void add_signal(SignalFile& file, const SignalTable& like, Signal signal);

/// Sets start and step when the values (SI) lie within 5 % of a step of a uniform ascending grid, else `x`.
void set_abscissa(SignalTable& table, Quantity quantity, const Eigen::VectorXd& values);

}  // namespace whirl::io
