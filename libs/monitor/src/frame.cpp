#include "whirl/monitor/frame.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "whirl/core/error.hpp"

namespace whirl::monitor {
namespace {

constexpr std::uint32_t kMagic = 0x574D1000;
constexpr std::size_t kHeader = 20;

template <class T>
void append(std::string& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) out += static_cast<char>(value >> (8 * i) & 0xFF);
}

template <class T>
T take(const std::string& bytes, std::size_t at) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value |= static_cast<T>(static_cast<T>(static_cast<std::uint8_t>(bytes[at + i])) << (8 * i));
  return value;
}

}  // namespace

std::string encode_frame(FrameKind kind, unsigned log2_group, std::uint32_t seq, double t_first,
                         const Eigen::Ref<const Eigen::MatrixXd>& values) {
  if (values.rows() > 0xFFFF || values.cols() > 0xFFFF) {
    throw Error(fmt::format("frame of {} x {} values: each must be at most 65535", values.rows(), values.cols()));
  }
  std::string out;
  out.reserve(kHeader + 4 * static_cast<std::size_t>(values.size()));
  append<std::uint32_t>(out, kMagic | static_cast<std::uint32_t>(kind) << 8 | log2_group);
  append<std::uint32_t>(out, seq);
  append<std::uint64_t>(out, static_cast<std::uint64_t>(std::llround(std::max(0.0, t_first) * 1e9)));
  append<std::uint16_t>(out, static_cast<std::uint16_t>(values.cols()));
  append<std::uint16_t>(out, static_cast<std::uint16_t>(values.rows()));
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      append<std::uint32_t>(out, std::bit_cast<std::uint32_t>(static_cast<float>(values(i, c))));
    }
  }
  return out;
}

FrameHeader decode_frame(const std::string& bytes, Eigen::MatrixXf* values) {
  if (bytes.size() < kHeader || (take<std::uint32_t>(bytes, 0) & 0xFFFFF000) != kMagic) {
    throw Error(fmt::format("frame of {} bytes: no frame of version 1", bytes.size()));
  }
  FrameHeader header;
  const auto magic = take<std::uint32_t>(bytes, 0);
  header.kind = static_cast<FrameKind>(magic >> 8 & 0xF);
  header.log2_group = magic & 0xFF;
  header.seq = take<std::uint32_t>(bytes, 4);
  header.t_ns = take<std::uint64_t>(bytes, 8);
  header.channels = take<std::uint16_t>(bytes, 16);
  header.n = take<std::uint16_t>(bytes, 18);
  const std::size_t expected = kHeader + std::size_t{4} * header.channels * header.n;
  if (bytes.size() != expected) throw Error(fmt::format("frame of {} bytes: must be {}", bytes.size(), expected));
  if (values != nullptr) {
    values->resize(header.n, header.channels);
    for (Eigen::Index k = 0; k < values->size(); ++k) {
      values->data()[k] = std::bit_cast<float>(take<std::uint32_t>(bytes, kHeader + 4 * static_cast<std::size_t>(k)));
    }
  }
  return header;
}

}  // namespace whirl::monitor
