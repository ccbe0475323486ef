// MAT-files of version 4: matrices one after the other, each with a header of five 32-bit integers. Layout: The
// MathWorks, MAT-File Format, appendix on level 4. Written by MATLAB with -v4, Octave, and many small analysers.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "formats/arrays/arrays.hpp"
#include "formats/arrays/bytes.hpp"
#include "formats/format.hpp"
#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

constexpr std::size_t kHeader = 20;

struct Header {
  int order = 0, precision = 0, kind = 0;  // M, P and T of the type word
  std::size_t rows = 0, columns = 0, name_length = 0;
  bool complex = false, big = false;
};

// Nothing when these bytes begin no matrix of version 4. The type word is a decimal number MOPT below 5000.
std::optional<Header> header_at(std::string_view bytes) {
  if (bytes.size() < kHeader) return {};
  for (const bool big : {false, true}) {
    std::array<std::int32_t, 5> word{};
    for (std::size_t i = 0; i < 5; ++i) word[i] = number_at<std::int32_t>(bytes, 4 * i, big);
    Header h;
    const int type = word[0];
    h.big = big;
    h.order = type / 1000;
    h.precision = type / 10 % 10;
    h.kind = type % 10;
    if (type < 0 || type > 4052 || type / 100 % 10 != 0 || h.precision > 5 || h.kind > 2) continue;
    if (h.order < 2 && (h.order == 1) != big) continue;
    if (word[1] < 0 || word[2] < 0 || word[3] < 0 || word[3] > 1 || word[4] < 2 || word[4] > 256) continue;
    h.rows = static_cast<std::size_t>(word[1]);
    h.columns = static_cast<std::size_t>(word[2]);
    h.complex = word[3] == 1;
    h.name_length = static_cast<std::size_t>(word[4]);
    return h;
  }
  return {};
}

bool is_name(std::string_view text) {
  if (text.size() < 2 || text.back() != '\0') return false;
  text = text.substr(0, text.find('\0'));
  for (const char c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') return false;
  }
  return !text.empty();
}

void read_mat4_arrays(const std::shared_ptr<const RandomBytes>& in, std::size_t, SignalFile& file,
                      const TakeArray& take) {
  const auto fail = [&](std::uint64_t at, const std::string& message) {
    return Error::in_file(in->name(), 0, fmt::format("byte {}: {}", at, message));
  };
  static constexpr std::array<NumberType, 6> kTypes = {NumberType::float64, NumberType::float32, NumberType::int32,
                                                       NumberType::int16,   NumberType::uint16,  NumberType::uint8};
  file.source = in->name();
  file.format = "MAT v4";
  for (std::uint64_t at = 0; at < in->size();) {
    const std::optional<Header> h = header_at(in->copy(at, std::min<std::uint64_t>(kHeader, in->size() - at)));
    if (!h) throw fail(at, "no header of a matrix");
    if (h->order > 1) throw fail(at, "numbers of a VAX or Cray: only IEEE numbers can be read");
    at += kHeader;
    if (in->size() - at < h->name_length) throw fail(at, "file ends inside a name");
    std::string label = in->copy(at, h->name_length);
    label.resize(std::min(label.find('\0'), label.size()));
    at += h->name_length;
    const NumberType type = kTypes[static_cast<std::size_t>(h->precision)];
    const double size = static_cast<double>(h->rows) * static_cast<double>(h->columns) * (h->complex ? 2 : 1) *
                        static_cast<double>(width_of(type));
    if (size > static_cast<double>(in->size() - at)) {
      throw fail(at, fmt::format("matrix '{}' of {} x {} values does not fit into {} bytes", label, h->rows, h->columns,
                                 in->size() - at));
    }
    const std::uint64_t part = h->rows * h->columns * width_of(type);
    if (h->kind != 0) {
      file.contents.push_back(fmt::format("'{}': {}", label, h->kind == 1 ? "text" : "sparse matrix (passed over)"));
    } else if (part == 0) {
      file.contents.push_back(fmt::format("'{}': empty", label));
    } else {
      StoredArray array{.in = in, .real = {type, at, width_of(type)}, .big = h->big};
      array.head.name = label;
      if (h->complex) array.imaginary = StoredPart{type, at + part, width_of(type)};
      array.shape = {h->rows, h->columns};
      take(std::move(array));
    }
    at += part * (h->complex ? 2 : 1);
  }
}

}  // namespace

Format mat4_format() {
  return format_of_arrays<read_mat4_arrays>(FileFormat::mat4, "MAT", {".mat"}, [](std::string_view head) {
    const std::optional<Header> h = header_at(head);
    return h && h->kind < 3 && head.size() >= kHeader + h->name_length && is_name(head.substr(kHeader, h->name_length));
  });
}

}  // namespace whirl::io
