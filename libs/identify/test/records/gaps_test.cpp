#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/identify/identify.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/testing/gappy_text.hpp"
#include "whirl/testing/machines.hpp"
#include "whirl/testing/oscillators.hpp"

namespace whirl::identification {
namespace {

using testing::Gaps;

Recording read(const std::string& text, std::vector<std::string>& remarks) {
  io::CsvOptions options;
  options.gaps = true;
  const io::RemarkHandler before =
      io::set_remark_handler([&](const std::string&, const std::string& said) { remarks.push_back(said); });
  Recording record = io::parse_csv(text, "made.csv", options);
  io::set_remark_handler(before);
  return record;
}

class GapsProperty : public ::testing::TestWithParam<Gaps> {};

// Errors of a rotor from a record with gaps are those of the record without, within the intervals; what was done is
// said.
TEST_P(GapsProperty, RotorFromWhatALoggerWrote) {
  constexpr int kFiner = 10;
  for (const unsigned seed : {61u, 62u, 63u}) {
    SCOPED_TRACE(seed);
    testing::DrawnMachine drawn = testing::draw_machine(testing::Oddity::none, seed);
    drawn.run.dt /= kFiner;
    const Eigen::MatrixX2d clean = testing::readings(drawn.machine, drawn.run);
    const Recording fine = testing::machine_record(clean, drawn.run);
    const double noise = 0.1 * std::sqrt(clean.squaredNorm() / static_cast<double>(clean.size()));
    std::vector<std::string> remarks;
    const Recording r =
        read(testing::gappy_text(fine, kFiner, {"t_s", "x_m", "y_m", "beta_rad"}, 2, noise, GetParam(), seed), remarks);
    const Identification found = identify(r);
    EXPECT_NE(found.summary.status, Status::unusable) << found.summary.warnings.back();
    EXPECT_THAT(found.summary.trust, ::testing::StartsWith("Trust"));
    EXPECT_EQ(found.evidence.held_out.reason, "");
    EXPECT_GT(found.summary.chi_square, 0.8);
    EXPECT_LT(found.summary.chi_square, 1.2);
    for (const auto& [name, truth, most] :
         {std::tuple("k1", drawn.machine.k, 5e-4), std::tuple("k2", drawn.machine.cubic, 0.03),
          std::tuple("c", drawn.machine.c, 0.01), std::tuple("e", drawn.machine.e, 0.006)}) {
      const Estimate& e = *found.model.parameter(name);
      EXPECT_LT(std::abs(e.value - truth), 4 * e.sd) << name;
      EXPECT_LT(std::abs(e.value / truth - 1), most) << name;
    }
    if (GetParam() == Gaps::none) {
      EXPECT_TRUE(remarks.empty());
    } else {
      EXPECT_GT(remarks.size() + found.summary.warnings.size(), 0u);
    }
  }
}

// The same of an oscillator with a free library.
TEST_P(GapsProperty, LibraryFromWhatALoggerWrote) {
  constexpr int kFiner = 10;
  std::size_t true_terms = 0, all_found = 0, all_terms = 0;
  for (const unsigned seed : {71u, 72u}) {
    SCOPED_TRACE(seed);
    const testing::Oscillator o = testing::oscillators(seed).front();
    const Recording fine = testing::oscillator_record(o, 5e-3 / kFiner, 4000 * kFiner, 0, seed);
    const double noise = 0.01 * std::sqrt(fine["y"].squaredNorm() / static_cast<double>(fine.size()));
    std::vector<std::string> remarks;
    const Recording r =
        read(testing::gappy_text(fine, kFiner, {"t_s", "y_m", "u_m_s2"}, 1, noise, GetParam(), seed), remarks);
    IdentifyOptions options;
    options.method = Method::sindy;
    options.sindy.states = {"y"};
    options.sindy.inputs = {"u"};
    options.sindy.order = 2;
    const Identification found = identify(r, options);
    EXPECT_NE(found.summary.status, Status::unusable) << found.summary.warnings.back();
    EXPECT_EQ(found.evidence.held_out.reason, "");
    ASSERT_FALSE(found.evidence.held_out.near.empty());
    EXPECT_LT(found.evidence.held_out.near[0].nrmse, 0.03);
    ASSERT_EQ(found.model.equations.size(), 2u);
    true_terms += 4;
    all_terms += found.model.equations[1].terms.size();
    for (const EquationTerm& t : found.model.equations[1].terms) {
      all_found += t.function == "y" || t.function == "y'" || t.function == "u" || t.function == "y^3";
      if (t.function == "y") {
        EXPECT_NEAR(t.coefficient.value, -o.stiffness, 4e-3 * o.stiffness);
      }
      if (t.function == "y'") {
        EXPECT_NEAR(t.coefficient.value, -o.damping, 0.02 * o.damping);
      }
      if (t.function == "u") {
        EXPECT_NEAR(t.coefficient.value, o.gain, 0.01 * o.gain);
      }
    }
  }
  EXPECT_EQ(all_found, true_terms);
  // One false term in 24 such equations was seen, at four standard deviations.
  EXPECT_LE(all_terms, true_terms + 1);
}

INSTANTIATE_TEST_SUITE_P(Kinds, GapsProperty, ::testing::ValuesIn(testing::kGaps));

}  // namespace
}  // namespace whirl::identification
