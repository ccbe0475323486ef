#include "whirl/io/record_stream.hpp"

#include <algorithm>
#include <vector>

#include "formats/format.hpp"
#include "formats/parts/rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {
RecordStream::RecordStream(std::unique_ptr<SignalStream> signals, const CsvOptions& options, Eigen::Index first,
                           std::function<void(double)> progress)
    : signals_(std::move(signals)), options_(options), progress_(std::move(progress)), row_(first) {
  options_.min_samples = 1;  // of a part
}

bool RecordStream::next(Recording& part) {
  SignalFile signals;
  if (!signals_->next(signals)) return false;
  part = recording_of(signals, options_);
  start_ = part.t0;
  part.t0 = start_ + part.dt * static_cast<double>(row_);
  row_ += part.size();
  if (progress_) progress_(signals_->done());
  return true;
}

namespace {

/// With the start of the whole.
SignalFile rows_of_file(const std::filesystem::path& file, const CsvOptions& options, const PartRows& rows) {
  if (!reads_in_parts(file)) {
    SignalFile whole = read_signals(file, options);
    Eigen::Index present = 0;
    for (const SignalTable& table : whole.tables) present = std::max(present, table.rows());
    require_rows(rows, present);
    keep_rows(whole, rows.first, rows.end - rows.first);
    return whole;
  }
  const std::unique_ptr<SignalStream> stream = open_signal_stream(file, options, rows);
  SignalFile out, part;
  std::vector<std::vector<Eigen::VectorXd>> pieces;  // of every vector of the file
  const auto vectors = [](SignalFile& of) {
    std::vector<Eigen::VectorXd*> all;
    for (SignalTable& table : of.tables) {
      all.push_back(&table.x);
      for (Signal& signal : table.signals) all.insert(all.end(), {&signal.value, &signal.imaginary});
    }
    return all;
  };
  while (stream->next(part)) {
    if (pieces.empty()) {
      out = part;
      pieces.resize(vectors(part).size());
    } else {
      out.findings.insert(out.findings.end(), part.findings.begin(), part.findings.end());
    }
    const std::vector<Eigen::VectorXd*> read = vectors(part);
    if (read.size() != pieces.size()) throw Error::in_file(out.source, 0, "its axes change inside these rows");
    for (std::size_t k = 0; k < read.size(); ++k) pieces[k].push_back(std::move(*read[k]));
  }
  const std::vector<Eigen::VectorXd*> whole = vectors(out);
  for (std::size_t k = 0; k < whole.size(); ++k) {
    Eigen::Index at = 0;
    for (const Eigen::VectorXd& piece : pieces[k]) at += piece.size();
    whole[k]->resize(at);
    at = 0;
    for (Eigen::VectorXd& piece : pieces[k]) {
      whole[k]->segment(at, piece.size()) = piece;
      at += piece.size();
      piece.resize(0);
    }
  }
  return out;
}

}  // namespace

SignalFile read_signal_rows(const std::filesystem::path& file, const CsvOptions& options, const PartRows& rows) {
  SignalFile out = rows_of_file(file, options, rows);
  for (SignalTable& table : out.tables) table.start += static_cast<double>(rows.first) * table.step;
  return out;
}

Recording read_record_rows(const std::filesystem::path& file, const CsvOptions& options, const PartRows& rows) {
  CsvOptions left = options;
  if (file_format(file) == FileFormat::csv) left.columns.clear();
  left.min_samples = 1;
  Recording record = recording_of(rows_of_file(file, options, rows), left);
  record.t0 += record.dt * static_cast<double>(rows.first);
  return record;
}

void keep_rows(SignalFile& file, Eigen::Index first, Eigen::Index count) {
  const auto keep = [&](Eigen::VectorXd& v) {
    if (v.size() >= first + count) v = v.segment(first, count).eval();
  };
  for (SignalTable& table : file.tables) {
    keep(table.x);
    for (Signal& signal : table.signals) keep(signal.value), keep(signal.imaginary);
  }
}

}  // namespace whirl::io
