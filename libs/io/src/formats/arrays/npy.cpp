// NumPy's files: .npy holds one array behind a text header, .npz is a ZIP archive of them. Layout: NEP 1 (NumPy) and
// PKWARE's application note on ZIP, stored and deflated members, without encryption.
#include <fmt/format.h>
#include <zlib.h>

#include <charconv>
#include <cstdint>
#include <map>

#include "formats/arrays/arrays.hpp"
#include "formats/arrays/bytes.hpp"
#include "formats/format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

constexpr std::string_view kMagic("\x93NUMPY", 6);
constexpr double kMostInflation = 1040;                      // of deflate
constexpr std::size_t kMostUnpacked = std::size_t{1} << 31;  // bytes of all members together

struct Field {
  std::string name;
  NumberType type = NumberType::float64;
  bool big = false, complex = false, truth = false;
  std::size_t offset = 0;
};

class NpyReader {
 public:
  NpyReader(std::string_view bytes, std::string_view file, std::string name)
      : bytes_(bytes), file_(file), name_(std::move(name)) {}

  void read(SignalFile& file, std::vector<NamedArray>& arrays) {
    if (bytes_.size() < 10 || !bytes_.starts_with(kMagic)) fail("no header of NumPy");
    const bool wide = bytes_[6] >= 2;
    if (wide && bytes_.size() < 12) fail("file ends inside the header");
    const std::size_t length =
        wide ? number_at<std::uint32_t>(bytes_, 8, false) : number_at<std::uint16_t>(bytes_, 8, false);
    const std::size_t at = wide ? 12 : 10;
    if (length > bytes_.size() - at) fail("file ends inside the header");
    const std::string_view header = bytes_.substr(at, length);
    data_ = bytes_.substr(at + length);
    const std::string_view descr = value_of(header, "descr");
    if (!read_type(descr)) {
      const std::string what = fmt::format("'{}': type {} (passed over)", name_, descr);
      // Text and objects are no samples; numbers that cannot be read are missed.
      const bool numbers = descr.find("O'") == std::string_view::npos && descr.find("U") == std::string_view::npos &&
                           descr.find("S") == std::string_view::npos;
      (numbers ? file.findings : file.contents).push_back(what);
      return;
    }
    const bool columns_first = value_of(header, "fortran_order").starts_with("True");
    read_shape(value_of(header, "shape"));
    if (shape_.size() > 3) {
      file.findings.push_back(fmt::format("'{}': {} dimensions (passed over)", name_, shape_.size()));
      return;
    }
    double count = 1;
    for (const std::size_t size : shape_) count *= static_cast<double>(size);
    if (count * static_cast<double>(item_) > static_cast<double>(data_.size())) {
      fail(fmt::format("{:g} values of {} bytes do not fit into {} bytes", count, item_, data_.size()));
    }
    if (count == 0) {
      file.contents.push_back(fmt::format("'{}': empty", name_));
      return;
    }
    for (const Field& field : fields_) {
      add(field, static_cast<std::size_t>(count), columns_first, arrays);
      if (field.type != NumberType::int64 && field.type != NumberType::uint64) continue;
      if (std::string rounded = rounding_of_integers(arrays.back().name, arrays.back().value); !rounded.empty())
        file.findings.push_back(std::move(rounded));
    }
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw Error::in_file(file_, 0, fmt::format("array '{}': {}", name_, message));
  }

  // Arrays of an archive's folder are a group.
  void name_array(NamedArray& array, const Field& field) const {
    const std::size_t slash = field.name.rfind('/');
    array.name = slash == std::string::npos ? field.name : field.name.substr(slash + 1);
    array.group = slash == std::string::npos ? "" : field.name.substr(0, slash);
    if (field.truth) array.unit = "1";
  }

  // The value of a key of the header, a dictionary of Python, as text.
  std::string_view value_of(std::string_view header, std::string_view key) const {
    const std::size_t at = header.find(fmt::format("'{}':", key));
    if (at == std::string_view::npos) fail(fmt::format("its header has no '{}'", key));
    std::string_view value = header.substr(at + key.size() + 3);
    value.remove_prefix(std::min(value.find_first_not_of(' '), value.size()));
    int depth = 0;
    for (std::size_t i = 0; i < value.size(); ++i) {
      depth += value[i] == '(' || value[i] == '[' ? 1 : value[i] == ')' || value[i] == ']' ? -1 : 0;
      if (depth == 0 && (value[i] == ',' || value[i] == '}')) return value.substr(0, i);
    }
    return value;
  }

