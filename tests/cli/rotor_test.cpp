#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "program.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/json.hpp"

namespace whirl::testing {
namespace {

TEST(RotorE2e, EveryTemplateGoesThroughEveryCommand) {
  const Folder folder;
  for (const std::string name : {"jeffcott", "two-disc", "overhung", "centrifuge", "kit"}) {
    const Outcome made = folder.whirl("rotor new --template " + name + " --out rotor.toml --force");
    ASSERT_EQ(made.exit_code, 0) << made.err;
    for (const char* call :
         {"modes rotor.toml --speed-rpm 1000 --figure modes.svg",
          "campbell rotor.toml --to-rpm 3000 --points 9 --out campbell.csv --figure campbell.svg",
          "criticals rotor.toml --to-rpm 10000 --figure map.svg",
          "response rotor.toml --to-rpm 3000 --points 50 --out response.csv --figure response.svg",
          "run rotor.toml --from-rpm 600 --to-rpm 500 --seconds 0.2 --out run.csv --figure run.svg"}) {
      const std::string again = std::string(call).find("--out") != std::string::npos ? " --force" : "";
      const Outcome outcome = folder.whirl("rotor " + std::string(call) + again);
      EXPECT_EQ(outcome.exit_code, 0) << name << ": " << call << "\n" << outcome.err;
      const Outcome json = folder.whirl("rotor " + std::string(call) + again + " --json --quiet");
      EXPECT_NO_THROW(io::parse_json(json.out, call)) << json.out;
    }
    EXPECT_EQ(io::read_table(folder / "campbell.csv").rows(), 9);
    EXPECT_EQ(io::read_table(folder / "run.csv").rows(), 201);
  }
}

TEST(RotorE2e, FitFindsTheBearingsOfARecordedRotor) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template two-disc --out drawing.toml").exit_code, 0);
  std::string text = slurp(folder / "drawing.toml") + "\n[[unbalance]]\nposition_mm = 1000\nsize_gmm = 0\n";
  folder.write("drawing.toml", text +
                                   "\n[fit]\nmaterial_damping = false\n[fit.tolerance]\nprobe_gain_percent = 5\n"
                                   "[[trial]]\nrun = \"trial\"\nposition_mm = 1000\nmass_gram = 2\nradius_mm = 40\n");
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("stiffness_x_N_m = 1e6", "stiffness_x_N_m = 1.3e6");
  replace("size_gmm = 0", "size_gmm = 60");
  folder.write("machine.toml", text);
  folder.write("with_trial.toml", text + "\n[[unbalance]]\nposition_mm = 1000\nsize_gmm = 80\n");
  for (const std::string call : {"machine.toml --out up.csv", "with_trial.toml --out trial.csv"})
    ASSERT_EQ(folder.whirl("rotor run --from-rpm 300 --to-rpm 3500 --seconds 20 " + call).exit_code, 0);
  const Outcome outcome = folder.whirl(
      "rotor fit drawing.toml up.csv trial.csv --at-mm 1000 --motion motion.csv --out fitted.toml --json --quiet");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const io::Json document = io::parse_json(outcome.out, "stdout");
  const io::JsonReader in(document, "stdout");
  EXPECT_TRUE(in.at("misfit").at("explained").flag()) << outcome.out;
  const auto unknowns = in.at("unknowns").items();
  EXPECT_EQ(unknowns[0].at("name").text(), "stiffness x of left");
  EXPECT_NEAR(unknowns[0].at("estimate").at("value").number(), 1.3e6, 1.3e4);
  EXPECT_GE(io::read_table(folder / "motion.csv").rows(), 200);  // more around the resonances
  EXPECT_EQ(folder.whirl("rotor criticals fitted.toml --to-rpm 5000").exit_code, 0);
  const Outcome missing = folder.whirl("rotor fit drawing.toml up.csv");
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("trial"), std::string::npos) << missing.err;
}

