#pragma once
#include <Eigen/Core>
#include <string>

#include "whirl/core/error.hpp"

namespace whirl::response {

/// All samples where `usable` is empty. Throws Error when it is of another length than the record, or none counts.
inline Eigen::ArrayX<bool> usable_or_all(const Eigen::ArrayX<bool>& usable, Eigen::Index samples, const char* what) {
  if (usable.size() == 0) return Eigen::ArrayX<bool>::Constant(samples, true);
  if (usable.size() != samples || !usable.any())
    throw Error(std::string(what) + ": the mask of usable samples must be as long as the record, with one at least");
  return usable;
}

/// The record with straight lines through what does not count: for a first look, never for a fit.
inline Eigen::VectorXd bridged(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::ArrayX<bool>& usable) {
  Eigen::VectorXd out = x;
  Eigen::Index last = -1;
  for (Eigen::Index i = 0; i <= x.size(); ++i) {
    if (i < x.size() && !usable[i]) continue;
    for (Eigen::Index k = last + 1; k < i; ++k) {
      if (last < 0 || i == x.size()) {
        out[k] = last < 0 ? x[i] : x[last];
      } else {
        out[k] = x[last] + (x[i] - x[last]) * static_cast<double>(k - last) / static_cast<double>(i - last);
      }
    }
    last = i;
  }
  return out;
}

}  // namespace whirl::response
