#pragma once
#include "white_fit.hpp"

namespace whirl::modal {

/// The fit with what modes of a nonlinear stiffness or damping add to a blow's response, when the evidence asks for it.
///
/// A mode rings as A exp(p t) with a pole that moves by c A^2, to first order: exp(p t) then becomes
/// exp(p t) [1 + k - k exp(-2 s t) + ...], s = -Re p, which are poles 3 Re p + j Im p, 5 Re p + j Im p, ... of residues
/// k of the mode's own, the same in every FRF (Krylov and Bogoliubov's averaging, expanded). A stiffness with a cubic
/// part also distorts into 3 p, one that is not symmetric into 2 p. None of these has a parameter beside its residues.
/// They are taken where the description length falls clearly and the residues are in one proportion; poles which only
/// stood for them go. What the terms left out would change is stated beside the poles (`Refined::truncation`).
Refined with_amplitude(const Band& band, const Refined& white, const ResidualTerms& terms, const ModeOptions& options);

}  // namespace whirl::modal
