#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "whirl/core/control_types.hpp"
#include "whirl/rt/drivers/board.hpp"
#include "whirl/rt/drivers/optoncdt_sensor.hpp"
#include "whirl/rt/drivers/tacho_tracker.hpp"
#include "whirl/rt/drivers/tick_alignment.hpp"

namespace whirl::rt {

/// Where one displacement comes from, and how it is calibrated:
///     displacement = direction gain (distance - offset)
/// with the distance by a serial laser (`laser.device` set) or, over a shunt, by its current output on an
/// analogue input of the board: I = V / shunt, distance = (I - 4 mA) / 16 mA range (operating instructions
/// ILD1420); a current below 3.6 mA or above 20.4 mA is an error.
struct PositionInput {
  optoncdt::SensorOptions laser;
  int analog = -1;     ///< 0 to 3; used when there is no device
  double shunt = 250;  ///< ohm
  double offset = 0;   ///< m, of the distance at displacement zero
  double gain = 1;
  int direction = 1;  ///< 1 or -1
};

/// Volts of one output: direction force / force_per_volt + offset, limited.
struct ForceOutput {
  double force_per_volt = 4;  ///< N/V
  double offset = 0;          ///< V
  double limit = 10;          ///< V
  int direction = 1;
};

struct HardwareOptions {
  std::array<PositionInput, 2> position;
  std::array<ForceOutput, 2> force;
  double sample_time = 1e-3;     ///< s
  double max_age = 5e-3;         ///< s; an older displacement is not valid
  double stuck = 25e-3;          ///< s; a signal that repeats itself exactly for longer is not valid; 0: not looked at
  double grace = 0.5e-3;         ///< s to wait for the other samples of a tick after the first has come
  double board_timeout = 50e-3;  ///< s without a board reading until the rig demands a trip
  int tacho = -1;  ///< analogue input of the board with a tacho's pulses, 0 to 3; -1: the board has an angle
};

/// Why a displacement is not used.
enum class InputState : std::uint8_t { good, no_sample, sensor_error, too_old, stuck, current };
constexpr int kInputStates = 6;
std::string_view to_string(InputState state);

/// Hardware behind the Rig concept: two displacement inputs, one board with angle, speed and two outputs. It is
/// also the source of a SampleClock: `wait` blocks until the samples of the next tick are there.
///
/// Ticks are those of the board. A board without a clock is read once in a cycle; ticks are then those of the first
/// laser where the loop waits for samples, else those of the loop, which says how many were left out. A laser runs on
/// its own; which of its frames belong to a tick is learned while the loop is disarmed, so a loop should stay disarmed
/// for some tens of cycles at first. Armed, clocks that run apart are followed by one tick in a thousand at most.
class HardwareRig {
 public:
  /// Opens the lasers. Throws Error for options out of range, a laser that does not start, a laser rate that is no
  /// multiple of the loop rate.
  HardwareRig(const HardwareOptions& options, std::unique_ptr<Board> board);
  ~HardwareRig();
  HardwareRig(const HardwareRig&) = delete;
  HardwareRig& operator=(const HardwareRig&) = delete;

  long wait(std::int64_t timeout) noexcept;
  void left_out(long ticks) noexcept { left_out_ += ticks; }
  Measurement read() noexcept;
  void write(const Command& force) noexcept;
  void advance() const noexcept {}
  void arm(bool armed) noexcept;
  Fault fault() const noexcept;
  /// Starts the experiment of a virtual rig without arming.
  void start() noexcept { started_ = true; }
  /// Armed commands act, but do not start the experiment of a virtual rig: its shaft stays at rest.
  void stay_at_rest() noexcept { at_rest_ = true; }
  /// From now on the angle comes from the pulses on the input `tacho` instead of the board: `tracker` in the state of
  /// the newest reading. Not while armed.
  void follow_tacho(const TachoTracker& tracker) noexcept;
  const TachoTracker* tacho() const noexcept { return tacho_ ? &*tacho_ : nullptr; }
  bool done() const noexcept { return reading_.done; }
  bool board_clock() const noexcept { return board_->descriptor() >= 0; }  ///< the board says when a tick is

  // For those who look at it from outside.
  InputState state(int axis) const noexcept { return axes_[static_cast<std::size_t>(axis)].state; }
  const BoardReading& board() const noexcept { return reading_; }
  std::string board_failure() const { return board_->failure(); }  ///< in words, empty without one
  const optoncdt::Sensor* laser(int axis) const noexcept {
    const auto& sensor = axes_[static_cast<std::size_t>(axis)].sensor;
    return sensor ? &*sensor : nullptr;
  }
  const optoncdt::Sample& sample(int axis) const noexcept {
    return axes_[static_cast<std::size_t>(axis)].newest;
  }                                                                                                    ///< of the laser
  double distance(int axis) const noexcept { return axes_[static_cast<std::size_t>(axis)].distance; }  ///< newest, m
  long late(int axis) const noexcept {
    return axes_[static_cast<std::size_t>(axis)].late;
  }  ///< ticks without a new sample

 private:
  struct Axis {
    std::optional<optoncdt::Sensor> sensor;
    long frames_per_tick = 1;
    bool seen = false;
    optoncdt::Sample newest;
    std::int64_t phase = 0;   ///< frames from a tick to index 0
    TickAlignment alignment;  ///< of the board and the laser
    long repeated = 0;        ///< frames, or ticks of an analogue input, with the same value
    double distance = 0;
    double last_analog = 0;
    InputState state = InputState::no_sample;
    long late = 0;
    long apart = 0;  ///< cycles in a row behind (> 0) or ahead (< 0) of the tick

    std::int64_t frame_tick() const noexcept;  ///< of the laser's own count
    std::int64_t tick() const noexcept { return frame_tick() + alignment.offset(); }
  };
  bool by_board() const noexcept { return board_->descriptor() >= 0; }
  const Axis& first() const noexcept { return axes_[0].sensor ? axes_[0] : axes_[1]; }
  std::int64_t newest() const noexcept;
  void drain() noexcept;
  void read_board() noexcept;
  void read_tacho(const BoardReading& before) noexcept;
  bool complete(std::int64_t tick, bool all) const noexcept;
  void align(std::int64_t now) noexcept;
  void follow_clocks() noexcept;
  InputState examine(Axis& axis, const PositionInput& input) noexcept;
  void follow_angle() noexcept;
  bool encoder_dead() const noexcept;
  bool plausible(const BoardReading& before) const noexcept;

  HardwareOptions options_;
  std::unique_ptr<Board> board_;
  std::optional<TachoTracker> tacho_;
  std::array<Axis, 2> axes_;
  BoardReading reading_;
  bool board_seen_ = false, board_fresh_ = false;
  std::int64_t board_tick_ = 0, tick_ = 0, start_ = 0;
  long left_out_ = 0;  ///< ticks without a cycle before this one
  long in_vain_ = 0;   ///< ticks for which nothing came although it was waited for
  long board_silent_ = 0, board_apart_ = 0, angle_repeated_ = 0;
  double last_beta_ = 0;
  /// Angle of the last ticks up to its last change, newest last: how fast the rotor turned, and whether it slowed down,
  /// by the encoder alone.
  std::array<double, 64> angles_{};
  long angles_known_ = 0;
  bool implausible_ = false, restarted_ = false;  ///< latched while armed
  bool armed_ = false, started_ = false, at_rest_ = false, waited_ = false;
};

}  // namespace whirl::rt
