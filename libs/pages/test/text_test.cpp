// What the program prints of models and modes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "whirl/pages/text/design.hpp"
#include "whirl/pages/text/identification.hpp"
#include "whirl/pages/text/modes.hpp"

namespace whirl::pages {
namespace {

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Before the table of coefficients.
long equations(const std::string& text) {
  return std::count(text.begin(), text.begin() + static_cast<long>(text.find("Coefficients")), '=');
}

IdentifiedModel oscillator() {
  IdentifiedModel model;
  model.method = "sindy";
  model.states = {"x", "v"};
  model.equations = {{"x'", {{"v", Estimate::from_sd(1, 0.01), ""}}},
                     {"v'", {{"x", Estimate::from_sd(-4, 0.02), ""}, {"x^3", Estimate::from_sd(-2, 0.1), ""}}}};
  model.timing.push_back({"u", Hold::zero, Estimate::from_sd(0.013, 1e-4)});
  return model;
}

TEST(IdentificationText, EveryEquationAndTimingIsPrintedWithItsInterval) {
  const std::string text = to_text(oscillator());
  EXPECT_TRUE(holds(text, "method: sindy"));
  EXPECT_EQ(equations(text), 2);
  EXPECT_TRUE(holds(text, "x³"));
  EXPECT_TRUE(holds(text, "hold zero, dead time"));
  EXPECT_TRUE(holds(text, "0.013"));
}

TEST(IdentificationText, AnEquationThatOnlyDefinesARateIsLeftOut) {
  IdentifiedModel model = oscillator();
  model.states = {"x", "x'"};
  model.equations[0] = {"x'", {{"x'", Estimate::from_sd(1, 0), ""}}};
  model.equations[1].lhs = "x''";
  EXPECT_EQ(equations(to_text(model)), 1);
}

TEST(IdentificationText, EvidenceSaysWhatIsNotKnown) {
  identification::Evidence evidence;
  Summary summary;
  EXPECT_TRUE(holds(to_text(evidence, summary), "not known"));
  summary.chi_square = 1.02;
  evidence.held_out = {"the last 30 %", {{"x", 0.02, 0.1, 0.01}}, 0, {}, "too short"};
  const std::string text = to_text(evidence, summary, {{"a bow or runout", "e differs", "a slow roll"}});
  EXPECT_TRUE(holds(text, "1.02"));
  EXPECT_TRUE(holds(text, "no prediction, too short"));
  EXPECT_TRUE(holds(text, "to decide: a slow roll"));
}

TEST(IdentificationText, AnUnbalanceThatWasFittedToTheRunIsPrinted) {
  identification::ValidationReport report;
  report.runs.emplace_back();
  report.runs[0].rotor = identification::Validation{};
  report.runs[0].rotor->eps = {0, 3e-4};
  const std::size_t plain = validation_table(report).columns.size();
  report.runs[0].rotor->unbalance = identification::UnbalanceSource::refitted;
  const report::Table table = validation_table(report);
  ASSERT_EQ(table.columns.size(), plain + 2);
  EXPECT_EQ(table.rows[0][8], "300");
  EXPECT_EQ(table.rows[0][9], "90.0");
}

// A machine of micrometres is told with as many digits as one of millimetres; what was not evaluated has no number.
TEST(IdentificationText, AValidationHasSignificantDigitsAndADashWhereNothingWasEvaluated) {
  identification::ValidationReport report;
  report.runs.resize(2);
  for (identification::ValidationRun& run : report.runs) run.rotor = identification::Validation{};
  identification::Validation& v = *report.runs[0].rotor;
  v.rmse_x = 3.0213e-7, v.rmse_y = 2.4e-5, v.band_x = 5.8e-7, v.nrmse = 0.000123;
  const report::Table table = validation_table(report);
  EXPECT_EQ(table.rows[0][1], "0.0003021");
  EXPECT_EQ(table.rows[0][2], "0.024");
  EXPECT_EQ(table.rows[0][3], "0.00058");
  EXPECT_EQ(table.rows[0][7], "0.0123");
  for (const std::size_t column : {1u, 2u, 3u, 4u, 7u}) EXPECT_EQ(table.rows[1][column], "-") << column;
}

TEST(IdentificationText, AValidationThatTellsNothingOfTheWholeRunShowsADash) {
  identification::ValidationReport report;
  identification::ValidationRun run;
  run.source = "test.csv";
  run.general = {"test.csv", {{"x", 0.5, 0.9, 0.01}}, 1.5, {{"x", 0.012, 0.02, 0.01}}, ""};
  run.band = {0.02};
  run.band_whole = {std::nan("")};
  report.runs = {run};
  const report::Table table = validation_table(report);
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.rows[0].size(), table.columns.size());
  EXPECT_EQ(table.rows[0][4], "-");
  report.runs[0].band_whole = {0.03};
  EXPECT_EQ(validation_table(report).rows[0][4], "0.03");
}

ModalModel two_modes() {
  ModalModel modes;
  modes.band_low = 5;
  modes.band_high = 50;
  for (const double frequency : {10.0, 70.0}) {
    Mode m;
    m.frequency = Estimate::from_sd(frequency, 0.01);
    m.damping = {0.01, std::nan(""), 0, 0};
    m.residues = Eigen::VectorXcd::Ones(1);
    modes.modes.push_back(m);
  }
  modes.responses = {"1:+Z"};
  modes.references = {"1:+Z"};
  return modes;
}

TEST(ModesText, AModeOutsideTheBandIsCalledSoAndAnUnknownDeviationIsADash) {
  const report::Table table = modes_table(two_modes());
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0][0], "1");
  EXPECT_EQ(table.rows[0][2], "0.01");
  EXPECT_EQ(table.rows[0][4], "-");
  EXPECT_EQ(table.rows[1][0], "outside");
}

