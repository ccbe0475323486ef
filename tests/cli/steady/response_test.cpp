#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <sstream>

#include "../made_files.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/json.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/testing/data.hpp"

namespace whirl::testing {
namespace {

/// A rotor with a fold: k1 = 8882.6, k2 = 2e8, c = 7.5, e = 0.3 mm.
void write_rotor(const Folder& folder) {
  IdentifiedModel model;
  model.method = "weak";
  RotorModel r;
  r.k1 = 8882.6;
  r.k2 = 2e8;
  r.c = 7.5;
  r.eps = 3e-4;
  model.rotor = r;
  model.rotor_covariance.assign(25, 0.0);
  const double sd[5] = {20, 2e6, 0.1, 1e-6, 1e-6};
  for (std::size_t k = 0; k < 5; ++k) model.rotor_covariance[6 * k] = sd[k] * sd[k];
  io::save(folder / "model.json", model);
}

// The folds of the curve are where slow runs jump: up at the upper one, down at the lower one.
TEST(ResponseE2e, SlowRunsJumpAtTheFoldsOfTheCurve) {
  const Folder folder;
  write_rotor(folder);
  const Outcome outcome = folder.whirl("response model.json --from-rpm 400 --to-rpm 1900 --json --figure r.svg");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const io::Json json = io::parse_json(outcome.out, "stdout");
  const io::JsonReader document(json, "stdout");
  std::vector<double> folds;
  for (const io::JsonReader& e : document.at("events").items()) folds.push_back(e.at("omega").number());
  ASSERT_EQ(folds.size(), 2U);
  double top = 0;
  for (const io::JsonReader& p : document.at("points").items()) top = std::max(top, p.at("amplitude").number());
  const std::vector<double> interval = document.at("peak_interval").numbers();
  EXPECT_LT(interval[0], top);
  EXPECT_GT(interval[1], top);

  const auto jump = [&](const char* flags) {
    EXPECT_EQ(
        folder.whirl(std::string("simulate model.json --seconds 120 --rate-hz 500 --out run.csv --force ") + flags)
            .exit_code,
        0);
    const io::Table run = io::read_table(folder / "run.csv");
    // Speed at the largest radius of the slow run up; of the run down where the radius grows fastest.
    const Eigen::VectorXd radius = (run["x"].array().square() + run["y"].array().square()).sqrt();
    Eigen::Index at = 0;
    radius.maxCoeff(&at);
    return (run["beta"][at + 1] - run["beta"][at - 1]) * 250;
  };
  EXPECT_NEAR(jump("--from-rpm 900 --to-rpm 1300"), std::max(folds[0], folds[1]), 1.0);
  EXPECT_NEAR(jump("--from-rpm 1300 --to-rpm 900"), std::min(folds[0], folds[1]), 1.5);
}

// A circular orbit of radius r has ((k1 + k2 r^2 - w^2)^2 + (c w)^2) r^2 = (e w^2)^2: a cubic in r^2, scanned for its
// roots. Between the folds it has three, of which the middle one is unstable.
TEST(ResponseE2e, EveryAnswerAtASpeedIsListed) {
  const Folder folder;
  write_rotor(folder);
  for (const double rpm : {800.0, 1130.0}) {
    const double w = rpm * std::numbers::pi / 30;
    const auto left = [&](double r) {
      return (std::pow(8882.6 + 2e8 * r * r - w * w, 2) + std::pow(7.5 * w, 2)) * r * r - std::pow(3e-4 * w * w, 2);
    };
    std::vector<double> radii;
    constexpr double kStep = 1e-7;
    for (double r = kStep; r < 0.02; r += kStep)
      if (left(r) * left(r + kStep) <= 0) radii.push_back(r);
    const Outcome outcome = folder.whirl(fmt::format("response model.json --at-rpm {} --json", rpm));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const io::Json json = io::parse_json(outcome.out, "stdout");
    std::vector<std::pair<double, bool>> found;
    for (const io::JsonReader& a : io::JsonReader(json, "stdout").at("answers").items())
      found.emplace_back(a.at("amplitude").number(), a.at("stable").flag());
    EXPECT_TRUE(std::ranges::is_partitioned(found, [](const auto& a) { return a.second; })) << "stable ones first";
    std::ranges::sort(found);
    ASSERT_EQ(found.size(), radii.size()) << rpm;
    for (std::size_t k = 0; k < radii.size(); ++k) {
      EXPECT_NEAR(found[k].first, radii[k], 1e-4 * radii[k]);
      EXPECT_EQ(found[k].second, k != 1);
    }
  }
  EXPECT_EQ(folder.whirl("response model.json --from-rpm 400 --to-rpm 900 --at-rpm 1000").exit_code, 2);
}

// The suggested rate is tried by another command of the program, on the model itself.
TEST(RunUpE2e, TheSuggestedRateKeepsTheLimitAndALimitOutOfReachFails) {
  const Folder folder;
  write_rotor(folder);
  const Outcome outcome = folder.whirl(
      "runup model.json --from-rpm 400 --to-rpm 1900 --limit-mm 3.5 --json --out plan.json --figure r.svg");
  ASSERT_LE(outcome.exit_code, 1) << outcome.err;
  const io::Json json = io::parse_json(outcome.out, "stdout");
  const io::JsonReader up = io::JsonReader(json, "stdout").at("up");
  const double rate = up.at("suggested").number();
  EXPECT_GE(rate, up.at("slowest_safe").number());
  EXPECT_LE(up.at("peak_interval").numbers()[1], 3.5e-3);
  EXPECT_TRUE(std::filesystem::exists(folder / "r.svg"));
  EXPECT_EQ(slurp(folder / "plan.json").empty(), false);
  const Outcome run = folder.whirl(fmt::format("simulate model.json --from-rpm 400 --to-rpm 1900 --seconds {} --json",
                                               1500 * std::numbers::pi / 30 / rate));
  EXPECT_LE(io::JsonReader(io::parse_json(run.out, "stdout"), "stdout").at("peak_radius_m").number(), 3.5e-3);

  const Outcome hopeless = folder.whirl("runup model.json --from-rpm 400 --to-rpm 1900 --limit-mm 0.01");
  EXPECT_EQ(hopeless.exit_code, 1);
  EXPECT_NE(hopeless.err.find("no rate"), std::string::npos) << hopeless.err;
  const Outcome weak =
      folder.whirl("runup model.json --from-rpm 400 --to-rpm 1900 --mass-kg 1.5 --inertia-kgm2 0.01 --torque-nm 0.005");
  EXPECT_EQ(weak.exit_code, 1);
  EXPECT_NE(weak.err.find("stalls"), std::string::npos) << weak.err;
  EXPECT_EQ(folder.whirl("runup model.json --from-rpm 1900 --to-rpm 400").exit_code, 2);
  EXPECT_EQ(folder.whirl("runup model.json --from-rpm 400 --to-rpm 1900 --torque-nm 1").exit_code, 2);
}

// A measured decay of a cantilever with magnets (Breunung and Balachandran 2024), driven until it is let go. Its
// frequency at small amplitude is that of its spectrum late in the record.
TEST(DecayE2e, MeasuredDecayGivesABackboneThatItsOwnSpectrumConfirms) {
  const std::filesystem::path data = data_file("frid/decay_42p05Hz.lvm.gz");
  WHIRL_REQUIRE_DATA(data);
  const Folder folder;
  std::filesystem::copy_file(data, folder / "d.lvm.gz");
  const Outcome outcome =
      folder.whirl("decay d.lvm.gz --columns Strain_0:x_strain --json --out mode.json --figure b.svg --points p.json");
  ASSERT_LE(outcome.exit_code, 1) << outcome.err;
  const io::Json json = io::parse_json(outcome.out, "stdout");
  const io::JsonReader mode(json, "stdout");
  EXPECT_GT(mode.at("points").items().size(), 10U);
  // Late in the record the spectrum has its line at 36.9 Hz (zero crossings of the samples, counted apart).
  EXPECT_NEAR(std::sqrt(mode.at("k1").at("value").number()) / (2 * std::numbers::pi), 36.9, 0.15);
  EXPECT_GT(mode.at("k3").at("value").number(), 0) << "the beam hardens";
  const Outcome response = folder.whirl("response mode.json --input u --amplitude 0.1 --from-rpm 600 --to-rpm 6000");
  EXPECT_LE(response.exit_code, 1) << response.err;
}

// x'' = -(2 pi 10)^2 x - c x' + g F: amplitude and phase in closed form.
TEST(SineE2e, LinearModeIsFoundFromItsTable) {
  const Folder folder;
  std::string table = "frequency_Hz,force_N,amplitude_mm,phase_deg\n";
  for (const double force : {2.0, 5.0}) {
    for (double f = 8; f <= 12.01; f += 0.25) {
      const double w = 2 * std::numbers::pi * f, w0 = 2 * std::numbers::pi * 10;
      const std::complex<double> x = force / 4.0 / std::complex<double>(w0 * w0 - w * w, 2.0 * w);
      table += fmt::format("{},{},{},{}\n", f, force, std::abs(x) * 1e3, std::arg(x) * 180 / std::numbers::pi);
    }
  }
  folder.write("t.csv", table);
  const Outcome outcome = folder.whirl("sine t.csv --json --figure s.svg --out mode.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const io::Json json = io::parse_json(outcome.out, "stdout");
  const io::JsonReader mode(json, "stdout");
  EXPECT_NEAR(mode.at("gain").at("value").number(), 0.25, 1e-6);
  EXPECT_NEAR(mode.at("c").at("value").number(), 2, 1e-5);
  EXPECT_EQ(folder.whirl("decay t.csv --channel q").exit_code, 2);
  // On a support that moves 0.1 mm: Omega^2 A / |w0^2 - Omega^2 + i c Omega|, against the support.
  const Outcome moved =
      folder.whirl("response mode.json --base x --amplitude 1e-4 --from-rpm 300 --to-rpm 1200 --out r.json");
  ASSERT_LE(moved.exit_code, 1) << moved.err;
  const io::Json curve = io::load_json(folder / "r.json");
  for (const io::JsonReader& p : io::JsonReader(curve, "r.json").at("points").items()) {
    const double w = p.at("omega").number(), w0 = 2 * std::numbers::pi * 10;
    const double expected = w * w * 1e-4 / std::abs(std::complex<double>(w0 * w0 - w * w, 2.0 * w));
    EXPECT_NEAR(p.at("amplitude").number() / expected, 1, 1e-5) << w;
  }
  const Outcome nowhere = folder.whirl("response mode.json --base q --amplitude 1 --from-rpm 300 --to-rpm 1200");
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_NE(nowhere.err.find("one of: x"), std::string::npos) << nowhere.err;
  EXPECT_EQ(folder.whirl("response mode.json --amplitude 1 --from-rpm 300 --to-rpm 1200").exit_code, 2);
  EXPECT_EQ(folder.whirl("sine absent.csv").exit_code, 2);
}

TEST(ResponseE2e, BadRequestsAreRefused) {
  const Folder folder;
  write_rotor(folder);
  EXPECT_EQ(folder.whirl("response model.json --from-rpm 0 --to-rpm 1900").exit_code, 2);
  EXPECT_EQ(folder.whirl("response model.json --from-rpm 300 --to-rpm 300").exit_code, 2);
  EXPECT_EQ(folder.whirl("response model.json --from-rpm 300 --to-rpm 900 --input q --amplitude 1").exit_code, 2);
  EXPECT_EQ(folder.whirl("simulate model.json").exit_code, 2);
  EXPECT_EQ(folder.whirl("simulate model.json --from-rpm 1 --to-rpm 2 --seconds -3").exit_code, 2);
}

// A decay cut off at 0.7 of its first amplitude, one that stands still for a while, one with spikes, and a sound one.
TEST(ResponseE2e, DamageOfADecayIsNamedAndLeftOut) {
  const Folder folder;
  for (const std::string kind : {"sound", "clipped", "frozen", "spikes"}) {
    std::ostringstream table;
    table << "t_s,x_mm\n";
    double held = 0;
    unsigned noise = 12345;
    for (int i = 0; i < 6000; ++i) {
      const double t = 0.001 * i;
      noise = noise * 1664525u + 1013904223u;
      double x = std::exp(-0.6 * t) * std::cos(2 * std::numbers::pi * 21 * t) + 1e-10 * static_cast<double>(noise >> 8);
      if (kind == "clipped") x = std::clamp(x, -0.7, 0.7);
      if (i == 700) held = x;
      if (kind == "frozen" && i >= 700 && i < 900) x = held;
      if (kind == "spikes" && i % 311 == 100 && i < 2000) x += i % 2 == 0 ? 2.5 : -2;
      table << t << "," << x << "\n";
    }
    folder.write("ring.csv", table.str());
    const Outcome outcome = folder.whirl("decay ring.csv --json");
    ASSERT_EQ(outcome.exit_code, 0) << kind << outcome.err;
    EXPECT_EQ(outcome.err.find("channel x: " + kind) != std::string::npos, kind != "sound") << outcome.err;
    EXPECT_EQ(outcome.err.find("channel x") != std::string::npos, kind != "sound") << outcome.err;
    const io::Json json = io::parse_json(outcome.out, "stdout");
    const io::JsonReader document(json, "stdout");
    EXPECT_NEAR(document.at("c").at("value").number(), 1.2, 0.01) << kind;
  }
}

// Records of a sine swept through the resonance of x'' + 4 x' + 1e4 x = 0.1 F, by semi-implicit Euler in small steps.
TEST(ResponseCommandsE2e, SweptSineRecordsGiveTheMode) {
  const Folder folder;
  for (const int level : {5, 15}) {
    std::ostringstream text;
    text.precision(10);
    text << "t_s,force_N,x_mm\n";
    double x = 0, v = 0, t = 0;
    constexpr int kSteps = 100;
    for (int i = 0; i < 12000; ++i) {
      const auto force = [&](double s) { return level * std::cos(70 * s + 2.5 * s * s); };
      text << t << "," << force(t) << "," << 1e3 * x << "\n";
      for (int k = 0; k < kSteps; ++k, t += 1e-3 / kSteps) {
        v += 1e-3 / kSteps * (0.1 * force(t) - 4 * v - 1e4 * x);
        x += 1e-3 / kSteps * v;
      }
    }
    folder.write("sweep" + std::to_string(level) + ".csv", text.str());
  }
  const Outcome outcome = folder.whirl("sine sweep5.csv sweep15.csv --out mode.json --figure sine.svg");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("windows of x over force"), std::string::npos);
  const IdentifiedModel mode = io::load<IdentifiedModel>(folder / "mode.json");
  ASSERT_EQ(mode.parameters.size(), 2U);  // k1 and c, no nonlinear term
  EXPECT_NEAR(mode.parameters[0].second.value, 1e4, 20);
  EXPECT_NEAR(mode.parameters[1].second.value, 4, 0.1);
  EXPECT_EQ(folder.whirl("sine sweep5.csv --force-channel nothing").exit_code, 2);
}

// A range that ends on the upper branch: the lower one, the peaks over the unbalance and their figure.
TEST(ResponseCommandsE2e, SecondBranchAndPeaksAreSaid) {
  const Folder folder;
  write_rotor(folder);
  const Outcome outcome = folder.whirl(
      "response model.json --from-rpm 400 --to-rpm 1050 --peaks-to 1.2 --isolas --peak-figure p.svg --out r.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("second branch"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("jump from"), std::string::npos);
  EXPECT_NE(outcome.out.find("isolas             none found"), std::string::npos);
  const io::Json json = io::load_json(folder / "r.json");
  const io::JsonReader document(json, "r.json");
  EXPECT_EQ(document.at("branches").items().size(), 1U);
  EXPECT_EQ(document.at("peaks").at("up").items().size(), 40U);
  // The figure holds the phase of both: only the second branch has an unstable part here.
  ASSERT_EQ(folder.whirl("response model.json --from-rpm 400 --to-rpm 1050 --figure c.csv").exit_code, 0);
  const std::string figure = slurp(folder / "c.csv");
  EXPECT_NE(figure.find("unstable: phase of X1"), std::string::npos) << figure.substr(0, figure.find('\n'));
  EXPECT_EQ(folder.whirl("response model.json --from-rpm 400 --to-rpm 1050 --peak-figure p.svg").exit_code, 2);
}

// What the records of a model covered stands in its file; what lies beyond it is said by every command that predicts.
TEST(ResponseCommandsE2e, WhatLiesBeyondTheRecordsOfTheModelIsSaid) {
  const Folder folder;
  copy_model(folder, "model.json");
  const io::Json model = io::load_json(folder / "model.json");
  const io::JsonReader range = io::JsonReader(model, "model").at("evidence").at("range");
  EXPECT_NEAR(range.at("amplitude_m").number(), 8.3e-3, 0.2e-3);
  EXPECT_NEAR(range.at("speed_high_rad_s").number(), 188, 4);
  const std::string slow = " model.json --from-rpm 300 --to-rpm 1750";
  for (const std::string& call : {"response" + slow, "runup" + slow, "simulate" + slow + " --seconds 60"}) {
    const Outcome far = folder.whirl(call);
    EXPECT_NE(far.err.find("extrapolation"), std::string::npos) << call << far.err;
  }
  const Outcome fast = folder.whirl("simulate model.json --from-rpm 300 --to-rpm 1750 --seconds 3");
  EXPECT_EQ(fast.err.find("extrapolation"), std::string::npos) << fast.err;
}

}  // namespace
}  // namespace whirl::testing
