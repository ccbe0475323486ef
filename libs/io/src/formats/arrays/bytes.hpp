#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>

namespace whirl::io {

/// The number of type T at byte `at`; the caller has checked that it lies inside.
template <class T>
T number_at(std::string_view bytes, std::size_t at, bool big_endian) {
  char raw[sizeof(T)];
  std::memcpy(raw, bytes.data() + at, sizeof(T));
  if (big_endian == (std::endian::native == std::endian::little)) std::reverse(raw, raw + sizeof(T));
  T value;
  std::memcpy(&value, raw, sizeof(T));
  return value;
}

/// Types of numbers in binary files.
enum class NumberType { int8, int16, int32, int64, uint8, uint16, uint32, uint64, float16, float32, float64 };

/// Bytes of one number.
std::size_t width_of(NumberType type);

/// Numbers that stand in rows of `width` bytes each, `offset` bytes behind the begin of a row. They lie inside.
void numbers_into(double* to, std::size_t count, std::string_view rows, std::size_t width, std::size_t offset,
                  NumberType type, bool big_endian);

/// All numbers of these bytes; what is left over behind the last whole one is not looked at.
Eigen::VectorXd numbers_of(std::string_view bytes, NumberType type, bool big_endian);

}  // namespace whirl::io
