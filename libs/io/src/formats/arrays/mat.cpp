// MAT-files of version 5, read and written by hand: the library for them trusts the sizes in the file, and a damaged
// file makes it allocate or crash. Layout: The MathWorks, MAT-File Format (a 128 byte header, then tagged elements).
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
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
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

enum : std::uint32_t {
  kInt8 = 1,
  kUint8 = 2,
  kInt16 = 3,
  kUint16 = 4,
  kInt32 = 5,
  kUint32 = 6,
  kSingle = 7,
  kDouble = 9,
  kInt64 = 12,
  kUint64 = 13,
  kMatrix = 14,
  kCompressed = 15
};
enum : unsigned {
  kCell = 1,
  kStruct = 2,
  kObject = 3,
  kChar = 4,
  kSparse = 5,
  kDoubleClass = 6,
  kUint64Class = 15,
  kFunction = 16,
  kOpaque = 17
};
constexpr int kMostNested = 32;
constexpr std::size_t kMostInflated = std::size_t{1} << 30;

struct MatElement {
  std::uint32_t type = 0;
  std::string_view data;
  std::size_t at = 0;  ///< byte offset of the data in the file (of the compressed block, when inside one)
};

std::size_t width_of(std::uint32_t type) {
  switch (type) {
    case kInt8:
    case kUint8:
      return 1;
    case kInt16:
    case kUint16:
      return 2;
    case kInt32:
    case kUint32:
    case kSingle:
      return 4;
    case kDouble:
    case kInt64:
    case kUint64:
      return 8;
    default:
      return 0;
  }
}

class MatReader {
 public:
  MatReader(std::string_view bytes, std::string_view name) : bytes_(bytes) {
    file_.source = name;
    file_.format = "MAT v5";
  }

  SignalFile read(const ResponseOptions* wanted = nullptr) {
    if (bytes_.size() < 128) fail(bytes_.size(), "file ends inside the header of 128 bytes");
    const std::string_view order = bytes_.substr(126, 2);
    if (order != "IM" && order != "MI") fail(126, "byte order mark: must be 'IM' or 'MI'");
    swap_ = (order == "MI") == (std::endian::native == std::endian::little);
    for (std::size_t at = 128; at < bytes_.size();) {
      const MatElement element = next(bytes_, at, 0, false);
      if (element.type == kCompressed) {
        const std::string inflated = inflate_all(element);
        std::size_t inner = 0;
        const MatElement matrix = next(inflated, inner, element.at, false);
        if (matrix.type == kMatrix) read_matrix(matrix, "", "", 0);
      } else if (element.type == kMatrix) {
        read_matrix(element, "", "", 0);
      } else {
        file_.contents.push_back(fmt::format("element of type {} (passed over)", element.type));
      }
    }
    add_arrays(file_, std::move(arrays_), wanted);
    return std::move(file_);
  }

 private:
  [[noreturn]] void fail(std::size_t at, const std::string& message) const {
    throw Error::in_file(file_.source, 0, fmt::format("byte {}: {}", at, message));
  }

  template <class T>
  T get(std::string_view bytes, std::size_t at) const {
    char raw[sizeof(T)];
    std::memcpy(raw, bytes.data() + at, sizeof(T));
    if (swap_) std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
  }

  // The element at `at`, which moves behind it. `base` is added to offsets in messages.
  MatElement next(std::string_view bytes, std::size_t& at, std::size_t base, bool inside) const {
    if (bytes.size() - at < 8) fail(base + at, "element cut off inside its tag");
    const auto first = get<std::uint32_t>(bytes, at);
    if (first >> 16 != 0) {  // small element: size and type in one word, data in the next
      const std::size_t size = first >> 16;
      if (size > 4) fail(base + at, fmt::format("small element of {} bytes: must be at most 4", size));
      const MatElement element{first & 0xFFFF, bytes.substr(at + 4, size), base + at + 4};
      at += 8;
      return element;
    }
    std::size_t size = get<std::uint32_t>(bytes, at + 4);
    const bool unpacked =
        !inside && base > 0;  // some writers state the size of a compressed variable with too much padding
    if (unpacked) size = std::min(size, bytes.size() - at - 8);
    if (size > bytes.size() - at - 8) {
      fail(base + at, fmt::format("element of {} bytes, but {} are left", size, bytes.size() - at - 8));
    }
    const MatElement element{first, bytes.substr(at + 8, size), base + at + 8};
    at += 8 + size;
    if (first != kCompressed || inside) at = std::min(bytes.size(), (at + 7) / 8 * 8);
    return element;
  }

