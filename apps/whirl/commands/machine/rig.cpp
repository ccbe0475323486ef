#include <fmt/format.h>

#include <numbers>

#include "command.hpp"
#include "rig_campbell.hpp"
#include "rig_serve.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/rig/from_modal.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/rig/rig_file.hpp"

namespace whirl::app {
namespace {

struct RigOptions {
  std::string rig, out, truth, modes;
  double angle_deg = 0;
  int channel = 1;
  std::uint64_t seed = 1;
  std::optional<double> added_mass_g, snr_db;
  bool run_up = false;

  double direction() const {
    require_range("--angle-deg", angle_deg, -360, 360, "deg");
    return angle_deg * std::numbers::pi / 180;
  }
  rig::RigParameters parameters() const {
    rig::RigParameters p = rig::read_rig(rig);
    if (added_mass_g) {
      require_range("--added-mass-g", *added_mass_g, 0, 1000, "g");
      p.rotor.added_mass = *added_mass_g * 1e-3;
    }
    return run_up ? p.run_up() : p;
  }
};

void add_common(CommandLine* sub, const std::shared_ptr<RigOptions>& o) {
  sub->add_option("--rig", o->rig, "TOML file of `whirl rig parameters`; default: the rig of the paper's levels")
      ->input();
  sub->add_option("--seed", o->seed, "of the sensor noise")->show_default();
}

void add_parameters(CommandLine& rig, Session& session, const std::shared_ptr<RigOptions>& o) {
  CommandLine* parameters = add_command(
      rig, session, "parameters", "Print the rig's parameters as TOML",
      "Any of these keys may be set in a file for --rig; the unit is part of the key. With --modes the linear "
      "structure "
      "(mass,\n"
      "stiffness, damping, further modes) is that of a hammer test with a drive point at the disk.\n\n"
      "Example: whirl rig parameters > rig.toml\n"
      "         whirl rig parameters --modes modes.json --channel 1 > rig.toml",
      [o] {
        rig::RigParameters p = o->parameters();
        if (!o->modes.empty()) {
          const ModalModel modal = io::load<ModalModel>(o->modes);
          const auto channels = static_cast<int>(modal.responses.size());
          if (o->channel < 1 || o->channel > channels) {
            throw Error::in_field("--channel", std::to_string(o->channel), fmt::format("1 to {}", channels));
          }
          p = rig::rig_from_modal(modal, o->channel - 1, p);
        }
        fmt::print("{}", rig::rig_toml(p));
      });
  add_common(parameters, o);
  parameters->add_option("--modes", o->modes, "modes.json of `whirl modes`: the measured structure")->input();
  parameters->add_option("--channel", o->channel, "its drive-point channel, from 1")->range(1, 1000);
}

void add_record(CommandLine& rig, Session& session, const std::shared_ptr<RigOptions>& o) {
  CommandLine* record = add_command(
      rig, session, "record", "Record a run without control",
      "Output: CSV with t_s, x_mm, y_mm, beta_rad at the control rate; --truth writes the clean motion of the disk\n"
      "centre (x_mm, y_mm) beside it, for `whirl validate --clean`.\n\n"
      "Example: whirl rig record --added-mass-g 5 --snr-db 20 --out rundown_5g.csv",
      [o, &session] {
        rig::RigRun run;
        run.seed = o->seed;
        const rig::OpenLoopRecord run_record = rig::record_open_loop(o->parameters(), run, o->snr_db);
        io::CsvWriteOptions csv;
        csv.units = {"x_mm", "y_mm"};
        session.write_together();
        io::write_csv(o->out, run_record.measured, csv);
        if (!o->truth.empty()) io::write_csv(o->truth, run_record.truth, csv);
        session.say(fmt::format("{}: {} samples at {:g} Hz, largest |x| {:.4g} mm peak", o->out,
                                run_record.measured.size(), run_record.measured.rate(),
                                1e3 * run_record.measured["x"].cwiseAbs().maxCoeff()));
      });
  add_common(record, o);
  record->add_option("--out", o->out, "CSV file to write (.csv or .csv.gz)")->output("record")->required();
  record->add_option("--truth", o->truth, "write the clean motion too")->output("record");
  record
      ->add_option("--added-mass-g", o->added_mass_g,
                   "screw in the disk; 0 = balanced rotor, 2.5 and 5 as in the paper")
      ->range(0, 1000);
  record->add_option("--snr-db", o->snr_db, "white noise relative to each axis' clean rms, instead of the sensor's")
      ->range(-60, 300);
  record->add_flag("--run-up", o->run_up, "accelerate instead of decelerate");
}

void add_stiffness(CommandLine& rig, Session& session, const std::shared_ptr<RigOptions>& o) {
  CommandLine* stiffness =
      add_command(rig, session, "stiffness", "Pull the shaft: force-deflection table (paper section III-B)",
                  "Output: CSV with deflection_mm, force_N, loading then unloading.\n\n"
                  "Example: whirl rig stiffness --out pull_x.csv && whirl stiffness pull_x.csv",
                  [o, &session] {
                    rig::StiffnessTestOptions test;
                    test.seed = o->seed;
                    test.direction = o->direction();
                    const rig::StiffnessTable table = rig::simulate_stiffness_test(o->parameters(), test);
                    io::Table file;
                    file.columns = {{"deflection", Quantity::displacement, table.deflection},
                                    {"force", Quantity::force, table.force}};
                    io::CsvWriteOptions csv;
                    csv.units = {"deflection_mm"};
                    io::write_csv(o->out, file, csv);
                    session.say(fmt::format("{}: {} readings", o->out, table.force.size()));
                  });
  add_common(stiffness, o);
  stiffness->add_option("--out", o->out, "CSV file to write")->output("table")->required();
  stiffness->add_option("--angle-deg", o->angle_deg, "direction of the pull from x towards y")->range(-360, 360);
}

void add_hammer(CommandLine& rig, Session& session, const std::shared_ptr<RigOptions>& o) {
  CommandLine* hammer =
      add_command(rig, session, "hammer", "Hit the rotor at rest: one record per impact (paper section IV-B)",
                  "Output: PREFIX1.csv, PREFIX2.csv, ... with t_s, force_N, acc_x_m_s2, acc_y_m_s2.\n\n"
                  "Example: whirl rig hammer --out blow_ && whirl frf blow_*.csv --out frf.json",
                  [o, &session] {
                    rig::HammerTestOptions test;
                    test.seed = o->seed;
                    test.direction = o->direction();
                    const std::vector<Recording> blows = rig::simulate_hammer_test(o->parameters(), test);
                    const auto name = [&](std::size_t i) { return fmt::format("{}{}.csv", o->out, i + 1); };
                    for (std::size_t i = 0; i < blows.size(); ++i) session.check_output(name(i), "record");
                    session.write_together();
                    for (std::size_t i = 0; i < blows.size(); ++i) io::write_csv(name(i), blows[i]);
                    session.say(fmt::format("{} written", counted(blows.size(), "impact")));
                  });
  add_common(hammer, o);
  hammer->add_option("--out", o->out, "prefix of the files to write")->output_prefix()->required();
  hammer->add_option("--angle-deg", o->angle_deg, "direction of the impacts from x towards y")->range(-360, 360);
}

}  // namespace

void add_rig(CommandLine& app, Session& session) {
  CommandLine* rig = app.add_subcommand("rig", "The virtual test rig: its parameters and its records");
  rig->require_subcommand();
  rig->footer(
      "The rig is a simulated rotor with its sensors, converters and actuators. Its records are files like those of a\n"
      "laboratory; identification and control get nothing else.\n\n"
      "Example: whirl rig record --added-mass-g 5 --snr-db 20 --out rundown_5g.csv");

  const auto o = std::make_shared<RigOptions>();
  add_parameters(*rig, session, o);
  add_record(*rig, session, o);
  add_stiffness(*rig, session, o);
  add_hammer(*rig, session, o);
  add_rig_campbell(*rig, session);
  add_rig_serve(*rig, session);
}

}  // namespace whirl::app
