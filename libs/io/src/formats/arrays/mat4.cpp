// MAT-files of version 4: matrices one after the other, each with a header of five 32-bit integers. Layout: The
// MathWorks, MAT-File Format, appendix on level 4. Written by MATLAB with -v4, Octave, and many small analysers.
#include <fmt/format.h>

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
#include "whirl/io/file.hpp"

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

SignalFile parse(std::string_view bytes, std::string_view name, const ResponseOptions* wanted) {
  const auto fail = [&](std::size_t at, const std::string& message) {
    return Error::in_file(name, 0, fmt::format("byte {}: {}", at, message));
  };
  static constexpr std::array<NumberType, 6> kTypes = {NumberType::float64, NumberType::float32, NumberType::int32,
                                                       NumberType::int16,   NumberType::uint16,  NumberType::uint8};
  SignalFile file;
  file.source = name;
  file.format = "MAT v4";
  std::vector<NamedArray> arrays;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::optional<Header> h = header_at(bytes.substr(at));
    if (!h) throw fail(at, "no header of a matrix");
    if (h->order > 1) throw fail(at, "numbers of a VAX or Cray: only IEEE numbers can be read");
    at += kHeader;
    if (bytes.size() - at < h->name_length) throw fail(at, "file ends inside a name");
    const std::string_view raw = bytes.substr(at, h->name_length);
    const std::string label(raw.substr(0, raw.find('\0')));
    at += h->name_length;
    const NumberType type = kTypes[static_cast<std::size_t>(h->precision)];
    const double size = static_cast<double>(h->rows) * static_cast<double>(h->columns) * (h->complex ? 2 : 1) *
                        static_cast<double>(width_of(type));
    if (size > static_cast<double>(bytes.size() - at)) {
      throw fail(at, fmt::format("matrix '{}' of {} x {} values does not fit into {} bytes", label, h->rows, h->columns,
                                 bytes.size() - at));
    }
    const std::size_t part = h->rows * h->columns * width_of(type);
    if (h->kind != 0) {
      file.contents.push_back(fmt::format("'{}': {}", label, h->kind == 1 ? "text" : "sparse matrix (passed over)"));
    } else if (part == 0) {
      file.contents.push_back(fmt::format("'{}': empty", label));
    } else {
      NamedArray array;
      array.name = label;
      const auto rows = static_cast<Eigen::Index>(h->rows), columns = static_cast<Eigen::Index>(h->columns);
      array.value = numbers_of(bytes.substr(at, part), type, h->big).reshaped(rows, columns);
      if (h->complex) array.imaginary = numbers_of(bytes.substr(at + part, part), type, h->big).reshaped(rows, columns);
      arrays.push_back(std::move(array));
    }
    at += part * (h->complex ? 2 : 1);
  }
  add_arrays(file, std::move(arrays), wanted);
  return file;
}

}  // namespace

Format mat4_format() {
  Format f{FileFormat::mat4, "MAT", {".mat"}, [](std::string_view head) {
             const std::optional<Header> h = header_at(head);
             return h && h->kind < 3 && head.size() >= kHeader + h->name_length &&
                    is_name(head.substr(kHeader, h->name_length));
           }};
  f.magic = true;
  f.read = [](const std::filesystem::path& path, const CsvOptions&) {
    return parse(read_text(path), path.string(), nullptr);
  };
  f.read_responses = [](const std::filesystem::path& path, const ResponseOptions& options) {
    return responses_of(parse(read_text(path), path.string(), &options), options);
  };
  return f;
}

}  // namespace whirl::io
