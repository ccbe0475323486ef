#include "whirl/monitor/recorder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <iterator>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/units.hpp"
#include "whirl/report/format.hpp"

namespace whirl::monitor {
namespace {

/// Header that read_csv understands: "x_m", "omega_rad_s".
std::string header(const StreamInfo& info) {
  std::string out = "t_s";
  for (const ChannelInfo& c : info.channels) out += fmt::format(",{}_{}", c.name, io::si_suffix(c.quantity).suffix);
  return out + ",valid_1\n";
}

}  // namespace

Recorder::Recorder(RecorderOptions options) : options_(std::move(options)) {
  if (options_.folder.empty()) return;
  std::error_code failed;
  std::filesystem::create_directories(options_.folder, failed);
  if (failed || ::access(options_.folder.c_str(), W_OK | X_OK) != 0) {
    throw Error::in_file(options_.folder.string(), 0,
                         "no folder that can be written: " +
                             (failed ? failed : std::error_code(errno, std::generic_category())).message());
  }
}

void Recorder::start(const StreamInfo& info, const std::string& settings_json) {
  if (options_.folder.empty()) throw Error("recording is off: start the monitor with a folder for records");
  if (active()) throw Error(fmt::format("a record is running already: {}", run_.string()));
  int number = 1;
  std::error_code failed;
  do {
    run_ = options_.folder / fmt::format("run_{:03}", number++);
  } while (!std::filesystem::create_directory(run_, failed) && !failed && number < 10000);
  if (failed) throw Error::in_file(run_.string(), 0, "folder cannot be created: " + failed.message());
  io::write_text(run_ / "settings.json", settings_json + "\n");
  file_.open(run_ / "record.csv", std::ios::binary);
  file_ << header(info);
  if (!file_) {
    file_.close();
    throw Error::in_file((run_ / "record.csv").string(), 0, "cannot be written");
  }
  events_.open(run_ / "events.csv", std::ios::binary);
  events_ << "t_s,event\n";
  rate_ = info.rate;
  last_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(info.channels.size()));
  bytes_ = checked_ = 0;
  samples_ = lost_ = 0;
  reason_.clear();
}

void Recorder::write(double t_first, const Eigen::Ref<const Eigen::MatrixXd>& block) {
  if (!active()) return;
  fmt::memory_buffer text;
  for (Eigen::Index i = 0; i < block.rows(); ++i) {
    fmt::format_to(std::back_inserter(text), "{:.9f}", t_first + static_cast<double>(i) / rate_);
    bool valid = true;
    for (Eigen::Index c = 0; c < block.cols(); ++c) {
      const bool finite = std::isfinite(block(i, c));
      if (finite) last_(c) = block(i, c);
      valid = valid && finite;
      fmt::format_to(std::back_inserter(text), ",{}", last_(c));
    }
    fmt::format_to(std::back_inserter(text), ",{}\n", valid ? 1 : 0);
    if (!valid) ++lost_;
  }
  file_.write(text.data(), static_cast<std::streamsize>(text.size()));
  bytes_ += text.size();
  samples_ += static_cast<std::uint64_t>(block.rows());
  if (!file_) return stop("writing failed");
  if (bytes_ >= options_.size_limit) return stop("size limit reached");
  // Asking the file system costs time: once per 4 MB.
  if (bytes_ - checked_ > 4'000'000) {
    checked_ = bytes_;
    std::error_code failed;
    const auto space = std::filesystem::space(run_, failed);
    if (!failed && space.available < options_.free_space) stop("disk nearly full");
  }
}

void Recorder::event(double t, const std::string& text) {
  if (active()) events_ << fmt::format("{:.6f},{}\n", t, report::escape_csv(text)) << std::flush;
}

void Recorder::stop(const std::string& reason) {
  if (!active()) return;
  file_.close();
  events_.close();
  reason_ = reason;
}

}  // namespace whirl::monitor
