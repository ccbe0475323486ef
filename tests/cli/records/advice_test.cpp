// A command that a message proposes works when it is followed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <sstream>

#include "../program.hpp"
#include "whirl/io/json.hpp"

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

// Phases that lag, under a heading that says nothing, as one that says so, and with the flag.
TEST(AdviceE2e, LagsAreToldFromLeads) {
  const Folder folder;
  const auto table = [](const std::string& header, double sign) {
    std::string text = header + "\n";
    for (int rpm = 1000; rpm <= 2000; rpm += 20) {
      const std::complex<double> s(0, rpm / 1500.0), h = s * s / (s * s + 0.04 * s + 1.0);
      text += fmt::format("{},{:.5f},{:.3f}\n", rpm, 80 * std::abs(h), sign * std::arg(h) * 180 / std::numbers::pi);
    }
    return text;
  };
  folder.write("lead.csv", table("speed_rpm,amp_pp_DE_um,phase_DE_deg", 1));
  folder.write("lag.csv", table("speed_rpm,amp_pp_DE_um,phase_DE_deg", -1));
  folder.write("named.csv", table("speed_rpm,amp_pp_DE_um,phase_lag_DE_deg", -1));
  folder.write("columns.csv", table("speed_rpm,DE_amp_pp_um,DE_phase_deg", -1));
  folder.write("said.csv", table("speed_rpm,DE_amp_pp_um,DE_lag_deg", -1));
  const std::string columns = " --amplitude-column DE_amp_pp --phase-column DE_phase", held = " --modes 1 --steady";
  for (const std::string wrong : {"lag.csv", "columns.csv", "named.csv --phase lead", "lead.csv --phase lag"}) {
    const bool by_name = wrong == "columns.csv";
    const Outcome o = folder.whirl("transient " + wrong + (by_name ? columns : "") + held);
    const bool contradicts = wrong.starts_with("named");
    EXPECT_EQ(o.exit_code, contradicts ? 2 : 1) << wrong << o.out << o.err;
    EXPECT_NE(o.err.find(contradicts ? "phase_lag_DE" : "read as"), std::string::npos) << o.err;
  }
  for (const std::string right :
       {"lead.csv", "lag.csv --phase lag", "named.csv", "named.csv --phase lag", "columns.csv", "said.csv"}) {
    const std::string named = right == "columns.csv" ? columns + " --phase lag"
                              : right == "said.csv"  ? " --amplitude-column DE_amp_pp --phase-column DE_lag"
                                                     : "";
    const Outcome o = folder.whirl("transient " + right + named + held);
    EXPECT_EQ(o.exit_code, 0) << right << o.err;
    EXPECT_NE(o.out.find("mode 1: 1500."), std::string::npos) << right << o.out;
    EXPECT_EQ(o.err.find("no kind of amplitude"), std::string::npos) << o.err;
  }

  // One mode under a sine of 2 and 6 N: mass 2 kg, 30 Hz, c / m = 4 1/s.
  const auto sine = [](const std::string& phase, double sign) {
    std::string text = "frequency_Hz,force_N,amplitude_mm," + phase + "\n";
    for (const double force : {2.0, 6.0})
      for (double f = 26; f <= 34; f += 0.25) {
        const double w = 2 * std::numbers::pi * f, scatter = 1 + 0.002 * std::sin(40 * f * force);
        const std::complex<double> h = force / 2 / std::complex<double>(35530 - w * w, 4 * w);
        text += fmt::format("{},{},{:.6f},{:.4f}\n", f, force, 1e3 * scatter * std::abs(h),
                            sign * std::arg(h) * 180 / std::numbers::pi);
      }
    return text;
  };
  folder.write("lead.csv", sine("phase_deg", 1));
  folder.write("lag.csv", sine("phase_deg", -1));
  folder.write("named.csv", sine("phase_lag_deg", -1));
  folder.write("leads.csv", sine("phase_lead_deg", 1));
  for (const char* right : {"lead.csv", "lag.csv --phase lag", "named.csv", "leads.csv"}) {
    const Outcome o = folder.whirl(std::string("sine ") + right);
    EXPECT_EQ(o.exit_code, 0) << right << o.err;
    EXPECT_NE(o.out.find("damping 1.0"), std::string::npos) << o.out;
  }
  const Outcome o = folder.whirl("sine lag.csv");
  EXPECT_EQ(o.exit_code, 1) << o.out;
  EXPECT_NE(o.err.find("--phase lag"), std::string::npos) << o.err;
  EXPECT_EQ(folder.whirl("sine named.csv --phase lead").exit_code, 2);
}

