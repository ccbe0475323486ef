// One set of real files of every kind, made by the program itself, once for all tests that run one build of it.
#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <cmath>

#include "program.hpp"

namespace whirl::testing {

/// Makes record.csv, pull.csv, blow_1.csv ..., frf.json, modes.json, model.json, controller.json, rig.toml, ...
inline void make_files(const Folder& folder) {
  for (const char* call :
       {"rig record --added-mass-g 5 --out record.csv", "rig stiffness --out pull.csv", "rig hammer --out blow_",
        "rig parameters > rig.toml; true", "identify record.csv --no-holdout --out model.json",
        "identify record.csv --out held.json", "stiffness pull.csv --out stiff.json", "frf blow_1.csv --out frf.json",
        "modes frf.json --out modes.json", "design model.json --mass-kg 1.5 --evaluations 10 --out controller.json"}) {
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
  folder.write("system.toml",
               "coordinates = [\"x\"]\nkinetic = \"m*x'^2/2\"\npotential = \"k*x^2/2\"\nparameters = {m = \"kg\", k = "
               "\"N/m\"}\n");
}

/// What `make` writes into a folder: kept beside the build under the size and time of the program, since every test is
/// a process of its own and an identification and a design take seconds.
inline std::filesystem::path kept(const char* name, void (*make)(const Folder&)) {
  namespace fs = std::filesystem;
  const fs::path all = binary_dir() + "/tests/" + name;
  fs::create_directories(all);
  const int lock = open((all / "lock").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
  EXPECT_GE(lock, 0) << all;
  flock(lock, LOCK_EX);
  const fs::path files = all / (std::to_string(fs::file_size(program())) + "_" +
                                std::to_string(fs::last_write_time(program()).time_since_epoch().count()));
  if (!fs::exists(files)) {
    for (const auto& old : fs::directory_iterator(all))
      if (old.is_directory()) fs::remove_all(old.path());
    const Folder folder;
    make(folder);
    // A rename is all or nothing; a test that fails here leaves none.
    if (!::testing::Test::HasFailure()) {
      fs::copy(folder / ".", files.string() + ".part", fs::copy_options::recursive);
      fs::rename(files.string() + ".part", files);
    }
  }
  close(lock);
  return files;
}

inline const std::filesystem::path& made() {
  static const std::filesystem::path files = kept("made_files", make_files);
  return files;
}

/// The folder "study" of `whirl reproduce`, and what that printed, stdout.txt.
inline const std::filesystem::path& made_study() {
  static const std::filesystem::path files = kept("made_study", [](const Folder& folder) {
    const Outcome outcome = folder.whirl("reproduce --out study --evaluations 12 --quiet");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  });
  return files;
}

/// A folder with a copy of all of them.
inline void copy_made(const Folder& to) {
  for (const auto& file : std::filesystem::directory_iterator(made()))
    std::filesystem::copy_file(file.path(), to / file.path().filename().string(),
                               std::filesystem::copy_options::overwrite_existing);
}

/// down.csv, the rig's run-down with 5 g, and model.json, identified from it with a part held out ("held.json") or
/// whole ("model.json").
inline void copy_model(const Folder& to, const char* kind = "held.json") {
  std::filesystem::copy_file(made() / "record.csv", to / "down.csv");
  std::filesystem::copy_file(made() / kind, to / "model.json");
}

}  // namespace whirl::testing
