// The solver inside the exported implicit law, by itself: it ends by rounding in float as in double, not at its last
// step.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "whirl/testing/compiled.hpp"
#include "whirl/testing/paths.hpp"

namespace whirl::testing {
namespace {

constexpr const char* kAround = R"(#include <math.h>
#include <stdint.h>
typedef {0} whirl_real;
static int powers;
static {0} counted_pow({0} a, {0} b) {{ ++powers; return pow{1}(a, b); }}
static {0} counted_fabs({0} a) {{ return fabs{1}(a); }}
static {0} counted_sqrt({0} a) {{ return sqrt{1}(a); }}
static {0} counted_fmin({0} a, {0} b) {{ return fmin{1}(a, b); }}
static {0} counted_copysign({0} a, {0} b) {{ return copysign{1}(a, b); }}
#define M(f) counted_##f
#define R(v) (({0})v)
#include "implicit_power.c"
{0} solve({0} x, {0} g, {0} r) {{ powers = 0; return whirl_implicit_power(x, g, r); }}
int count(void) {{ return powers; }}
)";

template <class Real>
void check(const char* type, const char* suffix, double precision) {
  const TemporaryFolder folder;
  std::ifstream in(source_dir() + "/libs/deploy/c/implicit_power.c");
  std::ostringstream text;
  text << in.rdbuf();
  folder.write("implicit_power.c", text.str());
  folder.write("solve.c", fmt::format(fmt::runtime(kAround), type, suffix));
  const ShellResult built =
      shell(folder.path(), "cc -std=c99 -O2 -ffp-contract=off -shared -fPIC solve.c -o solve.so -lm");
  ASSERT_EQ(built.exit_code, 0) << built.text;
  const SharedLibrary library(folder.path() / "solve.so");
  auto* solve = library.get<Real(Real, Real, Real)>("solve");
  auto* count = library.get<int()>("count");
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  long steps = 0;
  int most = 0;
  constexpr int kCases = 20000;
  for (int k = 0; k < kCases; ++k) {
    const double x = (k % 2 ? 1 : -1) * std::exp(-12 + 16 * unit(random)), g = std::exp(-9 + 8 * unit(random));
    const double r = 0.55 + 0.44 * unit(random);
    const double z = solve(Real(x), Real(g), Real(r));
    // The root of the rounded inputs, by bisection.
    double low = 0, high = std::abs(double(Real(x)));
    for (int i = 0; i < 200; ++i) {
      const double mid = 0.5 * (low + high);
      (mid + double(Real(g)) * std::pow(mid, double(Real(r))) > std::abs(double(Real(x))) ? high : low) = mid;
    }
    ASSERT_NEAR(std::abs(z), low, precision * low) << x << " " << g << " " << r;
    steps += count();
    most = std::max(most, count());
  }
  // One power before, one behind and one per step.
  EXPECT_LE(most, 12);
  EXPECT_LE(most, 2.0 * static_cast<double>(steps) / kCases) << "worst / mean";
}

TEST(ImplicitPowerExport, FloatEndsAsSoonAsDouble) {
  if (!has_program("cc")) GTEST_SKIP() << "no C compiler";
  check<double>("double", "", 1e-12);
  check<float>("float", "f", 1e-5);
}

}  // namespace
}  // namespace whirl::testing
