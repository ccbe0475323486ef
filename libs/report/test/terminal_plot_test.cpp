#include "whirl/report/terminal_plot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "example_figures.hpp"
#include "whirl/core/error.hpp"
#include "whirl/report/table.hpp"

namespace whirl::report {
namespace {

using ::testing::HasSubstr;

TEST(ReportTerminalPlot, ADiagonalInBraille) {
  Figure figure;
  Panel& p = figure.panel("", {"t", {"s", 1}}, {"x", {"m", 1}, Scale::linear, 0, 1});
  p.line("", Eigen::Vector2d(0, 1), Eigen::Vector2d(0, 1));
  const std::string text = to_terminal(figure, {.columns = 40, .rows = 4});
  std::istringstream lines(text);
  std::string header, top, row, bottom;
  std::getline(lines, header);
  std::getline(lines, top);
  std::getline(lines, row);
  std::getline(lines, row);
  std::getline(lines, bottom);
  EXPECT_EQ(header, "x [m]");
  // The line starts in the lowest row at the left and ends in the upper row at the right.
  EXPECT_THAT(bottom, HasSubstr("┤⣀"));
  EXPECT_EQ(top.substr(top.size() - 3), "⠉");
  EXPECT_THAT(text, HasSubstr("t [s]"));
}

TEST(ReportTerminalPlot, FitsTheTerminalAndKeepsThePeak) {
  Figure figure = testing::long_trace();
  figure.panels[0].series[0].y(7) = 0.02;  // a single sample far above all others
  const std::string text = to_terminal(figure, {.columns = 80, .rows = 12});
  std::istringstream lines(text);
  std::string line;
  int dotted_above = 0;
  for (int i = 0; std::getline(lines, line); ++i) {
    EXPECT_LE(display_width(line), 80U) << line;
    if (i == 3 && line.find('\xE2') != std::string::npos) ++dotted_above;
  }
  EXPECT_EQ(dotted_above, 1);
  EXPECT_THAT(text, HasSubstr("displacement [mm]"));
}

TEST(ReportTerminalPlot, NamesWhatItLeavesOut) {
  const std::string text = to_terminal(testing::one_of_each(), {.color = true});
  EXPECT_THAT(text, HasSubstr("[panel 'Projection' is not drawn in a terminal]"));
  EXPECT_THAT(text, HasSubstr("[panel 'Bars' is not drawn in a terminal]"));
  EXPECT_THAT(text, HasSubstr("\x1b[34m"));
  EXPECT_THROW((void)to_terminal(testing::long_trace(), {.columns = 10}), Error);
}

TEST(ReportTerminalPlot, AHeatMapIsDrawnInShadesWhereItsValuesAre) {
  Figure figure;
  HeatMap map;
  map.values = Eigen::MatrixXd::Zero(40, 40);
  map.values.bottomRightCorner(20, 20).setOnes();  // the last rows are the highest y
  map.x_high = map.y_high = 39;
  figure.panel("", {"x", {}}, {"y", {}}).heat_maps.push_back(map);
  const std::string text = to_terminal(figure, {.columns = 60, .rows = 8});
  std::vector<std::string> rows;
  for (std::size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
    rows.push_back(text.substr(at, end - at));
  std::vector<std::size_t> dark;
  for (std::size_t r = 1; r < 9; ++r) dark.push_back(rows[r].find("█"));
  for (std::size_t r = 0; r < 8; ++r) EXPECT_EQ(dark[r] != std::string::npos, r < 4) << r << "\n" << text;
}

}  // namespace
}  // namespace whirl::report