TEST(RotorE2e, ControlOfAnOverhungRotorThroughThreeCriticalSpeeds) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template active-centrifuge --out rotor.toml").exit_code, 0);
  const Outcome made = folder.whirl(
      "rotor control rotor.toml --from-rpm 300 --to-rpm 10000 --points 5 --out controller.json --json "
      "--quiet");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const io::Json design = io::parse_json(made.out, "stdout");
  EXPECT_LT(io::JsonReader(design, "stdout").at("worst_sensitivity").number(), 3);
  ASSERT_EQ(folder.whirl("export c controller.json --prefix step --out c").exit_code, 0);
  EXPECT_NE(slurp(folder / "c/step.c").find("step_step("), std::string::npos);
  ASSERT_EQ(folder.whirl("export fmu controller.json --fmi 3 --out fmu").exit_code, 0);
  EXPECT_GT(std::filesystem::file_size(folder / "fmu/controller.fmu"), 10000U);
  const Outcome form = folder.whirl("export matlab controller.json --out m");
  EXPECT_EQ(form.exit_code, 2);
  EXPECT_NE(form.err.find("c or fmu"), std::string::npos) << form.err;
  const Outcome run = folder.whirl(
      "rotor run rotor.toml --from-rpm 300 --to-rpm 10000 --seconds 100 --controller controller.json --out run.csv "
      "--json "
      "--quiet");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const io::Json document = io::parse_json(run.out, "stdout");
  const auto passages = io::JsonReader(document, "stdout").at("passages").items();
  ASSERT_EQ(passages.size(), 3U);
  for (const io::JsonReader& p : passages) EXPECT_LT(p.at("closed").number(), 0.05 * p.at("open").number()) << run.out;
  EXPECT_NE(slurp(folder / "run.csv").find("force_x_N"), std::string::npos);

  const Outcome beyond =
      folder.whirl("rotor run rotor.toml --from-rpm 9990 --to-rpm 10100 --seconds 0.2 --controller controller.json");
  EXPECT_NE(beyond.err.find("designed for"), std::string::npos) << beyond.err;

  // The same controller on a machine with an actuator connected the wrong way round; one without actuators.
  std::string text = slurp(folder / "rotor.toml");
  text.replace(text.rfind("angle_deg = 90"), 14, "angle_deg = 270");
  folder.write("wrong.toml", text);
  const Outcome refused = folder.whirl(
      "rotor control wrong.toml --check controller.json --from-rpm 300 --to-rpm 10000 --points 5 --out other.json");
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
  EXPECT_NE(refused.err.find("unstable at 300 rpm as designed"), std::string::npos) << refused.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "other.json"));
  ASSERT_EQ(folder.whirl("rotor new --template kit --out kit.toml").exit_code, 0);
  const Outcome none = folder.whirl("rotor control kit.toml --from-rpm 300 --to-rpm 1000");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("[[actuator]]"), std::string::npos) << none.err;
  EXPECT_EQ(
      folder.whirl("rotor run kit.toml --from-rpm 1 --to-rpm 2 --seconds 1 --controller controller.json").exit_code, 2);
}

TEST(RotorE2e, CentrifugeCheckAndLimits) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template centrifuge --out rotor.toml").exit_code, 0);  // 10 g in bucket 1
  ASSERT_EQ(folder.whirl("rotor run rotor.toml --from-rpm 40 --to-rpm 170 --seconds 60 --out spinup.csv").exit_code, 0);
  const Outcome outcome = folder.whirl("centrifuge check rotor.toml spinup.csv --json --quiet");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const io::Json document = io::parse_json(outcome.out, "stdout");
  const io::JsonReader in(document, "stdout");
  EXPECT_EQ(in.at("verdict").text(), "wrong");
  EXPECT_EQ(in.at("named").numbers(), std::vector<double>{1});
  const auto interval = in.at("imbalance").at("ci95").numbers();
  EXPECT_TRUE(interval[0] < 0.010 && 0.010 < interval[1]) << outcome.out;
  const Outcome limits = folder.whirl("centrifuge limits rotor.toml --to-rpm 2000 --out limits.csv --json --quiet");
  ASSERT_EQ(limits.exit_code, 0) << limits.err;
  EXPECT_EQ(io::read_table(folder / "limits.csv").rows(), 200);
  const Outcome none = folder.whirl("centrifuge check rotor.toml spinup.csv --sensor lid");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("--sensor"), std::string::npos) << none.err;
}

