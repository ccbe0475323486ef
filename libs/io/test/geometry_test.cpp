#include "whirl/io/geometry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "whirl/core/error.hpp"
#include "whirl/testing/error_of.hpp"

namespace {

using namespace whirl;
using namespace whirl::io;
using ::testing::HasSubstr;
using whirl::testing::error_of;

std::filesystem::path written(const std::string& name, const std::string& text) {
  const auto path = std::filesystem::path(::testing::TempDir()) / ("geometry_" + name);
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

ModalModel two_modes() {
  ModalModel model;
  for (const double f : {10.0, 25.0}) {
    Mode mode;
    mode.frequency = Estimate::from_sd(f, 0.01);
    mode.damping = Estimate::from_sd(0.01, 1e-4);
    mode.pole = 6.283185307179586 * f * std::complex<double>(-0.01, 0.99995);
    model.modes.push_back(mode);
  }
  return model;
}

TEST(Geometry, OfATomlFileAndBackThroughAUniversalFile) {
  const Geometry geometry = read_geometry(
      written("g.toml",
              "[nodes]\n1_mm = [0, 0, 0]\n2_mm = [250, 0, 0]\n3_m = [0.25, 0.1, 0]\n[lines]\nframe = [\"1\", "
              "\"2\", \"3\"]\n"));
  ASSERT_EQ(geometry.nodes.size(), 3u);
  EXPECT_EQ(geometry.nodes[1].position, Eigen::Vector3d(0.25, 0, 0));
  ASSERT_EQ(geometry.lines.size(), 2u);
  Eigen::MatrixXcd shapes(4, 2);
  shapes << std::complex<double>(1, 0), 2.0, std::complex<double>(0, 0.5), -1.0, 0.25, 3.0, 0.125, 1.0;
  const auto path = std::filesystem::path(::testing::TempDir()) / "geometry_modes.uff";
  write_uff(path, uff_from_modes(two_modes(), {"1:+Z", "2:-Z", "3:+X", "3:+Z"}, shapes, geometry));
  const UffFile back = read_uff(path);
  EXPECT_TRUE(back.warnings.empty());
  ASSERT_EQ(back.nodes.size(), 3u);
  EXPECT_NEAR(back.nodes[2].position[1], 0.1, 1e-12);
  ASSERT_EQ(back.elements.size(), 2u);
  EXPECT_EQ(back.elements[1].nodes, (std::vector<long>{2, 3}));
  ASSERT_EQ(back.shapes.size(), 2u);
  EXPECT_EQ(back.shapes[0].analysis, 3);
  EXPECT_NEAR(back.shapes[0].reals[1], two_modes().modes[0].pole.imag(), 1e-3);
  EXPECT_EQ(back.shapes[0].nodes, (std::vector<long>{1, 2, 3}));
  EXPECT_NEAR(std::abs(back.shapes[0].value(1, 2) - std::complex<double>(0, -0.5)), 0, 1e-6);  // -Z
  EXPECT_NEAR(back.shapes[1].value(2, 0).real(), 3, 1e-6);
  EXPECT_NEAR(back.shapes[1].value(2, 2).real(), 1, 1e-6);
  const Geometry again = read_geometry(path);
  EXPECT_EQ(again.nodes.size(), 3u);
  EXPECT_GE(again.lines.size(), 2u);
}

TEST(Geometry, WrongFilesAreRefusedWithTheirPlace) {
  EXPECT_THAT(error_of([] { (void)read_geometry(written("a.toml", "[nodes]\n1_mm = [0, 0]\n")); }),
              HasSubstr("[x, y, z]"));
  EXPECT_THAT(error_of([] {
                (void)read_geometry(written("b.toml", "[nodes]\n1_mm = [0, 0, 0]\n[lines]\na = [\"1\", \"9\"]\n"));
              }),
              HasSubstr("no node '9'"));
  EXPECT_THAT(error_of([] { (void)read_geometry(written("c.toml", "")); }), HasSubstr("no nodes"));
}

}  // namespace