  // "<f8" and the like.
  static bool read_code(std::string_view code, Field& field, std::size_t& width) {
    if (code.size() < 3 || (code[0] != '<' && code[0] != '>' && code[0] != '|')) return false;
    field.big = code[0] == '>';
    const std::string_view kind = code.substr(1);
    static constexpr std::pair<std::string_view, NumberType> kTypes[] = {
        {"f8", NumberType::float64},  {"f4", NumberType::float32}, {"f2", NumberType::float16},
        {"i8", NumberType::int64},    {"i4", NumberType::int32},   {"i2", NumberType::int16},
        {"i1", NumberType::int8},     {"u8", NumberType::uint64},  {"u4", NumberType::uint32},
        {"u2", NumberType::uint16},   {"u1", NumberType::uint8},   {"b1", NumberType::uint8},
        {"c16", NumberType::float64}, {"c8", NumberType::float32}};
    for (const auto& [text, type] : kTypes) {
      if (kind != text) continue;
      field.type = type;
      field.complex = text.front() == 'c';
      field.truth = text.front() == 'b' && split_unit(field.name).unit == nullptr;
      width = width_of(type) * (field.complex ? 2 : 1);
      return true;
    }
    return false;
  }

  // A code in quotes, or a list of ('name', code) for records of several fields.
  bool read_type(std::string_view text) {
    const auto quoted = [&](std::size_t& at) {
      const std::size_t first = text.find('\'', at);
      const std::size_t last = first == std::string_view::npos ? first : text.find('\'', first + 1);
      if (last == std::string_view::npos) return std::string_view();
      at = last + 1;
      return text.substr(first + 1, last - first - 1);
    };
    std::size_t at = 0, width = 0;
    if (!text.starts_with('[')) {
      Field field{name_};
      if (!read_code(quoted(at), field, width)) return false;
      item_ = width;
      fields_ = {field};
      return true;
    }
    while (text.find('(', at) != std::string_view::npos) {
      Field field{std::string(quoted(at))};
      const std::string_view code = quoted(at);
      if (code.starts_with("|V")) {  // padding
        const auto [end, error] = std::from_chars(code.data() + 2, code.data() + code.size(), width);
        if (error != std::errc() || end != code.data() + code.size() || width > (std::size_t{1} << 30)) return false;
        item_ += width;
        continue;
      }
      if (!read_code(code, field, width)) return false;
      // An array as field: ('xy', '<f8', (2,)).
      std::size_t parts = 1;
      if (text.substr(std::min(text.size(), text.find_first_not_of(' ', at))).starts_with(',')) {
        const std::size_t open = text.find('(', at), close = text.find(')', at);
        if (open == std::string_view::npos || close == std::string_view::npos || close < open) return false;
        const std::string_view sizes = text.substr(open + 1, close - open - 1);
        const auto [end, error] = std::from_chars(sizes.data(), sizes.data() + sizes.size(), parts);
        const std::string_view rest = sizes.substr(static_cast<std::size_t>(end - sizes.data()));
        if (error != std::errc() || rest.find_first_not_of(", ") != std::string_view::npos || parts < 1 || parts > 4096)
          return false;
        at = text.find(')', close + 1) == std::string_view::npos ? text.size() : close + 1;
      }
      const std::string name = field.name;
      for (std::size_t k = 0; k < parts; ++k) {
        field.name = parts == 1 ? name : part_name(name, k + 1);
        field.offset = item_;
        item_ += width;
        fields_.push_back(field);
      }
    }
    return !fields_.empty();
  }

  // "xy_mm" of several parts: "xy(1)_mm", ...
  static std::string part_name(const std::string& name, std::size_t part) {
    const NameWithUnit split = split_unit(name);
    return split.unit == nullptr ? fmt::format("{}({})", name, part)
                                 : fmt::format("{}({})_{}", split.name, part, split.unit->suffix);
  }

  void read_shape(std::string_view text) {
    for (std::size_t i = 0; i < text.size();) {
      if (text[i] < '0' || text[i] > '9') {
        ++i;
        continue;
      }
      std::size_t value = 0;
      const auto [end, error] = std::from_chars(text.data() + i, text.data() + text.size(), value);
      if (error != std::errc()) fail("a size of its shape is no number");
      i = static_cast<std::size_t>(end - text.data());
      shape_.push_back(value);
    }
  }

