#pragma once
#include "white_fit.hpp"

namespace whirl::modal {

/// What the residues of a viscous fit say of the damping. `open`: turned as by structural damping, or by sensors that
/// lag.
enum class DampingEvidence { viscous, open, structural };

/// With w0 and zeta the natural frequency and the damping ratio of a mode of real shape, the pole of positive frequency
/// has the residue
///
///     viscous      1/(w0^2 + 2 zeta w0 s + s^2)       j a = r / (2 w0 sqrt(1 - zeta^2))
///     structural   1/(w0^2 (1 + 2 j zeta) + s^2)      j a = r / (2 w0 sqrt(1 + 2 j zeta)),  turned by -zeta
///
/// with r real: near the peak the two differ in this alone, and it shows as sharply as the damping itself does (the
/// phase of a residue is known to sd(Im p) / (sqrt(2) |Re p|)). Their tails, which modes outside the band imitate, are
/// not looked at. Complex shapes turn single residues either way: the scatter over FRFs and over modes widens the
/// interval. A delay between force and response turns by its phase at each mode, which several modes tell apart.
DampingEvidence damping_evidence(const Band& band, const Refined& state, const ResidualTerms& terms);

}  // namespace whirl::modal