TEST(ModesText, ModesUnderOperationAreCountedAndTonesAreNot) {
  modal::OperationalModes found;
  modal::OperationalMode mode;
  mode.frequency = Estimate::from_sd(12, 0.01);
  mode.damping = Estimate::from_sd(0.01, 1e-3);
  mode.shape = Eigen::VectorXcd::Ones(2);
  found.modes = {mode, mode};
  modal::Tone tone;
  tone.frequency = 50;
  found.tones = {tone};
  const report::Table table = modes_table(found);
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_EQ(table.rows[1][0], "2");
  EXPECT_EQ(table.rows[2][0], "harmonic");
}

// The table says of each requirement whether it is met, by the limits of the verdict; what is not stated has no row.
TEST(DesignText, EachRequirementIsMetOrNotByItsLimit) {
  ControllerDesign design;
  design.law = "tsmc";
  design.estimator = "kfe";
  design.sample_time = 1e-3;
  design.margins = {
      {"gain_margin", 1.05},      {"delay_margin_s", 4e-3}, {"peak_sensitivity", 4.2}, {"phase_margin_deg", 13.8},
      {"nominal_peak_m", 4e-6},   {"peak_m", 7e-3},         {"open_peak_m", 6.6e-3},   {"kappa", -0.5},
      {"disturbance_bound", 1.5}, {"certified", 0}};
  const report::Table table = pages::requirements_table(design);
  const auto row = [&](const std::string& name) {
    for (const auto& r : table.rows)
      if (r[0].starts_with(name)) return r;
    return std::vector<std::string>(5);
  };
  EXPECT_EQ(row("gain of the loop, up to")[1], "1.05 times");
  EXPECT_EQ(row("gain of the loop, up to")[2], "at least 1.33 times");
  EXPECT_EQ(row("gain of the loop, up to")[3], "NO");
  EXPECT_EQ(row("further delay"),
            (std::vector<std::string>{"further delay", "4 ms", "at least 0.5 ms", "yes", "half a tick of the loop"}));
  EXPECT_EQ(row("phase margin")[2], "at least 14.4 deg");
  EXPECT_EQ(row("phase margin")[3], "NO");
  EXPECT_EQ(row("peak sensitivity")[1], "4.2, zone C");
  EXPECT_EQ(row("peak sensitivity")[3], "NO");
  EXPECT_EQ(row("vibration, nominal run")[3], "yes");
  EXPECT_EQ(row("vibration, 95 % of machines")[3], "NO");
  for (const auto& r : table.rows) EXPECT_FALSE(r[4].empty()) << r[0];
  EXPECT_EQ(row("switching gain")[1], "1 m/s^2");
  EXPECT_EQ(row("switching gain")[3], "NO");
  EXPECT_EQ(row("certified")[3], "NO");
  EXPECT_EQ(row("time to reach")[0], "");
}

}  // namespace
}  // namespace whirl::pages