// A resonance of 0.18 % damping is 3 rpm wide: its peak does not depend on the grid that it is asked on.
TEST(RotorE2e, PeaksOfTheResponseDoNotDependOnTheGrid) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template two-disc --out rotor.toml").exit_code, 0);
  std::vector<double> peaks;
  for (const char* range : {"--from-rpm 100 --to-rpm 6000 --points 50", "--from-rpm 100 --to-rpm 6000",
                            "--from-rpm 820 --to-rpm 835 --points 3000"}) {
    const Outcome outcome = folder.whirl(std::string("rotor response rotor.toml --json --quiet ") + range);
    const io::Json document = io::parse_json(outcome.out, "stdout");
    double most = 0;
    for (const io::JsonReader& r : io::JsonReader(document, "stdout").at("readings").items())
      for (const io::JsonReader& p : r.at("peaks").items())
        if (p.at("speed").number() < 900 * M_PI / 30) most = std::max(most, p.at("amplitude").number());
    peaks.push_back(most);
  }
  EXPECT_NEAR(peaks[0], peaks[2], 5e-3 * peaks[2]);
  EXPECT_NEAR(peaks[1], peaks[2], 5e-3 * peaks[2]);
}

// Magnets without control let the rotor go: the numbers of such a run say nothing, and its exit code says so.
TEST(RotorE2e, ARunThatDivergesIsAnError) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template levitated --out rotor.toml").exit_code, 0);
  const Outcome outcome = folder.whirl("rotor run rotor.toml --from-rpm 600 --to-rpm 500 --seconds 0.3");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("grows without bound"), std::string::npos) << outcome.err;
}

// A rotor as ROSS saves it: one element between two bearings.
TEST(RotorE2e, ImportOfARotorThatRossSaved) {
  const Folder folder;
  folder.write(
      "ross.toml",
      "ross_version = \"2.3.0\"\n[parameters]\n[\"ShaftElement_Shaft 0\"]\nL = 0.5\nidl = 0.0\nodl = 0.03\n"
      "idr = 0.0\nodr = 0.03\nn = 0\naxial_force = 0\ntorque = 0\nshear_effects = true\nrotary_inertia = true\n"
      "gyroscopic = true\nshear_method_calc = \"cowper\"\ntag = \"Shaft 0\"\nalpha = 0.0\nbeta = 0.0\n"
      "[\"ShaftElement_Shaft 0\".material]\nname = \"Steel\"\nrho = 7810.0\nE = 211000000000.0\n"
      "G_s = 81200000000.0\ncolor = \"#525252\"\n[BearingElement_a]\nn = 0\nkxx = [1e7,]\nkyy = [1e7,]\n"
      "[BearingElement_b]\nn = 1\nkxx = [1e7,]\nkyy = [1e7,]\n");
  const Outcome made = folder.whirl("rotor import ross.toml --out rotor.toml");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("sections 1, discs 0, bodies 0, bearings and mounts 2"), std::string::npos) << made.out;
  EXPECT_EQ(folder.whirl("rotor modes rotor.toml --speed-rpm 3000 --count 2").exit_code, 0);
  const Outcome json = folder.whirl("rotor import ross.toml --out rotor.toml --json");
  for (const char* part : {"\"schema\": \"whirl.rotor_import/1\"", "\"length\": 0.5", "\"supports\": 2"})
    EXPECT_NE(json.out.find(part), std::string::npos) << part << json.out;
  const Outcome again = folder.whirl("rotor import rotor.toml --out other.toml");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("Rotor.save()"), std::string::npos) << again.err;
}

