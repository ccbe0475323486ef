#include "command.hpp"
#include "io_survey.hpp"
#include "whirl/report/table.hpp"

namespace whirl::app {
namespace {

constexpr std::array<const char*, 2> kAxis{"x", "y"};

report::Table channel_table(const IoSettings& io, const LoopSurvey& s) {
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
    const ChannelSurvey& c = s.channel[i];
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

io::Json to_json(const IoSettings& io, const LoopSurvey& s, double excitation, const std::vector<std::string>& wrong) {
  io::Json json = io::start_document("whirl.io-test", 1);
  for (std::size_t i = 0; i < 2; ++i) {
    const ChannelSurvey& c = s.channel[i];
    io::Json channel = io::Json::object();
    channel.set("ticks", c.ticks).set("mean", c.mean).set("low", c.low).set("high", c.high).set("noise", c.noise);
    for (int k = 0; k < rt::kInputStates; ++k) {
      std::string key(to_string(static_cast<rt::InputState>(k)));
      std::replace(key.begin(), key.end(), ' ', '_');
      if (static_cast<rt::InputState>(k) == rt::InputState::current) key = "current";
      channel.set(key, c.share(static_cast<rt::InputState>(k)));
    }
    channel.set("longest_repeat", c.longest_repeat);
    if (!io.hardware.position[i].laser.device.empty()) {
      channel.set("rate", c.rate)
          .set("frames", static_cast<double>(c.frames))
          .set("frames_lost", static_cast<double>(c.frames_lost));
      channel.set("bytes_dropped", static_cast<double>(c.bytes_dropped));
    }
    if (excitation > 0) {
      const rt::LoopDelay& d = s.delay[i];
      io::Json delay = io::Json::object();
      delay.set("delay", d.delay)
          .set("deviation", d.deviation)
          .set("gain", d.gain)
          .set("frequency", d.frequency)
          .set("explained", d.explained);
      channel.set("excitation", delay);
    }
    json.set(kAxis[i], channel);
  }
  io::Json board = io::Json::object();
  board.set("rate", s.board_rate)
      .set("missed", s.missed)
      .set("omega", s.omega)
      .set("turned", s.beta_last - s.beta_first);
  board.set("turnaround_mean", s.turnaround_mean)
      .set("turnaround_max", s.turnaround_max)
      .set("turnarounds", s.turnarounds);
  json.set("board", board).set("seconds", s.seconds).set("problems", wrong);
  return json;
}

}  // namespace

void add_io(CommandLine& app, Session& session) {
  CommandLine* io = app.add_subcommand("io", "Sensors, board and actuators of io.toml");
  io->require_subcommand();
  struct Options {
    std::string io;
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
      "Exit code 1 when a channel is not fit for control, with the reasons.\n\n"
      "Example: whirl io test --io io.toml --excite-N 0.2",
      [o, &session] {
        const IoSettings settings = read_io(o->io);
        require_range("--seconds", o->seconds, 0.5, 600, "s");
        require_range("--excite-N", o->excite, 0, 1e4, "N");
        if (o->excite > 0 && settings.safety.displacement <= 0) {
          throw Error::in_file(o->io, 0, "safety.displacement_mm = 0: an excitation needs a displacement that trips");
        }
        const LoopSurvey s = survey(settings, o->seconds, o->excite);
        const std::vector<std::string> wrong = problems(settings, s);
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
          session.say(fmt::format(
              "{}: delay {:.3f} ms, standard deviation {:.3f} ms (force asked for to displacement read, without the "
              "hold); {:.4g} m/s^2 per N, free vibration {:.2f} Hz; fit explains {:.2f} %",
              kAxis[i], 1e3 * d.delay, 1e3 * d.deviation, d.gain, d.frequency, 100 * d.explained));
        }
        session.result(to_json(settings, s, o->excite, wrong));
        Summary summary;
        for (const std::string& text : wrong) summary.fail(text);
        session.finish(summary);
      });
  sub->add_option("--io", o->io, "settings of sensors, board and loop (TOML)")->input()->required();
  sub->add_option("--seconds", o->seconds, "length of each part")->show_default();
  sub->add_option("--excite-N", o->excite, "force of the excitation; 0: none")->show_default();
}

}  // namespace whirl::app
