// One set of real files of every kind, made once by the program itself.
#pragma once
#include <gtest/gtest.h>

#include <cmath>

#include "program.hpp"

namespace whirl::testing {

/// A folder with record.csv, pull.csv, blow_1.csv ..., frf.json, modes.json, model.json, controller.json, rig.toml, ...
inline const Folder& made() {
  static const Folder folder;
  static const bool done = [] {
    for (const char* call :
         {"rig record --added-mass-g 5 --out record.csv", "rig stiffness --out pull.csv", "rig hammer --out blow_",
          "rig parameters > rig.toml; true", "identify record.csv --no-holdout --out model.json",
          "stiffness pull.csv --out stiff.json", "frf blow_1.csv --out frf.json", "modes frf.json --out modes.json",
          "design model.json --mass-kg 1.5 --evaluations 10 --out controller.json"}) {
      const Outcome outcome = folder.whirl(call);
      EXPECT_NE(outcome.exit_code, 2) << call << "\n" << outcome.err;
    }
    std::filesystem::copy_file(folder / "stdout.txt", folder / "unused.txt");
    folder.write("rig.toml", "[rotor]\nmass_kg = 1.5\n");
    folder.write("bode.csv", "rpm,amp_um,phase_deg\n600,10,5\n900,20,40\n1200,50,90\n1500,20,140\n1800,12,160\n");
    std::string decay = "t_s,x_mm\n";
    for (int k = 0; k < 8000; ++k)
      decay += std::to_string(1e-3 * k) + "," + std::to_string(std::exp(-6e-4 * k) * std::cos(0.075 * k)) + "\n";
    folder.write("decay.csv", decay);
    std::filesystem::copy_file(source_dir() + "/examples/09_balance/runs.csv", folder / "runs.csv");
    folder.write(
        "system.toml",
        "coordinates = [\"x\"]\nkinetic = \"m*x'^2/2\"\npotential = \"k*x^2/2\"\nparameters = {m = \"kg\", k = "
        "\"N/m\"}\n");
    return true;
  }();
  (void)done;
  return folder;
}

/// A folder with a copy of all of them.
inline void copy_made(const Folder& to) {
  for (const auto& file : std::filesystem::directory_iterator(made() / "."))
    std::filesystem::copy_file(file.path(), to / file.path().filename().string(),
                               std::filesystem::copy_options::overwrite_existing);
}

}  // namespace whirl::testing
