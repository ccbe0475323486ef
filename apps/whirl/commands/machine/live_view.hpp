#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "whirl/monitor/hub.hpp"
#include "whirl/monitor/server.hpp"
#include "whirl/rt/loop_control.hpp"
#include "whirl/rt/loop_sample.hpp"

namespace whirl::app {

/// Flags of every command that shows something live.
struct ViewOptions {
  std::string address = "127.0.0.1", record_folder, reference;
  int port = 8765;
  std::vector<std::string> limits;  ///< x_mm=0.5
  bool read_only = false;

  void add_to(CommandLine* sub);
  /// Throws Error for a bad limit or a reference that cannot be read.
  monitor::HubOptions hub(double rate) const;  ///< for samples at `rate` Hz
  monitor::ServerOptions server() const;       ///< with a new token unless read-only
};

/// A file that the page sent, by `read`. Throws Error for one that names other files.
Recording read_opened(const std::filesystem::path& file,
                      const std::function<Recording(const std::filesystem::path&)>& read);

/// Hub and server of one source, from construction to destruction; says on stderr where the page is.
class Served {
 public:
  Served(const ViewOptions& options, std::unique_ptr<monitor::FrameSource> source, const monitor::HubOptions& hub);
  ~Served();
  /// Returns when a stop signal has come.
  void until_stopped() const;

 private:
  monitor::Hub hub_;
  monitor::Server server_;
};

/// The page of a running loop: what the loop recorded goes in, what a person wants comes out as LoopControl.
class LiveView {
 public:
  struct About {
    std::string name;                             ///< what runs
    double rate = 1000;                           ///< Hz
    double force_limit = 0;                       ///< of the controller, N; 0: none
    std::optional<monitor::Reference> reference;  ///< unless the options name one
  };
  LiveView(const ViewOptions& options, const About& about);
  ~LiveView();

  /// For the loop; null when the view is read-only.
  rt::LoopControl* control();
  /// Each cycle in the order of time, from the thread that empties the loop's queue.
  void take(const rt::LoopSample& sample);
  /// A line of the page's log.
  void note(const std::string& line);
  /// The loop is over; the page stays.
  void ended(const std::string& reason);
  void until_stopped() const { served_->until_stopped(); }

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::unique_ptr<Served> served_;
};

}  // namespace whirl::app
