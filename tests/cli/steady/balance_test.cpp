#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "../program.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/json.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::testing {
namespace {

std::string runs() { return source_dir() + "/examples/09_balance/runs.csv"; }
constexpr const char* kConvention = " --phase lag --amplitude pp --angles against --slow-roll-rpm 400";

TEST(BalanceRunsE2e, TheWrongRunIsNamedAndTheRotorBalanced) {
  const Folder folder;
  const Outcome outcome = folder.whirl("balance " + runs() + kConvention + " --json --html sheet.html");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("run '5' contradicts the others: looks as if plane P2 carried nothing"),
            std::string::npos);
  EXPECT_NE(outcome.err.find("plane P3 acts almost as plane P2"), std::string::npos);
  const io::Json json = io::parse_json(outcome.out, "stdout");
  const io::JsonReader document(json, "stdout");
  for (const io::JsonReader& row : document.at("readings").items())
    EXPECT_LT(row.at("after").at("value").number(), 0.1 * row.at("before").at("value").number());
  std::ifstream sheet(folder / "sheet.html");
  const std::string text((std::istreambuf_iterator<char>(sheet)), {});
  EXPECT_NE(text.find("Influence coefficients"), std::string::npos);
}

TEST(BalanceRunsE2e, TheSheetIsPrintedWhereABrowserIsInstalled) {
  if (std::system("command -v chromium >/dev/null") != 0)
    GTEST_SKIP() << "chromium is not installed (apt install chromium)";
  const Folder folder;
  const Outcome outcome = folder.whirl("balance " + runs() + kConvention + " --pdf sheet.pdf");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(slurp(folder / "sheet.pdf").substr(0, 5), "%PDF-");
  const Outcome none = folder.shell("PATH=/nowhere '" + program() + "' balance " + runs() + kConvention +
                                    " --pdf none.pdf --html none.html");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("needs the browser chromium"), std::string::npos) << none.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "none.html"));
}

TEST(BalanceRunsE2e, ARunWithoutAMassMayLeaveItsCellsEmpty) {
  const Folder folder;
  const std::string header = "run_1,speed_rpm,D_amp_um,D_phase_deg,A_mass_gram,A_angle_deg\n",
                    trial = "2,1480,61,75,10,0\n", stated = " --phase lag --amplitude pp --angles with --json";
  folder.write("zero.csv", header + "1,1480,80,40,0,0\n" + trial);
  folder.write("empty.csv", header + "1,1480,80,40,,\n" + trial);
  const Outcome zero = folder.whirl("balance zero.csv" + stated), empty = folder.whirl("balance empty.csv" + stated);
  ASSERT_EQ(empty.exit_code, zero.exit_code) << empty.err;
  const auto mass = [](const Outcome& o) {
    const io::Json json = io::parse_json(o.out, "stdout");
    return io::JsonReader(json, "stdout").at("planes").items().front().at("mass").at("value").number();
  };
  EXPECT_EQ(mass(zero), mass(empty));
  folder.write("half.csv", header + "1,1480,80,40,,30\n" + trial);
  folder.write("reading.csv", header + "1,1480,,40,0,0\n" + trial);
  EXPECT_NE(folder.whirl("balance half.csv" + stated).err.find("half.csv:2: column 'A_mass' is empty"),
            std::string::npos);
  EXPECT_NE(folder.whirl("balance reading.csv" + stated).err.find("reading.csv:2: column 'D_amp' is empty"),
            std::string::npos);
}

// Peak, peak-to-peak and rms differ by 2.8: a kind that was not stated was printed as 0-p, with zones by it.
TEST(BalanceRunsE2e, AKindOfAmplitudesThatIsNotStatedIsNotGuessed) {
  const Folder folder;
  const std::string sense = " --phase lag --angles against --slow-roll-rpm 400 --drop-dependent";
  const Outcome read = folder.whirl("balance " + runs() + sense);
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_NE(read.out.find("µm as read"), std::string::npos) << read.out;
  EXPECT_EQ(read.out.find("0-p"), std::string::npos) << read.out;
  EXPECT_EQ(read.out.find(" → "), std::string::npos) << read.out;
  EXPECT_NE((read.out + read.err).find("--amplitude is not stated"), std::string::npos) << read.out << read.err;
  const Outcome stated = folder.whirl("balance " + runs() + sense + " --amplitude pp");
  EXPECT_NE(stated.out.find("µm p-p"), std::string::npos) << stated.out;
  EXPECT_EQ((stated.out + stated.err).find("--amplitude is not stated"), std::string::npos);
  // Masses are the same; limits of the reader's own are in his kind.
  const auto masses = [](const std::string& text) { return text.substr(0, text.find("phase lag")); };
  EXPECT_EQ(masses(read.out), masses(stated.out));
  EXPECT_NE(folder.whirl("balance " + runs() + sense + " --zones-um 40,60,90").out.find(" → "), std::string::npos);
}

