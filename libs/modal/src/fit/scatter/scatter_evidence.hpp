#pragma once
#include "fit/scatter/scatter.hpp"
#include "fit/white_fit.hpp"

namespace whirl::modal {

/// Longer than the white fit's by so much, a fit with scatter is not worth going on with.
constexpr double kHopeless = 500;

/// The residues of one mode are its shape at the response times its shape at the reference. Poles that differ between
/// FRFs leave that product; two modes in one, each seen by its own reference, do not.
bool is_one_mode(const Band& band, const ScatterFit& fit, std::size_t pole);

/// Index of the pole nearest to `p`.
std::size_t nearest(const Poles& poles, std::complex<double> p);

/// True when the poles of single FRFs stray from the common ones by more than noise explains, or when two poles stand
/// so close that they may be one seen at two places, and the evidence about the worst of them agrees.
bool may_scatter(const Band& band, const Refined& state, const ResidualTerms& terms, const ModeOptions& options);

}  // namespace whirl::modal
