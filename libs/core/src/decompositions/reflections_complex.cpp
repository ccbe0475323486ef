#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_REFLECTIONS_COMPLEX(template)

}  // namespace Eigen