// "before" was the fit of all runs, and nobody could find it among his readings.
TEST(BalanceRunsE2e, TheSheetSaysWhatWasMeasuredAsFoundAndWhatWasFitted) {
  const Folder folder;
  const Outcome outcome = folder.whirl("balance " + runs() + kConvention + " --json");
  const io::Json json = io::parse_json(outcome.out, "stdout");
  const io::JsonReader row = io::JsonReader(json, "stdout").at("readings").items().front();
  // Runs 1 and 9 carry nothing: 48.29 at 7.8 and 50.68 at 4.2 degrees, p-p, less the slow roll.
  EXPECT_GT(row.at("measured_as_found").number(), 20e-6);
  EXPECT_LT(row.at("measured_as_found").number(), 80e-6);
  EXPECT_NEAR(row.at("measured_as_found").number(), row.at("before").at("value").number(), 3e-6);
  const std::string sheet = folder.whirl("balance " + runs() + kConvention).out;
  for (const char* column : {"measured as found [µm p-p]", "fitted as found [µm p-p]", "predicted after [µm p-p]"})
    EXPECT_NE(sheet.find(column), std::string::npos) << column << "\n" << sheet;
}

TEST(BalanceRunsE2e, TheSheetJudgesTheResidualWithItsErrors) {
  const Folder folder;
  const auto verdict = [&](const std::string& more) {
    return folder.whirl("balance " + runs() + kConvention + " --mass-kg 400 --radius-mm 150 " + more).out;
  };
  const std::string held = verdict("--grade 2.5 --zones-um 40,60,90");
  EXPECT_NE(held.find("Residual unbalance with its errors"), std::string::npos);
  EXPECT_NE(held.find(" 1137  held"), std::string::npos) << held;  // 9549 * 2.5 * 400 / 2800 / 3 planes
  EXPECT_NE(held.find("B → A"), std::string::npos);
  EXPECT_NE(verdict("--grade 2.5 --angle-error-deg 90").find("undecided"), std::string::npos);
  EXPECT_NE(verdict("--holes 2 --grade 0.4").find("not held"), std::string::npos);
  EXPECT_EQ(folder.whirl("balance " + runs() + " --zones-um 60,40,90").exit_code, 2);
}

// An earlier job of the machine and the run as found alone; one trial narrows the intervals of every plane.
TEST(BalanceRunsE2e, AnEarlierJobSavesTrialRuns) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("balance " + runs() + kConvention + " --out earlier.json").exit_code, 0);
  std::ifstream in(runs());
  std::ostringstream none, one;
  std::string line;
  for (int k = 0; std::getline(in, line); ++k) {
    const int run = k == 0 ? 0 : std::stoi(line);
    if (run <= 1) none << line << "\n";
    if (run <= 2) one << line << "\n";
  }
  folder.write("none.csv", none.str());
  folder.write("one.csv", one.str());
  const auto width = [&](const std::string& file) {
    const Outcome o = folder.whirl("balance " + file + kConvention + " --prior earlier.json --noise-um 0.3 --json");
    EXPECT_EQ(o.exit_code, 0) << o.err;
    const io::Json json = io::parse_json(o.out, "stdout");
    double sum = 0;
    for (const io::JsonReader& plane : io::JsonReader(json, "stdout").at("planes").items()) {
      const auto ends = plane.at("mass").at("ci95").items();
      sum += ends[1].number() - ends[0].number();
    }
    return sum;
  };
  EXPECT_LT(width("one.csv"), 0.8 * width("none.csv"));
  EXPECT_NE(folder.whirl("balance none.csv --prior earlier.json" + std::string(kConvention)).err.find("--noise-um"),
            std::string::npos);
  EXPECT_NE(folder.whirl("balance none.csv" + std::string(kConvention)).err.find("influence of plane"),
            std::string::npos);
}

