#include "formats/arrays/bytes.hpp"

#include <fmt/format.h>

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
void fill(std::string_view bytes, bool big, Eigen::VectorXd& to) {
  for (Eigen::Index i = 0; i < to.size(); ++i)
    to[i] = static_cast<double>(number_at<T>(bytes, static_cast<std::size_t>(i) * sizeof(T), big));
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

Eigen::VectorXd numbers_of(std::string_view bytes, NumberType type, bool big) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(bytes.size() / width_of(type)));
  switch (type) {
    case NumberType::int8:
      fill<std::int8_t>(bytes, big, v);
      break;
    case NumberType::int16:
      fill<std::int16_t>(bytes, big, v);
      break;
    case NumberType::int32:
      fill<std::int32_t>(bytes, big, v);
      break;
    case NumberType::int64:
      fill<std::int64_t>(bytes, big, v);
      break;
    case NumberType::uint8:
      fill<std::uint8_t>(bytes, big, v);
      break;
    case NumberType::uint16:
      fill<std::uint16_t>(bytes, big, v);
      break;
    case NumberType::uint32:
      fill<std::uint32_t>(bytes, big, v);
      break;
    case NumberType::uint64:
      fill<std::uint64_t>(bytes, big, v);
      break;
    case NumberType::float16:
      for (Eigen::Index i = 0; i < v.size(); ++i)
        v[i] = half(number_at<std::uint16_t>(bytes, static_cast<std::size_t>(i) * 2, big));
      break;
    case NumberType::float32:
      fill<float>(bytes, big, v);
      break;
    case NumberType::float64:
      fill<double>(bytes, big, v);
      break;
  }
  return v;
}

std::string rounding_of_integers(const std::string& name, const Eigen::Ref<const Eigen::MatrixXd>& values) {
  const auto beyond = (values.array().abs() >= 9007199254740992.0).count();
  if (beyond == 0) return {};
  return fmt::format("'{}': {} of {} integers are 2^53 or more: rounded to 53 bits", name, beyond, values.size());
}

}  // namespace whirl::io
