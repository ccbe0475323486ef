#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace whirl::rt {

/// Durations in nanoseconds, counted in eight classes per octave (12 % wide), with the exact maximum and where
/// it happened. Fixed size; adding neither allocates nor fails.
class Histogram {
 public:
  static constexpr int kPerOctave = 8;

  void add(std::int64_t nanoseconds, long index) noexcept {
    const std::uint64_t v = nanoseconds > 0 ? static_cast<std::uint64_t>(nanoseconds) : 0;
    ++counts_[class_of(v)];
    ++total_;
    if (v > max_ || worst_ < 0) max_ = v, worst_ = index;
  }
  std::uint64_t total() const noexcept { return total_; }
  double max() const noexcept { return 1e-9 * static_cast<double>(max_); }  ///< s
  long worst() const noexcept { return worst_; }                            ///< index of the maximum; -1 when empty
  /// Upper edge of the class in which the fraction `q` (0 to 1) of the values lies at or below, s; 0 when empty.
  double quantile(double q) const noexcept {
    const double wanted = q * static_cast<double>(total_);
    double seen = 0;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      seen += static_cast<double>(counts_[i]);
      if (counts_[i] > 0 && seen >= wanted) return std::min(1e-9 * upper_edge(i), max());
    }
    return 0;
  }
  /// Values from 2^octave to 2^(octave + 1) - 1 ns; octave 0 holds 0 too.
  std::uint64_t in_octave(int octave) const noexcept {
    std::uint64_t sum = 0;
    for (int i = 0; i < kPerOctave; ++i) sum += counts_[static_cast<std::size_t>(octave * kPerOctave + i)];
    return sum;
  }

 private:
  static constexpr int kOctaves = 48;  // up to three days
  static std::size_t class_of(std::uint64_t v) noexcept {
    if (v < 2) return 0;
    const int octave = std::min(static_cast<int>(std::bit_width(v)) - 1, kOctaves - 1);
    const std::uint64_t part = octave >= 3 ? (v >> (octave - 3)) & 7 : (v << (3 - octave)) & 7;
    return static_cast<std::size_t>(octave * kPerOctave) + static_cast<std::size_t>(part);
  }
  static double upper_edge(std::size_t i) noexcept {
    const double base = static_cast<double>(std::uint64_t{1} << (i / kPerOctave));
    return base * (1 + static_cast<double>(i % kPerOctave + 1) / kPerOctave);
  }
  std::array<std::uint64_t, static_cast<std::size_t>(kOctaves) * kPerOctave> counts_{};
  std::uint64_t total_ = 0, max_ = 0;
  long worst_ = -1;
};

}  // namespace whirl::rt
