#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "program.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/testing/ambient.hpp"
#include "whirl/testing/modal/shaker_records.hpp"
#include "whirl/testing/modal/windowed_random.hpp"

namespace whirl::testing {
namespace {

TEST(ModesE2e, HammerTestOfTheRigGivesItsFiveModesWithAndWithoutWindow) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rig hammer --out blow_").exit_code, 0);
  for (const char* window : {"100", "1"}) {
    const Outcome frf =
        folder.whirl(std::string("frf blow_*.csv --out frf.json --figure frf.svg --window-end-percent ") + window);
    ASSERT_EQ(frf.exit_code, 0) << frf.err;
    const Outcome modes = folder.whirl(
        "modes frf.json --out modes.json --figure stabilisation.svg --figure fit_frf.svg --figure shapes.svg");
    ASSERT_EQ(modes.exit_code, 0) << modes.err;
    const ModalModel model = io::load<ModalModel>(folder / "modes.json");
    // The eigenvalues of K, its split, the cross stiffness and m, then the frequencies in `whirl rig parameters`. The
    // doublet is hardening, but the modes are those of small motion.
    for (const double f : {11.8570, 12.1032, 46.0, 128.0, 310.0}) {
      const double above = f < 20 ? 0.0002 : 0.0005;
      bool found = false;
      for (const Mode& mode : model.modes) {
        const double error = mode.frequency.value / f - 1;
        found = found || std::abs(error) < above;
      }
      EXPECT_TRUE(found) << f << " Hz, window " << window << "\n" << modes.out;
    }
    for (const char* figure : {"frf.svg", "stabilisation.svg", "fit_frf.svg", "shapes.svg"})
      EXPECT_NE(slurp(folder / figure).find("<svg"), std::string::npos);
  }
}

TEST(ModesE2e, HannWindowOfAnAnalyserIsFoundOrStatedOrLeft) {
  const Folder folder;
  const RandomTest test = make_random_test({.seed = 8301});
  io::save(folder / "frf.json", test.frf);
  const Outcome found = folder.whirl("modes frf.json --out modes.json --figure fit_frf.svg --page modes.html");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_NE((found.out + found.err).find("Hann window"), std::string::npos) << found.out << found.err;
  EXPECT_EQ(io::load<ModalModel>(folder / "modes.json").modes.size(), test.frequency.size());
  // The page asks for the same lines when poles are chosen by hand.
  EXPECT_NE(slurp(folder / "modes.html").find("--window hann"), std::string::npos);
  ASSERT_EQ(folder.whirl("modes frf.json --window hann --out stated.json").exit_code, 0);
  EXPECT_EQ(io::load<ModalModel>(folder / "stated.json").modes.size(), test.frequency.size());
  ASSERT_EQ(folder.whirl("modes frf.json --window none --out left.json").exit_code, 0);
  EXPECT_GT(io::load<ModalModel>(folder / "left.json").modes.size(), test.frequency.size());
  EXPECT_EQ(folder.whirl("modes frf.json --window hann --window-end-percent 5").exit_code, 2);
}

TEST(ModesE2e, ShakersAreToldFromBlowsAndGiveModesWithoutAWindow) {
  const Folder folder;
  const ShakerRecords test = make_shaker_records({.forces = 2, .seconds = 40});
  io::write_csv(folder / "shaker.csv", test.records.front());
  const Outcome frf = folder.whirl("frf shaker.csv --out frf.json --figure frf.svg");
  ASSERT_EQ(frf.exit_code, 0) << frf.err;
  EXPECT_NE(frf.out.find("2 forces that act all the time"), std::string::npos) << frf.out;
  const Outcome modes = folder.whirl("modes frf.json --out modes.json");
  ASSERT_EQ(modes.exit_code, 0) << modes.err;
  EXPECT_EQ(modes.err.find("leakage"), std::string::npos) << modes.err;
  const ModalModel model = io::load<ModalModel>(folder / "modes.json");
  ASSERT_EQ(model.modes.size(), test.frequency.size()) << modes.out;
  for (std::size_t i = 0; i < model.modes.size(); ++i)
    EXPECT_NEAR(model.modes[i].frequency.value / test.frequency[i], 1, 1e-4);
  EXPECT_EQ(folder.whirl("frf shaker.csv --estimator h2").exit_code, 2);
  EXPECT_EQ(folder.whirl("frf shaker.csv --excitation hammer --force-channel force_1 force_2").exit_code, 2);
}

// K = 8500 N/m (1 +- 0.2 %) over 1.5 kg, C = 1.5 N s/m (1 +- 10 %): 11.969 and 11.993 Hz, a seventh of their half-power
// width apart.
TEST(ModesE2e, DoubletTwoTenthsOfAPercentApartIsResolvedFromTwoReferences) {
  const Folder folder;
  folder.write("split.toml", "[rotor]\nstiffness_split_percent = 0.2\ncross_stiffness_N_m = 0\ncubic_N_m3 = 0\n");
  for (const std::string axis : {"x", "y"}) {
    ASSERT_EQ(
        folder.whirl("rig hammer --rig split.toml --seed 3 --out hit_" + axis + (axis == "x" ? "" : " --angle-deg 90"))
            .exit_code,
        0);
    const Outcome frf = folder.whirl("frf hit_" + axis + "*.csv --reference acc_" + axis + " --out " + axis + ".json");
    ASSERT_EQ(frf.exit_code, 0) << frf.err;
  }
  const Outcome modes = folder.whirl("modes x.json y.json --band-high-hz 30 --out modes.json");
  ASSERT_EQ(modes.exit_code, 0) << modes.err;
  EXPECT_EQ(modes.err.find("reciprocity"), std::string::npos) << "the cross responses are noise: " << modes.err;
  const ModalModel model = io::load<ModalModel>(folder / "modes.json");
  ASSERT_EQ(model.modes.size(), 2u) << modes.out;
  const double k[] = {8500 * 0.998, 8500 * 1.002}, c[] = {1.5 * 0.9, 1.5 * 1.1};
  for (int i = 0; i < 2; ++i) {
    const double omega = std::sqrt(k[i] / 1.5);
    const Mode& mode = model.modes[static_cast<std::size_t>(i)];
    EXPECT_NEAR(mode.frequency.value, omega / (2 * std::numbers::pi), 3e-4 * 12);
    EXPECT_NEAR(mode.damping.value, c[i] / (2 * 1.5 * omega), 0.05 * 0.0066);
  }
  EXPECT_EQ(folder.whirl("modes x.json x.json").exit_code, 2) << "one point twice";
}

TEST(ModesE2e, RigBuiltFromTheModesRingsLikeTheOneThatWasHit) {
  const Folder folder;
  const auto hammer = [&](const std::string& rig, const std::string& name) {
    EXPECT_EQ(folder.whirl("rig hammer " + rig + " --out " + name).exit_code, 0);
    EXPECT_EQ(folder.whirl("frf " + name + "*.csv --out frf.json").exit_code, 0);
    EXPECT_EQ(folder.whirl("modes frf.json --out " + name + ".json").exit_code, 0);
    return io::load<ModalModel>(folder / (name + ".json"));
  };
  const ModalModel first = hammer("", "a");
  // The distortion of the rotor's stiffness, at three times its frequency, is no mode; the pair is that of small
  // motion.
  EXPECT_EQ(std::count_if(first.modes.begin(), first.modes.end(),
                          [&](const Mode& m) { return m.frequency.value < first.band_high; }),
            5);
  EXPECT_TRUE(first.modes.at(1).frequency.covers(12.1032)) << first.modes[1].frequency.value;
  ASSERT_EQ(folder.whirl("rig parameters --modes a.json --channel 1 > again.toml && echo written").exit_code, 0);
  const ModalModel second = hammer("--rig again.toml", "b");
  for (std::size_t k = 2; k < 5; ++k) {  // the modes above the pair, which keeps the split of the default rig
    const Mode& expected = first.modes.at(k);
    const auto nearest = std::min_element(second.modes.begin(), second.modes.end(), [&](const Mode& a, const Mode& b) {
      return std::abs(a.frequency.value - expected.frequency.value) <
             std::abs(b.frequency.value - expected.frequency.value);
    });
    EXPECT_NEAR(nearest->frequency.value, expected.frequency.value, 5e-4 * expected.frequency.value);
    EXPECT_NEAR(std::abs(nearest->residues[0]), std::abs(expected.residues[0]), 0.05 * std::abs(expected.residues[0]));
  }
  const Outcome against = folder.whirl("modes frf.json --compare a.json");
  EXPECT_EQ(against.exit_code, 0) << against.err;
  EXPECT_NE(against.out.find("Against a.json"), std::string::npos) << against.out;
  // What is written is read: the same responses, terms of the amplitude included.
  EXPECT_FALSE(first.amplitude.empty());
  io::save(folder / "same.json", first);
  EXPECT_EQ(slurp(folder / "same.json"), slurp(folder / "a.json"));
  EXPECT_EQ(folder.whirl("rig parameters --modes a.json --channel 9").exit_code, 2);
}

TEST(ModesE2e, AmbientModesAreWrittenWhereTheyWereAskedFor) {
  const Folder folder;
  io::write_csv(folder / "ambient.csv", make_ambient({.duration = 120, .structure = 2, .seed = 9}).recording);
  for (const std::string command :
       {"modes ambient.csv --method fdd", "oma ambient.csv --method efdd", "oma ambient.csv"}) {
    const Outcome run = folder.whirl(command + " --out f.json --figure f.svg");
    ASSERT_EQ(run.exit_code, 0) << command << run.err;
    EXPECT_NE(slurp(folder / "f.json").find("\"frequency\""), std::string::npos) << command;
    EXPECT_NE(slurp(folder / "f.svg").find("<svg"), std::string::npos) << command;
    std::filesystem::remove(folder / "f.json");
    std::filesystem::remove(folder / "f.svg");
    const Outcome refused = folder.whirl(command + " --out f.uff");
    EXPECT_EQ(refused.exit_code, 2) << command;
    EXPECT_FALSE(std::filesystem::exists(folder / "f.uff")) << command;
  }
  for (const char* wrong :
       {"oma ambient.csv --orders -1", "oma ambient.csv --method orders --orders 0", "oma ambient.csv --orders 21"}) {
    const Outcome refused = folder.whirl(wrong);
    EXPECT_EQ(refused.exit_code, 2) << wrong;
    EXPECT_NE(refused.err.find("orders"), std::string::npos) << wrong << refused.err;
  }
  const Outcome oma = folder.whirl("oma ambient.csv");
  EXPECT_NE(oma.out.find("harmonic"), std::string::npos) << oma.out;
  EXPECT_NE(oma.err.find("28 Hz is a tone"), std::string::npos) << oma.err;
}

}  // namespace
}  // namespace whirl::testing
