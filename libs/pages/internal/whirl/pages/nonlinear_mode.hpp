#pragma once
#include "whirl/io/json.hpp"
#include "whirl/report/figure.hpp"
#include "whirl/response/decay.hpp"

namespace whirl::pages {

/// Backbone and damping over amplitude: the windows of a decay with 95 % bars, and the fitted mode. `unit` of the
/// amplitude, as it is shown.
report::Figure decay_figure(const response::DecayCurve& curve, const response::NonlinearMode& mode,
                            const report::Unit& unit);
/// Amplitude and phase over frequency, one colour a force level, with what the mode predicts at the points.
report::Figure steady_figure(const std::vector<response::SteadyPoint>& points, const response::NonlinearMode& mode,
                             double gain);
/// `whirl.decay/1`: points of a decay (empty for a sine test), mode, and the gain of a sine test.
io::Json to_json(const response::NonlinearMode& mode, const response::DecayCurve& curve, const Estimate& gain);

}  // namespace whirl::pages
