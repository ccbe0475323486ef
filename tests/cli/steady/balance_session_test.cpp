#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include "../program.hpp"
#include "whirl/io/json.hpp"

namespace whirl::testing {
namespace {

using Complex = std::complex<double>;
constexpr double kDegree = std::numbers::pi / 180;

/// A rotor of two planes and two probes at two speeds, read as phase lag and peak-to-peak um, angles against rotation.
class Fan {
 public:
  explicit Fan(unsigned seed) : random_(seed) {}
  std::string read(const std::vector<Complex>& on, bool lead_and_rms = false) {
    std::normal_distribution<double> normal(0, 0.15);
    std::ostringstream text;
    for (int m = 0; m < 4; ++m) {
      const Complex a[4][2] = {{std::polar(1.6, -1.7), std::polar(0.5, 0.5)},
                               {std::polar(0.6, 0.3), std::polar(1.3, -1.4)},
                               {std::polar(2.1, -2.6), std::polar(-0.7, -0.2)},
                               {std::polar(0.9, 2.4), std::polar(1.9, -2.2)}};
      const Complex v[4] = {std::polar(24.0, -0.1), std::polar(23.0, -1.0), std::polar(31.0, -1.2),
                            std::polar(37.0, -2.1)};
      const Complex z = v[m] + a[m][0] * on[0] + a[m][1] * on[1] + Complex(normal(random_), normal(random_));
      const double phase = std::arg(z) / kDegree;
      if (lead_and_rms)
        text << std::abs(z) / std::numbers::sqrt2 << "@" << phase << " ";
      else
        text << 2 * std::abs(z) << "@" << -phase << " ";
    }
    return text.str();
  }

