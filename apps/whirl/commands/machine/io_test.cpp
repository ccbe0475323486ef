#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "command.hpp"
#include "stop_signal.hpp"
#include "whirl/hardware/sensitivity.hpp"
#include "whirl/hardware/survey.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/report/table.hpp"

namespace whirl::app {
namespace {

constexpr std::array<const char*, 2> kAxis{"x", "y"};

report::Table channel_table(const hardware::IoSettings& io, const hardware::LoopSurvey& s) {
  report::Table table;
  table.caption = "Displacement channels, disarmed";
  table.columns = {{"", "", report::Align::left},
                   {"source", "", report::Align::left},
                   {"distance", "mm"},
                   {"from", "mm"},
                   {"to", "mm"},
                   {"noise", "um rms"},
                   {"rate", "Hz"},
                   {"good", "%"},
                   {"errors", "%"},
                   {"stuck", "%"},
                   {"lost frames", ""}};
  for (std::size_t i = 0; i < 2; ++i) {
    const hardware::ChannelSurvey& c = s.channel[i];
    const rt::PositionInput& p = io.hardware.position[i];
    const bool laser = !p.laser.device.empty();
    const auto percent = [&](rt::InputState state) { return fmt::format("{:.2f}", 100 * c.share(state)); };
    table.add({kAxis[i], laser ? p.laser.device : fmt::format("input {}", p.analog),
               fmt::format("{:.4f}", 1e3 * c.mean), fmt::format("{:.4f}", 1e3 * c.low),
               fmt::format("{:.4f}", 1e3 * c.high), fmt::format("{:.2f}", 1e6 * c.noise),
               laser ? fmt::format("{:.1f}", c.rate) : fmt::format("{:.1f}", s.board_rate),
               percent(rt::InputState::good), percent(rt::InputState::sensor_error), percent(rt::InputState::stuck),
               laser ? fmt::format("{}", c.frames_lost) : "-"});
  }
  return table;
}

void measure_sensitivity(Session& session, const hardware::IoSettings& io, const std::string& controller,
                         double seconds, double excitation) {
  const ControllerDesign design = whirl::io::load<ControllerDesign>(controller);
  const hardware::LoopSensitivity m = hardware::measure_sensitivity(io, design, seconds, excitation, stop_requested);
  if (m.trip == Fault::none) {
    const tuning::LoopMargins& margins = m.margins;
    session.say(
        fmt::format("{} with {}, shaft at rest, {:g} N rms in {} lines of both whirl directions, {} periods of 2 s\n"
                    "peak sensitivity {:.2f} (standard deviation {:.2f}) at {:.1f} Hz: zone {} of ISO 14839-3\n"
                    "modulus margin {:.2f}, phase margin {:.0f} deg, gain margin {}, delay margin {}",
                    design.law, design.estimator, excitation, m.response.frequency.size(), m.periods,
                    margins.peak_sensitivity, m.peak_deviation, margins.peak_frequency, margins.zone(), margins.modulus,
                    margins.phase * 180 / std::numbers::pi,
                    std::isfinite(margins.gain_up) ? fmt::format("{:.2f}", margins.gain_up) : "not reached",
                    std::isfinite(margins.delay) ? fmt::format("{:.2f} ms", 1e3 * margins.delay) : "not reached"));
  }
  session.result(hardware::to_json(m));
  session.finish(m.summary);
}

}  // namespace

void add_io(CommandLine& app, Session& session) {
  CommandLine* io = app.add_subcommand("io", "Sensors, board and actuators of io.toml");
  io->require_subcommand();
  struct Options {
    std::string io, sensitivity;
    double seconds = 2, excite = 0;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      *io, session, "test", "Look at each channel and measure the delay of the loop",
      "Input: io.toml (docs/formats.md). Without force, for --seconds: each displacement's distance, noise (rms, from "
      "second\n"
      "differences, with the shaft at rest), rate against the nominal one, error codes, stuck values, lost frames; the "
      "board's\n"
      "rate, angle and speed; and the turnaround: ticks from a reading to the reading that confirms the command "
      "answering it,\n"
      "which a board that returns that number measures itself. With --excite-N also, for --seconds on x and then on y, "
      "a random\n"
      "telegraph force on the shaft at rest, from which the whole delay from force to displacement is fitted (sensor, "
      "computation,\n"
      "hold-off, amplifier lag), with the actuator's gain and direction. The trip limits of io.toml act; begin with a "
      "small force.\n"
      "Exit code 1 when a channel is not fit for control, with the reasons.\n"
      "With --sensitivity: the loop runs with that controller on the shaft at rest, --excite-N of all frequencies is "
      "added for\n"
      "--seconds (12 or more), and the sensitivity S is measured, with its zone of ISO 14839-3 and the margins; "
      "compare "
      "`whirl\n"
      "margins`. Exit code 1 in zone D or when the loop trips.\n\n"
      "Example: whirl io test --io io.toml --excite-N 0.2\n"
      "         whirl io test --io io.toml --sensitivity controller.json --excite-N 0.5 --seconds 40",
      [o, &session] {
        require_range("--seconds", o->seconds, 0.5, 600, "s");
        require_range("--excite-N", o->excite, 0, 1e4, "N");
        const hardware::IoSettings settings = hardware::read_io(o->io);
        catch_stop_signals();
        if (!o->sensitivity.empty()) {
          return measure_sensitivity(session, settings, o->sensitivity, o->seconds, o->excite);
        }
        const hardware::LoopSurvey s = hardware::survey(settings, o->seconds, o->excite, stop_requested);
        for (const std::string& text : s.angle) session.say(text);
        session.say(report::to_text(channel_table(settings, s)));
        session.say(fmt::format(
            "board: {} ticks a second by this machine's clock, nominal {:g}; {} ticks left out; speed {:.1f} rad/s, "
            "turned {:.3f} rad",
            s.board_rate > 0 ? fmt::format("{:.1f}", s.board_rate) : "no clock of its own,", settings.rate, s.missed,
            s.omega, s.beta_last - s.beta_first));
        session.say(fmt::format("board: analogue inputs {:.4f}, {:.4f}, {:.4f}, {:.4f} V", s.analog[0], s.analog[1],
                                s.analog[2], s.analog[3]));
        if (s.turnarounds > 0) {
          session.say(fmt::format("turnaround by the board: {:.3f} ticks on average, {} at most ({} readings)",
                                  s.turnaround_mean, s.turnaround_max, s.turnarounds));
        }
        for (std::size_t i = 0; i < 2 && o->excite > 0; ++i) {
          const rt::LoopDelay& d = s.delay[i];
          if (d.frequency == 0 && d.explained == 0) continue;  // refused, tripped or stopped
          session.say(fmt::format(
              "{}: delay {:.3f} ms, standard deviation {:.3f} ms (commanded force to displacement read, without the "
              "hold); {:.4g} m/s^2 per N, free vibration {:.2f} Hz; fit explains {:.2f} %",
              kAxis[i], 1e3 * d.delay, 1e3 * d.deviation, d.gain, d.frequency, 100 * d.explained));
        }
        session.result(hardware::to_json(settings, s));
        session.finish(s.summary);
      });
  sub->add_option("--io", o->io, "settings of sensors, board and loop (TOML)")->input()->required();
  sub->add_option("--sensitivity", o->sensitivity, "controller.json: measure the sensitivity of the loop it closes")
      ->input();
  sub->add_option("--seconds", o->seconds, "length of each part")->range(0.1, 3600)->show_default();
  sub->add_option("--excite-N", o->excite, "force of the excitation; 0: none")->range(0, 1e6)->show_default();
}

}  // namespace whirl::app
