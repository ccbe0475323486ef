#pragma once
#include <Eigen/Core>
#include <memory>

#include "whirl/io/record_stream.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {

/// A file whose channels can be read from any row on: what a format adds to be read in parts.
class RowReader {
 public:
  virtual ~RowReader() = default;
  virtual std::string name() const = 0;  ///< of the file
  virtual Eigen::Index rows() const = 0;
  /// The file as `read_signals` gives it, start of its tables included, but of every channel the values of rows first
  /// .. first + count alone. They lie inside, and are two or more. A file that is cut off may give fewer.
  virtual SignalFile read(Eigen::Index first, Eigen::Index count) = 0;
};

/// A stream of its rows.
std::unique_ptr<SignalStream> stream_rows(std::unique_ptr<RowReader> reader, const PartRows& rows);

/// Throws Error where a file of so many rows ends before those that are wanted.
void require_rows(const PartRows& wanted, Eigen::Index present);
/// Rows of a part of a file with so many channels.
Eigen::Index rows_of_part(const PartRows& rows, std::size_t channels);

/// Of every channel these rows alone.
void keep_rows(SignalFile& file, Eigen::Index first, Eigen::Index count);

/// Where the values of an axis stand in the whole of it.
struct PartOfAxis {
  Eigen::Index first = 0, rows = 0;
  double head = 0, tail = 0;  ///< first and last value of the whole, SI
};
/// As set_abscissa of signals.hpp, for the whole axis; `x` is that of the part.
void set_abscissa(SignalTable& table, Quantity quantity, const Eigen::VectorXd& values, const PartOfAxis& part);

}  // namespace whirl::io