  void add(const Field& field, std::size_t count, bool columns_first, std::vector<NamedArray>& arrays) const {
    const std::size_t width = width_of(field.type);
    const auto part = [&](std::size_t offset) {
      if (item_ == width) return numbers_of(data_.substr(0, count * width), field.type, field.big);
      std::string packed;
      packed.reserve(count * width);
      for (std::size_t i = 0; i < count; ++i) packed += data_.substr(i * item_ + offset, width);
      return numbers_of(packed, field.type, field.big);
    };
    NamedArray array;
    name_array(array, field);
    Eigen::VectorXd real = part(field.offset), imaginary;
    if (field.complex) imaginary = part(field.offset + width);
    set_values(array, real, imaginary, shape_, columns_first);
    arrays.push_back(std::move(array));
  }

  std::string_view bytes_, data_;
  std::string file_, name_;
  std::vector<Field> fields_;
  std::size_t item_ = 0;
  std::vector<std::size_t> shape_;
};

std::string without_npy(std::string_view name) {
  if (name.ends_with(".npy")) name.remove_suffix(4);
  return std::string(name);
}

std::string inflate_member(std::string_view packed, std::size_t size, std::string_view file, std::string_view name) {
  const auto fail = [&](const char* what) {
    return Error::in_file(file, 0, fmt::format("member '{}' {}", name, what));
  };
  if (static_cast<double>(size) > kMostInflation * static_cast<double>(packed.size()) + 64)
    throw fail("states more bytes than its data can hold");
  std::string out(size, '\0');
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int status = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  if (status != Z_STREAM_END || stream.avail_out != 0) throw fail("is damaged or cut off");
  return out;
}

/// Members of an archive stand apart: one that stands in another is a small file that unpacks without end.
class MemberPlaces {
 public:
  bool take(std::size_t from, std::size_t to) {
    const auto after = taken_.lower_bound(from);
    if (after != taken_.end() && after->first < to) return false;
    if (after != taken_.begin() && std::prev(after)->second > from) return false;
    taken_.emplace(from, to);
    return true;
  }

 private:
  std::map<std::size_t, std::size_t> taken_;
};

// Members of a ZIP archive by its central directory.
SignalFile parse_npz(std::string_view bytes, std::string_view file_name, const ResponseOptions* wanted) {
  const auto fail = [&](const std::string& message) { return Error::in_file(file_name, 0, message); };
  SignalFile file;
  file.source = file_name;
  file.format = "NPZ";
  std::vector<NamedArray> arrays;
  const std::size_t end = bytes.rfind(std::string_view("PK\x05\x06", 4));
  if (end == std::string_view::npos || bytes.size() - end < 22) throw fail("ZIP archive without a directory: cut off");
  std::size_t at = number_at<std::uint32_t>(bytes, end + 16, false);
  const std::size_t members = number_at<std::uint16_t>(bytes, end + 10, false);
  MemberPlaces places;
  std::size_t unpacked_bytes = 0;
  for (std::size_t k = 0; k < members; ++k) {
    if (at > bytes.size() || bytes.size() - at < 46 || number_at<std::uint32_t>(bytes, at, false) != 0x02014b50)
      throw fail(fmt::format("byte {}: no entry of a ZIP directory", at));
    const auto word = [&](std::size_t offset) {
      return std::size_t{number_at<std::uint16_t>(bytes, at + offset, false)};
    };
    const auto wide = [&](std::size_t offset) {
      return std::size_t{number_at<std::uint32_t>(bytes, at + offset, false)};
    };
    const std::size_t method = word(10), packed = wide(20), size = wide(24), name_size = word(28);
    const std::size_t local = wide(42), next = at + 46 + name_size + word(30) + word(32);
    if (bytes.size() - at - 46 < name_size) throw fail("file ends inside a ZIP directory");
    const std::string member(bytes.substr(at + 46, name_size));
    if ((word(8) & 1) != 0) throw fail(fmt::format("member '{}' is encrypted", member));
    if (packed == 0xFFFFFFFF || size == 0xFFFFFFFF || local == 0xFFFFFFFF)
      throw fail(fmt::format("member '{}' is larger than 4 GiB", member));
    if (local > bytes.size() || bytes.size() - local < 30) throw fail(fmt::format("member '{}' lies outside", member));
    const std::size_t from = local + 30 + number_at<std::uint16_t>(bytes, local + 26, false) +
                             number_at<std::uint16_t>(bytes, local + 28, false);
    if (from > bytes.size() || bytes.size() - from < packed) throw fail(fmt::format("member '{}' is cut off", member));
    if (!places.take(local, from + packed)) throw fail(fmt::format("member '{}' lies inside another", member));
    const std::string_view data = bytes.substr(from, packed);
    at = next;
    if (!member.ends_with(".npy")) {
      file.contents.push_back(fmt::format("'{}': no array (passed over)", member));
      continue;
    }
    if (method != 0 && method != 8) throw fail(fmt::format("member '{}' is packed by method {}", member, method));
    unpacked_bytes += method == 8 ? size : packed;
    if (unpacked_bytes > kMostUnpacked)
      throw fail(fmt::format("its members unpack to more than {} bytes together", kMostUnpacked));
    const std::string unpacked = method == 8 ? inflate_member(data, size, file_name, member) : std::string(data);
    NpyReader(unpacked, file_name, without_npy(member)).read(file, arrays);
  }
  add_arrays(file, std::move(arrays), wanted);
  return file;
}

