#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "whirl/monitor/hub.hpp"
#include "whirl/monitor/loop_view.hpp"
#include "whirl/monitor/server.hpp"

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

/// The page of a running loop.
class LiveView : public monitor::LoopView {
 public:
  /// `reference`: drawn behind, unless the options name one.
  LiveView(const ViewOptions& options, const About& about, const std::optional<monitor::Reference>& reference = {});
  void until_stopped() const { served_->until_stopped(); }

 private:
  std::optional<Served> served_;
};

}  // namespace whirl::app
