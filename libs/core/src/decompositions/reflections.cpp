#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_REFLECTIONS_REAL(template)

}  // namespace Eigen
