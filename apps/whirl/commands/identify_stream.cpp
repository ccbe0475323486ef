#include "identify_stream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "whirl/identify/partwise_score.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::app {
namespace {

constexpr Eigen::Index kRows = 65536;  // of a part
constexpr Eigen::Index kLeast = 1000;  // of a last part that speaks for the record

/// A record of any length, part by part.
class Source {
 public:
  virtual ~Source() = default;
  /// False at the end.
  virtual bool next(Recording& part) = 0;

 protected:
  /// Time of a sample that the uniform grid of the first part puts at `due`.
  static bool on_grid(double t, double due, double start, double dt, double rounding) {
    // The step read from the first part carries the rounding of its times over the whole file.
    return std::abs(t - due) <= 0.05 * dt + 1e-6 * (due - start) + rounding;
  }
};

class CsvSource : public Source {
 public:
  CsvSource(const std::string& file, const RecordOptions& options)
      : stream_(file, options.csv()), block_(kRows, static_cast<Eigen::Index>(stream_.columns().size())) {
    if (options.rate > 0)
      dt_ = 1 / options.rate;
    else if (stream_.time_column() < 0)
      throw Error(stream_.source() + ": no time column and no --rate");
  }

  bool next(Recording& part) override {
    const Eigen::Index n = stream_.next(block_);
    if (n == 0) return false;
    const int time = stream_.time_column();
    if (time >= 0) check_time(block_.col(time).head(n));
    part = {};
    part.dt = dt_;
    part.t0 = start_ + dt_ * static_cast<double>(rows_);
    part.source = stream_.source();
    for (std::size_t k = 0; k < stream_.columns().size(); ++k) {
      if (static_cast<int>(k) == time) continue;
      const io::CsvColumn& column = stream_.columns()[k];
      part.add(column.name, column.unit != nullptr ? column.unit->quantity : Quantity::dimensionless,
               block_.col(static_cast<Eigen::Index>(k)).head(n));
    }
    rows_ += n;
    return true;
  }

 private:
  void check_time(const Eigen::Ref<const Eigen::VectorXd>& t) {
    if (rows_ == 0) {
      start_ = t[0];
      if (t.size() < 2) throw Error(stream_.source() + ": one sample is no record");
      if (dt_ == 0) dt_ = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
      if (!(dt_ > 0)) throw Error(stream_.source() + ": time does not increase");
    }
    const double rounding = 0.5 * std::pow(10.0, -std::max(0, stream_.time_decimals()));
    for (Eigen::Index i = 0; i < t.size(); ++i) {
      const double due = start_ + dt_ * static_cast<double>(rows_ + i);
      if (!on_grid(t[i], due, start_, dt_, rounding)) {
        throw Error::in_file(stream_.source(), stream_.line_of(rows_ + i),
                             fmt::format("time {:g} s: must be {:g} s for a uniform step of {:g} s", t[i], due, dt_));
      }
    }
  }

  io::CsvStream stream_;
  Eigen::MatrixXd block_;
  double dt_ = 0, start_ = 0;
  Eigen::Index rows_ = 0;
};

class Hdf5Source : public Source {
 public:
  Hdf5Source(const std::string& file, const RecordOptions& options) : file_(file), options_(options.csv()) {}

  bool next(Recording& part) override {
    const io::SignalFile rows = io::read_hdf5_rows(file_, rows_, kRows);
    if (rows_ > 0 && rows.tables.empty()) return false;
    part = io::recording_of(rows, options_);
    const double t = part.t0;
    if (rows_ == 0) {
      dt_ = part.dt;
      start_ = t;
    }
    part.dt = dt_;
    part.t0 = start_ + dt_ * static_cast<double>(rows_);
    if (t != start_ && !on_grid(t, part.t0, start_, dt_, 0)) {
      throw Error::in_file(
          file_, 0,
          fmt::format("sample {}: time {:g} s: must be {:g} s for a uniform step of {:g} s", rows_, t, part.t0, dt_));
    }
    rows_ += part.size();
    return true;
  }

