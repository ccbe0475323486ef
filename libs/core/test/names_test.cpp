#include "whirl/core/names.hpp"

#include <gtest/gtest.h>

namespace whirl {
namespace {

TEST(Names, IdentifiersAreVariablesOfEquations) {
  for (const char* good : {"x", "_a", "X12", "x'", "beta''", "Weg_links"}) EXPECT_TRUE(is_identifier(good)) << good;
  for (const char* bad : {"", "1x", "x y", "x'y", "'", "a-b", "\xCE\xB2", "x\n", "X5*/", "a.b", "x'''''''''"})
    EXPECT_FALSE(is_identifier(bad)) << bad;
  EXPECT_FALSE(is_identifier(std::string(129, 'x')));
  EXPECT_TRUE(is_identifier(std::string(128, 'x')));
  for (const char* at_the_end : {"a0", "z9", "A", "Z", "_", "x''"}) EXPECT_TRUE(is_identifier(at_the_end));
  for (const char* beside : {"@", "[", "`", "{", "/", ":", "x/", "x:", "x@", "x[", "x`", "x{"})
    EXPECT_FALSE(is_identifier(beside)) << beside;
  EXPECT_TRUE(is_left_side("x[k+1]"));
  EXPECT_FALSE(is_left_side("x[k+1]'"));
  EXPECT_FALSE(is_left_side("x[k]"));
}

TEST(Names, LabelsAreOneLineForPeople) {
  for (const char* good : {"", "e*cos(phi)", "v': x^3", "Probe 1 [mm]", "\xCE\xB2 und \xC3\xA4", "runout1+_re"})
    EXPECT_TRUE(is_label(good)) << good;
  for (const char* bad :
       {"a\nb", "a\rb", "\x1b[31m", "\xff", "\xc0\xaf", "a\xE2\x80\xA8z", "a\xE2\x80\xAE", "\xC2\x85"})
    EXPECT_FALSE(is_label(bad)) << bad;
}

TEST(Names, UnitsHoldNoCommentSigns) {
  for (const char* good : {"", "1", "m/s^2", "1/(m^2 s^2)", "kg m^2", "N*m", "\xC2\xB5m", "%", "m/s^0.5"})
    EXPECT_TRUE(is_unit_text(good)) << good;
  for (const char* bad : {"m*/s", "m/*s", "m//s", "1\n}", "m;", "\"", "m{s}", "\\m", "m**2", "#"})
    EXPECT_FALSE(is_unit_text(bad)) << bad;
}

TEST(Names, OneLineKeepsWhatIsPrintableAndReplacesTheRest) {
  EXPECT_EQ(one_line("a\nb\tc\x1b"), "a b c ");
  EXPECT_EQ(one_line("\xCE\xB2\xff\xCE"), "\xCE\xB2??");
  EXPECT_EQ(one_line("a\xE2\x80\xA9z"), "a z");
}

TEST(Names, CharactersAtTheEndsOfWhatUtf8MayHold) {
  for (const char* good :
       {"a\xC2\xA0z", "\xED\x9F\xBF", "\xEE\x80\x80", "\xF4\x8F\xBF\xBF", "\xC2\xA1", "\xE0\xA0\x80"})
    EXPECT_EQ(one_line(good), good);
  for (const char* surrogate : {"\xED\xA0\x80", "\xED\xBF\xBF"}) EXPECT_EQ(one_line(surrogate), "???");
  EXPECT_EQ(one_line("\xF4\x90\x80\x80"), "????") << "above U+10FFFF";
  for (const char* hidden : {"\x7F", "\xC2\x9F", "\x1F", "\xE2\x80\x8B", "\xE2\x80\x8F", "\xE2\x80\xA8", "\xE2\x80\xAE",
                             "\xE2\x81\xA0", "\xE2\x81\xAF", "\xEF\xBB\xBF"})
    EXPECT_EQ(one_line(hidden), " ");
  for (const char* beside :
       {"\xE2\x80\x8A", "\xE2\x80\x90", "\xE2\x80\xA7", "\xE2\x80\xAF", "\xE2\x81\x9F", "\xE2\x81\xB0"})
    EXPECT_EQ(one_line(beside), beside);
}

}  // namespace
}  // namespace whirl
