// MAT-files of version 5, read and written by hand: the library for them trusts the sizes in the file, and a damaged
// file makes it allocate or crash. Layout: The MathWorks, MAT-File Format (a 128 byte header, then tagged elements).
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>

#include "formats/arrays/arrays.hpp"
#include "formats/arrays/bytes.hpp"
#include "formats/format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

enum : std::uint32_t { kInt8 = 1, kInt32 = 5, kUint32 = 6, kDouble = 9, kMatrix = 14, kCompressed = 15 };
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
constexpr std::uint64_t kMostName = 4096;  // bytes
constexpr std::size_t kMostInflated = std::size_t{1} << 30;

/// Bytes in what holds them: the file, or what was unpacked of it.
struct MatElement {
  std::uint32_t type = 0;
  std::uint64_t at = 0, size = 0;

  std::uint64_t end() const { return at + size; }
};

std::optional<NumberType> number_type(std::uint32_t type) {
  using enum NumberType;
  constexpr std::optional<NumberType> kTypes[] = {{},      int8, uint8,   int16, uint16, int32, uint32,
                                                  float32, {},   float64, {},    {},     int64, uint64};
  return type < std::size(kTypes) ? kTypes[type] : std::nullopt;
}

class MatReader {
 public:
  MatReader(std::shared_ptr<const RandomBytes> bytes, std::size_t most_unpacked, SignalFile& file,
            const TakeArray& take)
      : in_(std::move(bytes)), most_unpacked_(std::min(most_unpacked, kMostInflated)), file_(file), take_(take) {
    file_.source = in_->name();
    file_.format = "MAT v5";
  }

  void read() {
    const std::shared_ptr<const RandomBytes> whole = in_;
    if (whole->size() < 128) fail(whole->size(), "file ends inside the header of 128 bytes");
    const std::string order = whole->copy(126, 2);
    if (order != "IM" && order != "MI") fail(126, "byte order mark: must be 'IM' or 'MI'");
    big_ = order == "MI";
    for (std::uint64_t at = 128; at < whole->size();) {
      const MatElement element = next({0, 0, whole->size()}, at, false);
      if (element.type == kCompressed) {
        in_ = std::make_shared<RandomBytes>(inflate_all(element), whole->name());
        base_ = element.at;
        std::uint64_t inner = 0;
        const MatElement matrix = next({0, 0, in_->size()}, inner, false);
        if (matrix.type == kMatrix) read_matrix(matrix, "", "", 0);
        in_ = whole;
        base_ = 0;
      } else if (element.type == kMatrix) {
        read_matrix(element, "", "", 0);
      } else {
        file_.contents.push_back(fmt::format("element of type {} (passed over)", element.type));
      }
    }
  }

 private:
  [[noreturn]] void fail(std::uint64_t at, const std::string& message) const {
    throw Error::in_file(file_.source, 0, fmt::format("byte {}: {}", base_ + at, message));
  }

  template <class T>
  T get(std::uint64_t at) const {
    return in_->number<T>(at, big_);
  }

  // The element at `at`, which moves behind it.
  MatElement next(const MatElement& holder, std::uint64_t& at, bool inside) const {
    const std::uint64_t end = holder.end();
    if (end - at < 8) fail(at, "element cut off inside its tag");
    const auto first = get<std::uint32_t>(at);
    if (first >> 16 != 0) {  // small element: size and type in one word, data in the next
      const std::uint32_t size = first >> 16;
      if (size > 4) fail(at, fmt::format("small element of {} bytes: must be at most 4", size));
      const MatElement element{first & 0xFFFF, at + 4, size};
      at += 8;
      return element;
    }
    std::uint64_t size = get<std::uint32_t>(at + 4);
    const bool unpacked =
        !inside && base_ > 0;  // some writers state the size of a compressed variable with too much padding
    if (unpacked) size = std::min(size, end - at - 8);
    if (size > end - at - 8) fail(at, fmt::format("element of {} bytes, but {} are left", size, end - at - 8));
    const MatElement element{first, at + 8, size};
    at += 8 + size;
    if (first != kCompressed || inside) at = std::min(end, holder.at + (at - holder.at + 7) / 8 * 8);
    return element;
  }

