// Each part that a step leaves out is named in its answer, each that it refuses in its error; docs/parts.md says which.
#include "part_numbers.hpp"

namespace whirl::testing {
namespace {

using identification::Consumer;
using identification::ModelPart;
using identification::Treatment;

const std::vector<ModelPart> kOfOtherModels{ModelPart::tilting_disc, ModelPart::equations, ModelPart::map,
                                            ModelPart::hidden_states, ModelPart::input_timing};

/// The command of a step on model.json; controller.json stands beside it.
std::string command(Consumer consumer) {
  switch (consumer) {
    case Consumer::response:
      return "response model.json --from-rpm 540 --to-rpm 600";
    case Consumer::runup:
      return "runup model.json --from-rpm 300 --to-rpm 900";
    case Consumer::simulate:
      return "simulate model.json --from-rpm 300 --to-rpm 600 --seconds 2";
    case Consumer::validate:
      return "validate model.json run.csv";
    case Consumer::balance:
      return "balance model.json --mass-kg 1.5 --radius-mm 80 --speed-rpm 1800";
    case Consumer::design:
      return "design model.json --mass-kg 1.5 --law pd --evaluations 1";
    case Consumer::margins:
      return "margins controller.json model.json --mass-kg 1.5 --speeds 1";
    case Consumer::robustness:
      return "robustness controller.json model.json --mass-kg 1.5 --samples 8";
    case Consumer::compare:
      return "compare model.json --mass-kg 1.5 --laws pd:lpf --evaluations 1 --seeds 1 --no-matrix "
             "--balanced model.json";
    case Consumer::export_model:
      return "export python model.json --out exported";
    case Consumer::report:
      return "report model.json --out page.html";
  }
  return {};
}

/// Where the step takes one.
void write_controller(const Folder& folder, Consumer consumer) {
  if (consumer != Consumer::margins && consumer != Consumer::robustness) return;
  io::save(folder / "plain.json", rotor_with(plain_machine()));
  ask(folder, "design plain.json --mass-kg 1.5 --law pd --evaluations 1 --out controller.json");
}

class PartsLeftOut : public ::testing::TestWithParam<int> {};

// All parts that the step leaves out in one model: each has its finding with its sizes, and none that it uses has one.
TEST_P(PartsLeftOut, AreNamedWithTheirSizes) {
  const auto consumer = static_cast<Consumer>(GetParam());
  const Folder folder;
  IdentifiedModel model = rotor_with(plain_machine());
  std::vector<ModelPart> named;
  for (std::size_t p = 0; p < identification::kModelParts; ++p) {
    const auto part = static_cast<ModelPart>(p);
    const Treatment t = use_of(consumer, part).treatment;
    if (std::ranges::count(kOfOtherModels, part) > 0 || t == Treatment::used || t == Treatment::refused) continue;
    add_part(model, part);
    named.push_back(part);
  }
  io::save(folder / "model.json", model);
  write_record(folder, "model.json");
  write_controller(folder, consumer);
  const std::vector<Finding> found = findings(ask(folder, command(consumer)), FindingCode::part_left_out);
  for (const ModelPart part : named) {
    const Finding* f = left_out(found, part);
    ASSERT_NE(f, nullptr) << to_string(consumer) << ", " << to_string(part);
    EXPECT_EQ(f->consequence == Consequence::note, use_of(consumer, part).treatment == Treatment::noted)
        << to_string(part);
    const bool sized = part != ModelPart::covariance && part != ModelPart::drive;
    EXPECT_EQ(!f->amounts.empty(), sized) << to_string(part);
  }
  // The base model has no part at all; a cubic spring comes with the readings.
  for (const Finding& f : found) {
    const bool known = std::ranges::any_of(named, [&](ModelPart p) { return f.where == to_string(p); });
    EXPECT_TRUE(known || f.where == to_string(ModelPart::cubic_spring)) << to_string(consumer) << ": " << f.where;
  }
}

TEST_P(PartsLeftOut, AreRefusedInOneErrorThatSaysWhatToDo) {
  const auto consumer = static_cast<Consumer>(GetParam());
  const Folder folder;
  write_controller(folder, consumer);
  io::save(folder / "plain.json", rotor_with(plain_machine()));
  write_record(folder, "plain.json");
  for (std::size_t p = 0; p < identification::kModelParts; ++p) {
    const auto part = static_cast<ModelPart>(p);
    if (use_of(consumer, part).treatment != Treatment::refused) continue;
    io::save(folder / "model.json", model_with(part));
    const Outcome out = folder.whirl(command(consumer));
    EXPECT_EQ(out.exit_code, 2) << to_string(consumer) << ", " << to_string(part);
    const std::string said = fmt::format("{} does not take a model with ", to_string(consumer));
    EXPECT_NE(out.err.find(said), std::string::npos) << out.err;
    EXPECT_NE(out.err.find("model.json"), std::string::npos) << out.err;
  }
}
INSTANTIATE_TEST_SUITE_P(Each, PartsLeftOut, ::testing::Range(0, static_cast<int>(identification::kConsumers)),
                         [](const auto& p) { return std::string(to_string(static_cast<Consumer>(p.param))); });

// Parts of models that are no rotors.
TEST(PartsLeftOut, TheTimingOfInputsIsNamed) {
  const Folder folder;
  io::save(folder / "model.json", model_with(ModelPart::input_timing));
  for (const char* with : {"response model.json --from-rpm 60 --to-rpm 90 --input u --amplitude 1",
                           "export python model.json --out exported"}) {
    const std::vector<Finding> all = findings(ask(folder, with), FindingCode::part_left_out);
    const Finding* f = left_out(all, ModelPart::input_timing);
    ASSERT_NE(f, nullptr) << with;
    EXPECT_EQ(f->amount("u"), 0.03);
  }
}

// The controller of a model whose parts were left out says so again where it runs.
TEST(PartsLeftOut, ARunSaysWhatItsDesignLeftOut) {
  const Folder folder;
  IdentifiedModel model = rotor_with(plain_machine());
  add_part(model, ModelPart::twice_speed);
  io::save(folder / "model.json", model);
  ask(folder, "design model.json --mass-kg 1.5 --law pd --evaluations 1 --out controller.json");
  const std::vector<Finding> all = findings(ask(folder, "run controller.json"), FindingCode::part_left_out);
  ASSERT_NE(left_out(all, ModelPart::twice_speed), nullptr);
  EXPECT_EQ(left_out(all, ModelPart::twice_speed)->amount("e2_forward_re"), 1e-4);
}

TEST(PartsTable, TheDocumentHoldsTheTableOfTheProgram) {
  const std::string page = slurp(std::filesystem::path(source_dir()) / "docs/parts.md");
  const std::string begin = "<!-- table: begin -->\n", end = "<!-- table: end -->";
  const std::size_t from = page.find(begin), to = page.find(end);
  ASSERT_NE(from, std::string::npos);
  ASSERT_NE(to, std::string::npos);
  EXPECT_EQ(page.substr(from + begin.size(), to - from - begin.size()), identification::parts_table())
      << "print it anew: whirl_cli_test --gtest_filter=PartsTable.* shows the text";
}

}  // namespace
}  // namespace whirl::testing