/// Zero-to-peak amplitude in um and lag in degrees of x and y in a record of a rotor at constant speed: least squares
/// over its second half.
std::string steady_vectors(const std::filesystem::path& file) {
  const Recording record = io::read_csv(file);
  const Eigen::Index n = record.size() / 2;
  Eigen::MatrixXd basis(n, 3);
  basis << record["beta"].tail(n).array().cos(), record["beta"].tail(n).array().sin(), Eigen::ArrayXd::Ones(n);
  std::string text;
  for (const char* axis : {"x", "y"}) {
    const Eigen::Vector3d fit = basis.colPivHouseholderQr().solve(record[axis].tail(n));
    // cos(beta - lag) = cos(lag) cos(beta) + sin(lag) sin(beta)
    text += fmt::format(",{:.6f},{:.4f}", 1e6 * std::hypot(fit[0], fit[1]),
                        std::atan2(fit[1], fit[0]) * 180 / std::numbers::pi);
  }
  return text;
}

// A model identified from one run-down stands in for the trial runs: one run as found tells the mass. The truth is the
// virtual rig's: 51.3 um at 0.6 rad in the disk of 1.5 kg, and 1 g at 82.73 mm and 0 rad.
TEST(BalanceRunsE2e, AnIdentifiedModelSavesTheTrialRuns) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rig record --added-mass-g 1 --snr-db 30 --out down.csv").exit_code, 0);
  ASSERT_NE(folder.whirl("identify down.csv --no-holdout --out model.json").exit_code, 2);
  std::string runs = "run_1,speed_rpm,x_amp_um,x_phase_deg,y_amp_um,y_phase_deg,disk_mass_gram,disk_angle_deg\n";
  std::string odd =
      "run_1,speed_rpm,DE_amp_um,DE_phase_deg,disk_mass_gram,disk_angle_deg\n1,400,20,3,0,0\n1,1400,20,3,0,0\n";
  for (const int rpm : {400, 1400}) {
    folder.write("steady.toml", fmt::format("[profile]\nstart_rpm = {0}\nend_rpm = {0}\nramp_s = 40\ndwell_end_s = 0\n"
                                            "ripple_percent = 0\n",
                                            rpm));
    ASSERT_EQ(folder.whirl("rig record --rig steady.toml --added-mass-g 1 --out steady.csv --force").exit_code, 0);
    runs += fmt::format("1,{}{},0,0\n", rpm, steady_vectors(folder / "steady.csv"));
  }
  folder.write("runs.csv", runs);
  const std::string call =
      "balance runs.csv --phase lag --amplitude 0p --angles with --mass-kg 1.5 --radius-mm 82.73 "
      "--noise-um 2 --json --prior model.json";
  const Outcome o = folder.whirl(call + " --prior-common 0.05 --prior-each 0.05");
  ASSERT_LE(o.exit_code, 1) << o.err;
  const io::Json json = io::parse_json(o.out, "stdout");
  const io::JsonReader plane = io::JsonReader(json, "stdout").at("planes").items()[0];
  const std::complex<double> truth =
      -(std::polar(51.3e-6, 0.6) + 1e-3 * 82.73e-3 / 1.5) * 1.5 / 82.73e-3;  // kg at the radius of the masses
  const auto mass = plane.at("mass").at("ci95").items();
  EXPECT_LT(mass[0].number(), std::abs(truth)) << o.out;
  EXPECT_GT(mass[1].number(), std::abs(truth)) << o.out;
  EXPECT_LT(mass[1].number() - mass[0].number(), 0.5 * std::abs(truth)) << o.out;
  const double angle = std::remainder(plane.at("angle").at("value").number() - std::arg(truth), 2 * std::numbers::pi);
  EXPECT_LT(std::abs(angle), 0.1) << o.out;
  // A table of one row is one run as found at one speed.
  folder.write("row.csv", runs.substr(0, runs.find('\n') + 1) + runs.substr(runs.find("1,1400")));
  const Outcome row = folder.whirl(std::string(call).replace(call.find("runs.csv"), 8, "row.csv"));
  EXPECT_LE(row.exit_code, 1) << row.err;
  // What the model cannot answer is said.
  folder.write("odd.csv", odd);
  const auto refused = [&](const std::string& file, const std::string& more) {
    return folder
        .whirl("balance " + file + " --phase lag --amplitude 0p --angles with --noise-um 2 --prior model.json " + more)
        .err;
  };
  EXPECT_NE(refused("odd.csv", "--mass-kg 1.5 --radius-mm 82").find("name the probes x and y"), std::string::npos);
  EXPECT_NE(refused("runs.csv", "--mass-kg 1.5").find("--radius-mm"), std::string::npos);
  EXPECT_NE(refused("runs.csv", "--radius-mm 82").find("--mass-kg"), std::string::npos);
}

