#include "whirl/expr/tape.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <random>

#include "random_expr.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/library.hpp"

namespace whirl::expr {
namespace {

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index cols, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(-2, 2);
  return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return uniform(rng); });
}

TEST(Tape, SharesSubexpressions) {
  const Tape tape =
      compile(parse_library({"X6^2*cos(X5)", "X6^2*sin(X5)", "X6*cos(X5)", "3*X6^2*cos(X5)"}), {"X5", "X6"});
  EXPECT_EQ(tape.steps().size(), 7u);  // X6*X6, cos, sin, three products, times 3
  EXPECT_EQ(tape.n_outputs(), 4u);
}

TEST(Tape, ConstantsVariablesAndDuplicatesAsOutputs) {
  const Tape tape = compile(parse_library({"1", "b", "a*b", "a*b", "a"}), {"a", "b"});
  Eigen::MatrixXd in(300, 2);
  in.col(0).setLinSpaced(0, 1);
  in.col(1).setConstant(2);
  const Eigen::MatrixXd out = tape.evaluate(in);
  EXPECT_TRUE((out.col(0).array() == 1).all());
  EXPECT_EQ(out.col(1), in.col(1));
  EXPECT_EQ(out.col(2), Eigen::VectorXd(2 * in.col(0)));
  EXPECT_EQ(out.col(3), out.col(2));
  EXPECT_EQ(out.col(4), in.col(0));
}

TEST(Tape, RefusesUnknownVariablesAndWrongSizes) {
  try {
    compile({Expr::parse("X1*X9")}, {"X1", "X2"});
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "term uses variable X9: available are X1, X2");
  }
  const Tape tape = compile({Expr::parse("X1")}, {"X1"});
  EXPECT_THROW(tape.evaluate(Eigen::MatrixXd::Zero(3, 2)), Error);
}

TEST(TapeProperty, BlocksPointsAndTreesAgree) {
  std::mt19937_64 rng(21);
  for (int round = 0; round < 30; ++round) {
    std::vector<Expr> terms;
    for (int k = 0; k < 12; ++k) terms.push_back(Expr::parse(testing::random_term(rng, 4)));
    const std::vector<std::string> names = {"X1", "X2", "X3", "t"};
    const Tape tape = compile(terms, names);
    const std::size_t moving = static_cast<std::size_t>(round) % 5;
    const Tape holding = compile(terms, names, moving);
    std::vector<double> slots;
    // A view into a larger matrix: columns are not adjacent; the number of rows leaves a partial block.
    const Eigen::MatrixXd all = random_matrix(700, 4, static_cast<unsigned>(round));
    const Eigen::Ref<const Eigen::MatrixXd> in = all.middleRows(20, 521);
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(600, 12);
    tape.evaluate(in, out.middleRows(10, 521));
    EXPECT_TRUE((out.topRows(10).array() == 0).all() && (out.bottomRows(69).array() == 0).all());
    for (Eigen::Index i = 0; i < in.rows(); i += 40) {
      const Eigen::RowVector4d row = in.row(i);
      double point[12];
      tape.evaluate_point(row.data(), point);
      double held[12];
      holding.hold(row.data() + moving, slots);
      for (const double by : {1.5, 0.0}) {  // the last of several points
        const Eigen::RowVector4d moved = row.array() + by;
        holding.evaluate_held(moved.data(), slots, held);
      }
      for (int k = 0; k < 12; ++k) {
        EXPECT_EQ(held[k], point[k]) << moving << " moving: " << terms[static_cast<std::size_t>(k)].str();
        EXPECT_EQ(point[k], out(10 + i, k)) << terms[static_cast<std::size_t>(k)].str();
        const double tree = evaluate(terms[static_cast<std::size_t>(k)],
                                     {{"X1", row[0]}, {"X2", row[1]}, {"X3", row[2]}, {"t", row[3]}});
        EXPECT_NEAR(point[k], tree, 1e-10 * (1 + std::abs(tree))) << terms[static_cast<std::size_t>(k)].str();
      }
    }
  }
}

