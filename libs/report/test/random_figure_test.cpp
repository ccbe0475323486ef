#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <pugixml.hpp>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/report/figure.hpp"
#include "whirl/report/terminal_plot.hpp"

namespace whirl::report {
namespace {

/// Values that a broken record may hold: huge, tiny, missing, infinite, all equal.
Eigen::VectorXd awkward(std::mt19937_64& random, Eigen::Index n) {
  std::uniform_int_distribution<int> kind(0, 9);
  std::normal_distribution<double> normal;
  Eigen::VectorXd v(n);
  const double scale = std::pow(10.0, std::uniform_int_distribution<int>(-12, 12)(random));
  const bool constant = kind(random) == 0;
  for (double& value : v) {
    value = constant ? scale : scale * normal(random);
    switch (kind(random)) {
      case 0:
        value = std::numeric_limits<double>::quiet_NaN();
        break;
      case 1:
        value =
            std::uniform_int_distribution<int>(0, 20)(random) == 0 ? std::numeric_limits<double>::infinity() : value;
        break;
      case 2:
        value = std::uniform_int_distribution<int>(0, 20)(random) == 0 ? 1e300 : value;
        break;
      default:
        break;
    }
  }
  return v;
}

TEST(ReportFigureProperty, AnyDataGivesAWellFormedDrawingOrAnError) {
  std::mt19937_64 random(11);
  int drawn = 0;
  for (int i = 0; i < 400; ++i) {
    Figure figure;
    figure.columns = 1 + i % 3;
    figure.shared_x = i % 2 == 0;
    for (int k = 0; k < 1 + i % 4; ++k) {
      Panel& p = figure.panel("p & q", {"x", {"mm", 1e-3}}, {"y", {"µm", 1e-6}});
      if (std::uniform_int_distribution<int>(0, 3)(random) == 0) p.y.scale = Scale::logarithmic;
      if (std::uniform_int_distribution<int>(0, 3)(random) == 0) p.x.scale = Scale::logarithmic;
      p.equal_aspect = i % 7 == 0;
      const Eigen::Index n = std::uniform_int_distribution<int>(0, 3)(random) == 0 ? i % 3 : 1 + 37 * (i % 60);
      const Eigen::VectorXd x = awkward(random, n), y = awkward(random, n);
      switch (std::uniform_int_distribution<int>(0, 8)(random)) {
        case 0:
          p.line("l", x, y);
          break;
        case 1:
          p.scatter("s", x, y);
          break;
        case 2:
          p.step("t", x, y);
          break;
        case 3:
          p.stem("m", x, y);
          break;
        case 4:
          p.bars("b", x, y);
          break;
        case 5:
          p.band("d", x, y, awkward(random, n));
          break;
        case 6:
          p.error_bars("e", x, y, awkward(random, n), awkward(random, n));
          break;
        case 7:
          p.kind = Panel::Kind::polar;
          p.line("p", x, y);
          break;
        default:
          p.kind = Panel::Kind::projected;
          p.z = p.y;
          p.line3("3", x, y, awkward(random, n));
      }
      p.vertical(awkward(random, 1)(0), "v");
      p.horizontal(awkward(random, 1)(0), "h");
      p.span(awkward(random, 1)(0), awkward(random, 1)(0), "span");
      p.annotate(awkward(random, 1)(0), awkward(random, 1)(0), "note");
    }
    try {
      const std::string svg = to_svg(figure);
      pugi::xml_document document;
      const auto result = document.load_string(svg.c_str());
      ASSERT_TRUE(result) << i << ": " << result.description();
      ASSERT_EQ(svg.find("nan"), std::string::npos) << i;
      ASSERT_EQ(svg.find("inf"), std::string::npos) << i;
      (void)to_terminal(figure);
      ++drawn;
    } catch (const Error&) {
      // A panel without a finite value says so.
    }
  }
  EXPECT_GT(drawn, 200);
}

}  // namespace
}  // namespace whirl::report
