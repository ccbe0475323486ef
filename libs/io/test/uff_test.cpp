#include "whirl/io/uff.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/testing/data.hpp"

namespace {
using Complex = std::complex<double>;

#define WHIRL_READ_UFF(file, name)                           \
  const auto path_ = whirl::testing::data_file("uff/" name); \
  WHIRL_REQUIRE_DATA(path_);                                 \
  const whirl::io::UffFile file = whirl::io::read_uff(path_)

TEST(UffReference, ArtemisGeometry) {
  WHIRL_READ_UFF(file, "Artemis export - Geometry RPBC_setup_05_14102016_105117.uff");
  EXPECT_EQ(file.nodes.size(), 74u);
  ASSERT_EQ(file.traces.size(), 2u);
  EXPECT_EQ(file.traces[0].nodes.size(), 249u);
  EXPECT_EQ(file.traces[1].nodes.size(), 75u);
  ASSERT_EQ(file.elements.size(), 108u);
  for (const auto& e : file.elements) {
    EXPECT_EQ(e.type, 91);
    EXPECT_EQ(e.nodes.size(), 3u);
  }
}

TEST(UffReference, FourBinaryTimeRecords) {
  WHIRL_READ_UFF(file, "MPSTD#Set001_2024_10_08_10_27_07.uff.gz");
  ASSERT_EQ(file.functions.size(), 4u);
  const double largest[] = {0.34507, 0.43671, 0.21230, 0.27349};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(file.functions[i].value.size(), 222400);
    EXPECT_NEAR(file.functions[i].dx, 0.3125e-3, 1e-9);
    EXPECT_NEAR(file.functions[i].value.cwiseAbs().maxCoeff(), largest[i], 1e-5);
  }
  EXPECT_TRUE(file.warnings.empty());
  const auto recording = whirl::io::recording_of(whirl::io::signals_from_uff(file));
  EXPECT_EQ(recording.channels.size(), 4u);
  EXPECT_EQ(recording.channels[0].quantity, whirl::Quantity::acceleration);
  EXPECT_NEAR(recording.rate(), 3200, 1e-2);
}

TEST(UffReference, BinaryPressure) {
  WHIRL_READ_UFF(file, "Sample_UFF58b_bin.uff.gz");
  ASSERT_EQ(file.functions.size(), 1u);
  EXPECT_EQ(file.functions[0].value.size(), 79292);
  EXPECT_NEAR(file.functions[0].dx, 15.2588e-6, 1e-10);
  EXPECT_NEAR(file.functions[0].value[0].real(), -0.01475526, 1e-8);
  EXPECT_NEAR(file.functions[0].value.cwiseAbs().maxCoeff(), 0.1413039, 1e-7);
}

TEST(UffReference, HeaderUnitsSystemsAndGeometry) {
  WHIRL_READ_UFF(file, "TestLab 161 164 18 15 82.uff");
  EXPECT_FALSE(file.header.empty());
  ASSERT_EQ(file.units.size(), 1u);
  EXPECT_EQ(file.units[0].code, 9);
  EXPECT_NEAR(file.units[0].temperature_offset, -273.15, 1e-9);
  EXPECT_EQ(file.systems.size(), 36u);
  EXPECT_EQ(file.systems[1].name, "SYS2");
  EXPECT_EQ(file.nodes.size(), 36u);
  ASSERT_EQ(file.traces.size(), 3u);
  EXPECT_EQ(file.traces[0].nodes.size(), 9u);
  EXPECT_EQ(file.traces[1].nodes.size(), 32u);
  EXPECT_EQ(file.traces[2].nodes.size(), 11u);
}

TEST(UffReference, BinaryDoubles) {
  WHIRL_READ_UFF(file, "binary8byte.uff");
  ASSERT_EQ(file.functions.size(), 1u);
  const auto& f = file.functions[0];
  ASSERT_EQ(f.value.size(), 250);
  EXPECT_NEAR(f.dx, 0.01, 1e-12);
  // Doubles, but computed by their author with a single-precision phase.
  EXPECT_NEAR(f.value[1].real(), 0.30901697, 1e-7);
  double largest = 0;
  for (Eigen::Index i = 0; i < 250; ++i) {
    largest = std::max(largest, std::abs(f.value[i].real() - std::sin(0.1 * M_PI * static_cast<double>(i))));
  }
  EXPECT_LT(largest, 1e-5);
}

