#pragma once
#include <map>
#include <string>

#include "output_error/sindy_refine.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification::detail {

/// Correlation of each state's noise from sample to sample, by what free runs leave where their residuals are weighed
/// with that of `options` (none: as white noise). Empty where no state's is at least 0.2, and where over 12 samples
/// it is far from that of such noise, correlation^lag.
std::map<std::string, double> noise_correlation(const Followed& followed, const SindyOptions& options);

/// Whether what free runs leave is no more and no less than the noise of the records, and new in every sample: nothing
/// is missing. Tests the autocorrelation (Box and Pierce, J. Am. Stat. Assoc. 65, 1970) of every state.
bool only_noise_left(const Followed& followed);

}  // namespace whirl::identification::detail
