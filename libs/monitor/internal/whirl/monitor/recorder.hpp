#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>

#include "whirl/io/output.hpp"
#include "whirl/monitor/frame_source.hpp"

namespace whirl::monitor {

struct RecorderOptions {
  std::filesystem::path folder;               ///< below which each record gets its own folder; empty: no recording
  std::uintmax_t size_limit = 1'000'000'000;  ///< bytes of one record
  std::uintmax_t free_space = 500'000'000;    ///< bytes that must stay free on the disk
};

/// Writes the full stream, every sample in SI, to run_NNN/record.csv (for read_csv) with run_NNN/settings.json and
/// run_NNN/events.csv (t_s,event) beside it.
/// A lost value is written as the last one that came, so that every program reads the file; such rows have 0 in the
/// last column, `valid`, and are counted. Stops by itself at the size limit or when the disk fills: record.csv then
/// ends in a whole line and events.csv says `record stopped` and why. Never writes into a folder that was there.
class Recorder {
 public:
  /// Makes the folder. Throws Error when it cannot be written.
  explicit Recorder(RecorderOptions options);
  ~Recorder() { stop("program ended"); }

  /// Throws Error when recording is off, a record runs already, or the folder cannot be written.
  void start(const StreamInfo& info, const std::string& settings_json);
  void write(double t_first, const Eigen::Ref<const Eigen::MatrixXd>& block);
  /// Nothing when no record runs.
  void event(double t, const std::string& text);
  void stop(const std::string& reason);

  bool active() const { return file_.is_open(); }
  const std::filesystem::path& folder() const { return run_; }  ///< of the running or last record
  std::uint64_t samples() const { return samples_; }
  std::uint64_t lost() const { return lost_; }  ///< rows with a missing value
  const std::string& stopped_because() const { return reason_; }

 private:
  bool disk_is_nearly_full() const;
  void require_space() const;
  void close();

  RecorderOptions options_;
  std::filesystem::path run_;
  io::GrowingFile file_, events_;
  double rate_ = 0, last_time_ = 0;
  Eigen::VectorXd last_;  ///< finite value of each channel
  std::uintmax_t bytes_ = 0, checked_ = 0;
  std::uint64_t samples_ = 0, lost_ = 0;
  std::string reason_;
};

}  // namespace whirl::monitor
