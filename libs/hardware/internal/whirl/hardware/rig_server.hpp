#pragma once
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/hardware/io_settings.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rt/drivers/board.hpp"
#include "whirl/rt/drivers/optoncdt_line.hpp"
#include "whirl/tuning/closed_loop.hpp"

namespace whirl::hardware {

class BoardSocket;

/// Faults of the wires, beside those of the machine (RigFault).
enum class LineFault : std::uint8_t { lost_bytes, error_code, dropout, delay, board_silent, gap };

struct ScriptedLineFault {
  LineFault kind = LineFault::lost_bytes;
  double start = 0, end = 0;  ///< s
  rig::RigAxis axis = rig::RigAxis::both;
  unsigned every = 50;          ///< lost_bytes: one in so many
  std::uint32_t code = 262076;  ///< error_code: sent instead of the distance
  double delay = 0;             ///< delay: of the frames, s
};

struct ServeOptions {
  rig::RigParameters rig;
  rig::RigRun run;
  std::vector<ScriptedLineFault> line_faults;
  std::string address = "127.0.0.1:0";
  std::filesystem::path key_file;  ///< of the board; empty: no key, and an address of this machine
  double watchdog = 50e-3;         ///< s without a command until the outputs go to zero
  /// Every tick waits for its command instead of for the clock, from the first command on that answers a tick: equal
  /// runs give equal records, bit for bit.
  bool lockstep = false;
};

/// Reads [[fault]] tables; those of the machine go to `run.faults`. Throws Error.
void read_faults(const std::filesystem::path& path, ServeOptions& options);

/// The virtual rig behind wires: two lasers on pseudo-terminals, a board on UDP, time of its own.
///
/// Until the first start command the shaft waits at the first instant of the profile; the lasers stream and the
/// board ticks. An armed command without start acts on the shaft at rest (`whirl io test`). A command acts from the
/// next tick of the board on (delay_samples of the rig). Board reading and laser frames of one tick leave at the tick,
/// the reading first.
class RigServer {
 public:
  explicit RigServer(const ServeOptions& options);
  ~RigServer();
  RigServer(const RigServer&) = delete;
  RigServer& operator=(const RigServer&) = delete;

  /// Settings for `whirl run --io` to reach this server.
  IoSettings io() const;
  /// Runs until the profile has ended or `stop()` is true.
  template <class Stop>
  void run(Stop&& stop) {
    start_time();
    while (!finished() && !stop()) tick();
  }
  bool started() const { return started_; }
  long ticks_done() const { return static_cast<long>(truth_x_.size()); }
  double slipped() const {
    return slipped_;
  }  ///< s that the machine's time stood still because this process was not let run
  long commands() const { return commands_; }      ///< taken
  long expired() const { return expired_count_; }  ///< times the watchdog acted
  long refused() const;                            ///< datagrams without the key
  /// How the run ended, the amplitudes being those of the true disk centre; after run().
  tuning::ClosedLoopMetrics metrics() const;
  Recording truth() const;

 private:
  struct Axis {
    rt::optoncdt::DeviceLine line;
    struct Frame {
      long due;
      std::uint32_t raw;
      std::uint64_t number;
    };
    std::deque<Frame> queue;
  };
  void start_time();
  rig::VirtualRig& machine() { return rest_ ? *rest_ : rig_; }
  bool finished() const;
  void tick();
  void receive();
  void wait_for_command();
  void measure(int sub);
  void send_reading();
  const ScriptedLineFault* active(LineFault kind, int axis) const;
  std::uint32_t raw(double displacement, bool valid, int axis) const;

  ServeOptions options_;
  rig::RigParameters fine_;
  long ratio_;
  rig::VirtualRig rig_;
  std::shared_ptr<const rig::RigTables> rest_tables_;
  std::optional<rig::VirtualRig> rest_;  // while a test excites the standing shaft
  rt::optoncdt::Scale scale_;
  std::array<Axis, 2> axes_;
  std::unique_ptr<BoardSocket> socket_;
  std::uint32_t board_tick_ = 0, last_answers_ = 0;
  rt::BoardCommand command_;
  long silent_ = 0;  // ticks since the last command
  bool expired_ = false, started_ = false, locked_ = false, lockstep_lost_ = false;
  long commands_ = 0, expired_count_ = 0, after_end_ = 0;
  std::int64_t next_ = 0;
  std::mt19937_64 standby_;
  std::vector<double> truth_x_, truth_y_, truth_omega_, truth_beta_, force_x_, force_y_;
  double radial_ = 0, slipped_ = 0;
};

}  // namespace whirl::hardware
