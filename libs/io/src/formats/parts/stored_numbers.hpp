#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "formats/arrays/bytes.hpp"
#include "formats/parts/random_bytes.hpp"

namespace whirl::io {

/// Rows of equal width with a number in each; the same again at equal distances, as chunks of a recorder stand.
struct NumberRun {
  std::uint64_t at = 0;                       ///< byte of the first row
  std::uint64_t rows = 0;                     ///< of one stretch
  std::uint64_t width = 0;                    ///< bytes of a row
  std::uint64_t offset = 0;                   ///< of the number in its row
  std::uint64_t stretches = 1, distance = 0;  ///< bytes from the begin of one stretch to that of the next
};

/// Where the numbers of a channel stand in a file.
class StoredNumbers {
 public:
  StoredNumbers() = default;
  StoredNumbers(NumberType type, bool big, int bit = -1) : type_(type), big_(big), bit_(bit) {}

  /// Runs that go on as the one before become one.
  void add(NumberRun run);
  Eigen::Index count() const { return ends_.empty() ? 0 : static_cast<Eigen::Index>(ends_.back()); }
  std::size_t pieces() const { return runs_.size(); }
  /// Numbers first .. first + count, which lie inside.
  Eigen::VectorXd read(const RandomBytes& bytes, Eigen::Index first, Eigen::Index count) const;

 private:
  NumberType type_ = NumberType::float64;
  bool big_ = false;
  int bit_ = -1;  ///< of the byte, of a digital line; -1: the whole number
  std::vector<NumberRun> runs_;
  std::vector<std::uint64_t> ends_;  ///< numbers up to the end of each run
};

}  // namespace whirl::io