// Mounts that soften by 4 % over three runs with noise of 30 dB; the other mount and the damping stay.
TEST(RotorE2e, TrendFindsTheSupportThatSoftens) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template two-disc --out drawing.toml").exit_code, 0);
  const std::string drawing = slurp(folder / "drawing.toml") + "\n[[unbalance]]\nposition_mm = 1000\nsize_gmm = 60\n";
  folder.write("drawing.toml",
               drawing + "\n[fit]\nmaterial_damping = false\n[fit.tolerance]\nprobe_gain_percent = 5\n");
  std::string runs;
  for (int k = 0; k < 3; ++k) {
    std::string text = drawing;
    const std::string from = "stiffness_x_N_m = 1e6";
    text.replace(text.find(from), from.size(), fmt::format("stiffness_x_N_m = {:g}", 1e6 * (1 - 0.02 * k)));
    folder.write("machine.toml", text);
    ASSERT_EQ(folder
                  .whirl(fmt::format("rotor run machine.toml --from-rpm 300 --to-rpm 3500 --seconds 20 --noise-db 30 "
                                     "--seed {} --out run{}.csv",
                                     70 + k, k))
                  .exit_code,
              0);
    runs += fmt::format(" run{}.csv", k);
  }
  const Outcome outcome = folder.whirl("rotor trend drawing.toml" + runs + " --json --quiet");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const io::Json document = io::parse_json(outcome.out, "stdout");
  for (const io::JsonReader& row : io::JsonReader(document, "stdout").at("unknowns").items()) {
    const bool softens = row.at("name").text() == "stiffness x of left";
    EXPECT_EQ(row.at("changed").flag(), softens) << outcome.out;
    const std::vector<double> interval = row.at("change").at("ci95").numbers();
    EXPECT_LE(interval[0], softens ? -0.04 : 0) << row.at("name").text();
    EXPECT_GE(interval[1], softens ? -0.04 : 0) << row.at("name").text();
  }
  EXPECT_EQ(folder.whirl("rotor trend drawing.toml run0.csv").exit_code, 2);
}

// The machine is the two-disc rotor; the other drawing has a disc of half the mass, the third is the same with a
// heavier rim that only the acceleration shows.
TEST(RotorE2e, WhichTellsTheRotorThatIsOnTheMachine) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template two-disc --out drawing.toml").exit_code, 0);
  const std::string fit =
      "\n[[unbalance]]\nposition_mm = 1000\nsize_gmm = 60\n[fit]\nmaterial_damping = false\n"
      "[fit.tolerance]\nprobe_gain_percent = 5\n";
  const std::string drawing = slurp(folder / "drawing.toml");
  folder.write("right.toml", drawing + fit);
  folder.write("same.toml", drawing + fit);
  folder.write("machine.toml", drawing + "\n[[unbalance]]\nposition_mm = 1000\nsize_gmm = 60\n");
  folder.write("other.toml", drawing +
                                 "\n[[disc]]\nname = \"extra\"\nposition_mm = 700\nmass_kg = 8\n"
                                 "transverse_kgm2 = 0.05\npolar_kgm2 = 0.1\n" +
                                 fit);
  ASSERT_EQ(folder.whirl("rotor run machine.toml --from-rpm 300 --to-rpm 3500 --seconds 8 --noise-db 30 --out run.csv")
                .exit_code,
            0);
  const Outcome found = folder.whirl("rotor which run.csv other.toml right.toml --json --quiet");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const io::Json document = io::parse_json(found.out, "stdout");
  const auto candidates = io::JsonReader(document, "stdout").at("candidates").items();
  EXPECT_FALSE(candidates[0].at("possible").flag()) << found.out;
  EXPECT_TRUE(candidates[1].at("possible").flag()) << found.out;
  // The acceleration of 3200 rpm in 8 s by the inertia of the file, and by twice it.
  const double torque = candidates[1].at("inertia").number() * 3200 * M_PI / 30 / 8;
  for (const double part : {1.0, 2.0}) {
    const Outcome with = folder.whirl(
        fmt::format("rotor which run.csv right.toml same.toml --torque-nm {} --json --quiet", part * torque));
    EXPECT_EQ(with.exit_code, part > 1 ? 1 : 0) << with.err;
  }
}

