#include "whirl/core/products.hpp"

namespace Eigen {

WHIRL_PRODUCTS_REAL(template)

}  // namespace Eigen
