#include <gtest/gtest.h>

#include <cmath>

#include "made_files.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::testing {
namespace {

double number(const io::Json& json, std::initializer_list<const char*> path) {
  const io::Json* at = &json;
  for (const char* key : path) {
    at = at->find(key);
    if (at == nullptr) return NAN;
  }
  return at->get<double>() ? *at->get<double>() : NAN;
}

// The whole study with a small tuning budget: every file and figure is there, and the numbers reach the paper's.
TEST(StudyE2e, ReproduceWritesEveryFigureTableAndFile) {
  const std::filesystem::path folder = made_study();
  const std::string printed = slurp(folder / "stdout.txt");
  EXPECT_NE(printed.find("report: study/report.html"), std::string::npos) << printed;

  const std::string page = slurp(folder / "study/report.html");
  for (const char* figure : {"4",  "6",  "7",  "8",  "9a", "9b", "10a", "10b", "11", "12", "13", "17",
                             "18", "19", "20", "21", "22", "23", "24",  "25",  "26", "27", "28"}) {
    EXPECT_NE(page.find(std::string("Paper Fig. ") + figure), std::string::npos) << figure;
  }
  for (const char* text : {"Table 2", "Table 4", "3.25", "6.45", "<math", "<svg"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  for (const char* reference : {"src=\"http", "href=\"http", "@import", "<script src", "url(http"}) {
    EXPECT_EQ(page.find(reference), std::string::npos) << reference;
  }
  EXPECT_LT(page.size(), 5u << 20);

  for (const char* file : {"rig.toml", "stiffness.json", "frf.json", "modes.json", "model_weak_5g.json",
                           "model_paper_5g.json", "validation.json", "controller_tsmc.json", "controller_pd.json",
                           "run_5g_tsmc.json", "rundown_5g.csv", "runup_2.5g_20db.csv"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / ("study/" + std::string(file)))) << file;
  }

  // Table 4 of the paper: 61, 91, 96, 81.8, 92.7 %.
  const io::Json run = io::load_json(folder / "study/run_5g_tsmc.json");
  const double paper[4] = {0.61, 0.91, 0.96, 0.818};
  const io::Json::Array& segments = *run.find("segments")->get<io::Json::Array>();
  ASSERT_EQ(segments.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_GE(number(segments[i], {"suppression"}), paper[i]) << i;
  EXPECT_GE(number(run, {"whole", "suppression"}), 0.927);
  // Open loop: 1.242 mm balanced, 6.45 mm with 5 g, zero to peak.
  EXPECT_NEAR(number(run, {"whole", "open_peak"}), 6.45e-3, 0.02e-3);
  EXPECT_NEAR(number(io::load_json(folder / "study/run_balanced_tsmc.json"), {"whole", "open_peak"}), 1.242e-3,
              0.005e-3);
}

TEST(StudyE2e, ReproduceInterruptedLeavesNothing) {
  const Folder folder;
  const std::string command = "cd '" + (folder / "").string() + "' && timeout -s INT 3 '" + program() +
                              "' reproduce --out study --evaluations 50000 --quiet >/dev/null 2>&1";
  EXPECT_NE(std::system(command.c_str()), 0);
  EXPECT_FALSE(std::filesystem::exists(folder / "study"));
}

// The chain of subcommands on files gives a model whose JSON holds the contract's keys.
TEST(ChainE2e, RecordIdentifyValidateByFiles) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rig record --added-mass-g 5 --out down.csv --truth clean.csv").exit_code, 0);
  const Outcome identified = folder.whirl("identify down.csv --out model.json --json --quiet");
  ASSERT_EQ(identified.exit_code, 0) << identified.err;
  const io::Json printed = io::parse_json(identified.out, "stdout");
  for (const char* name : {"k1", "k2", "c", "e", "e_phase"}) {
    EXPECT_TRUE(std::isfinite(number(printed, {"parameters", name, "value"}))) << name;
    const io::Json* interval = printed.find("parameters")->find(name)->find("ci95");
    ASSERT_NE(interval, nullptr) << name;
  }
  EXPECT_NE(printed.find("equations"), nullptr);
  EXPECT_TRUE(std::isfinite(number(printed, {"summary", "chi_square"})));
  EXPECT_NE(printed.find("summary")->find("trust"), nullptr);
  // K1/m = 5667 1/s^2 is the mean of both axes of the default rig.
  EXPECT_NEAR(number(printed, {"parameters", "k1", "value"}), 8500 / 1.5, 0.01 * 8500 / 1.5);

  const Outcome valid = folder.whirl("validate model.json down.csv --clean clean.csv --json --quiet");
  ASSERT_EQ(valid.exit_code, 0) << valid.err;
  const io::Json validation = io::parse_json(valid.out, "stdout");
  const io::Json& run = validation.find("runs")->get<io::Json::Array>()->front();
  EXPECT_LT(number(run, {"rmse_x"}), 0.05e-3);
  EXPECT_LT(number(run, {"nrmse"}), 0.05);
}

TEST(RigFileE2e, PrintedParametersReadBackToTheSameRecord) {
  const Folder folder;
  const Outcome printed = folder.whirl("rig parameters");
  ASSERT_EQ(printed.exit_code, 0);
  folder.write("rig.toml", printed.out);
  ASSERT_EQ(folder.whirl("rig record --out a.csv").exit_code, 0);
  ASSERT_EQ(folder.whirl("rig record --rig rig.toml --out b.csv").exit_code, 0) << slurp(folder / "stderr.txt");
  const Recording a = io::read_csv(folder / "a.csv"), b = io::read_csv(folder / "b.csv");
  ASSERT_EQ(a.size(), b.size());
  // Decimal text of a parameter may differ in its last bit; the records agree to a converter step.
  EXPECT_LT((a["x"] - b["x"]).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace whirl::testing
