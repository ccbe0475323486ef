#pragma once
#include <atomic>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "whirl/monitor/client_queue.hpp"
#include "whirl/monitor/frame_source.hpp"
#include "whirl/monitor/recorder.hpp"
#include "whirl/monitor/spectrum_average.hpp"
#include "whirl/monitor/synchronous.hpp"

namespace whirl::monitor {

struct HubOptions {
  double frame_rate = 25;          ///< frames per second, 1 to 60
  Eigen::Index frame_groups = 512; ///< most values (or min/max pairs) per channel and frame
  SpectrumSettings spectrum;
  RecorderOptions recorder;
  /// Largest |value| allowed per channel name, SI. Each crossing goes to the log once, with time and speed.
  std::map<std::string, double> limits;
};

/// Takes samples from a source, makes frames of them and hands them to every client. Its own thread; the real-time loop
/// only pushes into the source's ring and is never waited for.
class Hub {
 public:
  Hub(std::unique_ptr<FrameSource> source, const HubOptions& options);
  ~Hub() { stop(); }

  /// Starts the thread that calls step() at the frame rate.
  void start();
  void stop();
  /// One pass: reads what arrived, publishes frames. For tests without the thread.
  void step();

  /// A client joins: it gets the description of the stream first, then everything published. Thread-safe.
  void add(const std::shared_ptr<ClientQueue>& client);
  void remove(const std::shared_ptr<ClientQueue>& client);

  /// A command of an authorised user, as JSON text such as {"command":"record","value":1}.
  /// Commands: record (1, 0), reset (averages), spectrum (block, averages, averaging, window), and those of the source.
  /// Executed in the next step; refused commands say why in the log of the status message. Thread-safe.
  void submit(std::string json);

  /// Stream description as sent to a new client.
  std::string description() const;

 private:
  void publish(MessagePtr message);
  void publish_frame(FrameKind kind, unsigned log2_group, double t, const Eigen::Ref<const Eigen::MatrixXd>& values);
  void publish_samples(double t_first, const Eigen::Ref<const Eigen::MatrixXd>& rows);
  void publish_synchronous(double t_first, const Eigen::Ref<const Eigen::MatrixXd>& rows);
  void publish_status();
  void watch_limits(double t_first, const Eigen::Ref<const Eigen::MatrixXd>& rows);
  void execute(const std::string& json);
  void note(const std::string& line);

  std::unique_ptr<FrameSource> source_;
  HubOptions options_;
  mutable std::mutex mutex_;  ///< guards clients_, commands_, spectrum settings in description()
  std::vector<std::shared_ptr<ClientQueue>> clients_;
  std::vector<std::string> commands_;

  SpectrumAverage spectrum_;
  std::optional<SynchronousTracker> synchronous_;
  Eigen::Index beta_ = -1;
  std::vector<Eigen::Index> tracked_;  ///< displacement channels
  /// State of the limit of one channel.
  struct Watch {
    Eigen::Index channel = 0;
    double limit = 0, last_over = 0, largest = 0;
    bool over = false;
  };
  std::vector<Watch> watches_;
  double speed_ = std::numeric_limits<double>::quiet_NaN();  ///< rad/s, of the last full turn
  Recorder recorder_;
  Eigen::MatrixXd block_;
  double last_time_ = 0;
  std::uint32_t seq_ = 0;
  long steps_ = 0;
  std::vector<std::string> log_;  ///< since the last status message
  std::atomic<bool> running_{false};
  std::thread thread_;
};

}  // namespace whirl::monitor
