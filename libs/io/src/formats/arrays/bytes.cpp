#include "formats/arrays/bytes.hpp"

#include <cmath>
#include <cstdint>

namespace whirl::io {
namespace {

double half(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
  const double size = exponent == 0    ? std::ldexp(mantissa, -24)
                      : exponent == 31 ? (mantissa == 0 ? INFINITY : NAN)
                                       : std::ldexp(1024 + mantissa, exponent - 25);
  return bits >> 15 != 0 ? -size : size;
}

template <class T>
void fill(double* to, std::size_t count, const char* from, std::size_t width, bool big) {
  for (std::size_t i = 0; i < count; ++i)
    to[i] = static_cast<double>(number_at<T>({from + i * width, sizeof(T)}, 0, big));
}

}  // namespace

std::size_t width_of(NumberType type) {
  switch (type) {
    case NumberType::int8:
    case NumberType::uint8:
      return 1;
    case NumberType::int16:
    case NumberType::uint16:
    case NumberType::float16:
      return 2;
    case NumberType::int32:
    case NumberType::uint32:
    case NumberType::float32:
      return 4;
    default:
      return 8;
  }
}

void numbers_into(double* to, std::size_t count, std::string_view rows, std::size_t width, std::size_t offset,
                  NumberType type, bool big) {
  const char* const from = rows.data() + offset;
  switch (type) {
    case NumberType::int8:
      return fill<std::int8_t>(to, count, from, width, big);
    case NumberType::int16:
      return fill<std::int16_t>(to, count, from, width, big);
    case NumberType::int32:
      return fill<std::int32_t>(to, count, from, width, big);
    case NumberType::int64:
      return fill<std::int64_t>(to, count, from, width, big);
    case NumberType::uint8:
      return fill<std::uint8_t>(to, count, from, width, big);
    case NumberType::uint16:
      return fill<std::uint16_t>(to, count, from, width, big);
    case NumberType::uint32:
      return fill<std::uint32_t>(to, count, from, width, big);
    case NumberType::uint64:
      return fill<std::uint64_t>(to, count, from, width, big);
    case NumberType::float16:
      for (std::size_t i = 0; i < count; ++i) to[i] = half(number_at<std::uint16_t>({from + i * width, 2}, 0, big));
      return;
    case NumberType::float32:
      return fill<float>(to, count, from, width, big);
    case NumberType::float64:
      return fill<double>(to, count, from, width, big);
  }
}

Eigen::VectorXd numbers_of(std::string_view bytes, NumberType type, bool big) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(bytes.size() / width_of(type)));
  numbers_into(v.data(), static_cast<std::size_t>(v.size()), bytes, width_of(type), 0, type, big);
  return v;
}

}  // namespace whirl::io