TEST(UffReference, CutOffDataAreReturnedWithAWarning) {
  WHIRL_READ_UFF(file, "dataset_milestone_in_header.uff");
  ASSERT_EQ(file.functions.size(), 1u);
  EXPECT_EQ(file.functions[0].declared, 2508876);
  ASSERT_EQ(file.functions[0].value.size(), 42);
  EXPECT_NEAR(file.functions[0].value[0].real(), -6.73633e-3, 1e-9);
  EXPECT_FALSE(file.warnings.empty());
}

TEST(UffReference, Mesh) {
  WHIRL_READ_UFF(file, "mesh_Oros-modal_uff15_uff2412.uff");
  EXPECT_EQ(file.systems.size(), 1u);
  EXPECT_EQ(file.nodes.size(), 96u);
  ASSERT_EQ(file.elements.size(), 72u);
  EXPECT_EQ(file.elements[0].nodes.size(), 4u);
  EXPECT_NEAR(file.nodes[0].position[0], -51.619, 1e-9);
}

TEST(UffReference, LatinOneHeaderAndUnitsOfAnFrf) {
  WHIRL_READ_UFF(file, "non_ascii_header.uff");
  ASSERT_EQ(file.functions.size(), 1u);
  const auto& f = file.functions[0];
  ASSERT_EQ(f.value.size(), 6);
  EXPECT_NEAR(f.dx, 0.195313, 1e-9);
  EXPECT_EQ(f.ordinate.unit, "(1/N)*(m/s\xC2\xB2)");
  EXPECT_NEAR(std::abs(f.value[0] - Complex(0.407994, 0)), 0, 1e-9);
  EXPECT_NEAR(std::abs(f.value[5] - Complex(3.75037, 2.93363)), 0, 1e-9);
  const auto frf = whirl::io::frf_from_uff(file);
  EXPECT_EQ(frf.kind, whirl::FrfKind::accelerance);
  EXPECT_NEAR(std::abs(frf.channels[0].value[5] - Complex(3.75037, 2.93363)), 0, 1e-9);
}

TEST(UffReference, UnevenComplexPsd) {
  WHIRL_READ_UFF(file, "sample_dataset58_psd.uff");
  ASSERT_EQ(file.functions.size(), 1u);
  const auto& f = file.functions[0];
  EXPECT_FALSE(f.even);
  ASSERT_EQ(f.value.size(), 3201);
  EXPECT_NEAR(f.x[0], 0, 1e-9);
  EXPECT_NEAR(f.x[3200], 3200, 1e-9);
  EXPECT_NEAR(f.value.real().maxCoeff(), 4.457989e-4, 1e-10);
  EXPECT_EQ(f.value.imag().cwiseAbs().maxCoeff(), 0);
}

TEST(UffReference, ShortLastLineAndThreeDigitExponents) {
  WHIRL_READ_UFF(file, "time-history-not-all-columns-filled.uff");
  const auto recording = whirl::io::recording_of(whirl::io::signals_from_uff(file));
  EXPECT_EQ(recording.size(), 13);
  EXPECT_NEAR(recording.dt, 50e-6, 1e-12);
  EXPECT_NEAR(recording.channels[0].samples[12], -5.84096, 1e-9);
  EXPECT_EQ(recording.channels[0].quantity, whirl::Quantity::acceleration);
}

TEST(UffReference, ComplexModeWithoutBlanks) {
  WHIRL_READ_UFF(file, "uff55 sample_test record10.uff");
  ASSERT_EQ(file.shapes.size(), 1u);
  const auto& s = file.shapes[0];
  EXPECT_TRUE(s.complex);
  ASSERT_EQ(s.reals.size(), 6u);
  const double expected[] = {-0.1111111, 41.11111, 4111.111, -3111.111, -111111, -211111};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(s.reals[i], expected[i], 1e-6 * std::abs(expected[i]));
  ASSERT_EQ(s.nodes.size(), 2u);
  EXPECT_EQ(s.nodes[1], 60101);
  EXPECT_NEAR(std::abs(s.value(0, 1) - Complex(0.1111111, 0.09111111)), 0, 1e-9);
}

