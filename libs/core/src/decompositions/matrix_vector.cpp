#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_MATRIX_VECTOR(template, double)
WHIRL_MATRIX_VECTOR(template, std::complex<double>)

}  // namespace Eigen