// The acceleration found is tried by another command: it keeps the limit, and three quarters of it do not.
TEST(RotorE2e, CentrifugeRunUpNeedsWhatItSays) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template centrifuge --out rotor.toml").exit_code, 0);
  const Outcome outcome = folder.whirl("centrifuge runup rotor.toml --to-rpm 3000 --limit-um 150 --json --quiet");
  const io::Json document = io::parse_json(outcome.out, "stdout");
  const io::JsonReader in(document, "stdout");
  // Half of 400 g of tubes stands on the buckets, with 3 g at 90 mm.
  std::string text = slurp(folder / "rotor.toml");
  text.replace(text.find("mass_gram = 10"), 14, "mass_gram = 3");
  folder.write("loaded.toml", text +
                                  "\n[[disc]]\nname = \"tubes\"\nposition_mm = 360\nmass_kg = 0.2\n"
                                  "transverse_kgm2 = 8.1e-4\npolar_kgm2 = 1.62e-3\n");
  int tried = 0;
  for (const io::JsonReader& p : in.at("passages").items()) {
    const double needed = p.at("needed").number_or_nan();
    if (!(needed > 0)) continue;
    ++tried;
    for (const double part : {1.05, 0.75}) {
      const double from = p.at("from").number(), to = p.at("to").number();
      const Outcome run =
          folder.whirl(fmt::format("rotor run loaded.toml --full --from-rpm {} --to-rpm {} --seconds {} --json --quiet",
                                   from * 30 / M_PI, to * 30 / M_PI, (to - from) / (part * needed)));
      const io::Json motion = io::parse_json(run.out, "stdout");
      double most = 0;
      for (const io::JsonReader& peak : io::JsonReader(motion, "stdout").at("stations").items())
        if (peak.at("name").text() != "tubes") most = std::max(most, peak.at("peak").number());
      EXPECT_EQ(most <= 150e-6, part > 1) << "needed " << needed << ", " << part << ": " << most;
    }
  }
  EXPECT_GT(tried, 0) << outcome.out;
}

TEST(RotorE2e, CriticalsOfTheTwoDiscRotor) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --out rotor.toml").exit_code, 0);
  const Outcome outcome = folder.whirl("rotor criticals rotor.toml --to-rpm 3000 --json --quiet --figure map.csv");
  const io::Json document = io::parse_json(outcome.out, "stdout");
  const io::JsonReader in(document, "stdout");
  const auto list = in.at("criticals").items();
  ASSERT_EQ(list.size(), 4u) << outcome.out;
  EXPECT_NEAR(list[0].at("speed").number(), 82.6, 0.2);  // rad/s, as in the book
  EXPECT_FALSE(in.has("unstable_from"));
  // Of the map (a reduced model) in the middle the file's own bearings; stiffer ones raise every critical speed.
  const std::string map = slurp(folder / "map.csv");
  const auto first_speed = [&map](const std::string& factor) {
    return std::stod(map.substr(map.find("\n" + factor + ",") + factor.size() + 2)) * M_PI / 30;
  };
  EXPECT_NEAR(first_speed("1"), list[0].at("speed").number(), 1e-4);
  EXPECT_GT(first_speed("100"), 1.2 * first_speed("1"));
}

