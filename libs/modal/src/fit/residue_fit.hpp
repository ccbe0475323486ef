#pragma once
#include "pole_fit.hpp"

namespace whirl::modal {

/// From the rows of PoleFit::residues to residues and residuals in SI; without errors.
ResidueFit unpack_residues(const Band& band, const ResidualTerms& terms, const Eigen::MatrixXd& parameters);

/// The errors of a residue fit from measured - model.
void set_errors(const Band& band, const Eigen::MatrixXcd& residual, ResidueFit& result);

}  // namespace whirl::modal
