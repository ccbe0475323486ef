#pragma once
#include <algorithm>
#include <complex>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "whirl/identify/output_error_rotor.hpp"

namespace whirl::identification::detail {

/// All that a fit of given records depends on.
struct FitStart {
  RotorModel model;
  OutputErrorOptions active;
  std::vector<std::complex<double>> eps;
  double delay = 0;
  bool operator==(const FitStart&) const = default;
};

/// Fits of the same records: the searches begin at the same model and try much of what those before them tried. A fit
/// is the same where its start is, bit by bit. May be asked by several threads at once.
class FitMemory {
 public:
  explicit FitMemory(const std::vector<RotorRecord>& records) {
    double readings = 0;
    for (const RotorRecord& r : records) readings += r.readings();
    most_ = static_cast<std::size_t>(kMostReadings / std::max(1.0, readings));
  }

  std::optional<OutputErrorFit> find(const FitStart& start) const {
    const std::lock_guard lock(guard_);
    const auto at = std::ranges::find(kept_, start, &Kept::first);
    return at == kept_.end() ? std::nullopt : std::optional(at->second);
  }
  void keep(FitStart start, const OutputErrorFit& fit) {
    const std::lock_guard lock(guard_);
    if (kept_.size() < most_) kept_.emplace_back(std::move(start), fit);
  }

 private:
  using Kept = std::pair<FitStart, OutputErrorFit>;
  static constexpr double kMostReadings = 2e6;  // of about 50 bytes
  std::size_t most_ = 0;
  mutable std::mutex guard_;
  std::vector<Kept> kept_;
};

}  // namespace whirl::identification::detail
