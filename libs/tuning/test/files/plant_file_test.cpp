#include "whirl/tuning/plant_file.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/io/json.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {
namespace {

// A rotor of 2 kg at 11 Hz and two modes of the structure, one of them against the sensor.
struct Oscillator {
  double hertz, damping, per_newton;  // 1/kg
};
constexpr Oscillator kMachine[] = {{11, 0.01, 0.5}, {46, 0.008, -0.015}, {120, 0.006, 0.01}};

std::string matrix(const Eigen::MatrixXd& m) {
  std::string out = "[";
  for (Eigen::Index r = 0; r < m.rows(); ++r) {
    out += r == 0 ? "[" : ", [";
    for (Eigen::Index c = 0; c < m.cols(); ++c) out += fmt::format("{}{:.17g}", c == 0 ? "" : ", ", m(r, c));
    out += "]";
  }
  return out + "]";
}

/// The machine in states that are mixed at random.
std::string state_space(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(6, 6), b = Eigen::MatrixXd::Zero(6, 1), c = Eigen::MatrixXd::Zero(1, 6),
                  t(6, 6);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Oscillator& o = kMachine[i];
    const double w = 2 * std::numbers::pi * o.hertz;
    a(2 * i, 2 * i + 1) = 1, a(2 * i + 1, 2 * i) = -w * w, a(2 * i + 1, 2 * i + 1) = -2 * o.damping * w;
    b(2 * i + 1, 0) = o.per_newton, c(0, 2 * i) = 1;
  }
  for (Eigen::Index i = 0; i < 36; ++i) t(i / 6, i % 6) = static_cast<double>(random() % 1000) / 500 - 1;
  t += 3 * Eigen::MatrixXd::Identity(6, 6);
  const Eigen::MatrixXd back = t.inverse();
  return fmt::format(R"({{"schema": "whirl.plant/1", "A": {}, "B": {}, "C": {}, "eccentricity_m": 3e-4}})",
                     matrix(t * a * back), matrix(t * b), matrix(c * back));
}

std::string modal() {
  std::string poles, residues;
  for (const Oscillator& o : kMachine) {
    const double w = 2 * std::numbers::pi * o.hertz, wd = w * std::sqrt(1 - o.damping * o.damping);
    poles += fmt::format("{}[{:.17g}, {:.17g}]", poles.empty() ? "" : ", ", -o.damping * w, wd);
    residues += fmt::format("{}[0, {:.17g}]", residues.empty() ? "" : ", ", -o.per_newton / (2 * wd));
  }
  return fmt::format(R"({{"schema": "whirl.plant/1", "poles": [{}], "residues": [{}], "eccentricity_m": 3e-4,
                         "eccentricity_phase_rad": 0.5}})",
                     poles, residues);
}

LinearPlant plant_of(const std::string& text) { return read_plant(io::parse_json(text, "plant.json"), "plant.json"); }

TEST(PlantFileProperty, MatricesInAnyStatesAndPolesGiveTheSameMachine) {
  for (const std::string& text : {state_space(1), state_space(2), state_space(3), modal()}) {
    EXPECT_TRUE(is_plant(io::parse_json(text, "plant.json")));
    const LinearPlant p = plant_of(text);
    EXPECT_NEAR(p.rotor.natural_frequency() / (2 * std::numbers::pi), 11, 1e-6);
    EXPECT_NEAR(p.rotor.damping_ratio(), 0.01, 1e-8);
    EXPECT_NEAR(p.rotor.gain, 0.5, 1e-7);
    EXPECT_EQ(p.rotor.k2, 0);
    EXPECT_NEAR(std::abs(p.rotor.eps), 3e-4, 1e-15);
    ASSERT_EQ(p.structure.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      const bool first = p.structure[i].frequency < 80;
      const Oscillator& o = kMachine[first ? 1 : 2];
      EXPECT_NEAR(p.structure[i].frequency, o.hertz, 1e-6);
      EXPECT_NEAR(p.structure[i].damping_ratio, o.damping, 1e-7);
      EXPECT_NEAR(p.structure[i].participation * p.structure[i].sensor_sign, o.per_newton / 0.5, 1e-7);
    }
  }
}

TEST(PlantFileProperty, APoleGivenInTwoPartsIsOneMode) {
  const auto with = [](const char* rest) {
    return plant_of(fmt::format(R"({{"schema": "whirl.plant/1", "eccentricity_m": 3e-4, {}}})", rest));
  };
  const LinearPlant whole = with(R"("poles": [[-1, 70]], "residues": [[0, -0.004]])"),
                    parts = with(R"("poles": [[-1, 70], [-1, 70]], "residues": [[0, -0.001], [0, -0.003]])");
  EXPECT_EQ(parts.structure.size(), 0u);
  EXPECT_NEAR(parts.rotor.gain, whole.rotor.gain, 1e-12 * whole.rotor.gain);
}