/// The records are those of another shaft: what the fit says against the rotor, its consumers read in the file.
TEST(RotorE2e, ADistrustedRotorGetsNoController) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template levitated --out rotor.toml").exit_code, 0);
  const std::string text = slurp(folder / "rotor.toml");
  folder.write("distrusted.toml", text.substr(0, text.find("[rotor]") + 8) + "not_trusted = \"model_error\"\n" +
                                      text.substr(text.find("[rotor]") + 8));
  const std::string to = " --from-rpm 1000 --to-rpm 1000 --points 2 --modes 3 --out ";
  const Outcome refused = folder.whirl("rotor control distrusted.toml" + to + "no.json");
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
  EXPECT_NE(refused.err.find("not to be trusted"), std::string::npos) << refused.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "no.json"));
  EXPECT_EQ(folder.whirl("rotor control rotor.toml" + to + "yes.json").exit_code, 0);
  const Outcome modes = folder.whirl("rotor modes distrusted.toml");
  EXPECT_NE(modes.err.find("not to be trusted"), std::string::npos) << modes.err;
  // As a fit writes it.
  ASSERT_EQ(folder.whirl("rotor new --template two-disc --out drawing.toml").exit_code, 0);
  folder.write("machine.toml",
               slurp(folder / "drawing.toml") +
                   "\n[[disc]]\nposition_mm = 700\nmass_kg = 8\ntransverse_kgm2 = 0.05\npolar_kgm2 = 0.1\n");
  ASSERT_EQ(folder.whirl("rotor run machine.toml --from-rpm 300 --to-rpm 3500 --seconds 8 --out up.csv").exit_code, 0);
  folder.write("fit.toml", slurp(folder / "drawing.toml") + "\n[fit]\nmaterial_damping = false\n");
  folder.whirl("rotor fit fit.toml up.csv --restarts 0 --out fitted.toml");
  EXPECT_NE(slurp(folder / "fitted.toml").find("not_trusted = \"model_error\""), std::string::npos);
}

TEST(RotorE2e, WhatAnUnstableRotorDoesNotDoIsSaid) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rotor new --template levitated --out rotor.toml").exit_code, 0);
  const Outcome criticals = folder.whirl("rotor criticals rotor.toml --to-rpm 9000");
  EXPECT_EQ(criticals.exit_code, 2);
  EXPECT_NE(criticals.err.find("negative stiffness"), std::string::npos) << criticals.err;
  for (const char* call :
       {"modes rotor.toml", "campbell rotor.toml --to-rpm 9000", "response rotor.toml --to-rpm 9000"}) {
    const Outcome outcome = folder.whirl("rotor " + std::string(call));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("falls away"), std::string::npos) << call << outcome.err;
  }
  // Damping that turns with the shaft, on bearings that hardly damp.
  ASSERT_EQ(folder.whirl("rotor new --template jeffcott --out rotor.toml --force").exit_code, 0);
  EXPECT_EQ(folder.whirl("rotor response rotor.toml --to-rpm 3000").err.find("unstable"), std::string::npos);
  std::string text = slurp(folder / "rotor.toml");
  const std::size_t material = text.find("[[material]]");
  ASSERT_NE(material, std::string::npos);
  text.insert(material + 13, "damping_time_us = 100\n");
  folder.write("turning.toml", text);
  const Outcome response = folder.whirl("rotor response turning.toml --to-rpm 9000 --json");
  EXPECT_NE(response.err.find("unstable from"), std::string::npos) << response.err;
  const io::Json document = io::parse_json(response.out, "stdout");
  EXPECT_GT(io::JsonReader(document, "stdout").at("unstable_from").at("speed").number(), 0);
}

TEST(RotorE2e, ErrorsNameThePlaceInTheFile) {
  const Folder folder;
  folder.write("rotor.toml", "[[section]]\nlength_mm = 500\nouter_mm = 20\ninner_mm = 30\n");
  const Outcome outcome = folder.whirl("rotor modes rotor.toml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("rotor.toml:4"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("section[0].inner_mm = 30"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace whirl::testing
