#pragma once
#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "whirl/core/quantity.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/monitor/sample_ring.hpp"

namespace whirl::monitor {

struct ChannelInfo {
  std::string name;
  Quantity quantity = Quantity::dimensionless;
};

/// What a stream consists of. Fixed while the source lives.
struct StreamInfo {
  std::string name;  ///< file, rig, ...
  double rate = 0;   ///< samples per second of the stream's own time
  std::vector<ChannelInfo> channels;
};

/// What an authorised user may ask of a source: a button, or a value in a range.
struct Control {
  std::string name = {};
  bool takes_value = false;
  double low = 0, high = 0, value = 0;
  std::string unit = {};
};

/// Where samples come from. Called by the hub's thread alone, but for `urgent`.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  virtual const StreamInfo& info() const = 0;
  /// Moves the samples that have arrived since the last call into the first rows of `block` (samples x channels, SI)
  /// and returns their number; `t_first` is the time of row 0, s. Rows continue at the stream's rate: a lost sample is
  /// a row of NaN. Returns 0 when there is nothing new. Never waits.
  virtual Eigen::Index read(Eigen::Ref<Eigen::MatrixXd> block, double& t_first) = 0;
  /// True once after the rows stopped following those before them: a new pass over a record, a seek.
  virtual bool jumped() { return false; }
  /// Names and values shown beside the plots: state, overruns, trip reason, ...
  virtual std::vector<std::pair<std::string, std::string>> status() const = 0;
  /// A command of an authorised user, e.g. "pause". False: not known here. Throws Error when the value is not allowed.
  virtual bool command(const std::string& name, double value) = 0;
  /// What `command` and `urgent` know.
  virtual std::vector<Control> controls() const { return {}; }
  /// A command that must not wait for the hub's next step, such as "trip". True: done. Called from any thread.
  virtual bool urgent(const std::string&) { return false; }
  /// Whether another recording may take its place; a running loop stays.
  virtual bool replaceable() const { return false; }
  /// What happened since the last call, for the log.
  virtual std::vector<std::string> events() { return {}; }
};

/// Plays a recording as if it were measured now, `speed` times as fast (0.01 to 10000). Commands: pause, play,
/// speed (value), seek (value, s from the start), loop (0 or 1).
class PlaybackSource : public FrameSource {
 public:
  using Clock = std::function<double()>;  ///< seconds, monotonic
  explicit PlaybackSource(Recording recording, double speed = 1, bool loop = false, Clock clock = steady_seconds);

  const StreamInfo& info() const override { return info_; }
  Eigen::Index read(Eigen::Ref<Eigen::MatrixXd> block, double& t_first) override;
  bool jumped() override { return std::exchange(jumped_, false); }
  std::vector<std::pair<std::string, std::string>> status() const override;
  bool command(const std::string& name, double value) override;
  std::vector<Control> controls() const override;
  bool replaceable() const override { return true; }

  static double steady_seconds();

 private:
  void restart_clock();

  Recording recording_;
  StreamInfo info_;
  double speed_;
  bool loop_, paused_ = false, jumped_ = false;
  Clock clock_;
  double started_ = 0;     ///< clock value at which `from_` was due
  double from_ = 0;        ///< samples played when the clock was restarted
  Eigen::Index next_ = 0;  ///< next sample of the recording
  std::int64_t lap_ = 0;   ///< complete passes
};

/// Samples that a loop pushes into a ring, which must outlive the source. What it is told and asked besides (`status`,
/// `command`, `urgent`, `events`) a loop adds by deriving.
class RingSource : public FrameSource {
 public:
  RingSource(StreamInfo info, SampleRing& ring);

  const StreamInfo& info() const override { return info_; }
  Eigen::Index read(Eigen::Ref<Eigen::MatrixXd> block, double& t_first) override;
  std::vector<std::pair<std::string, std::string>> status() const override;
  bool command(const std::string&, double) override { return false; }

 private:
  StreamInfo info_;
  SampleRing& ring_;
  std::vector<double> row_;
  bool started_ = false;
  std::uint64_t expected_ = 0;  ///< next tick of the stream
};

}  // namespace whirl::monitor
