#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/signal/derivative.hpp"

namespace whirl::identification::detail {

/// Smoothing spline that leaves the noise as residual; noise below 0.1 % of the signal is left in.
signal::SmoothedSignal without_noise(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double noise_sd);

/// A contiguous stretch of finite samples of one record.
struct Stretch {
  std::string source;      // of the record
  std::size_t record = 0;  // its number
  double t0 = 0, dt = 0;
  Eigen::MatrixXd raw;     // samples x states, as measured
  Eigen::MatrixXd smooth;  // the same without most of the noise
  Eigen::MatrixXd rate;    // first derivative of `smooth`
  Eigen::MatrixXd inputs;  // samples x inputs
  Eigen::Index samples() const { return raw.rows(); }
};

/// Noise sd of a state's channel, white or as the model has it.
double channel_noise(const IdentifiedModel& model, const std::string& state,
                     const Eigen::Ref<const Eigen::VectorXd>& samples);
/// Correlation of each state's noise from one sample to the next; empty: all white.
Eigen::VectorXd noise_correlations(const SindyOptions& options);
/// Finite stretches of at least 25 samples, unsmoothed.
std::vector<Stretch> finite_stretches(const std::vector<Recording>& records, const SindyOptions& options);
/// Noise sd per state (median over stretches, weighted by length), and smoothing of all stretches.
Eigen::VectorXd smooth_stretches(std::vector<Stretch>& stretches);
/// rms(x') / rms(x - mean) of all states together, rad/s.
double characteristic_rate(const std::vector<Stretch>& stretches);

/// Variables of the library at the samples of a stretch: states, (rates,) inputs, t.
Eigen::MatrixXd library_variables(const Stretch& s, const SindyOptions& options);
std::vector<std::string> library_names(const SindyOptions& options);

/// Rows int phi f dt (n x terms) and (-1)^order int phi^(order) x dt (n x states) of a stretch, half-width in samples.
struct IntegralRows {
  Eigen::MatrixXd theta, target;
};
IntegralRows integral_rows(const Stretch& s, const Eigen::MatrixXd& columns, int order, Eigen::Index half);

}  // namespace whirl::identification::detail
