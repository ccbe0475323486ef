#include "whirl/io/record_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {
namespace {

constexpr Eigen::Index kRows = 65536;  // of a part

/// Time of a sample that the uniform grid of the first part puts at `due`.
bool on_grid(double t, double due, double start, double dt, double rounding) {
  // The step read from the first part carries the rounding of its times over the whole file.
  return std::abs(t - due) <= 0.05 * dt + 1e-6 * (due - start) + rounding;
}

class CsvRecordStream : public RecordStream {
 public:
  CsvRecordStream(const std::string& file, const CsvOptions& options)
      : stream_(file, options), block_(kRows, static_cast<Eigen::Index>(stream_.columns().size())) {
    if (options.rate)
      dt_ = 1 / *options.rate;
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
      const CsvColumn& column = stream_.columns()[k];
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

  CsvStream stream_;
  Eigen::MatrixXd block_;
  double dt_ = 0, start_ = 0;
  Eigen::Index rows_ = 0;
};

class Hdf5RecordStream : public RecordStream {
 public:
  Hdf5RecordStream(std::string file, CsvOptions options) : file_(std::move(file)), options_(std::move(options)) {}

  bool next(Recording& part) override {
    const SignalFile rows = read_hdf5_rows(file_, rows_, kRows);
    if (rows_ > 0 && rows.tables.empty()) return false;
    part = recording_of(rows, options_);
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
  CsvOptions options_;
  double dt_ = 0, start_ = 0;
  Eigen::Index rows_ = 0;
};

}  // namespace

std::unique_ptr<RecordStream> stream_csv(const std::filesystem::path& path, const CsvOptions& options) {
  return std::make_unique<CsvRecordStream>(path.string(), options);
}

std::unique_ptr<RecordStream> stream_hdf5(const std::filesystem::path& path, const CsvOptions& options) {
  return std::make_unique<Hdf5RecordStream>(path.string(), options);
}

}  // namespace whirl::io
