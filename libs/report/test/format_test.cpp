#include "whirl/report/format.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace whirl::report {
namespace {

TEST(ReportFormat, SignificantDigits) {
  EXPECT_EQ(format_number(1234.56, 4), "1235");
  EXPECT_EQ(format_number(0.001234, 2), "0.0012");
  EXPECT_EQ(format_number(9.996, 3), "10.0");
  EXPECT_EQ(format_number(-2.5, 2), "−2.5");
  EXPECT_EQ(format_number(0, 3), "0");
  EXPECT_EQ(format_number(1.8492e9, 5), "1.8492×10⁹");
  EXPECT_EQ(format_number(-5.1e-7, 2), "−5.1×10⁻⁷");
  EXPECT_EQ(format_number(NAN), "–");
  EXPECT_EQ(format_number(-INFINITY), "−∞");
}

TEST(ReportFormat, NoNegativeZero) {
  EXPECT_EQ(format_fixed(-0.0004, 2), "0.00");
  EXPECT_EQ(format_fixed(-0.0, 1), "0.0");
}

TEST(ReportFormat, EngineeringUnits) {
  EXPECT_EQ(format_quantity(20.56e-6, Quantity::displacement), "20.6 µm");
  EXPECT_EQ(format_quantity(3.25e-3, Quantity::displacement), "3.25 mm");
  EXPECT_EQ(format_quantity(27.75, Quantity::frequency), "27.8 Hz");
  EXPECT_EQ(format_quantity(2.5e-4, Quantity::time, 2), "250 µs");
  EXPECT_EQ(format_quantity(0.5, Quantity::dimensionless, 1), "0.5");
}

TEST(ReportFormat, AmplitudesNameTheirKind) {
  EXPECT_EQ(format_amplitude(3.25e-3, AmplitudeKind::peak), "3.25 mm peak");
  EXPECT_EQ(format_amplitude(6.45e-3, AmplitudeKind::peak_to_peak), "6.45 mm p-p");
  EXPECT_EQ(format_amplitude(1.2, AmplitudeKind::rms, Quantity::force, 2), "1.2 N rms");
}

TEST(ReportFormat, EstimateRoundedByItsDeviation) {
  EXPECT_EQ(format_estimate(Estimate::from_sd(5667.31, 0.42), "1/s^2"), "(5667.3 ± 0.4) 1/s²");
  EXPECT_EQ(format_estimate(Estimate::from_sd(-41.172, 0.113)), "−41.17 ± 0.11");
  EXPECT_EQ(format_estimate(Estimate::from_sd(1.8492e9, 4e5)), "(1.8492 ± 0.0004)×10⁹");
  // A deviation that rounds up to the next power of ten, and one larger than the value.
  EXPECT_EQ(format_estimate(Estimate::from_sd(3.0, 0.0999)), "3.00 ± 0.10");
  EXPECT_EQ(format_estimate(Estimate::from_sd(0.02, 5.0)), "0 ± 5");
  // Digits left of the point are not invented: the deviation is in the hundreds.
  EXPECT_EQ(format_estimate(Estimate::from_sd(36125, 310)), "(3.61 ± 0.03)×10⁴");
  EXPECT_EQ(format_estimate({2.5, NAN, NAN, NAN}, "m"), "2.5000 m");
}

TEST(ReportFormat, UnitsWithSuperscripts) {
  EXPECT_EQ(pretty_unit("1/(m^2 s^2)"), "1/(m² s²)");
  EXPECT_EQ(pretty_unit("m^-1*N"), "m⁻¹·N");
  EXPECT_EQ(pretty_unit("x^y"), "x^y");
}

TEST(ReportFormat, MarkupAndCsvAreEscaped) {
  EXPECT_EQ(escape_markup("a<b & \"c\" > 'd'"), "a&lt;b &amp; &quot;c&quot; &gt; &#39;d&#39;");
  EXPECT_EQ(escape_markup(std::string_view("a\x01"
                                           "b\0c",
                                           5)),
            "abc");
  EXPECT_EQ(escape_csv("a,\"b\""), "\"a,\"\"b\"\"\"");
  EXPECT_EQ(escape_csv("plain"), "plain");
}

}  // namespace
}  // namespace whirl::report
