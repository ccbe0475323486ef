#include "evidence/noise_correlation.hpp"

#include <algorithm>
#include <cmath>

#include "rules/rules.hpp"
#include "whirl/core/distributions.hpp"

namespace whirl::identification::detail {

std::map<std::string, double> noise_correlation(const Followed& followed, const SindyOptions& options) {
  constexpr double kMost = 0.99;
  std::map<std::string, double> found;
  bool any = false;
  if (followed.autocorrelation.rows() != static_cast<Eigen::Index>(options.states.size())) return found;
  const Eigen::VectorXd before = noise_correlations(options);
  for (std::size_t k = 0; k < options.states.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const Eigen::VectorXd lags = followed.autocorrelation.row(at);
    for (Eigen::Index l = 1; l < lags.size(); ++l) {
      if (std::abs(lags[l] - std::pow(lags[0], l + 1)) > rules::kColourAlike) return {};
    }
    const double now = lags[0] + (before.size() > 0 ? before[at] : 0);
    found[options.states[k]] = std::clamp(now, 0.0, kMost);
    any = any || now >= rules::kColourLeast;
  }
  if (!any) found.clear();
  return found;
}

bool only_noise_left(const Followed& followed) {
  const Eigen::MatrixXd& r = followed.autocorrelation;
  if (r.rows() == 0) return false;
  const auto freedom = static_cast<double>(r.cols());
  for (Eigen::Index k = 0; k < r.rows(); ++k) {
    if (!(std::abs(2 * std::log(followed.output_rmse[k])) < rules::kNoiseKnown)) return false;
    const double q = followed.output_rows[k] * r.row(k).squaredNorm();
    if (!(chi_squared_tail(freedom, q) > rules::kWhiteLeft)) return false;
  }
  return true;
}

}  // namespace whirl::identification::detail
