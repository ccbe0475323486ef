#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/identify/identify.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/testing/machines.hpp"
#include "whirl/testing/oscillators.hpp"
#include "whirl/testing/records/gappy_text.hpp"
#include "whirl/testing/systems/identified_oscillator.hpp"

namespace whirl::identification {
namespace {

using testing::Gaps;

Recording read(const std::string& text, std::vector<std::string>& remarks) {
  io::CsvOptions options;
  options.gaps = true;
  const io::RemarkHandler before = io::set_remark_handler(
      [&](const std::string&, const std::string& said, io::RemarkCode) { remarks.push_back(said); });
  Recording record = io::parse_csv(text, "made.csv", options);
  io::set_remark_handler(before);
  return record;
}

/// A drawn rotor as a logger wrote it, with 20 dB noise.
Recording rotor_with(Gaps gaps, unsigned seed, testing::Machine& truth, std::vector<std::string>* said = nullptr) {
  constexpr int kFiner = 10;
  testing::DrawnMachine drawn = testing::draw_machine(testing::Oddity::none, seed);
  drawn.run.dt /= kFiner;
  truth = drawn.machine;
  const Eigen::MatrixX2d clean = testing::readings(drawn.machine, drawn.run);
  const double noise = 0.1 * std::sqrt(clean.squaredNorm() / static_cast<double>(clean.size()));
  std::vector<std::string> remarks;
  const Recording record = read(testing::gappy_text(testing::machine_record(clean, drawn.run), kFiner,
                                                    {"t_s", "x_m", "y_m", "beta_rad"}, 2, noise, gaps, seed),
                                remarks);
  if (said != nullptr) *said = remarks;
  return record;
}

class GapsProperty : public ::testing::TestWithParam<Gaps> {};

// Errors of a rotor from a record with gaps are those of the record without, within the intervals; what was done is
// said.
TEST_P(GapsProperty, RotorFromWhatALoggerWrote) {
  for (const unsigned seed : {61u, 62u, 63u}) {
    SCOPED_TRACE(seed);
    testing::Machine truth;
    std::vector<std::string> remarks;
    const Recording r = rotor_with(GetParam(), seed, truth, &remarks);
    const Identification found = identify(r);
    EXPECT_NE(found.summary.status, Status::unusable) << found.summary.warnings.back();
    EXPECT_THAT(found.summary.trust, ::testing::StartsWith("Trust"));
    EXPECT_EQ(found.evidence.held_out.reason, "");
    EXPECT_GT(found.summary.chi_square, 0.8);
    EXPECT_LT(found.summary.chi_square, 1.2);
    for (const auto& [name, right, most] : {std::tuple("k1", truth.k, 5e-4), std::tuple("k2", truth.cubic, 0.03),
                                            std::tuple("c", truth.c, 0.01), std::tuple("e", truth.e, 0.006)}) {
      const Estimate& e = *found.model.parameter(name);
      EXPECT_LT(std::abs(e.value - right), 4 * e.sd) << name;
      EXPECT_LT(std::abs(e.value / right - 1), most) << name;
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
    if (GetParam() == Gaps::none || GetParam() == Gaps::uneven_clock) {
      EXPECT_NEAR(found.summary.chi_square, 1, 0.12);
    }
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
  // Noise read off between neighbours is not white: one false term in 24 such equations was seen, at 4.1 standard
  // deviations.
  EXPECT_LE(all_terms, true_terms + (GetParam() == Gaps::single_cells ? 1 : 0));
}

// Samples at uneven instants: nothing but the machine's own terms, within the intervals, and noise of its size. At
// random instants gaps of 5 to 8 mean steps are bridged along the curve: what is trusted is right, the rest is told.
TEST(UnevenClockProperty, IntervalsHoldTheMachine) {
  constexpr int kFiner = 20;
  constexpr unsigned kMachines = 12;
  for (const Gaps clock : {Gaps::uneven_clock, Gaps::random_clock}) {
    SCOPED_TRACE(to_string(clock));
    testing::Tally tally;
    double chi_square = 0;
    int ok = 0;
    for (unsigned seed = 81; seed < 81 + kMachines; ++seed) {
      const testing::DrivenOscillator machine = testing::drawn_oscillator(seed);
      const Recording fine = driven_record(machine, {.seed = seed, .dt = 0.02 / kFiner, .noise = 0});
      const double noise = 0.02 * std::sqrt(fine["x"].squaredNorm() / static_cast<double>(fine.size()));
      std::vector<std::string> remarks;
      const Identification found = testing::identified_oscillator(
          {read(testing::gappy_text(fine, kFiner, {"t_s", "x_1", "v_1", "u_1"}, 2, noise, clock, seed), remarks)});
      EXPECT_EQ(remarks.size(), 1u);
      if (found.summary.status != Status::ok) continue;
      ++ok;
      chi_square += found.summary.chi_square;
      tally.add(found, machine);
    }
    EXPECT_GE(ok, clock == Gaps::uneven_clock ? 12 : 3);
    EXPECT_NEAR(chi_square / ok, 1, clock == Gaps::uneven_clock ? 0.06 : 0.2);
    EXPECT_EQ(tally.extra, 0);
    EXPECT_GE(tally.inside, 0.88 * tally.all);
    EXPECT_EQ(tally.far, 0);
  }
}

// The published chain and its consistent sister read the same records, nearly as without gaps.
TEST_P(GapsProperty, PaperMethodsFromWhatALoggerWrote) {
  testing::Machine truth;
  const Recording whole = rotor_with(Gaps::none, 64, truth), record = rotor_with(GetParam(), 64, truth);
  const auto found = [](const Recording& r, Method method) {
    IdentifyOptions options;
    options.method = method;
    options.holdout = 0;
    const Identification id = identify(r, options);
    EXPECT_NE(id.summary.status, Status::unusable) << id.summary.warnings.back();
    return id.model;
  };
  const IdentifiedModel tied = found(record, Method::consistent), tied_whole = found(whole, Method::consistent);
  for (const auto& [name, most] :
       {std::pair("k1", 3e-3), std::pair("k2", 0.03), std::pair("c", 0.02), std::pair("e", 0.01)})
    EXPECT_NEAR(tied.parameter(name)->value / tied_whole.parameter(name)->value, 1, most) << name;
  // The bias of one-sided filtering is what it is; interpolated noise adds to it.
  const IdentifiedModel paper = found(record, Method::paper);
  EXPECT_NEAR(paper.parameter("k1")->value / truth.k, 1, 0.15);
}

// --compare: a row of every method, and the best predicts what was held out to the noise.
TEST(Gaps, ComparedMethodsFromWhatALoggerWrote) {
  for (const Gaps gaps : {Gaps::empty_cells, Gaps::single_lines}) {
    testing::Machine truth;
    const MethodComparison compared = compare_methods({rotor_with(gaps, 65, truth)}, {});
    EXPECT_NE(compared.summary.status, Status::unusable);
    ASSERT_GT(compared.rows.size(), 10u);
    for (const MethodRow& row : compared.rows) {
      SCOPED_TRACE(row.fit.method);
      EXPECT_FALSE(row.held_out.scores.empty()) << row.held_out.reason;
      if (row.fit.method.starts_with("weak")) {
        EXPECT_LT(worst_nrmse(row.held_out.scores), 0.13);
      }
      if (row.fit.method.starts_with("consistent")) {
        EXPECT_LT(worst_nrmse(row.held_out.scores), 0.16);
      }
    }
  }
}

// One oscillator, one input: the structure, with the longest stretch without a gap.
TEST_P(GapsProperty, SecondOrderFromWhatALoggerWrote) {
  constexpr int kFiner = 10;
  const unsigned seed = 73;
  const testing::Oscillator o = testing::oscillators(seed).front();
  const Recording fine = testing::oscillator_record(o, 5e-3 / kFiner, 4000 * kFiner, 0, seed);
  const double noise = 0.01 * std::sqrt(fine["y"].squaredNorm() / static_cast<double>(fine.size()));
  std::vector<std::string> remarks;
  IdentifyOptions options;
  options.method = Method::second_order;
  const Identification found = identify(
      read(testing::gappy_text(fine, kFiner, {"t_s", "y_m", "u_m_s2"}, 1, noise, GetParam(), seed), remarks), options);
  ASSERT_NE(found.summary.status, Status::unusable) << found.summary.warnings.back();
  for (const EquationTerm& t : found.model.equations[1].terms) {
    const double v = t.coefficient.value;
    if (t.function == "y") {
      EXPECT_NEAR(v / -o.stiffness, 1, 1e-3);
    } else if (t.function == "y^3") {
      EXPECT_NEAR(v / -o.cubic, 1, 0.01);
    } else if (t.function == "y'") {
      EXPECT_NEAR(v / -o.damping, 1, 0.01);
    } else if (t.function == "u") {
      EXPECT_NEAR(v / o.gain, 1, 2e-3);
    } else {
      EXPECT_EQ(t.function, "1");
      EXPECT_LT(std::abs(v), 3e-3 * o.level);
    }
  }
  EXPECT_EQ(found.model.equations[1].terms.size(), 5u);
  if (GetParam() != Gaps::none) {
    EXPECT_GT(remarks.size() + found.summary.warnings.size(), 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, GapsProperty, ::testing::ValuesIn(testing::kGaps));

}  // namespace
}  // namespace whirl::identification