 private:
  std::mt19937_64 random_;
};

struct Told {
  std::string step, plane;
  std::vector<Complex> masses;  ///< g, with rotation
  Outcome outcome;
};

Told told(const Folder& folder, const std::string& arguments) {
  Told t;
  t.outcome = folder.whirl("balance --session fan.toml --json " + arguments);
  if (t.outcome.out.empty()) return t;
  const io::Json json = io::parse_json(t.outcome.out, "stdout");
  const io::JsonReader document(json, "stdout");
  t.step = document.at("step").text();
  t.plane = document.at("plane").text();
  for (const io::JsonReader& m : document.at("masses").items())
    t.masses.push_back(std::polar(1e3 * m.at("mass_kg").number(), -kDegree * m.at("angle_deg").number()));
  return t;
}

constexpr const char* kNew =
    "--planes A,B --probes DE,NDE --speeds-rpm 1500,2800 --phase lag --amplitude pp --angles against --trial-gram 8 "
    "--target-um 6 --probe-deg 45,45";

TEST(BalanceSessionE2e, TheProgramLeadsFromTheFirstRunToTheSheet) {
  const Folder folder;
  Fan fan(5);
  Told next = told(folder, kNew);
  ASSERT_EQ(next.outcome.exit_code, 0) << next.outcome.err;
  std::vector<std::string> steps;
  for (int k = 0; k < 9 && next.step != "done"; ++k) {
    steps.push_back(next.step + next.plane);
    next = told(folder, "--readings \"" + fan.read(next.masses) + "\" ");
    ASSERT_EQ(next.outcome.exit_code, 0) << next.outcome.err;
  }
  EXPECT_EQ(steps, (std::vector<std::string>{"as found", "trialA", "trialB", "correction"}));
  // Resumed: the same answer again, and the sheet with the check.
  next = told(folder, "--html sheet.html");
  EXPECT_EQ(next.step, "done");
  std::ifstream sheet(folder / "sheet.html");
  const std::string text((std::istreambuf_iterator<char>(sheet)), {});
  // Four readings, two planes: what is left is above the target, and that is said.
  EXPECT_NE(text.find("these planes cannot bring the readings below"), std::string::npos);
  EXPECT_NE(next.outcome.err.find("the target is not held"), std::string::npos);
  EXPECT_NE(text.find("Check: the last run"), std::string::npos);
  // The file is a job of its own, with its conventions.
  const Outcome plain = folder.whirl("balance fan.toml");
  EXPECT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_NE(plain.out.find("phase lag, amplitudes p-p, mass angles against rotation"), std::string::npos);
}

TEST(BalanceSessionE2e, ARunTypedInAnotherConventionIsTheSameRun) {
  const Folder a, b;
  const auto masses = [&](const Folder& folder, bool lead) {
    Fan fan(6);
    Told next = told(folder, kNew);
    for (int k = 0; k < 3; ++k)
      next = told(folder,
                  "--readings \"" + fan.read(next.masses, lead) + "\"" + (lead ? " --phase lead --amplitude rms" : ""));
    EXPECT_EQ(next.step, "correction") << next.outcome.err;
    return next.masses;
  };
  const auto lag = masses(a, false), lead = masses(b, true);
  for (std::size_t p = 0; p < 2; ++p) EXPECT_LT(std::abs(lag[p] - lead[p]), 1e-3 * std::abs(lag[p]));
}

// The mass was put on the opposite side in the check: the program asks to look, and goes on when it is done right.
TEST(BalanceSessionE2e, AWrongCorrectionIsNotTakenForTheRotor) {
  const Folder folder;
  Fan fan(7);
  Told next = told(folder, std::string(kNew) + " --drift none");
  for (int k = 0; k < 3; ++k) next = told(folder, "--readings \"" + fan.read(next.masses) + "\"");
  ASSERT_EQ(next.step, "correction");
  std::vector<Complex> wrong = next.masses;
  wrong[1] = -wrong[1];
  const Told after = told(folder, "--readings \"" + fan.read(wrong) + "\"");
  EXPECT_EQ(after.step, "repeat") << after.outcome.err;
  EXPECT_NE(after.outcome.out.find("contradict"), std::string::npos) << after.outcome.out;
  Told end = told(folder, "--undo --readings \"" + fan.read(next.masses) + "\"");
  EXPECT_EQ(end.step, "done");
}

TEST(BalanceSessionE2e, MistakesAreRefusedAndChangeNothing) {
  const Folder folder;
  EXPECT_NE(folder.whirl("balance").err.find("one of INPUT"), std::string::npos);
  EXPECT_NE(folder.whirl("balance --session fan.toml --planes A --probes X --phase lag --amplitude pp --trial-gram 1")
                .err.find("--angles"),
            std::string::npos);
  EXPECT_NE(folder.whirl("balance --session fan.toml --readings 1@2").err.find("make the job first"),
            std::string::npos);
  ASSERT_EQ(folder.whirl(std::string("balance --session fan.toml ") + kNew).exit_code, 0);
  const auto content = [&] {
    std::ifstream in(folder / "fan.toml");
    return std::string((std::istreambuf_iterator<char>(in)), {});
  };
  const std::string before = content();
  for (const char* bad : {"--readings \"1@2\"", "--readings \"1@2 3@x 4@5 6@7\"", "--readings \"1@2 -3@5 4@5 6@7\"",
                          "--readings \"1@2 3@5 4@5 6@7\" --masses 1@2", "--planes C", "--undo", "--masses \"0 0\"",
                          "--readings \"1@2 inf@5 4@5 6@7\"", "--html sheet.html"}) {
    const Outcome outcome = folder.whirl(std::string("balance --session fan.toml ") + bad);
    EXPECT_EQ(outcome.exit_code, 2) << bad << outcome.out;
    EXPECT_EQ(content(), before) << bad;
  }
  EXPECT_EQ(folder.whirl("balance --session fan.toml --readings \"1@2 - 4@5 6@7\"").exit_code, 0);
  EXPECT_NE(content().find("unread = [2]"), std::string::npos);
  EXPECT_EQ(folder.whirl("balance --session fan.toml --undo").exit_code, 0);
  EXPECT_EQ(content(), before);
}

/// A record of a run-up from 9 to 27 Hz at a constant rate through a critical speed of 18 Hz:
/// z'' + c z' + k z = (Omega^2 - i alpha) e exp(i beta), e = 60 um at 40 deg and 15 um per gram.
std::string run_up_record(Complex grams, double hertz_per_second, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, 1e-6);
  const Complex e = std::polar(60e-6, 40 * kDegree) + 15e-6 * grams;
  const double k = std::pow(2 * std::numbers::pi * 18, 2), c = 12, alpha = 2 * std::numbers::pi * hertz_per_second,
               h = 1e-4;
  Complex z = 0, v = 0;
  std::ostringstream text;
  text.precision(9);
  text << "t_s,X_um,key_V\n";
  double turns_before = 0;
  for (int i = 0; i < static_cast<int>(18 / hertz_per_second / h); ++i) {
    const double t = i * h;
    const auto beta = [&](double s) { return 2 * std::numbers::pi * 9 * s + 0.5 * alpha * s * s; };
    const auto force = [&](double s) {
      const double omega = 2 * std::numbers::pi * 9 + alpha * s;
      return Complex(omega * omega, -alpha) * e * std::polar(1.0, beta(s));
    };
    const auto a = [&](double s, Complex q, Complex w) { return force(s) - c * w - k * q; };
    if (i % 5 == 0) {
      const double turns = std::floor(beta(t) / (2 * std::numbers::pi));
      text << t << "," << 1e6 * (z.real() + normal(random)) << "," << (turns > turns_before ? 5 : 0) << "\n";
      turns_before = turns;
    }
    const Complex a1 = a(t, z, v), z2 = z + h / 2 * v, v2 = v + h / 2 * a1, a2 = a(t + h / 2, z2, v2);
    const Complex z3 = z + h / 2 * v2, v3 = v + h / 2 * a2, a3 = a(t + h / 2, z3, v3), z4 = z + h * v3, v4 = v + h * a3,
                  a4 = a(t + h, z4, v4);
    z += h / 6 * (v + 2.0 * v2 + 2.0 * v3 + v4);
    v += h / 6 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }
  return text.str();
}

// Every run is a run-up through the critical speed, always at the same rate: the 1X vectors at nine speeds come from
// the record, transient as they are, and one correction serves them all.
TEST(BalanceSessionE2e, RunUpsOfOneRateBalanceAllSpeedsAtOnce) {
  const Folder folder;
  std::mt19937_64 random(3);
  const auto run_up = [&](Complex grams, const std::string& name) {
    folder.write(name, run_up_record(grams, 2, random));
  };
  Told next = told(folder,
                   "--planes disk --probes X --speeds-rpm 700,800,900,1000,1050,1100,1150,1200,1400 --phase lead "
                   "--amplitude 0p --angles with --trial-gram 1.5 --drift none");
  ASSERT_EQ(next.outcome.exit_code, 0) << next.outcome.err;
  for (int k = 0; k < 4 && next.step != "done"; ++k) {
    // Angles count with the rotation here, `told` turns them for a job that counts against.
    run_up(std::conj(next.masses[0]), "run.csv");
    next = told(folder, "--record run.csv");
    ASSERT_LE(next.outcome.exit_code, 1) << next.outcome.err;
  }
  EXPECT_EQ(next.step, "done");
  EXPECT_EQ(next.outcome.err.find("differing rates"), std::string::npos) << next.outcome.err;
  const Complex best = -std::polar(4.0, 40 * kDegree);
  EXPECT_LT(std::abs(std::conj(next.masses[0]) - best), 0.1 * std::abs(best)) << next.outcome.out;
}

// A drive that never ramps twice alike: the vectors of a rotor that stays at the speed come from modes fitted to each
// run.
TEST(BalanceSessionE2e, RunUpsOfDifferingRatesBelongTogether) {
  const Complex best = -std::polar(4.0, 40 * kDegree);
  const auto left_over = [&](unsigned seed, const std::string& flag) {
    const Folder folder;
    std::mt19937_64 random(seed);
    Told next = told(folder,
                     "--planes disk --probes X --speeds-rpm 700,800,900,1000,1050,1100,1150,1200,1400 --phase lead "
                     "--amplitude 0p --angles with --trial-gram 1.5 --drift none");
    EXPECT_EQ(next.outcome.exit_code, 0) << next.outcome.err;
    // As found, the trial, and the correction that these two tell.
    for (const double rate : {0.8, 2.5, 1.5}) {
      folder.write("run.csv", run_up_record(std::conj(next.masses[0]), rate, random));
      next = told(folder, "--record run.csv" + flag);
      EXPECT_LE(next.outcome.exit_code, 1) << next.outcome.err;
      if (next.masses.empty()) return 1.0;
    }
    EXPECT_EQ(next.outcome.err.find("differing rates") == std::string::npos, !flag.empty()) << next.outcome.err;
    EXPECT_TRUE(next.step == "correction" || next.step == "done" || !flag.starts_with(" --steady")) << next.step;
    return std::abs(std::conj(next.masses[0]) - best) / std::abs(best);
  };
  double plain = 0;
  for (const unsigned seed : {11u, 12u}) {
    EXPECT_LT(left_over(seed, " --steady"), 0.05) << seed;
    plain = std::max(plain, left_over(seed, ""));
  }
  EXPECT_GT(plain, 0.1) << "runs of differing rates need no --steady";
}

TEST(BalanceSessionE2e, SteadyVectorsNeedARunThatModesExplain) {
  const Folder folder;
  told(folder,
       "--planes disk --probes X --speeds-rpm 700,900 --phase lead --amplitude 0p --angles with --trial-gram 1.5");
  EXPECT_NE(told(folder, "--steady").outcome.err.find("belongs to --record"), std::string::npos);
  // Constant speed, and a motion that swells and fades as no resonance does.
  std::ostringstream flat, waves;
  flat << "t_s,X_um,key_V\n";
  waves << "t_s,X_um,key_V\n";
  for (int i = 0; i < 8000; ++i) {
    const double t = i * 1e-3, steady = 2 * std::numbers::pi * 12 * t,
                 rising = 2 * std::numbers::pi * (8 * t + 0.75 * t * t);
    const auto key = [](double beta) { return std::fmod(beta, 2 * std::numbers::pi) < 0.4 ? 5 : 0; };
    flat << t << "," << 30 * std::cos(steady) << "," << key(steady) << "\n";
    waves << t << "," << (30 + 25 * std::sin(6 * t)) * std::cos(rising) << "," << key(rising) << "\n";
  }
  folder.write("flat.csv", flat.str());
  folder.write("waves.csv", waves.str());
  EXPECT_NE(told(folder, "--record flat.csv --steady").outcome.err.find("--steady needs a run-up or run-down"),
            std::string::npos);
  EXPECT_NE(told(folder, "--record waves.csv --steady").outcome.err.find("make all runs at one rate"),
            std::string::npos);
}

}  // namespace
}  // namespace whirl::testing
