#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::string units_error(std::string_view text, const CsvOptions& options = {}) {
  try {
    parse_csv(text, "a.csv", options);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

// What a proposal says is pasted: it may not state another unit than the heading, nor one beside it.
TEST(CsvUnits, AProposalKeepsTheUnitThatTheHeadingStates) {
  for (const auto& [heading, proposal] : {std::pair{"X (mils p-p)", "x_pp_mil"},
                                          {"X (Mils pp)", "x_pp_mil"},
                                          {"X mils pk-pk", "x_pp_mil"},
                                          {"X [thou]", "x_mil"},
                                          {"X [milli-inch]", "x_mil"},
                                          {"x_um_pp", "x_pp_um"},
                                          {"x [\xC2\xB5m pp]", "x_pp_um"},
                                          {"x / um pk-pk", "x_pp_um"},
                                          {"x (um peak-to-peak)", "x_pp_um"},
                                          {"x [um 0-p]", "x_peak_um"},
                                          {"x [RMS um]", "x_rms_um"},
                                          {"x [umpp]", "x_pp_um"},
                                          {"v [mm/s RMS]", "v_rms_mm_s"},
                                          {"v_mm_s_rms", "v_rms_mm_s"},
                                          {"v (in/s pk)", "v_peak_in_s"},
                                          {"v [ips pk]", "v_peak_in_s"},
                                          {"v ips", "v_in_s"},
                                          {"acc_G", "acc_g"},
                                          {"acc G", "acc_g"},
                                          {"a [g pk]", "a_peak_g"},
                                          {"a [m/s\xC2\xB2 rms]", "a_rms_m_s2"},
                                          {"a [m s\xE2\x81\xBB\xC2\xB2 rms]", "a_rms_m_s2"},
                                          {"a (m/s^2, rms)", "a_rms_m_s2"}}) {
    SCOPED_TRACE(heading);
    const std::string header = std::string("\"t_s\",\"") + heading + "\",q\n", rows = "0,1,1\n1,2,1\n2,4,1\n";
    EXPECT_THAT(units_error(header + rows), HasSubstr(std::string(heading) + ":" + proposal));
    CsvOptions pasted{.columns = {"t_s:t_s", std::string(heading) + ":" + proposal}};
    EXPECT_EQ(units_error(header + rows, pasted), "");
    // The line of before, and a unit of another size, contradict the heading.
    for (const char* wrong : {"c_nm", "c_mm_s2"}) {
      pasted.columns[1] = std::string(heading) + ":" + wrong;
      EXPECT_THAT(units_error(header + rows, pasted), HasSubstr("the header")) << wrong;
    }
  }
}

// A word that may be a unit and is not known is asked for, not replaced.
TEST(CsvUnits, AnUnknownUnitIsAskedFor) {
  for (const char* heading : {"x (furlong)", "x [lines]", "x_MM", "Probe A", "X MV"}) {
    const std::string error = units_error(std::string("t_s,") + heading + "\n0,1\n1,2\n");
    EXPECT_THAT(error, AllOf(HasSubstr("_UNIT"), HasSubstr("write its unit for UNIT"))) << heading;
    EXPECT_THAT(error, Not(HasSubstr("_mm\""))) << heading;
  }
  // Nothing stated: the usual one is offered as before.
  EXPECT_THAT(units_error("t_s,Disp X\n0,1\n1,2\n"), HasSubstr("Disp X:x_mm"));
}

// A line of units with kinds of amplitude is read with the names of --columns, and proposes them.
TEST(CsvUnits, ALineOfUnitsDoesNotStopNamedColumns) {
  const std::string text = "Drehzahl;1X Ampl;1X Phase\n1/min;\xC2\xB5m pp;\xC2\xB0\n300;3,94;322,5\n320;4;326\n";
  CsvOptions options{.columns = {"1:speed_rpm", "2:amp_pp_um", "3:phase_deg"}};
  const Table table = parse_table(text, "a.csv", options);
  EXPECT_NEAR(table["amp_pp"][0], 3.94e-6, 1e-15);
  options.columns[1] = "2:amp_pp_mm";
  EXPECT_THROW(parse_table(text, "a.csv", options), Error);
  options.columns[1] = "2:amp_rms_um";
  EXPECT_THROW(parse_table(text, "a.csv", options), Error);
  EXPECT_THAT(units_error("Time,Disp X,Disp Y\ns,um pk-pk,um pk-pk\n0,1,2\n1,2,4\n"),
              AllOf(HasSubstr("a.csv:2:"), HasSubstr("Disp X:x_pp_um"), HasSubstr("Disp Y:y_pp_um")));
  // A column that nobody asks for may have any unit; the one that is asked for, not.
  const std::string furlong = "Time,x,y\ns,um,furlong\n0,1,2\n1,2,4\n";
  EXPECT_EQ(units_error(furlong, {.columns = {"1:t_s", "2:x_um"}}), "");
  EXPECT_THAT(units_error(furlong), AllOf(HasSubstr("a.csv:2:"), HasSubstr("furlong")));
  EXPECT_NEAR(parse_csv(furlong, "a.csv", {.columns = {"1:t_s", "3:y_mm*201168"}})["y"][0], 402.336, 1e-9);
}

// A file that can be read, whose displacements no command of rotors would find.
TEST(CsvUnits, NamesOfARotorAreProposedForAFileWithoutThem) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "whirl_units_names.csv";
  const auto findings = [&](const std::string& text, const CsvOptions& options = {}) {
    std::ofstream(file) << text;
    return read_signals(file, options).findings;
  };
  const std::string rows = "0;1;2;3\n1;2;3;4\n2;4;5;6\n";
  const std::string german = "Zeit;Weg X;Weg Y;Drehwinkel\ns;\xC2\xB5m;\xC2\xB5m;\xC2\xB0\n" + rows;
  EXPECT_THAT(findings(german),
              ElementsAre(HasSubstr("--columns Zeit:t_s \"Weg X:x_um\" \"Weg Y:y_um\" Drehwinkel:beta_deg")));
  EXPECT_THAT(findings(german, {.columns = {"Zeit:t_s", "Weg X:x_um"}}), IsEmpty());
  EXPECT_THAT(findings("t_s;x_um;y_um;beta_deg\n" + rows), IsEmpty());
  EXPECT_THAT(findings("t_s;acc_g;force_N;V_V\n" + rows), IsEmpty());
  std::filesystem::remove(file);
}

TEST(CsvUnits, CommonSpellingsAreKnown) {
  for (const auto& [label, suffix] : {std::pair{"ips", "in_s"},
                                      {"thou", "mil"},
                                      {"milli-inch", "mil"},
                                      {"Mils", "mil"},
                                      {"micrometer", "um"},
                                      {"mum", "um"},
                                      {"m\xC2\xB7s\xE2\x81\xBB\xC2\xB2", "m_s2"},
                                      {"min\xE2\x81\xBB\xC2\xB9", "rpm"},
                                      {"inch/s", "in_s"},
                                      {"inches", "in"},
                                      {"tr/min", "rpm"},
                                      {"g's", "g"}}) {
    ASSERT_NE(unit_from_label(label), nullptr) << label;
    EXPECT_EQ(unit_from_label(label)->suffix, suffix) << label;
  }
  EXPECT_EQ(unit_from_label("um pp"), nullptr);  // a kind of amplitude is not dropped without a word
}

}  // namespace
}  // namespace whirl::io