 private:
  std::string file_;
  io::CsvOptions options_;
  double dt_ = 0, start_ = 0;
  Eigen::Index rows_ = 0;
};

std::unique_ptr<Source> open_source(const std::string& file, const RecordOptions& options) {
  switch (io::file_format(file)) {
    case io::FileFormat::csv:
      return std::make_unique<CsvSource>(file, options);
    case io::FileFormat::hdf5:
      return std::make_unique<Hdf5Source>(file, options);
    default:
      throw Error(file + ": --stream reads CSV and HDF5; whirl convert makes one of it");
  }
}

Eigen::Index count_rows(const std::string& file, const RecordOptions& options, Session& session) {
  const std::unique_ptr<Source> source = open_source(file, options);
  Eigen::Index rows = 0;
  for (Recording part; source->next(part);) {
    rows += part.size();
    session.progress(fmt::format("{:.3g} million samples counted", 1e-6 * static_cast<double>(rows)), 0);
  }
  return rows;
}

}  // namespace

IdentifiedModel identify_stream(const IdentifyOptions& o, Session& session, Evidence& evidence) {
  if (o.chosen_method() != "sindy") throw Error("--stream is for --method sindy");
  if (o.files.size() != 1) throw Error("--stream takes one file");
  if (!o.library.empty() || o.compare) throw Error("--stream takes neither --library nor --compare");
  if (!o.record.rows.empty()) throw Error("--rows and --stream exclude each other");
  RecordOptions reader = o.record;
  reader.required = o.required();
  const std::string& file = o.files.front();
  // Where the part held out begins is known when the samples have been counted.
  const Eigen::Index rows = o.no_holdout ? 0 : count_rows(file, reader, session);
  const Eigen::Index split =
      o.no_holdout ? std::numeric_limits<Eigen::Index>::max() : identification::holdout_start(rows, o.holdout);

  const std::unique_ptr<Source> source = open_source(file, reader);
  std::unique_ptr<identification::SindyStream> stream;
  std::unique_ptr<identification::HeldOutParts> test;
  evidence.held_out.what = o.no_holdout ? "" : identification::held_out_part(split, rows, file);
  const auto begin_test = [&] {
    try {
      const IdentifiedModel model = stream->fit();
      if (model.summary.status == Status::unusable)
        throw Error("the rest alone gives no model: " + model.summary.warnings.back());
      test = std::make_unique<identification::HeldOutParts>(model, evidence.held_out.what);
    } catch (const Error& e) {
      evidence.held_out.reason = e.what();
    }
  };
  Eigen::Index at = 0;
  Recording last;
  for (Recording part; source->next(part);) {
    session.progress(fmt::format("{:.3g} million samples", 1e-6 * static_cast<double>(at)),
                     rows > 0 ? 0.9 * static_cast<double>(at) / static_cast<double>(rows) : 0.5);
    if (!stream) stream = std::make_unique<identification::SindyStream>(o.sindy(part));
    const Eigen::Index fitted = std::clamp<Eigen::Index>(split - at, 0, part.size());
    if (fitted > 0) stream->add(identification::part_of(part, 0, fitted));
    if (at <= split && split < at + part.size()) begin_test();
    if (fitted < part.size()) {
      const Recording rest = identification::part_of(part, fitted, part.size() - fitted);
      stream->add(rest);
      if (test) test->add(rest);
    }
    at += part.size();
    if (part.size() >= kLeast || last.size() == 0) last = std::move(part);
  }
  if (!stream) throw Error(file + ": no samples");
  IdentifiedModel model = stream->fit(&evidence.bounds);
  if (model.summary.status == Status::unusable) return model;
  evidence.collinear = identification::collinear_groups(model, last);
  if (test) evidence.held_out = test->finish();
  return model;
}

}  // namespace whirl::app
