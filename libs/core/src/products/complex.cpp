#include "whirl/core/products.hpp"

namespace Eigen {

WHIRL_PRODUCTS_COMPLEX(template)

}  // namespace Eigen