  /// In parts the packed variables stay in memory, all together within the limit.
  std::string inflate_all(const MatElement& element) {
    const bool parts = most_unpacked_ < kMostInflated;
    const std::size_t most = parts ? most_unpacked_ - std::min(most_unpacked_, unpacked_) : most_unpacked_;
    z_stream stream{};
    if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
    std::string out, piece(std::size_t{1} << 16, '\0'), packed;
    std::uint64_t at = element.at;
    int status = Z_OK;
    while (status == Z_OK && out.size() < most) {
      if (stream.avail_in == 0) {
        packed = in_->copy(at, static_cast<std::size_t>(std::min<std::uint64_t>(piece.size(), element.end() - at)));
        at += packed.size();
        stream.next_in = reinterpret_cast<Bytef*>(packed.data());
        stream.avail_in = static_cast<uInt>(packed.size());
      }
      stream.next_out = reinterpret_cast<Bytef*>(piece.data());
      stream.avail_out = static_cast<uInt>(piece.size());
      status = inflate(&stream, Z_NO_FLUSH);
      out.append(piece.data(), piece.size() - stream.avail_out);
      if (stream.avail_in == 0 && stream.avail_out != 0 && at == element.end()) break;
    }
    inflateEnd(&stream);
    if (status != Z_STREAM_END && status != Z_OK) fail(element.at, "compressed data are damaged");
    if (out.size() >= most && parts)
      fail(element.at,
           fmt::format("compressed variables of more than {} MiB: such a file cannot be read in parts; save it with "
                       "-nocompression, or as v7.3",
                       most_unpacked_ >> 20));
    if (out.size() >= most) fail(element.at, "compressed variable of more than 1 GiB");
    unpacked_ += out.size();
    return out;
  }

