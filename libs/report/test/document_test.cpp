#include "whirl/report/document.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <pugixml.hpp>

#include "example_figures.hpp"
#include "whirl/core/error.hpp"

namespace whirl::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

IdentifiedModel example_model() {
  IdentifiedModel model;
  model.states = {"X1", "X2", "X3", "X4", "X5", "X6"};
  model.rotor = RotorModel{};
  model.equations = {{"X2'",
                      {{"X1", Estimate::from_sd(-36125.3, 12.3), "1/s^2"},
                       {"X1*(X1^2 + X3^2)", Estimate::from_sd(-1.8492e9, 4e5), "1/(m^2 s^2)"},
                       {"X2", Estimate::from_sd(-5.667, 0.04), "1/s"},
                       {"X6^2*cos(X5)", Estimate::from_sd(5.1234e-5, 3e-8), "m"}}}};
  model.parameters = {{"k1", Estimate::from_sd(36125.3, 12.3)}};
  return model;
}

Document example() {
  Document d;
  d.title = "Run-down & <suppression>";
  d.subtitle = "simulated rig";
  d.section("Model").paragraph("x < y & z").equations(example_model()).table(coefficient_table(example_model()));
  d.section("Results").subsection("Displacement").figure(testing::long_trace(), "Displacement, \"zero to peak\".");
  d.figure(testing::one_of_each(), "All.").callout(Callout::Kind::disagrees, "Table 4", "61 % against 55 %");
  d.section("Origin").key_values({{"h", "1 ms"}}).code("whirl run <file>").bullets({"one & two"});
  d.provenance({"0.1.0", {"run.csv sha256:00ff"}, "law=tsmc", 7});
  return d;
}

TEST(ReportDocument, OneWellFormedPageWithNothingOutside) {
  const std::string html = to_html(example());
  pugi::xml_document page;
  const std::string xml = html.substr(html.find("<html"));
  const auto result = page.load_string(xml.c_str());
  ASSERT_TRUE(result) << result.description() << " near " << xml.substr(static_cast<std::size_t>(result.offset), 80);
  EXPECT_STREQ(page.child("html").child("head").child_value("title"), "Run-down & <suppression>");
  // Nothing is loaded: the only addresses are names of XML dialects and links inside the page.
  // One script, the page's own; without it everything is there.
  EXPECT_EQ(html.find("<script>"), html.rfind("<script"));
  EXPECT_THAT(html, Not(HasSubstr("fetch(")));
  EXPECT_THAT(html, Not(HasSubstr("<link")));
  EXPECT_THAT(html, Not(HasSubstr("src=")));
  EXPECT_THAT(html, Not(HasSubstr("url(")));
  EXPECT_THAT(html, Not(HasSubstr("@import")));
  for (const auto& anchor : page.select_nodes("//a")) {
    const std::string href = anchor.node().attribute("href").value();
    ASSERT_EQ(href.front(), '#');
    EXPECT_TRUE(page.select_node(("//*[@id='" + href.substr(1) + "']").c_str()));
  }
  for (const auto& image : page.select_nodes("//image")) {
    EXPECT_THAT(image.node().attribute("href").value(), ::testing::StartsWith("data:image/png;base64,"));
  }
  EXPECT_EQ(page.select_nodes("//nav/ol/li").size(), 3U);
  EXPECT_EQ(page.select_nodes("//nav/ol/li/ol/li").size(), 1U);
}

TEST(ReportDocument, NumbersFiguresTablesAndEquations) {
  const std::string html = to_html(example());
  EXPECT_THAT(html, HasSubstr("<b>Figure 1.</b> Displacement, &quot;zero to peak&quot;."));
  EXPECT_THAT(html, HasSubstr("<b>Figure 2.</b> All."));
  EXPECT_THAT(html, HasSubstr("Table 1. Coefficients"));
  EXPECT_THAT(html, HasSubstr("<span class=\"number\">(1)</span>"));
  EXPECT_THAT(html, HasSubstr("Does not agree: Table 4"));
}

TEST(ReportDocument, TwentyEightLongFiguresStayBelowFiveMegabytes) {
  Document d;
  for (int i = 0; i < 28; ++i) d.figure(testing::long_trace(), "trace");
  EXPECT_LT(to_html(d).size(), 5'000'000U);
}

TEST(ReportDocument, TextForATerminal) {
  const std::string text = to_text(example());
  EXPECT_THAT(text, HasSubstr("Model\n=====\n"));
  EXPECT_THAT(text, HasSubstr("Does not agree: Table 4\n61 % against 55 %\n"));
  EXPECT_THAT(text, HasSubstr("[Figure 1. Displacement"));
}

TEST(ReportDocument, SummaryShowsWarnings) {
  Summary summary;
  summary.trust = "Peak within 5 %.";
  summary.warn("few samples above the critical speed");
  const std::string html = to_html(Document{}.summary(summary, "Model"));
  EXPECT_THAT(html, HasSubstr("<b>Warning: Model</b>"));
  EXPECT_THAT(html, HasSubstr("few samples above"));
  EXPECT_TRUE(Document{}.summary(Summary{}, "Model").blocks.empty());
}

TEST(ReportDocument, WritesThePageWithDrawingsAndData) {
  const auto folder = std::filesystem::temp_directory_path() / "whirl_report_document_test";
  std::filesystem::create_directories(folder);
  write_html(example(), folder / "run.html", true);
  for (const char* name : {"run.html", "run_figures/figure_1.svg", "run_figures/figure_2.csv"}) {
    EXPECT_GT(std::filesystem::file_size(folder / name), 100U) << name;
  }
  std::filesystem::remove_all(folder);
  EXPECT_THROW(write_html(example(), folder / "absent" / "run.html"), Error);
}

TEST(ReportTable, RowsMustFit) {
  Table table;
  table.columns = {{"a", "", Align::left}, {"b", "m^2", Align::right}};
  table.add({"x", "1"});
  EXPECT_THROW(table.add({"x"}), Error);
  table.rows.push_back({"only one"});
  EXPECT_THROW((void)to_text(table), Error);
  EXPECT_THROW((void)to_html(table), Error);
}

TEST(ReportTable, TextIsAligned) {
  Table table;
  table.columns = {{"run", "", Align::left}, {"peak", "µm", Align::right}};
  table.add({"ẋ open", "1234"});
  table.add({"closed", "5"});
  EXPECT_EQ(to_text(table), "run     peak [µm]\n──────  ─────────\nẋ open       1234\nclosed          5\n");
  EXPECT_EQ(to_csv(table), "run,peak [µm]\nẋ open,1234\nclosed,5\n");
}

}  // namespace
}  // namespace whirl::report
