#pragma once
#include <Eigen/Core>

namespace whirl::signal {

/// Windows of stationary signals (periodic form). Impact records use `force_window` and `exponential_window` instead.
enum class Window { rectangular, hann, flat_top };

Eigen::VectorXd window(Window kind, Eigen::Index n);

/// Equivalent noise bandwidth in lines: N sum w^2 / (sum w)^2 (1, 1.5, 3.77).
double noise_bandwidth(const Eigen::Ref<const Eigen::VectorXd>& w);

/// Force window of an impact: 1 up to sample `end`, then a cosine taper to 0 over `taper` samples, then 0.
Eigen::VectorXd force_window(Eigen::Index n, Eigen::Index end, Eigen::Index taper);

/// w_i = exp(-decay i dt), decay in 1/s. A pole seen through it is p - decay.
Eigen::VectorXd exponential_window(Eigen::Index n, double dt, double decay);

}  // namespace whirl::signal
