#include "whirl/core/products.hpp"

namespace Eigen {

WHIRL_PRODUCTS_MIXED(template)

}  // namespace Eigen
