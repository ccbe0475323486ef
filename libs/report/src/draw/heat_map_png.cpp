#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "drawing.hpp"
#include "whirl/core/error.hpp"

// An indexed PNG is four chunks around one zlib stream: less code than the calls libpng would need, and zlib is there.
namespace whirl::report {
namespace {

constexpr int kLevels = 254;  ///< palette entries 0..253 are colours, kMissing is transparent
constexpr std::uint8_t kMissing = 255;

/// A perceptually even ramp from dark blue over green to yellow, readable by colour-blind readers and in grey: anchor
/// colours of the published "viridis" map at equal steps (public domain).
constexpr std::array<std::array<int, 3>, 11> kAnchors = {{{68, 1, 84},
                                                          {72, 36, 117},
                                                          {65, 68, 135},
                                                          {53, 95, 141},
                                                          {42, 120, 142},
                                                          {33, 145, 140},
                                                          {34, 168, 132},
                                                          {68, 191, 112},
                                                          {122, 209, 81},
                                                          {189, 223, 38},
                                                          {253, 231, 37}}};

void append_u32(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 0xFF);
}

void append_chunk(std::string& out, const std::string& type, const std::string& data) {
  append_u32(out, static_cast<std::uint32_t>(data.size()));
  const std::string body = type + data;
  out += body;
  append_u32(out, static_cast<std::uint32_t>(
                      crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()))));
}

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

}  // namespace

std::string png_data_uri(const Eigen::MatrixXd& values, const Limits& limits, double factor) {
  std::string header;
  append_u32(header, static_cast<std::uint32_t>(values.cols()));
  append_u32(header, static_cast<std::uint32_t>(values.rows()));
  header += std::string("\x08\x03\x00\x00\x00", 5);  // 8 bit, palette

  std::string palette, alpha;
  for (int level = 0; level < 256; ++level) {
    const double at = std::min(1.0, level / (kLevels - 1.0)) * (kAnchors.size() - 1);
    const auto low = std::min(kAnchors.size() - 2, static_cast<std::size_t>(at));
    for (std::size_t c = 0; c < 3; ++c) {
      const double mixed =
          kAnchors[low][c] + (at - static_cast<double>(low)) * (kAnchors[low + 1][c] - kAnchors[low][c]);
      palette += static_cast<char>(std::lround(mixed));
    }
    alpha += static_cast<char>(level == kMissing ? 0 : 255);
  }

  std::string pixels;
  for (Eigen::Index i = values.rows(); i-- > 0;) {
    pixels += '\0';  // no row filter
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
      const double f = limits.fraction(values(i, j) / factor);
      pixels += static_cast<char>(std::isnan(f) ? kMissing : std::lround(std::clamp(f, 0.0, 1.0) * (kLevels - 1)));
    }
  }
  uLongf size = compressBound(static_cast<uLong>(pixels.size()));
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(pixels.data()),
                static_cast<uLong>(pixels.size()), 9) != Z_OK) {
    throw Error("figure: heat map cannot be compressed: out of memory");
  }
  packed.resize(size);

  std::string png = "\x89PNG\r\n\x1a\n";
  append_chunk(png, "IHDR", header);
  append_chunk(png, "PLTE", palette);
  append_chunk(png, "tRNS", alpha);
  append_chunk(png, "IDAT", packed);
  append_chunk(png, "IEND", "");
  return "data:image/png;base64," + base64(png);
}

}  // namespace whirl::report
