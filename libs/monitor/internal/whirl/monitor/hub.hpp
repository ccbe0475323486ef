#pragma once
#include <atomic>
#include <deque>
#include <filesystem>
#include <functional>
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
#include "whirl/monitor/limit_watch.hpp"
#include "whirl/monitor/recorder.hpp"
#include "whirl/monitor/reference.hpp"
#include "whirl/monitor/spectrum_average.hpp"
#include "whirl/monitor/speed_trend.hpp"
#include "whirl/monitor/synchronous.hpp"
#include "whirl/rt/histogram.hpp"

namespace whirl::monitor {

struct HubOptions {
  double frame_rate = 30;           ///< frames per second, 1 to 60
  Eigen::Index frame_groups = 512;  ///< most values (or min/max pairs) per channel and frame
  SpectrumSettings spectrum;
  RecorderOptions recorder;
  /// Largest |value| allowed per channel name, SI. Each crossing goes to the log once, with time and speed.
  std::map<std::string, double> limits;
  std::optional<Reference> reference;  ///< shown behind the run
  /// Reads a file that somebody with the token dropped on the page; throws Error. Empty: none are taken.
  std::function<Recording(const std::filesystem::path&)> read;
};

/// What becomes of a recording that was dropped on the page.
enum class Opened { played, compared };

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

  /// A client joins: it gets the description of the stream and the log so far first, then everything published.
  /// Thread-safe.
  void add(const std::shared_ptr<ClientQueue>& client);
  void remove(const std::shared_ptr<ClientQueue>& client);

  /// A command of an authorised user, as JSON text such as {"command":"record","value":1}.
  /// Commands: record (1, 0), reset (averages), spectrum (block, averages, averaging, window), limit (channel, value),
  /// marker (text), and those of the source. An urgent one of the source acts before this returns, all others in the
  /// next step; each goes to the log, refused ones with the reason. Thread-safe.
  void submit(std::string json);
  /// A line for the log, from any thread.
  void report(std::string line);

  /// Whether the page may open a recording so.
  bool takes(Opened as) const;
  /// Reads a recording in the caller's thread; it is played in place of the one shown, or becomes the reference, with
  /// the hub's next step. `name`: what the user called the file. Throws Error, and changes nothing, when it cannot be
  /// read or be opened so. Thread-safe.
  void open(const std::filesystem::path& file, const std::string& name, Opened as);

  /// Stream description as sent to a new client.
  std::string description() const;

 private:
  void publish(MessagePtr message);
  void publish_frame(FrameKind kind, unsigned log2_group, double t, const Eigen::Ref<const Eigen::MatrixXd>& values);
  void publish_samples(double t_first, const Eigen::Ref<const Eigen::MatrixXd>& rows);
  void publish_synchronous(double t_first, const Eigen::Ref<const Eigen::MatrixXd>& rows);
  void publish_status();
  MessagePtr history() const;
  void publish_spectra();
  void take_turns(double t_first, const Eigen::MatrixXd& turns);
  void note_run(const SpeedTrend::Run& run);
  void time_cycles(const Eigen::Ref<const Eigen::MatrixXd>& rows);
  void execute(const std::string& json, bool done);
  void set_up();
  void replace_source(std::unique_ptr<FrameSource> source);
  void take_opened();
  SpectrumAverage make_spectrum(const SpectrumSettings& settings) const;
  static std::string controls_of(const FrameSource& source);
  void note(const std::string& line);

  std::shared_ptr<FrameSource> source_;  ///< replaced by the hub's thread alone
  std::string controls_;                 ///< JSON
  HubOptions options_;
  /// Guards clients_, asked_, history_, opened_, what changes in description(), and the pointer source_ against the
  /// other threads.
  mutable std::mutex mutex_;
  struct {
    std::unique_ptr<FrameSource> source;
    std::optional<Reference> reference;
  } opened_;
  int streams_ = 0;  ///< recordings opened so far
  std::vector<std::shared_ptr<ClientQueue>> clients_;
  struct Asked {
    std::string text;
    enum { command, done, line } kind = command;
  };
  std::vector<Asked> asked_;
  std::deque<std::string> history_;  ///< of the log

  std::optional<SynchronousTracker> synchronous_;
  Eigen::Index beta_ = -1;
  std::vector<Eigen::Index> tracked_;
  LimitWatch limits_;
  SpectrumAverage spectrum_;
  SpeedTrend trend_;
  /// Times of the loop, from the channels "latency" and "period", when the stream has them.
  struct Times {
    std::string name;
    Eigen::Index channel;
    rt::Histogram histogram;
  };
  std::vector<Times> times_;
  long cycles_ = 0;
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
