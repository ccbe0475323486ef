// A bending mode above the speeds of the records: it moves the readings, and is not taken for damping.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "whirl/identify/identify_rotor.hpp"
#include "whirl/testing/systems/odd_rotors.hpp"

namespace whirl::identification {
namespace {

using namespace testing;
using ::testing::Contains;
using ::testing::HasSubstr;

// Before: a delay, a drift or a searched mode in its place.
TEST(ModesAboveProperty, WhatTheyAddToTheReadingsIsNotTakenForDamping) {
  int covered = 0, intervals = 0;
  for (unsigned seed = 701; seed < 707; ++seed) {
    for (const double snr : {20.0, 40.0}) {
      const OddRecord record = odd_record(OddKind::upper_mode, snr, seed);
      const RotorIdentification r = identify_rotor_detailed({rotor_record(record.record)});
      SCOPED_TRACE(fmt::format("seed {}, {} dB", seed, snr));
      if (snr > 30) {
        EXPECT_THAT(r.added, Contains("modes above the speeds"));
        EXPECT_THAT(r.assumptions, Contains(HasSubstr("modes above the speeds move the readings")));
      }
      for (const auto& [name, truth] :
           {std::pair("k1", record.k1), {"k2", record.k2}, {"c", record.c}, {"e", record.e}}) {
        const Estimate* e = r.model.parameter(name);
        EXPECT_LT(std::abs(e->value - truth), 4.5 * e->sd) << name;
        covered += e->covers(truth);
        ++intervals;
      }
    }
  }
  EXPECT_GT(covered, 0.88 * intervals);
}

}  // namespace
}  // namespace whirl::identification
