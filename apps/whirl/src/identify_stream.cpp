#include "identify_stream.hpp"

#include <cmath>
#include <filesystem>

#include "whirl/io/csv.hpp"

namespace whirl::app {
namespace {

/// A CSV file as parts of equal length; a part is passed on when the next one has been read, so that the last stays behind.
class Parts {
 public:
  Parts(const std::string& file, const RecordOptions& options)
      : stream_(file, options.csv()), block_(kRows, static_cast<Eigen::Index>(stream_.columns().size())) {
    const int time = stream_.time_column();
    if (options.rate > 0) dt_ = 1 / options.rate;
    else if (time < 0) throw Error(stream_.source() + ": no time column and no --rate");
    read_next();
  }

  bool next(Recording& part) {
    if (waiting_.size() == 0) return false;
    part = std::move(waiting_);
    waiting_ = {};
    read_next();
    // A short rest is no record of its own.
    if (waiting_.size() == 0 || waiting_.size() < kLeast) {
      last_ = std::move(part);
      return false;
    }
    return true;
  }

  const Recording& last() const { return last_; }
  Eigen::Index rows() const { return rows_; }

 private:
  static constexpr Eigen::Index kRows = 65536, kLeast = 1000;

  void read_next() {
    const Eigen::Index n = stream_.next(block_);
    if (n == 0) return;
    const int time = stream_.time_column();
    if (time >= 0) check_time(block_.col(time).head(n));
    waiting_ = {};
    waiting_.dt = dt_;
    waiting_.t0 = start_ + dt_ * static_cast<double>(rows_);
    waiting_.source = stream_.source();
    for (std::size_t k = 0; k < stream_.columns().size(); ++k) {
      if (static_cast<int>(k) == time) continue;
      const CsvColumn& column = stream_.columns()[k];
      waiting_.add(column.name, column.unit != nullptr ? column.unit->quantity : Quantity::dimensionless,
                   block_.col(static_cast<Eigen::Index>(k)).head(n));
    }
    rows_ += n;
  }

  void check_time(const Eigen::Ref<const Eigen::VectorXd>& t) {
    if (rows_ == 0) {
      start_ = t[0];
      if (t.size() < 2) throw Error(stream_.source() + ": one sample is no record");
      if (dt_ == 0) dt_ = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
      if (!(dt_ > 0)) throw Error(stream_.source() + ": time does not increase");
    }
    for (Eigen::Index i = 0; i < t.size(); ++i) {
      const double due = start_ + dt_ * static_cast<double>(rows_ + i);
      // Written times are rounded; the step read from the first part carries that over the whole file.
      const double allowed = 0.05 * dt_ + 1e-6 * static_cast<double>(rows_ + i) * dt_;
      if (!(std::abs(t[i] - due) <= allowed + 0.5 * std::pow(10.0, -std::max(0, stream_.time_decimals())))) {
        throw Error::in_file(stream_.source(), stream_.line_of(rows_ + i),
                             fmt::format("time {:g} s: must be {:g} s for a uniform step of {:g} s", t[i], due, dt_));
      }
    }
  }

  CsvStream stream_;
  Eigen::MatrixXd block_;
  Recording waiting_, last_;
  double dt_ = 0, start_ = 0;
  Eigen::Index rows_ = 0;
};

}  // namespace

IdentifiedModel identify_stream(const IdentifyOptions& o, Session& session, Evidence& evidence) {
  if (o.chosen_method() != "sindy") throw Error("--stream is for --method sindy");
  if (o.files.size() != 1) throw Error("--stream takes one file");
  if (!o.library.empty() || o.compare) throw Error("--stream takes neither --library nor --compare");
  if (!o.record.rows.empty()) throw Error("--rows and --stream exclude each other");
  RecordOptions reader = o.record;
  reader.required = o.required();
  Parts parts(o.files.front(), reader);
  Recording part;
  if (!parts.next(part)) throw Error(o.files.front() + ": too short to be read part by part; leave out --stream");
  const SindyOptions options = o.sindy(part);
  bool first = true;
  const RecordingSource source = [&](Recording& out) {
    session.progress(fmt::format("{:.3g} million samples", 1e-6 * static_cast<double>(parts.rows())), 0.5);
    if (first) {
      first = false;
      out = std::move(part);
      return true;
    }
    return parts.next(out);
  };
  IdentifiedModel model = fit_sindy_stream(source, options);
  if (model.summary.status == Status::unusable) return model;
  evidence.collinear = collinear_groups(model, parts.last());
  evidence.held_out = predict_held_out(model, parts.last(),
                                       fmt::format("the last {} of {} samples", parts.last().size(), parts.rows()), false);
  return model;
}

}  // namespace whirl::app
