#include "whirl/expr/expr.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <unordered_set>

#include "random_expr.hpp"
#include "whirl/core/error.hpp"

namespace whirl::expr {
namespace {

using ::testing::HasSubstr;

Expr P(std::string_view text) { return Expr::parse(text); }
std::string parse_error(std::string_view text) {
  try {
    P(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ExprParse, ReadsPrecedenceAndNames) {
  const std::map<std::string, double, std::less<>> at = {{"x", 3}, {"X2'", 5}, {"_u1", 7}, {"t", 2}};
  EXPECT_EQ(evaluate(P("-x^2"), at), -9);
  EXPECT_EQ(evaluate(P("2^-1"), at), 0.5);
  EXPECT_EQ(evaluate(P("2^t^x"), at), 256);
  EXPECT_EQ(evaluate(P("t**x"), at), 8);
  EXPECT_EQ(evaluate(P("12/x/t"), at), 2);
  EXPECT_EQ(evaluate(P("1 - x - t"), at), -4);
  EXPECT_EQ(evaluate(P("X2'*_u1 + 1.5e1"), at), 50);
  EXPECT_EQ(evaluate(P("--x"), at), 3);
  EXPECT_EQ(evaluate(P("max(x, t) - min(x, t)"), at), 1);
  EXPECT_EQ(evaluate(P("sgn(0*x) + sgn(-x)"), at), -1);
  EXPECT_DOUBLE_EQ(evaluate(P("cos(pi)"), at), -1);
}

TEST(ExprParse, ErrorsNameColumnAndExpectation) {
  EXPECT_THAT(parse_error("X6^2*cos(X5"), HasSubstr("column 12: expected ')' or an operator, found the end"));
  EXPECT_THAT(parse_error("X1 + * X2"), HasSubstr("column 6: expected a number, a variable or '(', found '*'"));
  EXPECT_THAT(parse_error("X1 X2"), HasSubstr("column 4: expected an operator or the end, found 'X'"));
  EXPECT_THAT(parse_error("foo(X1)"), HasSubstr("column 1: unknown function foo: known are abs"));
  EXPECT_THAT(parse_error("2*sin X1"), HasSubstr("column 7: expected '(' after sin"));
  EXPECT_THAT(parse_error("sin(X1, X2)"), HasSubstr("sin takes 1 argument, found 2"));
  EXPECT_THAT(parse_error("x/(1 - 1)"), HasSubstr("column 2: division by zero"));
  EXPECT_THAT(parse_error("log(-1)"), HasSubstr("column 1: log(-1) is not a finite number"));
  EXPECT_THAT(parse_error(""), HasSubstr("column 1: expected a number"));
  EXPECT_THAT(parse_error("1e999"), HasSubstr("column 1: number out of range"));
  EXPECT_THAT(parse_error("x # y"), HasSubstr("found '#'"));
  EXPECT_THAT(parse_error("x \xc3\xa9"), HasSubstr("found byte 0xc3"));
}

TEST(ExprParse, RefusesHostileInputWithoutOverflow) {
  EXPECT_THAT(parse_error(std::string(50000, '(')), HasSubstr("nested more than 200 levels"));
  std::string towers = "x";
  for (int i = 0; i < 20000; ++i) towers += "^x";
  EXPECT_THAT(parse_error(towers), HasSubstr("nested more than 200 levels"));
  EXPECT_THAT(parse_error(std::string(200000, 'x')), HasSubstr("at most 100000"));
  EXPECT_EQ(P(std::string(40000, '-') + "x"), P("x"));
  std::string terms = "0";
  for (int i = 0; i < 9000; ++i) terms += "+x" + std::to_string(i);
  EXPECT_EQ(P(terms).args().size(), 9000u);
  EXPECT_THROW(
      {
        Expr e = P("x");
        for (int i = 0; i < 100000; ++i) e = sin(e) + Expr::symbol("y");
      },
      Error);
  EXPECT_THROW(
      {
        Expr e = P("x");
        for (int i = 0; i < 60; ++i) e = sin(e) + cos(e);
      },
      Error);
}

TEST(ExprCanonical, EqualTermsAreEqualAndHashEqual) {
  const std::pair<const char*, const char*> same[] = {{"X1*X3^2", "X3*X1*X3"},      {"x + y - x", "y"},
                                                      {"2*(x + y)", "2*x + 2*y"},   {"x/x", "1"},
                                                      {"sin(-x)", "-sin(x)"},       {"cos(x - y)", "cos(y - x)"},
                                                      {"abs(-3*x)", "abs(3*x)"},    {"(x*y)^3", "x^3*y^3"},
                                                      {"(x^2)^3", "x^6"},           {"sqrt(x)^2*0 + 1", "1"},
                                                      {"abs(x)^2", "x^2"},          {"exp(x)^2", "exp(2*x)"},
                                                      {"x^2*x^-2*y", "y"},          {"1/(x*y)", "x^-1/y"},
                                                      {"min(x, y)", "min(y, x)"},   {"abs(x)^0.5*abs(x)^1.5", "x^2"},
                                                      {"1/sqrt(x)", "x^-0.5"},      {"3*x - x - 2*x", "0"},
                                                      {"X6*abs(X6)", "abs(X6)*X6"}, {"(-x - y)*z", "-(x + y)*z"},
                                                      {"(y - x)^3", "-(x - y)^3"},  {"1/(-x - y)", "-1/(x + y)"}};
  for (const auto& [a, b] : same) {
    EXPECT_EQ(P(a), P(b)) << a << " and " << b << ": " << P(a).str() << ", " << P(b).str();
    EXPECT_EQ(P(a).hash(), P(b).hash()) << a;
  }
  EXPECT_FALSE(P("sqrt(x)*sqrt(x)") == P("x")) << "differs for x < 0";
  EXPECT_FALSE(P("sqrt(x^2)") == P("x")) << "differs for x < 0";
  EXPECT_FALSE(P("x*abs(x)") == P("x^2"));
}

TEST(ExprPrint, Text) {
  const std::pair<const char*, const char*> cases[] = {{"cos(X5)*X6^2", "X6^2*cos(X5)"},
                                                       {"X10 + X2 + 1", "X2 + X10 + 1"},
                                                       {"-K1/m*x", "-K1*x/m"},
                                                       {"a/(b*c)", "a/(b*c)"},
                                                       {"(a + b)^2/c", "(a + b)^2/c"},
                                                       {"-(x - y)", "-x + y"},
                                                       {"sqrt(x)", "sqrt(x)"},
                                                       {"2^x", "2^x"},
                                                       {"x^-2", "1/x^2"},
                                                       {"x^(y + 1)", "x^(y + 1)"},
                                                       {"0.1*x", "0.1*x"},
                                                       {"(x^2)^0.3", "(x^2)^0.3"}};
  for (const auto& [in, out] : cases) EXPECT_EQ(P(in).str(), out);
}

TEST(ExprPrint, OtherNotations) {
  EXPECT_EQ(to_latex(P("-K1*X1/m + beta^2*cos(X5)")), "-\\frac{K_{1} X_{1}}{m} + \\beta^{2} \\cos\\left(X_{5}\\right)");
  EXPECT_EQ(to_latex(P("1.5e-5*abs(X2')")), "1.5 \\cdot 10^{-5} \\left|X_{2}'\\right|");
  EXPECT_EQ(to_latex(P("sin(x)^2/sqrt(y)")), "\\frac{\\sin^{2}\\left(x\\right)}{\\sqrt{y}}");
  EXPECT_EQ(to_c99(P("X2^3 - 2*sgn(X6)/X1^2")), "-2.0*((X6 > 0) - (X6 < 0))/(X1*X1) + X2*X2*X2");
  EXPECT_EQ(to_c99(P("abs(x)^1.5")), "pow(fabs(x), 1.5)");
  EXPECT_EQ(print(P("sgn(x)*x^2"), Notation::matlab), "x^2*sign(x)");
  EXPECT_EQ(print(P("min(x, 2)^3"), Notation::python), "np.minimum(2, x)**3");
  PrintOptions options;
  options.name = [](std::string_view name) { return "s->" + std::string(name); };
  EXPECT_EQ(print(P("2*X1"), Notation::c99, options), "2.0*s->X1");
}

TEST(ExprCalculus, Derivatives) {
  EXPECT_EQ(differentiate(P("X1*X3^2"), "X3"), P("2*X1*X3"));
  EXPECT_EQ(differentiate(P("X6*abs(X6)"), "X6"), P("abs(X6) + X6*sgn(X6)"));
  EXPECT_EQ(differentiate(P("cos(w*t)"), "t"), P("-w*sin(w*t)"));
  EXPECT_EQ(differentiate(P("a^x"), "x"), P("a^x*log(a)"));
  EXPECT_EQ(differentiate(P("x"), "y"), P("0"));
  EXPECT_EQ(expand(P("(x + y)^3*(x - y)")), P("x^4 + 2*x^3*y - 2*x*y^3 - y^4"));
  EXPECT_EQ(substitute(P("x^2 + y"), {{"x", P("a + b")}, {"y", P("-(a + b)^2")}}), P("0"));
  const std::vector<std::string> names = variables(P("X10*X2 + sin(t)"));
  EXPECT_EQ(names, (std::vector<std::string>{"X2", "X10", "t"}));
  EXPECT_EQ(split_coefficient(P("-3*x*y")).first, -3);
  EXPECT_EQ(split_coefficient(P("-3*x*y")).second, P("x*y"));
}

const std::map<std::string, double, std::less<>> kPoint = {{"X1", 0.7}, {"X2", -1.3}, {"X3", 0.4}, {"t", 1.9}};

TEST(ExprProperty, TextRoundTripsAndKeepsTheValue) {
  std::mt19937_64 rng(7);
  std::unordered_set<Expr> seen;
  for (int i = 0; i < 2000; ++i) {
    const std::string text = testing::random_term(rng, 4);
    const Expr e = P(text);
    const Expr again = P(e.str());
    EXPECT_EQ(e, again) << text << "\n  " << e.str() << "\n  " << again.str();
    EXPECT_EQ(e.hash(), again.hash()) << text;
    const double a = evaluate(e, kPoint), b = evaluate(again, kPoint);
    EXPECT_EQ(a, b) << text;
    seen.insert(e);
  }
  EXPECT_GT(seen.size(), 1500u);
}

// Powers of powers and quotients of powers, which meet again only after printing.
TEST(ExprProperty, WildTermsRoundTripAndKeepTheValue) {
  std::mt19937_64 rng(21);
  const std::map<std::string, double, std::less<>> at = {{"X1", 1.3}, {"X2", -0.7}, {"X3", 2.1}};
  int read = 0, compared = 0;
  for (int i = 0; i < 20000; ++i) {
    const testing::WildTerm term = testing::wild_term(rng, 2 + i % 4);
    Expr e;
    try {
      e = P(term.text);
    } catch (const Error&) {
      continue;  // a constant part is undefined
    }
    ++read;
    const Expr again = P(e.str());
    EXPECT_EQ(e, again) << term.text << "\n  " << e.str() << "\n  " << again.str();
    EXPECT_EQ(e.hash(), again.hash()) << term.text;
    if (!(std::abs(term.value) > 1e-6)) continue;
    ++compared;
    EXPECT_NEAR(evaluate(e, at), term.value, 1e-7 * std::abs(term.value)) << term.text << "\n  " << e.str();
  }
  EXPECT_GT(read, 15000);
  EXPECT_GT(compared, 10000);
}

TEST(ExprCanonical, PowersOfOneBaseMeetWhereverTheyStand) {
  const Expr e = P("-(X1^2e-3*X2)/(1 + abs(X4))^exp(-2.5e-3*X2)/(1 + abs(X4))");
  EXPECT_EQ(P(e.str()), e);
  EXPECT_EQ(e, P("-X1^0.002*X2*(1 + abs(X4))^(-1 - exp(-0.0025*X2))"));
  EXPECT_EQ(P("1/2^x/2^y"), P("2^(-x - y)"));
  EXPECT_EQ(P("(x - y)*(y - x)"), P("-(x - y)^2"));
  EXPECT_EQ(P("(x - y)/(y - x)"), P("-1"));
  EXPECT_EQ(P("exp(x)^y*exp(x)"), P("exp(x*y)*exp(x)"));
  EXPECT_FALSE(P("(x^y)^2") == P("x^(2*y)"));  // x may be negative
}

TEST(ExprProperty, OrderIsTotal) {
  std::mt19937_64 rng(8);
  std::vector<Expr> terms;
  for (int i = 0; i < 120; ++i) terms.push_back(P(testing::random_term(rng, 2)));
  for (const char* text : {"x^0.5", "(x*y)^0.5", "(x^2)^0.5", "x^-1", "x^2", "x", "x*y", "y^x", "(x + y)^2", "2*x"})
    terms.push_back(P(text));
  for (const Expr& a : terms) {
    for (const Expr& b : terms) {
      EXPECT_EQ(compare(a, b), -compare(b, a));
      if (compare(a, b) > 0) continue;
      for (const Expr& c : terms) {
        if (compare(b, c) <= 0) {
          ASSERT_LE(compare(a, c), 0) << a.str() << " ; " << b.str() << " ; " << c.str();
        }
      }
    }
  }
}

TEST(ExprProperty, DerivativeMatchesDifferenceQuotient) {
  std::mt19937_64 rng(9);
  int compared = 0;
  for (int i = 0; i < 500; ++i) {
    const Expr e = P(testing::random_term(rng, 3));
    const auto value = [&](double x) {
      auto at = kPoint;
      at["X1"] = x;
      return evaluate(e, at);
    };
    const double x = kPoint.at("X1"), h = 1e-5;
    const double slope = (value(x + h) - value(x - h)) / (2 * h);
    const double left = (value(x) - value(x - h)) / h, right = (value(x + h) - value(x)) / h;
    if (std::abs(left - right) > 1e-2 * (1 + std::abs(slope))) continue;  // a kink or a jump lies between
    EXPECT_NEAR(evaluate(differentiate(e, "X1"), kPoint), slope, 1e-5 * (1 + std::abs(slope))) << e.str();
    ++compared;
  }
  EXPECT_GT(compared, 450);
}

TEST(ExprProperty, ExpandAndSubstituteKeepTheValue) {
  std::mt19937_64 rng(10);
  for (int i = 0; i < 300; ++i) {
    const Expr e = P(testing::random_term(rng, 3));
    const double value = evaluate(e, kPoint);
    EXPECT_NEAR(evaluate(expand(e), kPoint), value, 1e-9 * (1 + std::abs(value))) << e.str();
    auto at = kPoint;
    at["s"] = 0.2;
    at["X1"] = std::sin(0.2) + 2;
    const double expected = evaluate(e, at);
    EXPECT_NEAR(evaluate(substitute(e, {{"X1", P("sin(s) + 2")}}), at), expected, 1e-9 * (1 + std::abs(expected)))
        << e.str();
  }
}

TEST(ExprProperty, AnyBytesGiveATermOrAnError) {
  std::mt19937_64 rng(11);
  static constexpr std::string_view alphabet = "X1t+-*/^()., 0e9.'sincoabgqrtlhpmx\t\xff#";
  int parsed = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text;
    for (int n = static_cast<int>(rng() % 24); n > 0; --n) text += alphabet[rng() % alphabet.size()];
    if (i % 2 == 0) {  // a valid term, damaged
      std::string valid = testing::random_term(rng, 2);
      valid[rng() % valid.size()] = alphabet[rng() % alphabet.size()];
      text = valid;
    }
    try {
      const Expr e = P(text);
      EXPECT_EQ(P(e.str()), e) << text;
      ++parsed;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("column")) << text;
    }
  }
  EXPECT_GT(parsed, 2000);
}

}  // namespace
}  // namespace whirl::expr
