#include "whirl/monitor/recorder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <iterator>

#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/units.hpp"
#include "whirl/report/format.hpp"

namespace whirl::monitor {
namespace {

/// Header that read_csv understands: "x_m", "omega_rad_s".
std::string header(const StreamInfo& info) {
  std::string out = "t_s";
  for (const ChannelInfo& c : info.channels) {
    std::string name = one_line(c.name);  // of a file that is played
    for (char& sign : name) sign = std::string_view(",;\"#").find(sign) == std::string_view::npos ? sign : '_';
    out += fmt::format(",{}_{}", name, io::si_suffix(c.quantity).suffix);
  }
  return out + ",valid_1\n";
}

constexpr std::size_t kRoomForEvents = 1 << 16;  // bytes: why a record stopped is written also to a full disk

/// run_001, run_002, ...: the first that is not there.
std::filesystem::path new_folder(const std::filesystem::path& below) {
  std::error_code failed;
  for (int number = 1; number < 1'000'000; ++number) {
    std::filesystem::path run = below / fmt::format("run_{:03}", number);
    if (std::filesystem::create_directory(run, failed)) return run;
    if (failed) throw Error::in_file(run.string(), 0, "folder cannot be created: " + failed.message());
  }
  throw Error::in_file(below.string(), 0, "holds a million records: start the monitor with another folder");
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
  require_space();
  run_ = new_folder(options_.folder);
  io::write_text(run_ / "settings.json", settings_json + "\n");
  try {
    events_.create(run_ / "events.csv", kRoomForEvents);
    events_.append("t_s,event\n");
    file_.create(run_ / "record.csv");
    file_.append(header(info));
  } catch (...) {
    close();
    throw;
  }
  rate_ = info.rate;
  last_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(info.channels.size()));
  last_time_ = 0;
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
  if (block.rows() > 0) last_time_ = t_first + static_cast<double>(block.rows() - 1) / rate_;
  try {
    file_.append({text.data(), text.size()});
  } catch (const Error& e) {
    return stop(e.what());
  }
  bytes_ += text.size();
  samples_ += static_cast<std::uint64_t>(block.rows());
  if (bytes_ >= options_.size_limit) return stop("size limit reached");
  // Asking the file system costs time: once per 4 MB.
  if (bytes_ - checked_ > 4'000'000) {
    checked_ = bytes_;
    if (disk_is_nearly_full()) stop("disk nearly full");
  }
}

bool Recorder::disk_is_nearly_full() const {
  std::error_code failed;
  const auto space = std::filesystem::space(options_.folder, failed);
  return !failed && space.available < options_.free_space;
}

void Recorder::require_space() const {
  if (!disk_is_nearly_full()) return;
  throw Error::in_file(options_.folder.string(), 0,
                       fmt::format("disk nearly full: a record needs {} MB free", options_.free_space / 1'000'000));
}

void Recorder::event(double t, const std::string& text) {
  if (!active()) return;
  try {
    events_.append(fmt::format("{:.6f},{}\n", t, report::escape_csv(text)));
  } catch (const Error& e) {
    stop(e.what());
  }
}

void Recorder::stop(const std::string& reason) {
  if (!active()) return;
  reason_ = reason;
  try {
    events_.append(fmt::format("{:.6f},{}\n", last_time_, report::escape_csv("record stopped: " + reason)));
  } catch (const Error&) {  // the page says it in any case
  }
  close();
}

void Recorder::close() {
  for (io::GrowingFile* file : {&file_, &events_}) {
    try {
      file->close();
    } catch (const Error& e) {
      reason_ = e.what();
    }
  }
}

}  // namespace whirl::monitor
