#pragma once
#include <complex>
#include <string>
#include <unordered_map>
#include <vector>

#include "terms/growing_model.hpp"

namespace whirl::identification::detail {

/// Fits of one set of records by what they began with. Searches with other candidates begin alike and try the same
/// terms; a fit that one of them has made is not made again. It holds some tens of megabytes at most.
class FitMemo {
 public:
  explicit FitMemo(const std::vector<RotorRecord>& records);

  /// The fit of `growth` from `eps`; null: not made yet.
  const OutputErrorFit* find(const Growth& growth, const std::vector<std::complex<double>>& eps) const;
  void keep(const Growth& growth, const std::vector<std::complex<double>>& eps, const OutputErrorFit& fit);

 private:
  std::unordered_map<std::string, OutputErrorFit> fits_;
  std::size_t most_;
};

}  // namespace whirl::identification::detail
