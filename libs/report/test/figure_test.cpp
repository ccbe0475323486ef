#include "whirl/report/figure.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <pugixml.hpp>
#include <sstream>

#include "example_figures.hpp"
#include "whirl/core/error.hpp"
#include "whirl/testing/paths.hpp"

namespace whirl::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

pugi::xml_document parse(const std::string& xml) {
  pugi::xml_document document;
  const auto result = document.load_string(xml.c_str());
  EXPECT_TRUE(result) << result.description() << " at " << result.offset;
  return document;
}

std::string drawing_error(const Figure& figure) {
  try {
    (void)to_svg(figure);
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

/// Compares with the stored drawing. WHIRL_UPDATE_GOLDEN=1 writes it anew; look at it before committing.
void expect_golden(const std::string& svg, const std::string& name) {
  const std::string path = whirl::testing::source_dir() + "/libs/report/test/golden/" + name;
  if (std::getenv("WHIRL_UPDATE_GOLDEN") != nullptr) std::ofstream(path, std::ios::binary) << svg;
  std::ifstream file(path, std::ios::binary);
  std::stringstream stored;
  stored << file.rdbuf();
  EXPECT_EQ(svg, stored.str()) << "drawing differs from " << path
                               << "; if that is meant, run with WHIRL_UPDATE_GOLDEN=1 and look at the file";
}

TEST(ReportFigure, WellFormedWithAccessibleNames) {
  const Figure figure = testing::one_of_each();
  const auto document = parse(to_svg(figure));
  EXPECT_EQ(document.child("svg").child_value("title"), figure.title);
  EXPECT_EQ(document.child("svg").child_value("desc"), figure.description);
}

TEST(ReportFigure, SameFigureSameBytes) {
  EXPECT_EQ(to_svg(testing::one_of_each()), to_svg(testing::one_of_each()));
  expect_golden(to_svg(testing::one_of_each()), "one_of_each.svg");
}

TEST(ReportFigure, LongTraceStaysSmallAndKeepsThePeak) {
  const Figure figure = testing::long_trace();
  const std::string svg = to_svg(figure);
  EXPECT_LT(svg.size(), 45'000U);
  // The highest point of the line: trace the relative path and compare with where 3.25 mm lies.
  const auto document = parse(svg);
  const auto plot = document.select_node("//rect[@class='plot']").node();
  const auto line = document.select_node("//svg/svg/path[@class='s0']").node();
  ASSERT_TRUE(plot && line);
  std::string d = line.attribute("d").value();
  std::string spaced;
  for (const char c : d) spaced += c == '-' ? " -" : (c == 'M' || c == 'l') ? " " : std::string(1, c);
  std::istringstream numbers(spaced);
  double x = 0, y = 0, dx = 0, dy = 0;
  numbers >> x >> y;
  double top = y, bottom = y;
  while (numbers >> dx >> dy) {
    y += dy;
    top = std::min(top, y);
    bottom = std::max(bottom, y);
  }
  const Eigen::VectorXd& data = figure.panels[0].series[0].y;
  const double plot_height = plot.attribute("height").as_double();
  // Limits: data widened by 5 % at each side, then room for two rows of labels above.
  const double range = (data.maxCoeff() - data.minCoeff()) * 1.1;
  const double px_per_m = (plot_height - 28) / range;
  EXPECT_NEAR(bottom - top, (data.maxCoeff() - data.minCoeff()) * px_per_m, 0.3);
}

TEST(ReportFigure, TextIsEscaped) {
  Figure figure = testing::long_trace();
  figure.panels[0].title = "<script>alert(1)</script> & \"quotes\"";
  figure.panels[0].series[0].name = "a<b";
  const std::string svg = to_svg(figure);
  EXPECT_THAT(svg, Not(HasSubstr("<script")));
  EXPECT_THAT(svg, HasSubstr("a&lt;b"));
  parse(svg);
}

TEST(ReportFigure, MissingSamplesLeaveAGap) {
  Figure figure = testing::long_trace();
  figure.panels[0].series[0].y.segment(5000, 100).setConstant(NAN);
  const auto document = parse(to_svg(figure));
  const std::string d = document.select_node("//svg/svg/path[@class='s0']").node().attribute("d").value();
  EXPECT_EQ(std::count(d.begin(), d.end(), 'M'), 2);
  EXPECT_THAT(d, Not(HasSubstr("nan")));
}

TEST(ReportFigure, ErrorsNameWhatIsWrong) {
  EXPECT_THAT(drawing_error(Figure{}), HasSubstr("no panel"));
  Figure figure = testing::long_trace();
  figure.panels[0].series[0].y.conservativeResize(10);
  EXPECT_THAT(drawing_error(figure), HasSubstr("'open loop' of panel 'X' has 15000 values of x but 10 of y"));
  figure = testing::long_trace();
  figure.panels[0].series[0].y.setConstant(NAN);
  EXPECT_THAT(drawing_error(figure), HasSubstr("panel 'X', y has no finite value"));
  figure = testing::long_trace();
  figure.panels[0].y.scale = Scale::logarithmic;
  figure.panels[0].series[0].y = -figure.panels[0].series[0].y.array().abs();
  EXPECT_THAT(drawing_error(figure), HasSubstr("no positive value"));
  figure = testing::long_trace();
  figure.panels[0].x.low = 3;
  figure.panels[0].x.high = 2;
  EXPECT_THAT(drawing_error(figure), HasSubstr("must ascend"));
  figure = testing::long_trace();
  figure.panels.push_back(figure.panels[0]);
  figure.panels[1].x.scale = Scale::logarithmic;
  figure.shared_x = true;
  EXPECT_THAT(drawing_error(figure), HasSubstr("share x: must have the same scale"));
}

TEST(ReportFigure, HugeValuesStayDrawable) {
  Figure figure = testing::long_trace();
  figure.panels[0].y.low = -1e-3;
  figure.panels[0].y.high = 1e-3;
  figure.panels[0].series[0].y(9) = 1e300;
  const std::string svg = to_svg(figure);
  EXPECT_THAT(svg, Not(HasSubstr("e+")));
  parse(svg);
}

TEST(ReportFigure, EqualAspectShowsCirclesRound) {
  Figure figure;
  Panel& p = figure.panel("Orbit", {"x", testing::kMm}, {"y", {"µm", 1e-6}});
  p.equal_aspect = true;
  const Eigen::VectorXd angle = Eigen::VectorXd::LinSpaced(721, 0, 2 * 3.14159265358979);
  p.line("", 1e-3 * angle.array().cos(), 1e-3 * angle.array().sin());
  const auto document = parse(to_svg(figure));
  const std::string d = document.select_node("//svg/svg/path[@class='s0']").node().attribute("d").value();
  std::string spaced;
  for (const char c : d) spaced += c == '-' ? " -" : (c == 'M' || c == 'l') ? " " : std::string(1, c);
  std::istringstream numbers(spaced);
  double x = 0, y = 0, dx = 0, dy = 0;
  numbers >> x >> y;
  double left = x, right = x, top = y, bottom = y;
  while (numbers >> dx >> dy) {
    x += dx;
    y += dy;
    left = std::min(left, x), right = std::max(right, x), top = std::min(top, y), bottom = std::max(bottom, y);
  }
  EXPECT_NEAR(right - left, bottom - top, 0.5);
}

/// A line that turns by a quarter: after a quarter of the instants it lies where `later` says, after all of them where
/// it began.
TEST(ReportFigure, LinesThatVibrateGoThroughTheirPeriod) {
  Figure figure;
  Panel& panel = figure.panel("Mode", {"position", testing::kMm}, {"x", {}});
  panel.kind = Panel::Kind::projected;
  for (Axis* axis : {&panel.y, &panel.z}) axis->low = -1.1, axis->high = 1.1;
  const Eigen::Vector3d z(0, 0.5, 1), one(0, 1, 0), none(0, 0, 0);
  const auto points_of = [](const std::string& svg, std::size_t instant) {
    std::string list = svg.substr(svg.find("values=\"") + 8);
    list = list.substr(0, list.find('"'));
    for (; instant > 0; --instant) list.erase(0, list.find(';') + 1);
    return list.substr(0, list.find(';'));
  };
  Series& moving = panel.line3("shaft", z, one, none);
  moving.y_later = none;
  moving.z_later = one;
  const std::string svg = to_svg(figure);
  ASSERT_NE(svg.find("<animate"), std::string::npos);
  EXPECT_EQ(points_of(svg, 0), points_of(svg, 24));
  panel.series[0].y = none;
  panel.series[0].z = one;
  EXPECT_EQ(points_of(svg, 6), points_of(to_svg(figure), 0));
  panel.series[0].z_later = Eigen::Vector2d(0, 0);
  EXPECT_THROW(to_svg(figure), Error);
}

TEST(ReportFigure, HistogramCountsEveryFiniteValue) {
  Panel panel;
  Eigen::VectorXd values(7);
  values << 0, 1, 1, 2, NAN, 4, 4;
  const Series& s = panel.histogram("h", values, 4);
  EXPECT_EQ(s.y, Eigen::Vector4d(1, 2, 1, 2));
  EXPECT_DOUBLE_EQ(s.x(0), 0.5);
}

TEST(ReportFigure, CsvHoldsAllDataInShownUnits) {
  Figure figure;
  Panel& p = figure.panel("X", {"time", testing::kSecond}, {"displacement", testing::kMm});
  p.line("open", Eigen::Vector3d(0, 1, 2), Eigen::Vector3d(1e-3, NAN, 2.5e-3));
  p.line("closed", Eigen::Vector2d(0, 1), Eigen::Vector2d(1e-4, 2e-4));
  EXPECT_EQ(to_csv(figure),
            "X: open: time [s],X: open: displacement [mm],X: closed: time [s],X: closed: displacement [mm]\n"
            "0,1,0,0.1\n1,,1,0.2\n2,2.5,,\n");
}

}  // namespace
}  // namespace whirl::report
