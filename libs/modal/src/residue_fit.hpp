#pragma once
#include "pole_fit.hpp"

namespace whirl::modal {

/// From the columns of a PoleFit to residues and residuals in SI.
ResidueFit unpack_residues(const Band& band, const Poles& poles, const ResidualTerms& terms, const PoleFit& fit);

}  // namespace whirl::modal
