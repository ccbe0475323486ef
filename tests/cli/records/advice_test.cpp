// A command that a message proposes works when it is followed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

#include "../program.hpp"

namespace whirl::testing {
namespace {

/// Rows of a run at 1200 rpm: time, x, y, and what `last` makes of the turns.
std::string run(const std::string& header, const std::function<double(double turns)>& last, const char* cell = ",") {
  std::string text = header + "\n";
  for (int i = 0; i < 2000; ++i) {
    const double t = 1e-3 * i, turns = 20 * t, a = 2 * std::numbers::pi * turns;
    text += fmt::format("{0:.4f}{4}{1:.6f}{4}{2:.6f}{4}{3:.6f}\n", t, std::cos(a), std::sin(a), last(turns), cell);
  }
  return text;
}
double pulse(double turns) { return turns - std::floor(turns) < 0.1 ? 5 : 0; }
double radians(double turns) { return 2 * std::numbers::pi * turns; }

/// What follows `flag` in a message, with it, up to a bracket that explains.
std::string proposal(const Outcome& o, const std::string& flag) {
  const std::size_t at = o.err.find(flag);
  EXPECT_NE(at, std::string::npos) << o.err << o.out;
  return at == std::string::npos ? "" : o.err.substr(at, o.err.find_first_of("(;\n", at) - at);
}

TEST(AdviceE2e, PulsesAreFoundByTheirNameInAnyLettersOrProposed) {
  const Folder folder;
  for (const char* name : {"Tacho", "Keyphasor", "KEY", "tacho"}) {
    folder.write("run.csv", run(fmt::format("Time [s],X [mm],Y [mm],{} [V]", name), pulse));
    const Outcome o = folder.whirl("info run.csv");
    EXPECT_EQ(o.exit_code, 0) << o.err;
    EXPECT_EQ(o.out.find("no rotor angle"), std::string::npos) << name << "\n" << o.out;
    EXPECT_EQ(folder.whirl(fmt::format("info run.csv --pulses {}", name)).exit_code, 0) << name;
  }
  folder.write("run.csv", run("Time [s],X [mm],Y [mm],Beta [rad]", radians));
  EXPECT_EQ(folder.whirl("info run.csv").out.find("no rotor angle"), std::string::npos);
  for (const char* name : {"Tach", "Trigger", "AI3"}) {
    folder.write("run.csv", run(fmt::format("Time [s],X [mm],Y [mm],{} [V]", name), pulse));
    const Outcome o = folder.whirl("info run.csv");
    const std::string advice = fmt::format("--pulses {}", name);
    EXPECT_NE(o.out.find("looks like the pulses of a tacho; for the angle: " + advice), std::string::npos) << o.out;
    EXPECT_EQ(o.out.find("channel :"), std::string::npos) << o.out;
    EXPECT_EQ(folder.whirl("info run.csv " + advice).out.find("no rotor angle"), std::string::npos);
  }
  folder.write("run.csv", run("Time [s],X [mm],Y [mm],AI3 [V]", [](double turns) { return std::sin(radians(turns)); }));
  EXPECT_EQ(folder.whirl("info run.csv").out.find("--pulses"), std::string::npos) << "a sine is no tacho";
}

// A cell is missing in every turn of a run: each was left out, and no size of 1X remained.
TEST(AdviceE2e, SingleMissingCellsHideNoSize) {
  const Folder folder;
  std::string text = "t_s,x_mm,beta_rad\n";
  for (int i = 0; i < 8000; ++i) {
    const double t = 1e-3 * i, angle = 2 * std::numbers::pi * (20 * t - 0.8 * t * t);
    text += fmt::format("{},{},{}\n", t, i % 60 == 7 ? "" : fmt::format("{:.6f}", std::cos(angle)), angle);
  }
  folder.write("gaps.csv", text);
  const std::string out = folder.whirl("info gaps.csv").out;
  EXPECT_NE(out.find("1X 1.0"), std::string::npos) << out;
}

TEST(AdviceE2e, ProposedColumnsAndHeaderLinesCanBeRead) {
  const Folder folder;
  folder.write("two.csv", run("Project: pump 7\nOperator: K.M.\n\nTime,X,Y,Angle\n(s),(mm),(mm),(rad)", radians));
  Outcome o = folder.whirl("info two.csv");
  EXPECT_EQ(proposal(o, "--header-line 4"), "--header-line 4 ");
  EXPECT_EQ(folder.whirl("info two.csv " + proposal(o, "--header-line")).exit_code, 0);

  folder.write("de.csv", run("Zeit [s],x [mm],y [mm],Winkel [rad]", radians));
  o = folder.whirl("identify de.csv");
  EXPECT_NE(folder.whirl("identify de.csv " + proposal(o, "--columns")).exit_code, 2) << o.err;

  folder.write("probes.csv", run("Time (s),Disp A (mm),Disp B (mm),Angle (rad)", radians));
  o = folder.whirl("identify probes.csv --columns \"Time (s)\" \"Disp A (mm):x\" \"Disp B (mm):y\" \"Angle (rad)\"");
  const std::size_t at = o.err.find("--columns");
  ASSERT_NE(at, std::string::npos) << o.err;
  EXPECT_NE(folder.whirl("identify probes.csv " + o.err.substr(at)).exit_code, 2) << o.err;

  folder.write("pull.csv", "Weg,Kraft\n0,0\n1,2\n2,4.1\n3,5.9\n4,8\n5,10.1\n");
  o = folder.whirl("stiffness pull.csv");
  EXPECT_EQ(folder.whirl("stiffness pull.csv " + proposal(o, "--columns")).exit_code, 0) << o.err;
  folder.write("bare.csv", "deflection_mm,load_N\n0,0\n1,2\n2,4\n");
  EXPECT_NE(folder.whirl("stiffness bare.csv").err.find("'force_N'"), std::string::npos);

  folder.write("volts.csv", run("Time [s],Ch1 [V],Ch2 [V],Angle [rad]", radians));
  o = folder.whirl("identify volts.csv --columns Ch1:x_mm Ch2:y_mm Angle:beta");
  EXPECT_NE(o.err.find("Ch1:x_mm*FACTOR: the header says V, so FACTOR is the calibration in mm per V"),
            std::string::npos)
      << o.err;
}

TEST(AdviceE2e, ABalancingTableIsToldWhichColumnAndHow) {
  const Folder folder;
  const std::string rows = "1;1480;3.2;40;0;0\n2;1480;2.243;55.5;15;60\n3;1480;3.3;41;0;0\n";
  folder.write("run.csv", "run;speed_rpm;DE_amp_mm_s;DE_phase_deg;Fan_mass_g;Fan_angle_deg\n" + rows);
  EXPECT_NE(folder.whirl("balance run.csv").err.find("column 'run' needs a unit: run_1"), std::string::npos);
  folder.write("rms.csv", "run_1;speed_rpm;DE_amp_mm_s_rms;DE_phase_deg;Fan_mass_gram;Fan_angle_deg\n" + rows);
  const std::string err = folder.whirl("balance rms.csv").err;
  EXPECT_NE(err.find("column 'DE_amp_mm_s_rms' needs a unit: DE_amp_um (or "), std::string::npos) << err;
  EXPECT_EQ(err.find("--columns"), std::string::npos) << err;
  folder.write("good.csv", "run_1;speed_rpm;DE_amp_mm_s;DE_phase_deg;Fan_mass_g;Fan_angle_deg\n" + rows);
  EXPECT_EQ(folder.whirl("balance good.csv --phase lag --amplitude rms --angles against").exit_code, 0);
  folder.write("rad.csv",
               "run_1,speed_rpm,A_amp_um,A_phase_deg,P_mass_gram,P_angle_deg\n1,1500,50,0.7,0,0\n"
               "2,1500,60,1.92,10,0\n3,1500,50,0.72,0,0\n4,1500,55,3.1,10,90\n");
  EXPECT_NE(folder.whirl("balance rad.csv").err.find("are they in rad (a header A_phase_rad)?"), std::string::npos);
  EXPECT_EQ(folder.whirl("balance rad.csv --limit-gram 0").exit_code, 2) << "no mass at all";
}

TEST(AdviceE2e, WhatMadeTheNumbersUnusableIsTheReason) {
  const Folder folder;
  std::string pull = "deflection_mm,force_N\n", wide = pull;
  for (int i = 0; i < 20; ++i) {
    pull += fmt::format("{},{}\n", 0.2 * i, -2.0 * i);
    wide += fmt::format("{},{}\n", 200 * i, 2.0 * i);
  }
  folder.write("pull.csv", pull), folder.write("wide.csv", wide);
  EXPECT_NE(folder.whirl("stiffness pull.csv").err.find("not usable: linear stiffness is not positive"),
            std::string::npos);
  const std::string err = folder.whirl("stiffness wide.csv").err;
  EXPECT_NE(err.find("not usable: deflections up to 3.8 m (3.8e+03 mm)"), std::string::npos) << err;
}

// The amplitude of one mode at held speeds: 1500 rpm, damping 0.02.
TEST(AdviceE2e, HeldSpeedsAreNoFastRun) {
  const Folder folder;
  std::string text = "rpm,amp_1x_um,phase_1x_deg\n";
  for (int rpm = 600; rpm <= 2400; rpm += 5) {
    const std::complex<double> s(0, rpm / 1500.0), h = s * s / (s * s + 0.04 * s + 1.0);
    text += fmt::format("{},{:.8f},{:.8f}\n", rpm, 40 * std::abs(h), std::arg(h) * 180 / std::numbers::pi);
  }
  folder.write("bode.csv", text);
  const Outcome fast = folder.whirl("transient bode.csv --modes 1");
  EXPECT_EQ(fast.exit_code, 1) << fast.out;
  EXPECT_NE(fast.err.find("--steady fits them"), std::string::npos) << fast.err;
  const Outcome held = folder.whirl("transient bode.csv --modes 1 --steady");
  EXPECT_EQ(held.exit_code, 0) << held.err;
  EXPECT_NE(held.out.find("mode 1: 1500.0"), std::string::npos) << held.out;
}

TEST(AdviceE2e, UnitsOfAFlagOrAFileAreDoubted) {
  const Folder folder;
  const std::string shaft =
      "[[material]]\nname = \"steel\"\n[[section]]\nlength_mm = 800\nouter_{0} = {1}\nmaterial = \"steel\"\n"
      "[[disc]]\nposition_mm = 400\nmass_kg = 5\ntransverse_{2} = 0.012\npolar_kgm2 = 0.024\n"
      "[[bearing]]\nposition_mm = 50\nstiffness_N_m = 1e6\n[[bearing]]\nposition_mm = 750\nstiffness_N_m = 1e6\n";
  folder.write("thin.toml", fmt::format(fmt::runtime(shaft), "mm", 0.02, "kgm2"));
  Outcome o = folder.whirl("rotor modes thin.toml");
  EXPECT_EQ(o.exit_code, 1) << o.out;
  EXPECT_NE(o.err.find("under its own weight: is a length in mm given as m?"), std::string::npos) << o.err;
  folder.write("unit.toml", fmt::format(fmt::runtime(shaft), "mm", 20, "kgmm2"));
  o = folder.whirl("rotor modes unit.toml");
  EXPECT_NE(o.err.find("transverse_kgmm2 = 0.012: unknown unit; allowed units: kgm2"), std::string::npos) << o.err;
  folder.write("about.toml", "name = \"pump 7\"\n");
  folder.write("run.csv", run("t_s,x_mm,y_mm,beta_rad", radians));
  const std::pair<const char*, const char*> calls[] = {
      {"report run.csv --about about.toml --out r.html", "unknown key 'name'; it belongs under [machine]"},
      {"rig stiffness --angle-deg 1.5708 --out p.csv",
       "--angle-deg = 1.5708: must be in degrees: 1.5708 rad is 90 deg"},
      {"identify run.csv --holdout 30", "--holdout = 30: must be between 0.05 and 0.8: 30 % is 0.3"},
      {"balance run.csv --phase lag --phase lead", "--phase: given more than once"},
  };
  for (const auto& [call, part] : calls) {
    o = folder.whirl(call);
    EXPECT_EQ(o.exit_code, 2) << call;
    EXPECT_NE(o.err.find(part), std::string::npos) << call << "\n" << o.err;
  }
}

}  // namespace
}  // namespace whirl::testing