TEST(UffReference, RealModes) {
  {
    WHIRL_READ_UFF(file, "uff55_translation.uff");
    ASSERT_EQ(file.shapes.size(), 3u);
    const double frequency[] = {10, 12, 13};
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(file.shapes[i].reals[0], frequency[i], 1e-9);
      EXPECT_EQ(file.shapes[i].value.rows(), 4);
      EXPECT_EQ(file.shapes[i].value.cols(), 3);
    }
    EXPECT_NEAR(file.shapes[0].value(2, 1).real(), -3.76396e-1, 1e-9);
  }
  WHIRL_READ_UFF(file, "uff55_translation_rotation.uff");
  ASSERT_EQ(file.shapes.size(), 1u);
  EXPECT_NEAR(file.shapes[0].reals[0], 97.013, 1e-9);
  EXPECT_EQ(file.shapes[0].value.rows(), 43);
  EXPECT_EQ(file.shapes[0].value.cols(), 6);
  EXPECT_EQ(file.shapes[0].characteristic, 3);
  EXPECT_EQ(file.shapes[0].integers[1], 0);
}

whirl::io::UffFile sample() {
  whirl::FrequencyResponse frf;
  frf.frequency = Eigen::VectorXd::LinSpaced(9, 5, 9);
  frf.kind = whirl::FrfKind::mobility;
  Eigen::VectorXcd value(9);
  for (Eigen::Index i = 0; i < 9; ++i) value[i] = Complex(1e-5 * static_cast<double>(i) - 3e-110, -2.5e120);
  frf.channels.push_back({"3:-Z", "12:+Y", value, {}, {}});
  whirl::io::UffFile file = whirl::io::uff_from_frf(frf);
  file.header = {"model", "-1"};
  file.nodes = {{3, {-1, 2, 3.5}}, {12, {0, -1e-7, 4}}};
  file.traces = {{"line", {3, 12, 0, 3, 3, 3, 3, 3, 12}}};
  whirl::io::UffShape shape;
  shape.id[0] = "-1";
  shape.complex = true;
  shape.analysis = 3;
  shape.integers = {1, 7};
  shape.reals = {-1, 40, 1, 0, 0, 1};
  shape.nodes = {3, 12};
  shape.value = Eigen::MatrixXcd::Constant(2, 3, Complex(1, -2));
  file.shapes.push_back(shape);
  return file;
}

TEST(UffProperty, WrittenFilesReadBack) {
  const whirl::io::UffFile file = sample();
  const std::string text = whirl::io::format_uff(file);
  const whirl::io::UffFile back = whirl::io::parse_uff(text, "memory");
  EXPECT_TRUE(back.warnings.empty());
  ASSERT_EQ(back.functions.size(), 1u);
  EXPECT_LT((back.functions[0].value - file.functions[0].value).norm(), 1e-11 * file.functions[0].value.norm());
  EXPECT_EQ(back.nodes.size(), 2u);
  EXPECT_EQ(back.nodes[1].position[1], -1e-7);
  EXPECT_EQ(back.traces[0].nodes, file.traces[0].nodes);
  EXPECT_EQ(back.shapes[0].reals, file.shapes[0].reals);
  EXPECT_EQ(back.shapes[0].value, file.shapes[0].value);
  EXPECT_EQ(back.shapes[0].integers, file.shapes[0].integers);
  const auto frf = whirl::io::frf_from_uff(back);
  EXPECT_EQ(frf.kind, whirl::FrfKind::mobility);
  EXPECT_EQ(frf.channels[0].response, "3:-Z");
  EXPECT_EQ(frf.channels[0].reference, "12:+Y");
  EXPECT_NEAR(frf.frequency[8], 9, 1e-9);
  // Fixed columns hold the same numbers when the file has CR LF line ends.
  std::string crlf;
  for (char c : text) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(whirl::io::format_uff(whirl::io::parse_uff(crlf, "memory")), whirl::io::format_uff(back));
}

