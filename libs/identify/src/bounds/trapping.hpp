#pragma once
#include "bounds/bound_rows.hpp"

namespace whirl::identification::detail {

/// Throws Error on what a trapping model does not go with: inputs, time, maps, candidates beyond degree 2.
void check_trapping(const IdentifyOptions& options);

/// Moves the parameters of a refined model of degree 2 to the most likely ones whose quadratic terms preserve an energy
/// sum w_i (x_i - m_i)^2 / 2 and whose linear part about m takes energy out of it: linear equalities, then in turn the
/// best m for the parameters and cutting planes on the eigenvectors for the parameters (Schlegel and Noack 2015;
/// Kaptanoglu et al. 2021). The weights are 1 unless the records ask for others. `bounds`: further rows to keep. What
/// it costs is a warning; a model that no longer follows the records is unusable. Throws Error where there is no such
/// model. The certificate is of the model that is left, by `certify`.
Trapping hold_trapping(const Unknowns& unknowns, const std::vector<BoundRow>& bounds, const Recording& like,
                       IdentifiedModel& model);

/// What the right-hand sides say of the energy about `shift`, by evaluating them only: throws Error unless the energy
/// falls everywhere beyond the radius.
Trapping certify(const IdentifiedModel& model, const Eigen::VectorXd& shift, const Eigen::VectorXd& weights);

}  // namespace whirl::identification::detail
