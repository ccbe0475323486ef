// CSV in parts: the lines are read one after the other, as they are of any length.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "formats/csv/csv_rates.hpp"
#include "formats/format.hpp"
#include "formats/parts/random_bytes.hpp"
#include "formats/parts/rows.hpp"
#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

/// Time of a sample that the uniform grid of the first part puts at `due`.
bool on_grid(double t, double due, double start, double dt, double rounding) {
  // The step read from the first part carries the rounding of its times over the whole file.
  return std::abs(t - due) <= 0.05 * dt + 1e-6 * (due - start) + rounding;
}

class CsvSignalStream : public SignalStream {
 public:
  CsvSignalStream(const std::filesystem::path& file, const CsvOptions& options, const PartRows& rows)
      : stream_(file, options), gaps_(options.gaps), rows_(rows) {
    require_rows(rows, rows.end);
    block_.resize(rows_of_part(rows, stream_.columns().size()), static_cast<Eigen::Index>(stream_.columns().size()));
    std::error_code none;
    bytes_ = static_cast<double>(std::filesystem::file_size(file, none));
    if (options.rate)
      dt_ = 1 / *options.rate;
    else if (stream_.time_column() < 0)
      throw Error(stream_.source() + ": no time column and no --rate");
    else if (!stream_.dialect().compressed)
      last_time_ = last_time(file, options);
  }

  bool next(SignalFile& part) override {
    while (at_ < rows_.end) {
      const Eigen::Index n = stream_.next(block_);
      if (n == 0) {
        require_rows(rows_, at_);
        return false;
      }
      if (stream_.time_column() >= 0) check_time(block_.col(stream_.time_column()).head(n));
      const Eigen::Index from = std::max<Eigen::Index>(rows_.first - at_, 0), to = std::min(n, rows_.end - at_);
      at_ += n;
      if (from >= to) continue;
      part = {.source = stream_.source(), .format = to_string(stream_.dialect())};
      SignalTable table{.abscissa = Quantity::time, .start = start_, .step = dt_};
      for (std::size_t k = 0; k < stream_.columns().size(); ++k) {
        if (static_cast<int>(k) == stream_.time_column()) continue;
        const CsvColumn& column = stream_.columns()[k];
        const Quantity quantity = column.unit != nullptr ? column.unit->quantity : Quantity::dimensionless;
        table.signals.push_back({column.name, std::string(si_unit(quantity)), quantity,
                                 block_.col(static_cast<Eigen::Index>(k)).segment(from, to - from)});
      }
      if (uneven_) {
        table.step = 0;
        table.x = block_.col(stream_.time_column()).segment(from, to - from);
      }
      part.tables.push_back(std::move(table));
      return true;
    }
    return false;
  }
  double done() const override { return std::min(1.0, static_cast<double>(stream_.bytes_read()) / bytes_); }

 private:
  void check_time(const Eigen::Ref<const Eigen::VectorXd>& t) {
    if (at_ == 0) {
      start_ = t[0];
      if (t.size() < 2) throw Error(stream_.source() + ": one sample is no record");
      if (dt_ == 0) dt_ = step(t);
      if (!(dt_ > 0)) throw Error(stream_.source() + ": time does not increase");
    }
    const double rounding = 0.5 * std::pow(10.0, -std::max(0, stream_.time_decimals()));
    for (Eigen::Index i = 0; i < t.size(); ++i) {
      const double due = start_ + dt_ * static_cast<double>(at_ + i);
      if (on_grid(t[i], due, start_, dt_, rounding)) continue;
      if (gaps_) {
        uneven_ = true;
      } else {
        throw Error::in_file(stream_.source(), stream_.line_of(at_ + i),
                             fmt::format("time {:g} s: must be {:g} s for a uniform step of {:g} s", t[i], due, dt_));
      }
    }
  }

  /// As of the whole file, where its last time is known.
  double step(const Eigen::Ref<const Eigen::VectorXd>& t) const {
    const double mean = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
    const double rows = last_time_ ? std::round((*last_time_ - t[0]) / mean) + 1 : 0;
    if (!(mean > 0) || !(rows >= 2 && rows < 1e15)) return mean;
    return detail::csv_grid(stream_, t[0], *last_time_, static_cast<Eigen::Index>(rows), 0, false).dt;
  }

  /// The time in the last line, read as a file of the first lines and the last ones.
  std::optional<double> last_time(const std::filesystem::path& file, const CsvOptions& options) const {
    constexpr std::uint64_t kEnd = std::uint64_t{1} << 16;
    try {
      const RandomBytes bytes(file);
      std::string text = bytes.copy(0, std::min(bytes.size(), 4 * kEnd));
      if (bytes.size() > text.size() + kEnd) {
        std::size_t end = 0;  // of the first line of values
        for (long line = 0; line < stream_.line_of(0); ++line) {
          end = text.find('\n', end) + 1;
          if (end == 0) return {};
        }
        const std::string last = bytes.copy(bytes.size() - kEnd, kEnd);
        text = text.substr(0, end) + last.substr(std::min(last.find('\n'), last.size() - 1) + 1);
      } else {
        text = bytes.copy(0, bytes.size());
      }
      CsvStream stream(text, stream_.source(), options);
      Eigen::MatrixXd block(4096, static_cast<Eigen::Index>(stream.columns().size()));
      std::optional<double> time;
      while (const Eigen::Index n = stream.next(block)) time = block(n - 1, stream.time_column());
      return time;
    } catch (const Error&) {  // said where the lines are read
      return {};
    }
  }

  CsvStream stream_;
  std::optional<double> last_time_;
  bool gaps_, uneven_ = false;  ///< uneven times are let through; some were there
  PartRows rows_;
  Eigen::MatrixXd block_;
  double dt_ = 0, start_ = 0, bytes_ = 0;
  Eigen::Index at_ = 0;
};

}  // namespace

std::unique_ptr<SignalStream> stream_csv(const std::filesystem::path& path, const CsvOptions& options,
                                         const PartRows& rows) {
  return std::make_unique<CsvSignalStream>(path, options, rows);
}

}  // namespace whirl::io
