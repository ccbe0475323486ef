// Tails and quantiles of the distributions that tests and intervals ask for. Boost computes them, compiled once.
#pragma once

// Degrees of freedom are above 0 and need not be whole. All throw std::domain_error for others, for a negative x and
// for a probability outside [0, 1], and std::overflow_error for a quantile at 0 or 1 that is not finite.

namespace whirl {

/// z with P(Z <= z) = p for a standard normal Z.
double normal_quantile(double p);

/// t with P(T <= t) = p for Student's T.
double students_t_quantile(double freedom, double p);

/// P(T > t).
double students_t_tail(double freedom, double t);

/// P(X > x) for a chi-squared X, x >= 0.
double chi_squared_tail(double freedom, double x);

/// x with P(F <= x) = p for Fisher's F of `above` and `below` degrees of freedom.
double fisher_f_quantile(double above, double below, double p);

/// P(F > x), x >= 0.
double fisher_f_tail(double above, double below, double x);

/// Bounds of a probability of which `successes` of `trials` were seen, each left with probability `alpha`: Clopper and
/// Pearson.
double proportion_lower_bound(double trials, double successes, double alpha);
double proportion_upper_bound(double trials, double successes, double alpha);

}  // namespace whirl
