#pragma once
#include <cmath>
#include <cstdint>
#include <random>

namespace whirl::rig {

/// Standard normal numbers, the same on every platform (std::normal_distribution is not): polar method of
/// Marsaglia.
class Normal {
 public:
  explicit Normal(std::uint64_t seed) noexcept : random_(seed) {}

  double operator()() noexcept {
    if (stored_) {
      stored_ = false;
      return second_;
    }
    double u = 0, v = 0, s = 0;
    do {
      u = uniform();
      v = uniform();
      s = u * u + v * v;
    } while (s >= 1 || s == 0);
    const double scale = std::sqrt(-2 * std::log(s) / s);
    second_ = v * scale;
    stored_ = true;
    return u * scale;
  }

  /// Uniform in [-1, 1).
  double uniform() noexcept { return static_cast<double>(static_cast<std::int64_t>(random_()) >> 11) * 0x1p-52; }

 private:
  std::mt19937_64 random_;
  double second_ = 0;
  bool stored_ = false;
};

}  // namespace whirl::rig