// What is said to be left out is in no number, figure or page, and each of them says so: a run-up whose 1X of y grows
// to 287 um at its end, with readings that are none, or cut off.
TEST(AdviceE2e, ReadingsLeftOutAreInNoNumber) {
  const Folder folder;
  const auto write = [&](const std::string& name, const std::function<double(int, double)>& reading) {
    std::string text = "t_s,x_um,y_um,beta_rad\n";
    for (int i = 0; i < 8000; ++i) {
      const double t = 1e-3 * i, turns = 10 * t + t * t, a = 2 * std::numbers::pi * turns, share = t / 8;
      const double noise = 0.3 * std::sin(77.7 * i * i);
      const double x = 287 * share * std::cos(a) + noise, y = 287 * share * std::sin(a) + noise;
      text += fmt::format("{:.4f},{:.3f},{:.3f},{:.5f}\n", t, x, reading(i, y), a);
    }
    folder.write(name, text);
  };
  write("one.csv", [](int i, double y) { return i == 5000 ? -9999 : y; });
  write("more.csv", [](int i, double y) { return i % 1000 == 500 ? 9999 : y; });
  write("cut.csv", [](int, double y) { return std::clamp(y, -250.0, 250.0); });
  for (const std::string name : {"one", "more", "cut"}) {
    const std::string file = name + ".csv", kind = name == "cut" ? "clipped" : "spikes";
    const Outcome info = folder.whirl("info " + file + " --json");
    const io::Json json = io::parse_json(info.out, "info");
    const io::Json& table = json.find("tables")->get<io::Json::Array>()->front();
    const io::JsonReader in(table, "table"), y = in.at("vibration").items()[1];
    EXPECT_NEAR(y.at("synchronous").at("peak").number(), 286e-6, 3e-6) << name;
    EXPECT_LT(y.at("largest_peak").number(), 300e-6) << name;
    EXPECT_LT(in.at("channels").items()[1].at("maximum").number(), 300e-6) << name;
    EXPECT_GT(in.at("channels").items()[1].at("minimum").number(), -300e-6) << name;
    const Outcome plot = folder.whirl("plot " + file + " --what bode --channels y --out " + name + "_bode.csv");
    EXPECT_EQ(plot.exit_code, 0) << plot.err;
    EXPECT_NE(plot.err.find(kind), std::string::npos) << name << plot.err;
    const std::string bode = slurp(folder / (name + "_bode.csv"));
    double largest = 0;
    std::size_t vectors = 0;
    for (std::size_t at = bode.find('\n'); at + 1 < bode.size(); at = bode.find('\n', at + 1), ++vectors) {
      const std::size_t comma = bode.find(',', at);
      largest = std::max(largest, std::atof(bode.c_str() + comma + 1));
    }
    EXPECT_GT(vectors, 100u);
    EXPECT_TRUE(std::abs(largest - 286) < 3 || std::abs(largest - 0.286) < 0.003) << name << " " << largest;
    const Outcome report = folder.whirl("report " + file + " --out " + name + ".html");
    EXPECT_EQ(report.exit_code, 0) << report.err;
    const std::string page = slurp(folder / (name + ".html"));
    EXPECT_NE(page.find("Readings left out of every number"), std::string::npos) << name;
    EXPECT_NE(page.find("channel y: " + kind), std::string::npos) << name;
    EXPECT_NE(folder.whirl("transient " + file + " --channel y").err.find(kind), std::string::npos) << name;
  }
}

// A whirl below the speed does not repeat from turn to turn: at one speed it is in no vector of a figure or a zone.
TEST(AdviceE2e, VectorsOfASteadyRunAreThoseOfInfo) {
  const Folder folder;
  std::string text = "t_s,x_um,y_um,beta_rad\n";
  for (int i = 0; i < 16000; ++i) {
    const double t = 5e-4 * i, a = 2 * std::numbers::pi * 25 * t, noise = 0.3 * std::sin(77.7 * i * i);
    text += fmt::format("{:.4f},{:.3f},{:.3f},{:.5f}\n", t, 30 * std::cos(a - 2.6) + 5 * std::cos(0.43 * a) + noise,
                        40 * std::cos(a - 1) + noise, a);
  }
  folder.write("run.csv", text);
  ASSERT_EQ(folder.whirl("plot run.csv --what bode --channels x --out bode.csv").exit_code, 0);
  std::istringstream rows(slurp(folder / "bode.csv"));
  long vectors = 0;
  std::string row;
  std::getline(rows, row);
  for (; std::getline(rows, row); ++vectors) {
    double speed = 0, amplitude = 0, phase = 0;
    ASSERT_EQ(std::sscanf(row.c_str(), "%lf,%lf,%lf", &speed, &amplitude, &phase), 3) << row;
    EXPECT_NEAR(amplitude, 30, 0.2);
    EXPECT_NEAR(phase, 2.6 * 180 / std::numbers::pi, 0.5);
  }
  EXPECT_GT(vectors, 150);
  ASSERT_EQ(folder.whirl("report run.csv --service-rpm 1500 --out page.html").exit_code, 0);
  const std::string page = slurp(folder / "page.html");
  EXPECT_NE(page.find(">60.0<"), std::string::npos);
}

TEST(AdviceE2e, UnitsOfAFlagOrAFileAreDoubted) {
  const Folder folder;
  const std::string shaft =
      "[[material]]\nname = \"steel\"\n[[section]]\nlength_mm = 800\nouter_{0} = {1}\nmaterial = \"steel\"\n"
      "[[disc]]\nposition_mm = 400\nmass_kg = 5\ntransverse_{2} = 0.012\npolar_kgm2 = 0.024\n"
      "[[bearing]]\nposition_mm = 50\nstiffness_N_m = 1e6\n[[bearing]]\nposition_mm = 750\nstiffness_N_m = 1e6\n";
  folder.write("thin.toml", fmt::format(fmt::runtime(shaft), "mm", 0.02, "kgm2"));
  Outcome o = folder.whirl("rotor modes thin.toml");
  EXPECT_EQ(o.exit_code, 2) << o.out;
  EXPECT_NE(o.err.find("under its own weight: is a length in mm given as m?"), std::string::npos) << o.err;
  for (const char* command : {"response", "criticals", "campbell", "run --from-rpm 100 --seconds 5"})
    EXPECT_EQ(folder.whirl(fmt::format("rotor {} thin.toml --to-rpm 3000", command)).err, o.err) << command;
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