TEST(TapeReference, RotorLibraryByHand) {
  const std::vector<std::string> names = {"X1", "X2", "X3", "X4", "X5", "X6"};
  const Tape tape = compile(rotor_library(), names);
  ASSERT_EQ(tape.n_outputs(), 17u);
  const Eigen::MatrixXd in = random_matrix(50, 6, 3);
  const Eigen::MatrixXd out = tape.evaluate(in);
  for (Eigen::Index i = 0; i < in.rows(); ++i) {
    const double x = in(i, 0), v = in(i, 1), y = in(i, 2), w = in(i, 3), b = in(i, 4), r = in(i, 5);
    const double expected[] = {1,
                               x,
                               x * x * x,
                               v,
                               r * r * std::cos(b),
                               r * r * std::sin(b),
                               r * std::cos(b),
                               r * std::sin(b),
                               y,
                               y * y * y,
                               w,
                               x * y * y,
                               x * x * y,
                               r,
                               r * r,
                               std::sin(b),
                               std::cos(b)};
    for (int k = 0; k < 17; ++k) EXPECT_NEAR(out(i, k), expected[k], 1e-15 * (1 + std::abs(expected[k]))) << k;
  }
}

TEST(TapeExport, C99GivesTheSameBits) {
  std::mt19937_64 rng(31);
  std::vector<Expr> terms;
  for (int k = 0; k < 40; ++k) terms.push_back(Expr::parse(testing::random_term(rng, 4)));
  const Tape tape = compile(terms, {"X1", "X2", "X3", "t"});
  Tape::C99Options options;
  for (std::size_t k = 0; k < terms.size(); ++k) options.outputs.push_back("out[" + std::to_string(k) + "]");
  const std::string base = ::testing::TempDir() + "whirl_tape_c99";
  {
    std::ofstream c(base + ".c");
    c << "#include <math.h>\n#include <stdio.h>\n"
      << "static void f(double X1, double X2, double X3, double t, double* out) {\n"
      << "  (void)X1; (void)X2; (void)X3; (void)t;\n"
      << tape.c99(options) << "}\n"
      << "int main(void) {\n  double x[4], out[40];\n"
      << "  while (scanf(\"%la %la %la %la\", x, x + 1, x + 2, x + 3) == 4) {\n    f(x[0], x[1], x[2], x[3], out);\n"
      << "    for (int k = 0; k < 40; ++k) printf(\"%a\\n\", out[k]);\n  }\n  return 0;\n}\n";
  }
  const Eigen::MatrixXd in = random_matrix(200, 4, 5);
  {
    std::ofstream points(base + ".in");
    for (Eigen::Index i = 0; i < in.rows(); ++i) {
      points << fmt::format("{:a} {:a} {:a} {:a}\n", in(i, 0), in(i, 1), in(i, 2), in(i, 3));
    }
  }
  const std::string build =
      "cc -std=c99 -Wall -Wextra -Wconversion -pedantic -Werror -ffp-contract=off -o " + base + " " + base + ".c -lm";
  ASSERT_EQ(std::system(build.c_str()), 0);
  ASSERT_EQ(std::system((base + " < " + base + ".in > " + base + ".out").c_str()), 0);
  std::ifstream result(base + ".out");
  const Eigen::MatrixXd expected = tape.evaluate(in);
  std::string text;
  for (Eigen::Index i = 0; i < in.rows(); ++i) {
    for (Eigen::Index k = 0; k < 40; ++k) {
      ASSERT_TRUE(result >> text);
      EXPECT_EQ(std::strtod(text.c_str(), nullptr), expected(i, k)) << terms[static_cast<std::size_t>(k)].str();
    }
  }
}

}  // namespace
}  // namespace whirl::expr