SignalFile read_numpy(const std::filesystem::path& path, const ResponseOptions* wanted) {
  const std::string bytes = read_text(path), name = path.string();
  if (!bytes.starts_with(kMagic)) return parse_npz(bytes, name, wanted);
  SignalFile file;
  file.source = name;
  file.format = "NPY";
  std::vector<NamedArray> arrays;
  NpyReader(bytes, name, path.stem().string()).read(file, arrays);
  add_arrays(file, std::move(arrays), wanted);
  return file;
}

template <class T>
void put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string npy_of(const Eigen::VectorXd& value) {
  std::string header = fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}", value.size());
  header.append(63 - (10 + header.size()) % 64, ' ');
  header += '\n';
  std::string out(kMagic);
  out += std::string("\x01\x00", 2);
  put(out, static_cast<std::uint16_t>(header.size()));
  out += header;
  out.append(reinterpret_cast<const char*>(value.data()), static_cast<std::size_t>(value.size()) * 8);
  return out;
}

void write_npz(const std::filesystem::path& path, const Recording& recording) {
  if (path.extension() == ".npy")
    throw Error::in_field("OUT", path.string(), "a file ending in .npz: an .npy file holds one array, not a record");
  std::vector<std::pair<std::string, std::string>> members = {{"t_s", npy_of(recording.times())}};
  for (const Channel& channel : recording.channels) {
    members.emplace_back(fmt::format("{}_{}", channel.name, si_suffix(channel.quantity).suffix),
                         npy_of(channel.samples));
  }
  std::string out, directory;
  for (auto& [name, data] : members) {
    for (char& c : name) c = c == '/' ? '_' : c;
    name += ".npy";
    if (out.size() + data.size() > 0xFFFFFFF0u)
      throw Error(fmt::format("{}: an NPZ archive holds up to 4 GiB here", path.string()));
    std::string entry;  // what the local and the central header share
    for (const int v : {20, 0, 0, 0, 0x21}) put(entry, static_cast<std::uint16_t>(v));  // stored, 1980-01-01
    put(entry, static_cast<std::uint32_t>(crc32(crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(data.data()),
                                                static_cast<uInt>(data.size()))));
    put(entry, static_cast<std::uint32_t>(data.size()));
    put(entry, static_cast<std::uint32_t>(data.size()));
    put(entry, static_cast<std::uint16_t>(name.size()));
    put(entry, std::uint16_t{0});
    const auto at = static_cast<std::uint32_t>(out.size());
    out += std::string("PK\x03\x04", 4) + entry + name + data;
    directory += std::string("PK\x01\x02", 4);
    put(directory, std::uint16_t{20});
    directory += entry + std::string(10, '\0');
    put(directory, at);
    directory += name;
  }
  const auto begin = static_cast<std::uint32_t>(out.size());
  out += directory + std::string("PK\x05\x06\0\0\0\0", 8);
  put(out, static_cast<std::uint16_t>(members.size()));
  put(out, static_cast<std::uint16_t>(members.size()));
  put(out, static_cast<std::uint32_t>(directory.size()));
  put(out, begin);
  put(out, std::uint16_t{0});
  write_text(path, out);
}

}  // namespace

Format numpy_format() {
  Format f{FileFormat::numpy, "NPY or NPZ", {".npz", ".npy"}, [](std::string_view head) {
             if (head.starts_with(kMagic)) return true;
             if (!head.starts_with(std::string_view("PK\x03\x04", 4)) || head.size() < 30) return false;
             const std::size_t length = number_at<std::uint16_t>(head, 26, false);
             return head.size() >= 30 + length && head.substr(30, length).ends_with(".npy");
           }};
  f.magic = true;
  f.read = [](const std::filesystem::path& path, const CsvOptions&) { return read_numpy(path, nullptr); };
  f.write = write_npz;
  f.read_responses = [](const std::filesystem::path& path, const ResponseOptions& options) {
    return responses_of(read_numpy(path, &options), options);
  };
  return f;
}

}  // namespace whirl::io