/// x1, x2 of a symmetric two-disc shaft (1 kg each, k to ground 4e4, between 3e4 N/m; modal damping 2 %): modes (1, 1)
/// and (1, -1) over sqrt(2), of 200 and sqrt(1e5) rad/s.
std::complex<double> two_disc_receptance(double w, int a, int b) {
  const std::complex<double> i(0, 1);
  const auto mode = [&](double own) { return 0.5 / (own * own - w * w + 2.0 * i * 0.02 * own * w); };
  return mode(200) + (a == b ? 1.0 : -1.0) * mode(std::sqrt(1e5));
}

// Modes of hammer blows on both discs stand in for the trial runs of a job of two planes: one run as found at two
// speeds.
TEST(BalanceRunsE2e, ModesOfBlowsSaveTheTrialRunsOfTwoPlanes) {
  const Folder folder;
  ModalModel modes;
  modes.responses = {"disk1:+X", "disk2:+X"};
  modes.references = {"disk1:+X", "disk1:+X"};
  modes.lower = modes.upper = modes.upper_slope = Eigen::VectorXcd::Zero(2);
  modes.band_low = 5, modes.band_high = 100;
  for (const double own : {200.0, std::sqrt(1e5)}) {
    Mode mode;
    mode.pole = own * std::complex<double>(-0.02, std::sqrt(1 - 4e-4));
    mode.frequency = Estimate::from_sd(own / (2 * std::numbers::pi), 0.02);
    mode.damping = Estimate::from_sd(0.02, 5e-4);
    const std::complex<double> residue = 0.5 / (std::complex<double>(0, 2) * mode.pole.imag());
    mode.residues = Eigen::Vector2cd(residue, own == 200.0 ? residue : -residue);
    modes.modes.push_back(mode);
  }
  io::save(folder / "modes.json", modes);
  const std::complex<double> unbalance[] = {std::polar(3e-3, 0.7), std::polar(2e-3, -1.9)};  // kg at 80 mm
  std::string text =
      "run_1,speed_rpm,disk1_amp_um,disk1_phase_deg,disk2_amp_um,disk2_phase_deg,disk1_mass_gram,"
      "disk1_angle_deg,disk2_mass_gram,disk2_angle_deg\n";
  for (const double rpm : {1300.0, 1700.0}) {
    const double w = rpm * std::numbers::pi / 30;
    text += fmt::format("1,{}", rpm);
    for (int probe = 0; probe < 2; ++probe) {
      const std::complex<double> z =
          0.08 * w * w *
          (two_disc_receptance(w, probe, 0) * unbalance[0] + two_disc_receptance(w, probe, 1) * unbalance[1]);
      text += fmt::format(",{:.4f},{:.4f}", 1e6 * std::abs(z), -std::arg(z) * 180 / std::numbers::pi);
    }
    text += ",0,0,0,0\n";
  }
  folder.write("asfound.csv", text);
  const std::string call =
      "balance asfound.csv --phase lag --amplitude 0p --angles with --radius-mm 80 --noise-um 1 --prior modes.json "
      "--prior-common 0.06 --prior-each 0.03";
  const Outcome o = folder.whirl(call + " --json");
  ASSERT_LE(o.exit_code, 1) << o.err;
  const io::Json json = io::parse_json(o.out, "stdout");
  const auto planes = io::JsonReader(json, "stdout").at("planes").items();
  for (std::size_t p = 0; p < 2; ++p) {
    const std::complex<double> found =
        std::polar(planes[p].at("mass").at("value").number(), planes[p].at("angle").at("value").number());
    EXPECT_LT(std::abs(found + unbalance[p]), 0.05 * std::abs(unbalance[p])) << p << o.out;
    const auto ends = planes[p].at("mass").at("ci95").items();
    EXPECT_LT(ends[0].number(), std::abs(unbalance[p]));
    EXPECT_GT(ends[1].number(), std::abs(unbalance[p]));
  }
  folder.write("other.csv", [&] {
    std::string other = text;
    for (std::size_t at;
         (at = other.find("disk2_mass")) != std::string::npos || (at = other.find("disk2_angle")) != std::string::npos;)
      other.replace(at, 5, "fan");
    return other;
  }());
  const Outcome refused = folder.whirl("balance other" + call.substr(call.find(".csv")));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("do not connect plane 'fan'"), std::string::npos) << refused.err;
}