  // Fields of a structure and parts of a cell array are matrices of their own, without a name.
  void read_matrix(const MatElement& matrix, const std::string& group, const std::string& given, int depth) {
    std::uint64_t at = matrix.at;
    const auto part = [&] { return next(matrix, at, true); };
    if (matrix.size == 0) return;  // an empty matrix has no parts
    const MatElement flags = part();
    if (flags.type != kUint32 || flags.size < 8) fail(flags.at, "array flags are expected");
    const auto word = get<std::uint32_t>(flags.at);
    const unsigned kind = word & 0xFF;
    const MatElement sizes = kind == kOpaque ? MatElement{} : part();
    if (kind != kOpaque && (sizes.type != kInt32 || sizes.size < 8)) fail(sizes.at, "array dimensions are expected");
    const std::string stated = text(part());
    const std::string name = given.empty() ? stated : given;
    const std::string full = group.empty() ? name : group + "." + name;
    // Checked against the bytes before anything is allocated.
    std::vector<std::size_t> shape;
    double count = 1;
    for (std::uint64_t d = 0; d + 4 <= sizes.size; d += 4) {
      const auto size = get<std::int32_t>(sizes.at + d);
      count *= size;
      if (size < 0 || count > static_cast<double>(matrix.size))
        fail(sizes.at, fmt::format("variable '{}': {:g} values in {} bytes", full, count, matrix.size));
      shape.push_back(static_cast<std::size_t>(size));
    }
    const auto elements = static_cast<std::size_t>(count);
    if (kind == kCell || kind == kStruct) {
      if (depth > kMostNested) fail(matrix.at, fmt::format("variable '{}': nested deeper than {}", full, kMostNested));
      if (kind == kStruct) {
        read_structure(matrix, at, full, elements, depth);
      } else {
        for (std::size_t i = 0; i < elements && at < matrix.end(); ++i)
          read_matrix(next(matrix, at, true), group, fmt::format("{}{{{}}}", name, i + 1), depth + 1);
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
    StoredArray array{.in = in_, .big = big_};
    array.head.group = group;
    array.head.name = name;
    if ((word & 0x200) != 0 && split_unit(name).unit == nullptr) array.head.unit = "1";  // logical
    while (shape.size() > 2 && shape.back() == 1) shape.pop_back();
    while (shape.size() > 3) {  // dimensions beyond the third are taken together
      shape[shape.size() - 2] *= shape.back();
      shape.pop_back();
    }
    array.shape = std::move(shape);
    array.real = place_of_numbers(part(), array, full);
    if ((word & 0x800) != 0) array.imaginary = place_of_numbers(part(), array, full);
    take_(std::move(array));
  }

  std::string text(const MatElement& element) const {
    if (element.size > kMostName)
      fail(element.at, fmt::format("name of {} bytes: must be at most {}", element.size, kMostName));
    return in_->copy(element.at, static_cast<std::size_t>(element.size));
  }

  StoredPart place_of_numbers(const MatElement& element, StoredArray& array, const std::string& name) const {
    const std::optional<NumberType> type = number_type(element.type);
    if (!type) fail(element.at, fmt::format("variable '{}': data type {} cannot be read", name, element.type));
    const std::size_t width = width_of(*type);
    if (element.size < array.size() * width)
      fail(element.at, fmt::format("variable '{}': {} values of {} bytes do not fit into {} bytes", name, array.size(),
                                   width, element.size));
    if (*type == NumberType::int64 || *type == NumberType::uint64) array.head.integers = name;
    return {*type, element.at, width};
  }

  void read_structure(const MatElement& matrix, std::uint64_t at, const std::string& full, std::size_t elements,
                      int depth) {
    const MatElement length = next(matrix, at, true);
    if (length.type != kInt32 || length.size < 4) fail(length.at, "length of field names is expected");
    const auto width = get<std::int32_t>(length.at);
    if (width < 1 || width > 1024) fail(length.at, fmt::format("field names of {} bytes: must be 1 to 1024", width));
    const MatElement names = next(matrix, at, true);
    const std::uint64_t fields = names.size / static_cast<std::uint64_t>(width);
    for (std::size_t i = 0; i < elements && fields > 0; ++i) {
      const std::string group = elements == 1 ? full : fmt::format("{}({})", full, i + 1);
      for (std::uint64_t f = 0; f < fields && at < matrix.end(); ++f) {
        const auto bytes = static_cast<std::size_t>(width);
        std::string field = in_->copy(names.at + f * bytes, bytes);
        field.resize(std::min(field.find('\0'), field.size()));
        read_matrix(next(matrix, at, true), group, field.empty() ? "field" : field, depth + 1);
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

  std::shared_ptr<const RandomBytes> in_;
  std::uint64_t base_ = 0;  ///< byte of the file where what was unpacked stands
  std::size_t most_unpacked_, unpacked_ = 0;
  bool big_ = false;
  SignalFile& file_;
  const TakeArray& take_;
};

void read_mat_arrays(const std::shared_ptr<const RandomBytes>& bytes, std::size_t most_unpacked, SignalFile& file,
                     const TakeArray& take) {
  MatReader(bytes, most_unpacked, file, take).read();
}

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

SignalFile parse_mat(std::string_view bytes, std::string_view name) {
  return read_arrays(std::make_shared<RandomBytes>(std::string(bytes), std::string(name)), read_mat_arrays);
}

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
  Format f = format_of_arrays<read_mat_arrays>(FileFormat::mat, "MAT", {".mat"},
                                               [](std::string_view head) { return head.starts_with("MATLAB 5.0"); });
  f.write = write_mat;
  f.missing = "NaN";
  return f;
}

}  // namespace whirl::io