  std::string inflate_all(const MatElement& element) const {
    z_stream stream{};
    if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
    std::string out, piece(std::size_t{1} << 16, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(element.data.data()));
    stream.avail_in = static_cast<uInt>(element.data.size());
    int status = Z_OK;
    while (status == Z_OK && out.size() < kMostInflated) {
      stream.next_out = reinterpret_cast<Bytef*>(piece.data());
      stream.avail_out = static_cast<uInt>(piece.size());
      status = inflate(&stream, Z_NO_FLUSH);
      out.append(piece.data(), piece.size() - stream.avail_out);
      if (stream.avail_in == 0 && stream.avail_out != 0) break;
    }
    inflateEnd(&stream);
    if (status != Z_STREAM_END && status != Z_OK) fail(element.at, "compressed data are damaged");
    if (out.size() >= kMostInflated) fail(element.at, "compressed variable of more than 1 GiB");
    return out;
  }

  Eigen::MatrixXd numbers(const MatElement& element, Eigen::Index rows, Eigen::Index columns,
                          const std::string& name) const {
    const std::size_t width = width_of(element.type), count = static_cast<std::size_t>(rows * columns);
    if (width == 0) fail(element.at, fmt::format("variable '{}': data type {} cannot be read", name, element.type));
    if (element.data.size() < count * width) {
      fail(element.at, fmt::format("variable '{}': {} values of {} bytes do not fit into {} bytes", name, count, width,
                                   element.data.size()));
    }
    Eigen::MatrixXd m(rows, columns);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t at = i * width;
      double v = 0;
      switch (element.type) {
        case kInt8:
          v = get<std::int8_t>(element.data, at);
          break;
        case kUint8:
          v = get<std::uint8_t>(element.data, at);
          break;
        case kInt16:
          v = get<std::int16_t>(element.data, at);
          break;
        case kUint16:
          v = get<std::uint16_t>(element.data, at);
          break;
        case kInt32:
          v = get<std::int32_t>(element.data, at);
          break;
        case kUint32:
          v = get<std::uint32_t>(element.data, at);
          break;
        case kSingle:
          v = get<float>(element.data, at);
          break;
        case kInt64:
          v = static_cast<double>(get<std::int64_t>(element.data, at));
          break;
        case kUint64:
          v = static_cast<double>(get<std::uint64_t>(element.data, at));
          break;
        default:
          v = get<double>(element.data, at);
      }
      m.data()[i] = v;
    }
    return m;
  }

  // Fields of a structure and parts of a cell array are matrices of their own, without a name.
  void read_matrix(const MatElement& matrix, const std::string& group, const std::string& given, int depth) {
    std::size_t at = 0;
    const auto part = [&] { return next(matrix.data, at, matrix.at, true); };
    if (matrix.data.empty()) return;  // an empty matrix has no parts
    const MatElement flags = part();
    if (flags.type != kUint32 || flags.data.size() < 8) fail(flags.at, "array flags are expected");
    const auto word = get<std::uint32_t>(flags.data, 0);
    const unsigned kind = word & 0xFF;
    const bool complex = (word & 0x800) != 0;
    const MatElement sizes = kind == kOpaque ? MatElement{} : part();
    if (kind != kOpaque && (sizes.type != kInt32 || sizes.data.size() < 8))
      fail(sizes.at, "array dimensions are expected");
    const std::string name = given.empty() ? std::string(part().data) : (part(), given);
    const std::string full = group.empty() ? name : group + "." + name;
    // Checked against the bytes before anything is allocated.
    std::vector<std::size_t> shape;
    double count = 1;
    for (std::size_t d = 0; d + 4 <= sizes.data.size(); d += 4) {
      const auto size = get<std::int32_t>(sizes.data, d);
      count *= size;
      if (size < 0 || count > static_cast<double>(matrix.data.size()))
        fail(sizes.at, fmt::format("variable '{}': {:g} values in {} bytes", full, count, matrix.data.size()));
      shape.push_back(static_cast<std::size_t>(size));
    }
    const auto elements = static_cast<std::size_t>(count);
    if (kind == kCell || kind == kStruct) {
      if (depth > kMostNested) fail(matrix.at, fmt::format("variable '{}': nested deeper than {}", full, kMostNested));
      if (kind == kStruct) {
        read_structure(matrix, at, full, elements, depth);
      } else {
        for (std::size_t i = 0; i < elements && at < matrix.data.size(); ++i)
          read_matrix(next(matrix.data, at, matrix.at, true), group, fmt::format("{}{{{}}}", name, i + 1), depth + 1);
      }
      return;
    }
    if (kind == kChar || count == 0) {
      file_.contents.push_back(fmt::format("'{}': {}", full, kind == kChar ? "text" : "empty"));
      return;
    }
    if (kind < kDoubleClass || kind > kUint64Class) {
      file_.contents.push_back(fmt::format("'{}': {} (passed over)", full, class_name(kind)));
      return;
    }
    NamedArray array;
    array.group = group;
    array.name = name;
    if ((word & 0x200) != 0 && split_unit(name).unit == nullptr) array.unit = "1";  // logical
    while (shape.size() > 2 && shape.back() == 1) shape.pop_back();
    while (shape.size() > 3) {  // dimensions beyond the third are taken together
      shape[shape.size() - 2] *= shape.back();
      shape.pop_back();
    }
    const auto total = static_cast<Eigen::Index>(elements);
    const MatElement stored = part();
    const Eigen::VectorXd real = numbers(stored, total, 1, full);
    if (stored.type == kInt64 || stored.type == kUint64) {
      if (std::string rounded = rounding_of_integers(full, real); !rounded.empty())
        file_.findings.push_back(std::move(rounded));
    }
    const Eigen::VectorXd imaginary = complex ? Eigen::VectorXd(numbers(part(), total, 1, full)) : Eigen::VectorXd();
    set_values(array, real, imaginary, shape, true);
    arrays_.push_back(std::move(array));
  }

  void read_structure(const MatElement& matrix, std::size_t at, const std::string& full, std::size_t elements,
                      int depth) {
    const MatElement length = next(matrix.data, at, matrix.at, true);
    if (length.type != kInt32 || length.data.size() < 4) fail(length.at, "length of field names is expected");
    const auto width = get<std::int32_t>(length.data, 0);
    if (width < 1 || width > 1024) fail(length.at, fmt::format("field names of {} bytes: must be 1 to 1024", width));
    const MatElement names = next(matrix.data, at, matrix.at, true);
    const std::size_t fields = names.data.size() / static_cast<std::size_t>(width);
    for (std::size_t i = 0; i < elements; ++i) {
      const std::string group = elements == 1 ? full : fmt::format("{}({})", full, i + 1);
      for (std::size_t f = 0; f < fields && at < matrix.data.size(); ++f) {
        const std::string_view raw =
            names.data.substr(f * static_cast<std::size_t>(width), static_cast<std::size_t>(width));
        const std::string field(raw.substr(0, raw.find('\0')));
        read_matrix(next(matrix.data, at, matrix.at, true), group, field.empty() ? "field" : field, depth + 1);
      }
    }
  }

  static const char* class_name(unsigned kind) {
    return kind == kObject     ? "object"
           : kind == kSparse   ? "sparse matrix"
           : kind == kFunction ? "function handle"
           : kind == kOpaque   ? "object of a class"
                               : "unknown class";
  }

  std::string_view bytes_;
  bool swap_ = false;
  SignalFile file_;
  std::vector<NamedArray> arrays_;
};

