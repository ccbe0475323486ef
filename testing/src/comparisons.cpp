#include "whirl/testing/comparisons.hpp"

namespace testing::internal {

WHIRL_COMPARISONS(template)

}  // namespace testing::internal
