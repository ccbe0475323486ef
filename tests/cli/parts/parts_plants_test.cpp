// What design, margins, robustness and compare use of a model is in the plants that they run.
#include <deque>

#include "part_numbers.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/rig/parameters.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::testing {
namespace {

using identification::Consumer;
using identification::ModelPart;
using identification::Treatment;

const std::vector<ModelPart> kOfPlants{ModelPart::cubic_spring, ModelPart::unequal_axes, ModelPart::further_forces,
                                       ModelPart::drifts};

Answer designed(const Folder& folder, const std::string& model, const std::string& out) {
  return ask(folder,
             fmt::format("design {} --mass-kg 1.5 --law pd --evaluations 1 --no-feedforward --out {}", model, out));
}

// Without control the plant of a design moves as `simulate` says over its profile.
TEST(PartsUsedReference, TheOpenLoopOfADesignIsASimulationOfTheWholeModel) {
  const AngleSignal angle = rotor::angle_signal(rig::RigParameters::default_profile().without_ripple(), 5e-4);
  const Folder folder;
  const IdentifiedModel without = rotor_with(plain_machine());
  io::save(folder / "without.json", without);
  const double plain = designed(folder, "without.json", "c.json").read().at("margins").at("open_peak_m").number();
  for (const ModelPart part : kOfPlants) {
    ASSERT_EQ(use_of(Consumer::design, part).treatment, Treatment::used) << to_string(part);
    ASSERT_EQ(use_of(Consumer::compare, part).treatment, Treatment::used) << to_string(part);
    IdentifiedModel with = model_with(part);
    if (part == ModelPart::unequal_axes) with.rotor->k1_conj = 800;  // moves the peak of x by 7 %
    io::save(folder / "with.json", with);
    const auto peak = [&](const IdentifiedModel& m) {
      return identification::simulate_rotor(m, angle).z.real().cwiseAbs().maxCoeff();
    };
    const double open = designed(folder, "with.json", "c.json").read().at("margins").at("open_peak_m").number();
    // The plant begins at rest and has the tolerances of its actuators: what the part changes is compared.
    EXPECT_NEAR(open / plain, peak(with) / peak(without), 0.04) << to_string(part);
    EXPECT_GT(std::abs(open / plain - 1), 0.01) << to_string(part);
  }
}

TEST(PartsUsedReference, TheRunoutFoundGoesIntoTheController) {
  const Folder folder;
  ASSERT_EQ(use_of(Consumer::design, ModelPart::runout).treatment, Treatment::used);
  io::save(folder / "with.json", model_with(ModelPart::runout));
  io::save(folder / "without.json", rotor_with(plain_machine()));
  const auto counted = [&](const char* model) {
    const Answer design = designed(folder, model, "c.json");
    double sum = 0;
    for (const auto& [name, value] : design.read().at("parameters").members())
      if (name.starts_with("runout_")) sum += std::pow(value.number(), 2);
    return sum;
  };
  // (a + b) and (a - b) of the amplitudes along the axes: twice the sum of the squares.
  EXPECT_NEAR(counted("with.json"), 2 * (std::norm(std::complex<double>(2e-5, -1e-5)) + 1e-10), 1e-13);
  EXPECT_EQ(counted("without.json"), 0);
}

TEST(PartsUsedReference, MarginsAndRobustnessAreThoseOfPlantsWithThePart) {
  const Folder folder;
  io::save(folder / "without.json", rotor_with(plain_machine()));
  designed(folder, "without.json", "controller.json");
  std::deque<Answer> answers;  // what is read refers to them
  const auto margin = [&](const char* model) {
    answers.push_back(ask(folder, fmt::format("margins controller.json {} --mass-kg 1.5 --speeds 2", model)));
    return answers.back().read().at("plants").items();
  };
  const auto opens = [&](const char* model) {
    return ask(folder, fmt::format("robustness controller.json {} --mass-kg 1.5 --samples 8", model))
        .read()
        .at("samples")
        .at("open_peak")
        .numbers();
  };
  const double own = margin("without.json").front().at("worst").at("peak_sensitivity").number();
  const std::vector<double> plain = opens("without.json");
  for (const ModelPart part : kOfPlants) {
    ASSERT_EQ(use_of(Consumer::margins, part).treatment, Treatment::used) << to_string(part);
    ASSERT_EQ(use_of(Consumer::robustness, part).treatment, Treatment::used) << to_string(part);
    io::save(folder / "with.json", model_with(part));
    EXPECT_NE(margin("with.json").front().at("worst").at("peak_sensitivity").number(), own) << to_string(part);
    const std::vector<double> with = opens("with.json");
    ASSERT_EQ(with.size(), plain.size());
    double most = 0;
    for (std::size_t k = 0; k < with.size(); ++k) most = std::max(most, std::abs(with[k] / plain[k] - 1));
    EXPECT_GT(most, 0.02) << to_string(part);
  }
  // The draws follow the covariance.
  io::save(folder / "with.json", model_with(ModelPart::covariance));
  EXPECT_NE(opens("with.json"), plain);
  // Two readings of the records: margins of both.
  io::save(folder / "with.json", model_with(ModelPart::other_readings));
  const std::vector<io::JsonReader> plants = margin("with.json");
  ASSERT_EQ(plants.size(), 2u);
  EXPECT_EQ(plants[1].at("plant").text(), "per axis");
}

}  // namespace
}  // namespace whirl::testing