// One 58b FRF of four complex doubles whose header states `stated` bytes of data.
std::string binary_frf(int stated, int blocks = 1) {
  std::string text;
  for (int b = 0; b < blocks; ++b) {
    text += fmt::format("    -1\n    58b     1     2          11{:12}     0     0           0           0\n", stated);
    for (int i = 0; i < 5; ++i) text += "NONE\n";
    text +=
        fmt::format("{:5}{:10}{:5}{:10} {:10}{:10}{:4} {:10}{:10}{:4}\n", 4, 0, 0, 0, "NONE", b + 1, 3, "NONE", 1, 3);
    text += fmt::format("{:10}{:10}{:10}{:13.5E}{:13.5E}{:13.5E}\n", 6, 4, 1, 0.0, 1.0, 0.0);
    for (const int kind : {18, 12, 13, 0})
      text += fmt::format("{:10}{:5}{:5}{:5} {:20} {:20}\n", kind, 0, 0, 0, "NONE", "NONE");
    for (int i = 0; i < 8; ++i) {
      const double value = 0.5 * (i + 1);
      text.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    text += "\n    -1\n";
  }
  return text;
}

TEST(UffReference, ComplexBinaryDataAreWholeWhateverTheHeaderCounts) {
  // 64 bytes follow. pyuff states values x width = 32; others count values, or state 0.
  for (const int stated : {64, 32, 8, 4, 0}) {
    const whirl::io::UffFile file = whirl::io::parse_uff(binary_frf(stated, 3), "memory");
    ASSERT_EQ(file.functions.size(), 3u) << stated;
    EXPECT_EQ(file.warnings.size(), stated == 64 ? 0u : 3u) << stated;
    for (const auto& f : file.functions) {
      ASSERT_EQ(f.value.size(), 4) << stated;
      EXPECT_EQ(f.value[0], Complex(0.5, 1)) << stated;
      EXPECT_EQ(f.value[3], Complex(3.5, 4)) << stated;
    }
  }
}

// Dataset 1858 before the functions, as laboratory programs write it: window code, damping factor of an exponential
// one.
std::string qualifiers(int window, double factor) {
  std::string text = fmt::format("    -1\n{:6}{:74}\n", 1858, " ");
  text += fmt::format("{:12}{:12}{:12}{:12}{:12}{:12}\n", 1, 0, 1, 0, 0, 0);
  text += fmt::format("{:6}{:6}{:6}{:6}{:6}{:6}{:6}{:6}{:6}{:6}{:6}{:6}\n", 0, window, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0);
  text += fmt::format("{0:15.7e}{0:15.7e}{0:15.7e}{0:15.7e}{0:15.7e}\n", 0.0);
  text += fmt::format("{0:15.7e}{0:15.7e}{0:15.7e}{0:15.7e}{1:15.7e}\n", 0.0, factor);
  text += fmt::format("{0:15.7e}{0:15.7e}{0:15.7e}{0:15.7e}{0:15.7e}\n", 0.0);
  return text + "NONE  NONE\n" + fmt::format("{:<80}\n", "NONE") + "    -1\n";
}

TEST(Uff, WindowThatDataset1858StatesIsSaidOfFrequencyResponses) {
  const std::string functions = binary_frf(64, 2);
  for (const int window : {0, 5})
    EXPECT_TRUE(whirl::io::parse_uff(qualifiers(window, 0) + functions, "memory").warnings.empty()) << window;
  for (const auto& [window, word] : std::vector<std::pair<int, std::string>>{
           {1, "Hann"}, {2, "Hann"}, {3, "flat top"}, {4, "exponential window (damping factor 4.6)"}, {6, "4.6"}}) {
    const auto file = whirl::io::parse_uff(qualifiers(window, 4.6) + functions, "memory");
    ASSERT_EQ(file.warnings.size(), 1u) << window;
    EXPECT_NE(file.warnings[0].find(word), std::string::npos) << file.warnings[0];
    EXPECT_EQ(file.functions.size(), 2u);
  }
  EXPECT_TRUE(whirl::io::parse_uff(functions, "memory").warnings.empty());
}

TEST(UffProperty, DamagedFilesGiveAnErrorOrAResultNeverACrash) {
  const std::string text = whirl::io::format_uff(sample());
  std::mt19937_64 random(3);
  std::uniform_int_distribution<std::size_t> position(0, text.size() - 1);
  std::uniform_int_distribution<int> byte(0, 255);
  int errors = 0;
  for (int run = 0; run < 3000; ++run) {
    std::string damaged = text;
    for (int k = 0; k < 1 + run % 4; ++k) {
      switch (run % 3) {
        case 0:
          damaged[position(random)] = static_cast<char>(byte(random));
          break;
        case 1:
          damaged.resize(std::min(damaged.size(), position(random) + 1));
          break;
        default:
          damaged[position(random)] = "9-1E .\n"[byte(random) % 7];
      }
    }
    try {
      whirl::io::parse_uff(damaged, "damaged");
    } catch (const whirl::Error& e) {
      ++errors;
      EXPECT_EQ(std::string(e.what()).rfind("damaged", 0), 0u) << e.what();
    }
  }
  EXPECT_GT(errors, 300);
}

TEST(Uff, HugeCountsInAHeaderDoNotAllocate) {
  std::string text = whirl::io::format_uff(sample());
  const auto at = text.find("         6         9");
  ASSERT_NE(at, std::string::npos);
  text.replace(at + 10, 10, "2000000000");
  const auto file = whirl::io::parse_uff(text, "memory");
  EXPECT_EQ(file.functions[0].value.size(), 9);
  EXPECT_EQ(file.functions[0].declared, 2000000000);
}

TEST(Uff, WhatIsNotAUniversalFileIsAnError) {
  EXPECT_THROW(whirl::io::parse_uff("", "memory"), whirl::Error);
  EXPECT_THROW(whirl::io::parse_uff("t_s,x_mm\n0,1\n", "memory"), whirl::Error);
  EXPECT_THROW(whirl::io::parse_uff("    -1\n    58b     1     3          11         100\n    -1\n", "memory"),
               whirl::Error);
  EXPECT_THROW(whirl::io::parse_uff("    -1\n    15\n abc\n    -1\n", "memory"), whirl::Error);
}

TEST(Uff, MissingUnitIsAskedForNotGuessed) {
  whirl::Recording recording;
  recording.dt = 0.01;
  recording.add("1:+X", whirl::Quantity::displacement, Eigen::VectorXd::LinSpaced(5, 0, 1));
  whirl::io::UffFile file = whirl::io::uff_from_recording(recording);
  EXPECT_EQ(whirl::io::recording_of(whirl::io::signals_from_uff(file))["1:+X"], recording["1:+X"]);
  // A name alone keeps the unit of the file.
  EXPECT_EQ(whirl::io::recording_of(whirl::io::signals_from_uff(file), {.columns = {"1:+X:x"}})["x"],
            recording["1:+X"]);
  EXPECT_THROW(whirl::io::recording_of(whirl::io::signals_from_uff(file), {.columns = {"1:+X:x_furlong"}}),
               whirl::Error);
  file.functions[0].ordinate.unit.clear();
  file.units.clear();
  EXPECT_THROW(whirl::io::recording_of(whirl::io::signals_from_uff(file)), whirl::Error);
  EXPECT_NEAR(whirl::io::recording_of(whirl::io::signals_from_uff(file), {.columns = {"1:+X:x_mm"}})["x"][4], 1e-3,
              1e-15);
}
/// Names of more than their ten columns move what stands behind them; names that fill them do not.
TEST(Uff, NamesOfAnyLengthKeepNodeAndDirection) {
  std::mt19937 random(5);
  for (int k = 0; k < 200; ++k) {
    const auto name = [&] {
      std::string out(1 + random() % 24, 'a');
      for (char& c : out) c = "PQx-_+07"[random() % 8];
      return out;
    };
    const std::string response = name(), reference = name();
    const long node = static_cast<long>(random() % 100000), other = static_cast<long>(random() % 100000);
    const int direction = static_cast<int>(random() % 7) - 3, along = static_cast<int>(random() % 7) - 3;
    const std::string text = fmt::format(
        "    -1\n    58\nNONE\nNONE\nNONE\nNONE\nNONE\n"
        "{:5d}{:10d}{:5d}{:10d} {:<10}{:10d}{:4d} {:<10}{:10d}{:4d}\n"
        "{:10d}{:10d}{:10d}  0.00000e+00  1.00000e-03  0.00000e+00\n"
        "        17    0    0    0 Time                 s                   \n"
        "        12    0    0    0 Acceleration         m/s^2               \n"
        "         0    0    0    0 NONE                 NONE                \n"
        "         0    0    0    0 NONE                 NONE                \n"
        "  1.00000000000000E+00  2.00000000000000E+00  3.00000000000000E+00\n    -1\n",
        1, 0, 1, 0, response, node, direction, reference, other, along, 4, 3, 1);
    const whirl::io::UffFile file = whirl::io::parse_uff(text, "long.uff");
    ASSERT_EQ(file.functions.size(), 1u);
    const auto& f = file.functions[0];
    EXPECT_EQ(f.type, 1);
    EXPECT_EQ(f.response.name, response);
    EXPECT_EQ(f.response.node, node) << response;
    EXPECT_EQ(f.response.direction, direction) << response;
    EXPECT_EQ(f.reference.name, reference);
    EXPECT_EQ(f.reference.node, other) << response << ' ' << reference;
    EXPECT_EQ(f.reference.direction, along);
    EXPECT_EQ(f.value.size(), 3);
    EXPECT_EQ(!file.warnings.empty(), response.size() > 10 || reference.size() > 10);
  }
}

}  // namespace
