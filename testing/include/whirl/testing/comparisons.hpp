#pragma once
#include <gtest/gtest.h>

#include <string>

// What EXPECT_LT, EXPECT_EQ, ... make of the commonest types when they fail, compiled once (src/comparisons.cpp).
// INSTANTIATE is `extern template` here and `template` there.
#define WHIRL_COMPARISON(INSTANTIATE, A, B)                                                                        \
  INSTANTIATE AssertionResult CmpHelperOpFailure<A, B>(const char*, const char*, const A&, const B&, const char*); \
  INSTANTIATE AssertionResult CmpHelperEQFailure<A, B>(const char*, const char*, const A&, const B&);              \
  INSTANTIATE AssertionResult CmpHelperEQ<A, B>(const char*, const char*, const A&, const B&);
#define WHIRL_COMPARISONS(INSTANTIATE)                        \
  WHIRL_COMPARISON(INSTANTIATE, double, double)               \
  WHIRL_COMPARISON(INSTANTIATE, double, int)                  \
  WHIRL_COMPARISON(INSTANTIATE, int, int)                     \
  WHIRL_COMPARISON(INSTANTIATE, unsigned long, unsigned long) \
  WHIRL_COMPARISON(INSTANTIATE, unsigned long, unsigned)      \
  WHIRL_COMPARISON(INSTANTIATE, long, int)                    \
  WHIRL_COMPARISON(INSTANTIATE, bool, bool)                   \
  WHIRL_COMPARISON(INSTANTIATE, std::string, std::string)     \
  INSTANTIATE AssertionResult CmpHelperFloatingPointEQ<double>(const char*, const char*, double, double);

namespace testing::internal {

WHIRL_COMPARISONS(extern template)

}  // namespace testing::internal
