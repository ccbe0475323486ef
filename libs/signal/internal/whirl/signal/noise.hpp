#pragma once
#include <Eigen/Core>

namespace whirl::signal {

/// Standard deviation of the white noise on a smooth record, from its sixth differences:
///
///   sd = median |6th difference| / 0.6745 / sqrt(924)
///
/// 924 = sum of the squared binomial coefficients of order 6. A tone of angular frequency w leaks (2 sin(w dt / 2))^6 /
/// 30 of its amplitude, so the samples should be at least about 20 per cycle. Needs 16 samples (Error otherwise). The
/// result is 0 for a record that is constant or so coarsely quantised that most differences vanish.
double noise_sd(const Eigen::Ref<const Eigen::VectorXd>& samples);

/// The same for noise e(i) = correlation e(i - 1) + w(i), w white: sd of w, from the samples less `correlation` times
/// those before. The sd of e is that over sqrt(1 - correlation^2). Needs 17 samples.
double innovation_sd(const Eigen::Ref<const Eigen::VectorXd>& samples, double correlation);

}  // namespace whirl::signal
