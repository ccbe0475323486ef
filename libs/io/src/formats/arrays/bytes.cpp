#include "formats/arrays/bytes.hpp"

#include <cstdint>

namespace whirl::io {
namespace {

template <class T>
void fill(double* to, std::size_t count, const char* from, std::size_t width, bool big) {
  for (std::size_t i = 0; i < count; ++i)
    to[i] = static_cast<double>(number_at<T>({from + i * width, sizeof(T)}, 0, big));
}

struct NumberKind {
  std::size_t width;
  void (*fill)(double* to, std::size_t count, const char* from, std::size_t width, bool big);
};
template <class T>
constexpr NumberKind number_kind() {
  return {sizeof(T), fill<T>};
}
constexpr NumberKind kNumberKinds[] = {  // by NumberType
    number_kind<std::int8_t>(),   number_kind<std::int16_t>(),  number_kind<std::int32_t>(),
    number_kind<std::int64_t>(),  number_kind<std::uint8_t>(),  number_kind<std::uint16_t>(),
    number_kind<std::uint32_t>(), number_kind<std::uint64_t>(), number_kind<Eigen::half>(),
    number_kind<float>(),         number_kind<double>()};

}  // namespace

std::size_t width_of(NumberType type) { return kNumberKinds[static_cast<std::size_t>(type)].width; }

void numbers_into(double* to, std::size_t count, std::string_view rows, std::size_t width, std::size_t offset,
                  NumberType type, bool big) {
  kNumberKinds[static_cast<std::size_t>(type)].fill(to, count, rows.data() + offset, width, big);
}

Eigen::VectorXd numbers_of(std::string_view bytes, NumberType type, bool big) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(bytes.size() / width_of(type)));
  numbers_into(v.data(), static_cast<std::size_t>(v.size()), bytes, width_of(type), 0, type, big);
  return v;
}

}  // namespace whirl::io