void put_u32(std::string& out, std::uint32_t value) { out.append(reinterpret_cast<const char*>(&value), 4); }

void put_element(std::string& out, std::uint32_t type, std::string_view data) {
  put_u32(out, type);
  put_u32(out, static_cast<std::uint32_t>(data.size()));
  out += data;
  out.append((8 - data.size() % 8) % 8, '\0');
}

// A variable's name: letters, digits and underscores, starting with a letter, at most 63 of them.
std::string identifier(std::string name) {
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  if (name.empty() || std::isalpha(static_cast<unsigned char>(name.front())) == 0) name = "c" + name;
  return name.substr(0, 63);
}

void put_column(std::string& out, const std::string& name, const Eigen::VectorXd& value) {
  std::string matrix, flags, sizes;
  put_u32(flags, kDoubleClass);
  put_u32(flags, 0);
  put_element(matrix, kUint32, flags);
  put_u32(sizes, static_cast<std::uint32_t>(value.size()));
  put_u32(sizes, 1);
  put_element(matrix, kInt32, sizes);
  put_element(matrix, kInt8, identifier(name));
  put_element(matrix, kDouble,
              {reinterpret_cast<const char*>(value.data()), static_cast<std::size_t>(value.size()) * 8});
  put_element(out, kMatrix, matrix);
}

}  // namespace

SignalFile parse_mat(std::string_view bytes, std::string_view name) { return MatReader(bytes, name).read(); }

void write_mat(const std::filesystem::path& path, const Recording& recording) {
  if (recording.size() > (Eigen::Index{1} << 28))
    throw Error(fmt::format("{}: a MAT v5 variable holds up to 2 GiB", path.string()));
  std::string out = "MATLAB 5.0 MAT-file, written by whirl";
  out.resize(124, ' ');
  const std::uint16_t version = 0x0100, order = 'M' << 8 | 'I';
  out.append(reinterpret_cast<const char*>(&version), 2);
  out.append(reinterpret_cast<const char*>(&order), 2);
  put_column(out, "t_s", recording.times());
  for (const Channel& channel : recording.channels) {
    put_column(out, fmt::format("{}_{}", channel.name, si_suffix(channel.quantity).suffix), channel.samples);
  }
  write_text(path, out);
}

Format mat_format() {
  Format f{FileFormat::mat, "MAT", {".mat"}, [](std::string_view head) { return head.starts_with("MATLAB 5.0"); }};
  f.magic = true;
  f.read = [](const std::filesystem::path& path, const CsvOptions&) {
    return parse_mat(read_text(path), path.string());
  };
  f.write = write_mat;
  f.read_responses = [](const std::filesystem::path& path, const ResponseOptions& options) {
    const std::string bytes = read_text(path), name = path.string();
    return responses_of(MatReader(bytes, name).read(&options), options);
  };
  return f;
}

}  // namespace whirl::io
