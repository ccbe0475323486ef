#include "rig_serve.hpp"

#include <fmt/format.h>

#include "stop_signal.hpp"
#include "whirl/hardware/rig_server.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/pages/run_json.hpp"
#include "whirl/rig/rig_file.hpp"

namespace whirl::app {

static io::Json result_of(const hardware::RigServer& server, const tuning::ClosedLoopMetrics& m) {
  io::Json json = pages::to_json(m);
  json.set("ticks", server.ticks_done())
      .set("commands", server.commands())
      .set("watchdog_expired", server.expired())
      .set("refused", server.refused());
  return json.set("radial_peak", m.radial_peak).set("slipped", server.slipped());
}

void add_rig_serve(CommandLine& rig, Session& session) {
  struct Options {
    std::string rig, faults, io = "io.toml", log;
    std::optional<double> added_mass_g;
    double watchdog_ms = 50;
    bool run_up = false;
    hardware::ServeOptions serve;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      rig, session, "serve", "The rig as a process of its own, behind real wires",
      "Two lasers optoNCDT 1420 on pseudo-terminals (commands, prompts, frames with counter) and a converter board on "
      "UDP\n"
      "(docs/formats.md), in real time. Writes the settings that reach them to --io for `whirl run --io`. The profile "
      "starts\n"
      "with the first armed command; without commands for --watchdog-ms the outputs go to zero. --faults FILE: TOML "
      "tables\n"
      "[[fault]] kind, start_s, end_s, axis; kinds lost_bytes (every), error_code (code), dropout, delay (delay_ms), "
      "stuck,\n"
      "board_silent, gap (no tick arrives), command_delay (delay_ms), actuator_loss, encoder_stuck.\n"
      "Output at the end: peaks and suppression of the true disk centre, as `whirl run` without --io.\n\n"
      "Example: whirl rig serve --added-mass-g 5 --io io.toml & sleep 1; whirl run controller.json --io io.toml",
      [o, &session] {
        hardware::ServeOptions serve = o->serve;
        serve.rig = rig::read_rig(o->rig);
        if (o->added_mass_g) {
          require_range("--added-mass-g", *o->added_mass_g, 0, 1000, "g");
          serve.rig.rotor.added_mass = *o->added_mass_g * 1e-3;
        }
        if (o->run_up) serve.rig = serve.rig.run_up();
        require_range("--watchdog-ms", o->watchdog_ms, 1, 1e4, "ms");
        serve.watchdog = 1e-3 * o->watchdog_ms;
        if (!o->faults.empty()) hardware::read_faults(o->faults, serve);
        hardware::RigServer server(serve);
        catch_stop_signals();
        const hardware::IoSettings io = server.io();
        // Lasers and board are there before the file that says so.
        io::write_text(o->io, hardware::io_toml(io));
        fmt::print(stderr, "whirl: laser x {}, laser y {}, board {}; settings in {}\n",
                   io.hardware.position[0].laser.device, io.hardware.position[1].laser.device, io.address, o->io);
        const rt::RealtimeThread realtime({});  // a machine is never late
        server.run([] { return stop_signal() != 0; });
        if (!o->log.empty() && server.ticks_done() > 1) io::write_csv(o->log, server.truth());
        const tuning::ClosedLoopMetrics m = server.metrics();
        session.say(report::to_text(pages::segment_table(m, "Served simulated rig", false)));
        session.say(fmt::format(
            "{} ticks, {} commands, outputs set to zero by the watchdog {} times, force {:.2f} N rms; the rig "
            "itself was late by {:.3f} s in all, which its time stood still",
            server.ticks_done(), server.commands(), server.expired(), m.force_rms, server.slipped()));
        session.result(result_of(server, m));
        Summary summary;
        if (!server.started()) summary.fail("nobody started the run");
        if (server.refused() > 0)
          session.say(fmt::format("{} datagrams without the right key were ignored", server.refused()));
        // A loop that left before the end is judged by its own end.
        if (server.commands() > 0 && server.expired() == 0 && !m.stable) summary.fail(m.verdict.text());
        session.finish(summary);
      });
  sub->add_option("--rig", o->rig, "TOML file of `whirl rig parameters`; default: the rig of the paper's levels")
      ->input();
  sub->add_option("--added-mass-g", o->added_mass_g, "screw in the disk; 0 = balanced")->range(0, 1000);
  sub->add_flag("--run-up", o->run_up, "accelerate instead of decelerate");
  sub->add_option("--seed", o->serve.run.seed, "of the sensor noise");
  sub->add_option("--faults", o->faults, "scripted faults (TOML)")->input();
  sub->add_option("--io", o->io, "settings file to write")->output("settings")->show_default();
  sub->add_option("--address", o->serve.address,
                  "of the board; without --board-key on this machine (127.x.x.x); port 0: any free one")
      ->show_default();
  sub->add_option("--board-key", o->serve.key_file,
                  "file (mode 0600) with the key of the board: datagrams without it are ignored")
      ->input();
  sub->add_option("--watchdog-ms", o->watchdog_ms, "silence after which the outputs go to zero")
      ->range(1, 1e4)
      ->show_default();
  sub->add_flag("--lockstep", o->serve.lockstep,
                "every tick waits for its command: the result does not depend on the speed of the machine");
  sub->add_option("--log", o->log, "CSV of the true motion and the forces")->output("record");
}

}  // namespace whirl::app
