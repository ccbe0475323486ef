#include "whirl/io/atfx.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/testing/data.hpp"

namespace {
using Complex = std::complex<double>;

std::string no_parts(const std::string& name) { throw whirl::Error("absent: " + name); }

const whirl::io::AtfxColumn* column(const whirl::io::AtfxFile& file, const std::string& name) {
  for (const auto& c : file.columns) {
    if (c.name == name) return &c;
  }
  return nullptr;
}

template <class T>
void append(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

// The binary parts that the file describes: blocks of 12 and of 11 bytes.
std::string test_part(const std::string& name) {
  std::string bytes;
  if (name == "test_0001_0001.bin") {
    for (int i = 0; i < 10; ++i) {
      append(bytes, static_cast<double>(i));
      append(bytes, static_cast<std::int32_t>(i % 5));
    }
  } else if (name == "test_0001_0002.bin") {
    for (int i = 0; i < 20; ++i) {
      append(bytes, static_cast<double>(i));
      append(bytes, static_cast<std::int16_t>(2 * i));
      append(bytes, static_cast<std::uint8_t>(2 * i));
    }
  } else {
    throw whirl::Error("absent: " + name);
  }
  return bytes;
}

TEST(AtfxReference, EveryDataTypeInline) {
  const auto path = whirl::testing::data_file("atfx/Example_AllTypes.atfx");
  WHIRL_REQUIRE_DATA(path);
  const auto file = whirl::io::read_atfx(path);
  ASSERT_EQ(file.columns.size(), 12u);
  for (const auto& c : file.columns) EXPECT_EQ(c.size(), 5) << c.name;
  const auto* complex = column(file, "MyMqDcomplex");
  ASSERT_NE(complex, nullptr);
  EXPECT_TRUE(complex->complex);
  EXPECT_EQ(complex->value[3], Complex(-4.44, 1.11));
}

TEST(AtfxReference, SmallTables) {
  for (const auto& [name, columns] :
       {std::pair{"Simple", 5u}, {"Bus", 5u}, {"BusWithIndex", 7u}, {"Workflow", 0u}, {"Geometry", 24u}}) {
    const auto path = whirl::testing::data_file(std::string("atfx/Example_") + name + ".atfx");
    WHIRL_REQUIRE_DATA(path);
    EXPECT_EQ(whirl::io::read_atfx(path).columns.size(), columns) << name;
  }
}

TEST(AtfxReference, ImplicitAndComplexColumns) {
  const auto path = whirl::testing::data_file("atfx/Example_Geometry.atfx");
  WHIRL_REQUIRE_DATA(path);
  const auto file = whirl::io::read_atfx(path);
  const auto* frequency = column(file, "Frequency");
  ASSERT_NE(frequency, nullptr);
  EXPECT_TRUE(frequency->implicit);
  ASSERT_EQ(frequency->size(), 10);  // 0 to 18 Hz in steps of 2 Hz
  EXPECT_EQ(frequency->value[9].real(), 18);
  int spectra = 0, cross = 0;
  for (const auto& c : file.columns) {
    spectra += c.size() == 100 && !c.complex;
    cross += c.size() == 100 && c.complex;
  }
  EXPECT_EQ(spectra, 3);
  EXPECT_EQ(cross, 3);  // stored as pairs of floats, complex by their measurement quantity
}

TEST(AtfxReference, BlockedBinaryParts) {
  const auto path = whirl::testing::data_file("atfx/test.atfx");
  WHIRL_REQUIRE_DATA(path);
  const auto file = whirl::io::parse_atfx(whirl::io::read_text(path), "test.atfx", test_part);
  ASSERT_EQ(file.columns.size(), 8u);
  EXPECT_EQ(column(file, "I")->value[7].real(), 2);
  EXPECT_EQ(column(file, "s")->value[19].real(), 38);
  EXPECT_EQ(column(file, "b")->value[19].real(), 38);
  EXPECT_EQ(column(file, "implicit_linear")->value[9].real(), 19);
  EXPECT_EQ(column(file, "implicit_constant")->value[9].real(), 1);
  EXPECT_EQ(column(file, "implicit_constant_string")->text.at(9), "const");
  const auto recording = whirl::io::recording_of(whirl::io::signals_from_atfx(file), {.rate = 1, .columns = {"s"}});
  EXPECT_EQ(recording.size(), 20);
  EXPECT_EQ(recording.dt, 1);
  EXPECT_EQ(recording["s"][3], 6);
}

TEST(AtfxReference, MissingBinaryPartIsNamed) {
  for (const auto& [name, part] : {std::pair{"test", "test_0001_0001.bin"}, {"example", "PAK_Data"}}) {
    const auto path = whirl::testing::data_file(std::string("atfx/") + name + ".atfx");
    WHIRL_REQUIRE_DATA(path);
    try {
      whirl::io::read_atfx(path);
      FAIL() << "no error for " << name;
    } catch (const whirl::Error& e) {
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
    }
  }
}

TEST(AtfxReference, VendorExportWithBrokenDocumentation) {
  const auto path = whirl::testing::data_file("atfx/example.atfx");
  WHIRL_REQUIRE_DATA(path);
  const auto file = whirl::io::parse_atfx(whirl::io::read_text(path), "example.atfx", [](const std::string&) {
    std::string bytes(8 << 20, '\0');
    const float value = 42.5f;
    std::memcpy(bytes.data() + 136, &value, 4);
    return bytes;
  });
  EXPECT_EQ(file.columns.size(), 17u);
  const auto* right = column(file, "LS.Right Side");
  ASSERT_NE(right, nullptr);
  EXPECT_EQ(right->size(), 167);
  EXPECT_EQ(right->value[0].real(), 42.5);
}

TEST(AtfxProperty, DamagedFilesGiveAnErrorOrAResultNeverACrash) {
  const auto path = whirl::testing::data_file("atfx/test.atfx");
  WHIRL_REQUIRE_DATA(path);
  const std::string text = whirl::io::read_text(path);
  const std::size_t data = text.find("<Submatrix>");
  std::mt19937_64 random(1);
  int errors = 0;
  for (int run = 0; run < 400; ++run) {
    std::string damaged = text;
    std::uniform_int_distribution<std::size_t> position(data, damaged.size() - 1);
    if (run % 4 == 0) {
      damaged.resize(position(random));
    } else {
      for (int k = 0; k < 3; ++k) damaged[position(random)] = "90123-<>x "[random() % 10];
    }
    try {
      whirl::io::parse_atfx(damaged, "damaged", test_part);
    } catch (const whirl::Error&) {
      ++errors;
    }
  }
  EXPECT_GT(errors, 50);
}

TEST(Atfx, ABinaryColumnLongerThanItsFileIsLeftOutAndNamed) {
  const auto path = whirl::testing::data_file("atfx/test.atfx");
  WHIRL_REQUIRE_DATA(path);
  std::string text = whirl::io::read_text(path);
  for (const char* length : {"<length>11</length>", "<length>4000000000000</length>", "<length>-3</length>"}) {
    std::string wrong = text;
    wrong.replace(wrong.find("<length>10</length>"), 19, length);
    const auto file = whirl::io::parse_atfx(wrong, "wrong", test_part);
    EXPECT_EQ(file.columns.size(), 7u) << length;
    ASSERT_EQ(file.warnings.size(), 1u) << length;
    EXPECT_NE(file.warnings[0].find("left out: binary column"), std::string::npos) << file.warnings[0];
    ASSERT_NE(column(file, "s"), nullptr);
    EXPECT_EQ(column(file, "s")->value[19].real(), 38);
  }
  EXPECT_THROW(whirl::io::parse_atfx("", "empty", no_parts), whirl::Error);
  EXPECT_THROW(whirl::io::parse_atfx("<a/>", "other", no_parts), whirl::Error);
}

TEST(Atfx, AnOffsetThatIsNoWholeNumberLeavesItsColumnOut) {
  const auto path = whirl::testing::data_file("atfx/test.atfx");
  WHIRL_REQUIRE_DATA(path);
  const std::string text = whirl::io::read_text(path);
  const std::string nines(120, '9');
  for (const std::string& offset :
       {nines, std::string("-1"), std::string("1.5"), std::string("nan"), std::string("x")}) {
    std::string wrong = text;
    const std::size_t at = wrong.find("<valoffsets>");
    ASSERT_NE(at, std::string::npos);
    wrong.insert(at + 12, offset + " ");
    const auto file = whirl::io::parse_atfx(wrong, "wrong", test_part);
    ASSERT_EQ(file.warnings.size(), 1u) << offset;
    EXPECT_NE(file.warnings[0].find("valoffsets = '"), std::string::npos) << file.warnings[0];
  }
}

}  // namespace
