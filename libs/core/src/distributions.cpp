#include "whirl/core/distributions.hpp"

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

namespace whirl {

using boost::math::complement;

double normal_quantile(double p) { return quantile(boost::math::normal(), p); }

double students_t_quantile(double freedom, double p) { return quantile(boost::math::students_t(freedom), p); }

double students_t_tail(double freedom, double t) { return cdf(complement(boost::math::students_t(freedom), t)); }

double chi_squared_tail(double freedom, double x) { return cdf(complement(boost::math::chi_squared(freedom), x)); }

double fisher_f_quantile(double above, double below, double p) {
  return quantile(boost::math::fisher_f(above, below), p);
}

double fisher_f_tail(double above, double below, double x) {
  return cdf(complement(boost::math::fisher_f(above, below), x));
}

double proportion_lower_bound(double trials, double successes, double alpha) {
  return boost::math::binomial::find_lower_bound_on_p(trials, successes, alpha);
}

double proportion_upper_bound(double trials, double successes, double alpha) {
  return boost::math::binomial::find_upper_bound_on_p(trials, successes, alpha);
}

}  // namespace whirl
