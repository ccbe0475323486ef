#include "whirl/report/equation.hpp"

#include <gtest/gtest.h>

#include <pugixml.hpp>

#include "whirl/core/error.hpp"

namespace whirl::report {
namespace {

TEST(ReportEquation, TermsInMathml) {
  EXPECT_EQ(term_mathml("X6^2*cos(X5)", rotor_names()),
            "<mrow><msup><mover accent=\"true\"><mi>β</mi><mo>˙</mo></mover><mn>2</mn></msup><mspace width=\"0.17em\"/>"
            "<mrow><mi>cos</mi><mo>&#x2061;</mo><mspace width=\"0.17em\"/><mi>β</mi></mrow></mrow>");
  EXPECT_EQ(term_mathml("K1"), "<msub><mi>K</mi><mn>1</mn></msub>");
  EXPECT_EQ(term_mathml("a/b"), "<mrow><mfrac><mrow><mi>a</mi></mrow><mrow><mi>b</mi></mrow></mfrac></mrow>");
}

TEST(ReportEquation, TermsInLatexAndText) {
  EXPECT_EQ(term_latex("X6^2*cos(X5)", rotor_names()), "\\dot{\\beta}^{2} \\cos\\left(\\beta\\right)");
  EXPECT_EQ(term_latex("u_x"), "u_{x}");
  EXPECT_EQ(term_text("X1*X3^2", rotor_names()), "x·y²");
  EXPECT_EQ(term_text("X2", rotor_names()), "x\u0307");
}

TEST(ReportEquation, PrimesBecomeDots) {
  EXPECT_EQ(term_latex("X2'", rotor_names()), "\\ddot{x}");
  EXPECT_EQ(term_latex("x'"), "\\dot{x}");
}

TEST(ReportEquation, CoefficientsCarrySignAndUncertainty) {
  const Equation equation{"X2'",
                          {{"X1", Estimate::from_sd(-5667.31, 0.42), "1/s^2"},
                           {"X2", Estimate::from_sd(41.172, 0.113), "1/s"},
                           {"1", {-1e-7, NAN, NAN, NAN}, "m/s^2"}}};
  EXPECT_EQ(to_text(equation, rotor_names()), "x\u0308 = − (5667.3 ± 0.4) x + (41.17 ± 0.11) x\u0307 − 1.0000×10⁻⁷");
  EXPECT_EQ(to_latex(equation, rotor_names()),
            "\\ddot{x} ={}& - (5667.3 \\pm 0.4) \\, x + (41.17 \\pm 0.11) \\, \\dot{x} - 1.0000 \\times 10^{-7}");
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(to_mathml(equation, rotor_names()).c_str()));
  EXPECT_EQ(to_text(Equation{"x'", {}}), "x\u0307 = 0");
  const Equation tied{"y'", {{"a + b", {2, 0.1, 1.8, 2.2}, ""}}};
  EXPECT_EQ(to_text(tied), "y\u0307 = (2.00 ± 0.10) (a + b)");
  EXPECT_NE(to_latex(tied).find("\\left(a + b\\right)"), std::string::npos) << to_latex(tied);
}

TEST(ReportEquation, EveryKindOfTermIsWellFormed) {
  for (const char* term : {"X1", "-X1", "2", "-2.5e-7", "X1^-2", "X1^0.5", "sqrt(X1*X2)", "sin(X5)^2", "abs(X6)*X6",
                           "sgn(X6)", "X1*(X1^2+X3^2)", "max(X1, 3)", "exp(-3*t)*cos(40*t)", "a-b-c", "(a+b)/(c-d)",
                           "x^(y+1)", "(x^2)^y", "-(a+b)", "1/(a*b)"}) {
    pugi::xml_document document;
    const std::string xml = "<math>" + term_mathml(term) + "</math>";
    EXPECT_TRUE(document.load_string(xml.c_str())) << term << ": " << xml;
    EXPECT_FALSE(term_latex(term).empty());
  }
  EXPECT_THROW((void)term_mathml("X1*"), Error);
}

}  // namespace
}  // namespace whirl::report