TEST(PlantFileE2e, ADesignOnAPlantFileIsCertified) {
  const LinearPlant p = plant_of(modal());
  IdentifiedModel model;
  model.rotor = p.rotor;
  DesignOptions o;
  o.law = "pd";
  o.estimator = "kfe";
  o.hardware = data_sheet({});
  o.hardware.modes = p.structure;
  o.evaluations = 16;
  const ControllerDesign d = design(model, o);
  EXPECT_EQ(d.margins.at("certified"), 1);
  EXPECT_LT(d.margins.at("peak_m"), 60e-6);
}

TEST(PlantFile, WhatIsNoPlantIsRefusedWithItsPlace) {
  const auto refused = [](const std::string& text, const char* place) {
    try {
      plant_of(text);
      ADD_FAILURE() << "taken: " << text;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(place), std::string::npos) << e.what();
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    }
  };
  const auto with = [](const std::string& rest) {
    return R"({"schema": "whirl.plant/1", "eccentricity_m": 3e-4)" + rest + "}";
  };
  refused(R"({"schema": "whirl.model/2"})", "whirl.plant");
  refused(with(""), "either A, B, C or poles");
  refused(with(R"(, "A": [[0, 1], [-4000]], "B": [0, 1], "C": [1, 0])"), "$.A[1]");
  refused(with(R"(, "A": [[0, 1], [-4000, -1]], "B": [0, 1, 2], "C": [1, 0])"), "$.B");
  refused(with(R"(, "A": [[0, 1], [-4000, -1]], "B": [0, 1], "C": [[1, 0], [0, 1]])"), "$.C");
  refused(with(R"(, "A": [[0, 1], [-4000, -1]], "B": [0, 1], "C": [1, 0], "D": [0.1])"), "$.D");
  refused(with(R"(, "A": [[0, 1], [-4000, 1]], "B": [0, 1], "C": [1, 0])"), "not stable");
  refused(with(R"(, "A": [[0, 1], [-4000, -1]], "B": [0, 1], "C": [0, 1])"), "residue");
  refused(with(R"(, "A": [[0, 1], [-4000, -1]], "B": [0, -1], "C": [1, 0])"), "modal mass");
  refused(with(R"(, "A": [[0, 1], [-4000, -1]], "B": [0, 0], "C": [1, 0])"), "moves nothing");
  refused(with(R"(, "A": [[0, 1, 0], [-4000, -1, 1], [0, 0, -9]], "B": [0, 0, 1], "C": [1, 0, 0])"), "real pole");
  refused(with(R"(, "A": [[0, 1, 0, 0], [-4000, -1, 1, 0], [0, 0, 0, 1], [0, 0, -4000, -1]], "B": [0, 0, 0, 1],
               "C": [1, 0, 0, 0])"),
          "$");
  refused(with(R"(, "poles": [[-1, 70], [-1, 300]], "residues": [[0, -0.003]])"), "$.residues");
  refused(with(R"(, "poles": [[-1, -70]], "residues": [[0, -0.003]])"), "$.poles[0]");
  refused(with(R"(, "poles": [[-1, 70]], "residues": [[-0.003, 0]])"), "residue");
  refused(R"({"schema": "whirl.plant/1", "poles": [[-1, 70]], "residues": [[0, -0.003]]})", "eccentricity_m");
  // A key that is not read would be lost: a phase in degrees, a matrix beside poles.
  refused(with(R"(, "poles": [[-1, 70]], "residues": [[0, -0.003]], "eccentricity_phase_deg": 30)"),
          "eccentricity_phase_deg");
  refused(with(R"(, "poles": [[-1, 70]], "residues": [[0, -0.003]], "B": [0, 1])"), "key 'B'");
  refused(with(R"(, "poles": [[-1, 70]], "residues": [[0, -0.003]], "eccentricity_phase_rad": 30)"),
          "$.eccentricity_phase_rad");
  refused(with(R"(, "poles": [[-1, 70]], "residues": [[0, 0]])"), "residue 0");
  refused(R"({"schema": "whirl.plant/1", "poles": [[-1, 70]], "residues": [[0, -0.003]], "eccentricity_m": -1})",
          "$.eccentricity_m");
}

}  // namespace
}  // namespace whirl::tuning