// The same vectors written in another convention are the same job; mixed conventions are said.
TEST(BalanceRunsE2e, ConventionsAreReadAsStatedAndAMixtureIsSaid) {
  const Folder folder;
  const Outcome mixed = folder.whirl("balance " + runs() + " --phase lag --amplitude pp --slow-roll-rpm 400");
  EXPECT_NE(mixed.err.find("counted in opposite senses"), std::string::npos) << mixed.err;
  std::ifstream in(runs());
  std::string line;
  std::getline(in, line);
  std::ostringstream lead;
  lead << line << "\n";
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::string cell;
    for (int k = 0; std::getline(cells, cell, ','); ++k) {
      double v = std::stod(cell);
      if (k == 2 || k == 4) v /= 2;                                 // zero-to-peak
      if (k == 3 || k == 5 || k == 7 || k == 9 || k == 11) v = -v;  // lead, with rotation
      lead << (k ? "," : "") << v;
    }
    lead << "\n";
  }
  folder.write("lead.csv", lead.str());
  const auto mass = [&](const Outcome& o) {
    const io::Json json = io::parse_json(o.out, "stdout");
    const io::JsonReader plane = io::JsonReader(json, "stdout").at("planes").items()[0];
    return std::polar(plane.at("mass").at("value").number(), plane.at("angle").at("value").number());
  };
  const Outcome a = folder.whirl("balance " + runs() + kConvention + " --json");
  const Outcome b = folder.whirl("balance lead.csv --phase lead --slow-roll-rpm 400 --json");
  ASSERT_EQ(b.exit_code, 0) << b.err;
  EXPECT_LT(std::abs(mass(a) - std::conj(mass(b))), 1e-3 * std::abs(mass(a)));
}

TEST(BalanceRunsE2e, TomlTrialsLeftOnOrTakenOff) {
  const Folder folder;
  folder.write("job.toml", R"([job]
planes = ["A", "B"]
probes = ["X", "Y"]
phase = "lead"
[[run]]
name = "as found"
amplitudes_um = [10, 20]
phases_deg = [0, 90]
[[run]]
name = "trial A"
masses_gram = [10, 0]
angles_deg = [0, 0]
amplitudes_um = [20, 20]
phases_deg = [0, 90]
[[run]]
name = "trial B"
keep = true
masses_gram = [0, 10]
angles_deg = [0, 0]
amplitudes_um = [20, 40]
phases_deg = [0, 90]
)");
  // A moves X by 1 um/g, B moves Y by 2i um/g: -10 g and -10 g.
  const Outcome outcome = folder.whirl("balance job.toml --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("no interval can be given"), std::string::npos);
  const io::Json json = io::parse_json(outcome.out, "stdout");
  for (const io::JsonReader& plane : io::JsonReader(json, "stdout").at("planes").items()) {
    EXPECT_NEAR(plane.at("mass").at("value").number(), 10e-3, 1e-9);
    EXPECT_NEAR(std::abs(plane.at("angle").at("value").number()), std::numbers::pi, 1e-9);
  }
}

TEST(BalanceRunsE2e, BadTablesAreRefusedWithTheirPlace) {
  const Folder folder;
  folder.write("a.csv", "run_1,X_amp_um,X_phase_deg,P_mass_gram,P_angle_deg\n1,1,0,0,0\n1,2,0,5,0\n");
  EXPECT_NE(folder.whirl("balance a.csv").err.find("run 1 has different masses"), std::string::npos);
  folder.write(
      "d.csv",
      "run_1,X_amp_um,X_phase_deg,P_mass_gram,P_angle_deg,Q_mass_gram,Q_angle_deg\n1,1,0,0,0,0,0\n2,2,0,5,0,0,0\n");
  EXPECT_NE(folder.whirl("balance d.csv").err.find("influence of plane Q"), std::string::npos);
  folder.write("b.csv", "run_1,X_amp_um,P_mass_gram,P_angle_deg\n1,1,0,0\n2,2,5,0\n");
  EXPECT_NE(folder.whirl("balance b.csv").err.find("X_phase"), std::string::npos);
  folder.write("c.csv", "run_1,X_amp_um,X_phase_deg,P_mass_gram,P_angle_deg\n1,-1,0,0,0\n2,2,0,5,0\n");
  const Outcome negative = folder.whirl("balance c.csv");
  EXPECT_EQ(negative.exit_code, 2);
  EXPECT_NE(negative.err.find("c.csv:2"), std::string::npos) << negative.err;
  EXPECT_EQ(folder.whirl("balance c.csv --phase sideways").exit_code, 2);
}

}  // namespace
}  // namespace whirl::testing
