#pragma once
#include "whirl/identify/identify.hpp"

namespace whirl::identification::detail {

/// Throws Error on what bounds between coefficients do not go with.
void check_bounds(const IdentifyOptions& options);

/// Moves the parameters of a refined model, and with them the coefficients of its equations, to the most likely values
/// within the bounds: minimum of (p - p0)' C^-1 (p - p0), C the covariance, linear bounds exactly, the decay of the
/// linear part by successive linearisation. Intervals are those along the active bounds. A term of the library that is
/// not in the model has the coefficient 0. Active bounds are warnings. Throws Error on other names and on bounds that
/// contradict each other. `like`: a record that the model was fitted to. Returns the certificate of a trapping model
/// where one is asked for.
std::optional<Trapping> hold_bounds(const IdentifyOptions& options, const Recording& like, IdentifiedModel& model);

}  // namespace whirl::identification::detail
