// Frequency responses in arrays as scripts write them: unit of the axis, parts in two arrays, order of the dimensions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "whirl/io/formats.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/io/uff.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/records/foreign_files.hpp"

namespace {

using namespace whirl;
using namespace whirl::io;
using namespace whirl::testing;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kTurn = 2 * std::numbers::pi;

std::filesystem::path keep(const std::string& name, const std::string& bytes) {
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / ("responses_" + name);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

std::complex<double> truth(int o, int r, int line) { return {100.0 * o + 10 * r + line, -7.0 * o - r - 0.5 * line}; }

std::string doubles(const std::vector<double>& values) {
  Bytes b;
  for (const double v : values) b.put(v);
  return b.str();
}
std::string floats(const std::vector<double>& values) {
  Bytes b;
  for (const double v : values) b.put(static_cast<float>(v));
  return b.str();
}
std::string shape_of(const std::vector<int>& n) {
  std::string text = "(";
  for (const int v : n) text += std::to_string(v) + ",";
  return text + ")";
}

using Member = std::pair<std::string, std::string>;
Member vector_of(const std::string& name, const std::vector<double>& v) {
  return {name + ".npy", npy("'<f8'", shape_of({static_cast<int>(v.size())}), doubles(v))};
}

// What an order of the letters o (responses), r (references), f (lines) stores, the last running fastest.
template <class Of>
std::string cube(const std::string& order, int o, int r, int f, Of of) {
  const auto size = [&](char c) { return c == 'o' ? o : c == 'r' ? r : f; };
  Bytes b;
  for (int i = 0; i < size(order[0]); ++i) {
    for (int j = 0; j < size(order[1]); ++j) {
      for (int k = 0; k < size(order[2]); ++k) {
        const auto at = [&](char c) { return order[0] == c ? i : order[1] == c ? j : k; };
        of(b, truth(at('o'), at('r'), at('f')));
      }
    }
  }
  return npy(b.str().size() == static_cast<std::size_t>(o * r * f) * 16 ? "'<c16'" : "'<f8'",
             shape_of({size(order[0]), size(order[1]), size(order[2])}), b.str());
}
std::string complex_cube(const std::string& order, int o, int r, int f) {
  return cube(order, o, r, f, [](Bytes& b, std::complex<double> v) { b.put(v.real()).put(v.imag()); });
}

void expect_truth(const FrequencyResponse& frf, int o, int r, int f) {
  ASSERT_EQ(frf.channels.size(), static_cast<std::size_t>(o * r));
  ASSERT_EQ(frf.frequency.size(), f);
  for (int i = 0; i < o; ++i) {
    for (int j = 0; j < r; ++j) {
      const std::string out = "out" + std::to_string(i + 1), in = "in" + std::to_string(j + 1);
      const auto c = std::find_if(frf.channels.begin(), frf.channels.end(), [&](const FrfChannel& channel) {
        return channel.response.ends_with("." + out) && channel.reference.ends_with("." + in);
      });
      ASSERT_NE(c, frf.channels.end()) << out << in;
      for (int line = 0; line < f; ++line)
        ASSERT_NEAR(std::abs(c->value[line] - truth(i, j, line)), 0, 1e-10 * std::abs(truth(i, j, line)));
    }
  }
}

std::vector<double> lines(double first, double step, int n, double unit = 1) {
  std::vector<double> v;
  for (int i = 0; i < n; ++i) v.push_back(unit * (first + step * i));
  return v;
}
std::vector<double> spread(double first, double last, int n, double unit = 1) {
  std::vector<double> v;
  for (int i = 0; i < n; ++i) v.push_back(unit * (first + (last - first) * i / (n - 1)));
  return v;
}

std::filesystem::path with_axis(const std::string& axis, const std::vector<double>& values, bool single = false) {
  const int n = static_cast<int>(values.size());
  const Member member =
      single ? Member{axis + ".npy", npy("'<f4'", shape_of({n}), floats(values))} : vector_of(axis, values);
  return keep("axis.npz", zip({member, {"H.npy", complex_cube("orf", 2, 1, n)}}, false));
}

// Steps and last lines as analysers and scripts set them. An axis in rad/s under the name of a frequency is asked for.
TEST(ForeignResponsesReference, AnAxisInRadPerSecondUnderTheNameOfAFrequencyIsAskedFor) {
  const std::vector<std::pair<double, double>> grids = {{0, 0.25}, {1, 0.5},      {0, 51200.0 / 16384}, {5, 1.0 / 3},
                                                        {0, 0.1},  {20, 0.78125}, {0, 44100.0 / 4096},  {0, 0.0625}};
  for (const auto& [first, step] : grids) {
    for (const bool single : {false, true}) {
      if (single && step > 10) continue;  // 11025/1024: seven digits do not show it
      for (const std::string name : {"freq", "f", "frequency", "faxis"}) {
        const auto wrong = with_axis(name, lines(first, step, 400, kTurn), single);
        EXPECT_THAT(error_of([&] { (void)read_responses(wrong, FrfKind::mobility); }),
                    AllOf(HasSubstr(name), HasSubstr("rad/s"), HasSubstr("--frequency-unit")))
            << step;
        ResponseOptions stated(FrfKind::mobility);
        stated.frequency_unit = "rad_s";
        EXPECT_NEAR(read_responses(wrong, stated)->frequency[399], first + 399 * step, 1e-6 * (first + 399 * step));
        const auto right = with_axis(name, lines(first, step, 400), single);
        EXPECT_NEAR(read_responses(right, FrfKind::mobility)->frequency[399], first + 399 * step,
                    1e-6 * (first + 399 * step));
      }
    }
  }
  for (const int n : {401, 512, 1024, 1601}) {
    EXPECT_THAT(error_of([&] { (void)read_responses(with_axis("freq", spread(0, 800, n, kTurn)), FrfKind::mobility); }),
                HasSubstr("rad/s"))
        << n;
    EXPECT_NEAR(read_responses(with_axis("freq", spread(0, 800, n)), FrfKind::mobility)->frequency[n - 1], 800, 1e-9);
  }
  // `info` says it, too, and shows no wrong frequency.
  const SignalFile shown = read_signals(with_axis("freq", lines(0, 0.25, 400, kTurn)));
  EXPECT_THAT(shown.findings, Contains(HasSubstr("rad/s")));
  for (const SignalTable& table : shown.tables) EXPECT_FALSE(table.abscissa);
}

// False alarms: any sample rate to a tenth of a Hz and any block length, in double and single precision.
TEST(ForeignResponsesProperty, AxesInHertzAreNotDoubted) {
  std::mt19937 random(7011);
  int doubted = 0;
  for (int k = 0; k < 400; ++k) {
    const double rate = 0.1 * static_cast<double>(std::uniform_int_distribution<int>(5000, 2000000)(random));
    const int block = std::uniform_int_distribution<int>(500, 40000)(random);
    const auto file = with_axis("freq", lines(0, rate / block, 250), k % 2 == 1);
    doubted += error_of([&] { (void)read_responses(file, FrfKind::mobility); }) == "no error" ? 0 : 1;
  }
  EXPECT_EQ(doubted, 0);
}

TEST(ForeignResponses, AStatedUnitOfTheAxisCounts) {
  for (const auto& [name, unit] : std::vector<std::pair<std::string, double>>{{"freq_rad_s", kTurn},
                                                                              {"freq_Hz", 1},
                                                                              {"f_hz", 1},
                                                                              {"freq_rpm", 60},
                                                                              {"w_rad_s", kTurn},
                                                                              {"omega", kTurn}}) {
    const auto frf = read_responses(with_axis(name, lines(2, 0.5, 300, unit)), FrfKind::receptance);
    ASSERT_TRUE(frf) << name;
    EXPECT_NEAR(frf->frequency[299], 151.5, 1e-9) << name;
  }
  ResponseOptions twice(FrfKind::receptance);
  twice.frequency_unit = "rad_s";
  EXPECT_THAT(error_of([&] { (void)read_responses(with_axis("freq_hz", lines(2, 0.5, 300)), twice); }),
              HasSubstr("states its unit itself"));
}

TEST(ForeignResponsesReference, RealAndImaginaryPartInTwoArrays) {
  const int n = 90;
  const auto part = [&](bool imaginary) {
    return cube("orf", 3, 2, n, [&](Bytes& b, std::complex<double> v) { b.put(imaginary ? v.imag() : v.real()); });
  };
  for (const auto& [re, im] : std::vector<std::pair<std::string, std::string>>{{"H_re", "H_im"},
                                                                               {"H_real", "H_imag"},
                                                                               {"real", "imag"},
                                                                               {"re", "im"},
                                                                               {"HRe", "HIm"},
                                                                               {"Re_H", "Im_H"},
                                                                               {"realH", "imagH"},
                                                                               {"H_r", "H_i"},
                                                                               {"frf_Real", "frf_Imaginary"}}) {
    const auto file =
        keep("parts.npz",
             zip({vector_of("freq", lines(1, 0.5, n)), {im + ".npy", part(true)}, {re + ".npy", part(false)}}, true));
    const auto frf = read_responses(file, FrfKind::accelerance);
    ASSERT_TRUE(frf) << re;
    expect_truth(*frf, 3, 2, n);
  }
  // In a structure of MATLAB, and lines x channels.
  std::vector<double> re, im;
  for (int c = 0; c < 2; ++c) {
    for (int i = 0; i < n; ++i) re.push_back(truth(c, 0, i).real()), im.push_back(truth(c, 0, i).imag());
  }
  const auto file = keep("parts.mat", mat5_file(mat5_struct("FRF", {{"f", mat5_double("", {n, 1}, lines(1, 0.5, n))},
                                                                    {"re", mat5_double("", {n, 2}, re)},
                                                                    {"im", mat5_double("", {n, 2}, im)}})));
  const auto frf = read_responses(file, FrfKind::accelerance);
  ASSERT_TRUE(frf);
  ASSERT_EQ(frf->channels.size(), 2u);
  EXPECT_EQ(frf->channels[1].value[5], truth(1, 0, 5));
}

TEST(ForeignResponsesReference, MagnitudeAndPhaseInTwoArrays) {
  const int n = 60;
  const auto made = [&](const std::string& magnitude, const std::string& phase, double unit, bool decibel) {
    const auto size = cube("orf", 2, 2, n, [&](Bytes& b, std::complex<double> v) {
      b.put(decibel ? 20 * std::log10(std::abs(v)) : std::abs(v));
    });
    const auto angle = cube("orf", 2, 2, n, [&](Bytes& b, std::complex<double> v) { b.put(unit * std::arg(v)); });
    return keep("polar.npz",
                zip({vector_of("freq", lines(1, 0.5, n)), {magnitude + ".npy", size}, {phase + ".npy", angle}}, true));
  };
  const double degrees = 360 / kTurn;
  for (const auto& file : {made("H_mag", "H_phase_deg", degrees, false), made("H_abs", "H_angle_rad", 1, false)})
    expect_truth(*read_responses(file, FrfKind::receptance), 2, 2, n);
  expect_truth(*read_responses(made("H_mag_dB", "H_phase_deg", degrees, true), FrfKind::receptance), 2, 2, n);
  EXPECT_THAT(error_of([&] { (void)read_responses(made("H_mag", "H_phase", degrees, false), FrfKind::receptance); }),
              AllOf(HasSubstr("H_phase"), HasSubstr("_deg or")));
}

TEST(ForeignResponses, WhatIsNoFrequencyResponseYetSaysWhatIsMissing) {
  const std::string whole = complex_cube("orf", 2, 1, 50);
  const std::string real = cube("orf", 2, 1, 50, [](Bytes& b, std::complex<double> v) { b.put(std::abs(v)); });
  const auto only_real = keep("real.npz", zip({vector_of("freq", lines(1, 1, 50)), {"H.npy", real}}, false));
  EXPECT_THAT(error_of([&] { (void)read_responses(only_real, FrfKind::mobility); }),
              AllOf(HasSubstr("real"), HasSubstr("H_re and H_im")));
  const auto no_axis = keep("bare.npz", zip({vector_of("abscissa", lines(1, 1, 50)), {"H.npy", whole}}, false));
  EXPECT_THAT(error_of([&] { (void)read_responses(no_axis, FrfKind::mobility); }),
              AllOf(HasSubstr("complex"), HasSubstr("called freq")));
  // Parts of other sizes, and pairs of a record, stay what they are.
  const auto record =
      keep("record.npz", zip({vector_of("t_s", lines(0, 0.01, 50)), vector_of("x_re_mm", lines(0, 1, 50)),
                              vector_of("x_im_mm", lines(0, 2, 50))},
                             false));
  EXPECT_FALSE(read_responses(record, FrfKind::mobility));
  EXPECT_EQ(read_recording(record).channels.size(), 2u);
}

// The dimension as long as the frequencies is theirs, longest or not; two such are asked for.
TEST(ForeignResponsesReference, TheDimensionAlongTheFrequenciesIsTheirLength) {
  for (const std::string order : {"orf", "ofr", "for"}) {
    for (const auto& [o, r, f] : std::vector<std::array<int, 3>>{{3, 2, 40}, {90, 2, 40}, {41, 3, 40}}) {
      const auto file =
          keep("order.npz", zip({vector_of("freq", lines(1, 0.5, f)), {"H.npy", complex_cube(order, o, r, f)}}, false));
      const auto frf = read_responses(file, FrfKind::accelerance);
      ASSERT_TRUE(frf) << order << o;
      expect_truth(*frf, o, r, f);
    }
    const int n = 40;
    const auto open =
        keep("open.npz", zip({vector_of("freq", lines(1, 0.5, n)), {"H.npy", complex_cube(order, n, 2, n)}}, false));
    EXPECT_THAT(error_of([&] { (void)read_responses(open, FrfKind::accelerance); }),
                AllOf(HasSubstr("'H' is"), HasSubstr("--lines-dimension")));
    ResponseOptions stated(FrfKind::accelerance);
    stated.lines_dimension = static_cast<int>(order.find('f')) + 1;
    expect_truth(*read_responses(open, stated), n, 2, n);
    EXPECT_THAT(read_signals(open).findings, Contains(HasSubstr("which side")));
  }
}

TEST(ForeignResponses, ASquareMatrixIsAskedFor) {
  const int n = 30;
  std::vector<double> re, im;
  for (int c = 0; c < n; ++c) {
    for (int i = 0; i < n; ++i) re.push_back(truth(c, 0, i).real()), im.push_back(truth(c, 0, i).imag());
  }
  const auto file = keep("square.mat", mat4_matrix("freq_hz", n, 1, lines(1, 0.5, n)) + mat4_matrix("H", n, n, re, im));
  EXPECT_THAT(error_of([&] { (void)read_responses(file, FrfKind::accelerance); }), HasSubstr("30 x 30"));
  ResponseOptions stated(FrfKind::accelerance);
  for (const int dimension : {1, 2}) {
    stated.lines_dimension = dimension;
    const auto frf = read_responses(file, stated);
    EXPECT_EQ(frf->channels[2].value[7], dimension == 1 ? truth(2, 0, 7) : truth(7, 0, 2));
  }
  stated.lines_dimension = 3;
  EXPECT_THAT(error_of([&] { (void)read_responses(file, stated); }), HasSubstr("--lines-dimension 3"));
}

// A universal file states the unit of its abscissa; it was passed over.
TEST(ForeignResponsesReference, UniversalFilesStateTheUnitOfTheirFrequencies) {
  FrequencyResponse frf;
  frf.kind = FrfKind::mobility;
  frf.frequency = Eigen::VectorXd::LinSpaced(50, 10, 34.5);
  frf.channels = {{"1:+X", "1:+X", Eigen::VectorXcd::Constant(50, {1, 2}), {}, {}}};
  for (const auto& [unit, size] : std::vector<std::pair<std::string, double>>{
           {"Hz", 1}, {"rad/s", kTurn}, {"kHz", 1e-3}, {"RPM", 60}, {"Hertz", 1}, {"", 1}}) {
    for (const bool even : {true, false}) {
      UffFile file = uff_from_frf(frf);
      UffFunction& f = file.functions[0];
      f.abscissa.unit = unit;
      f.x0 *= size;
      f.dx *= size;
      f.even = even;
      if (!even) f.x = size * frf.frequency;
      const FrequencyResponse back = frf_from_uff(parse_uff(format_uff(file), "a.uff"));
      EXPECT_NEAR(back.frequency[49], 34.5, 1e-3) << unit << even;
      const SignalFile shown = signals_from_uff(file);
      EXPECT_NEAR(shown.tables[0].step, 0.5, 1e-6) << unit << even;
    }
  }
  UffFile file = uff_from_frf(frf);
  file.functions[0].abscissa.unit = "orders";
  EXPECT_THAT(error_of([&] { (void)frf_from_uff(file); }), HasSubstr("'orders', which is no unit of frequency"));
  // Without units the kind says what the values are.
  file = uff_from_frf(frf);
  file.units.clear();
  file.functions[0].ordinate.unit = file.functions[0].denominator.unit = "NONE";
  EXPECT_THAT(error_of([&] { (void)frf_from_uff(file); }), HasSubstr("state --kind"));
  EXPECT_EQ(frf_from_uff(file, FrfKind::mobility).channels[0].value[3], std::complex<double>(1, 2));
  EXPECT_THAT(error_of([&] { (void)frf_from_uff(file, FrfKind::receptance); }), HasSubstr("shows velocity"));
}

}  // namespace
