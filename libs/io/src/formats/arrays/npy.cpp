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
#include "formats/text_lines.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

constexpr std::string_view kMagic("\x93NUMPY", 6);
constexpr double kMostInflation = 1040;                      // of deflate
constexpr std::size_t kMostUnpacked = std::size_t{1} << 31;  // bytes of all deflated members together
constexpr std::size_t kMostHeader = std::size_t{1} << 20;    // bytes

struct Field {
  std::string name;
  NumberType type = NumberType::float64;
  bool big = false, complex = false, truth = false;
  std::size_t offset = 0;
};

class NpyReader {
 public:
  /// The bytes from `at` to `end`.
  NpyReader(std::shared_ptr<const RandomBytes> in, std::uint64_t at, std::uint64_t end, std::string name)
      : in_(std::move(in)), at_(at), end_(end), name_(std::move(name)) {}

  void read(SignalFile& file, const TakeArray& take) {
    const std::string start = in_->copy(at_, std::min<std::uint64_t>(12, end_ - at_));
    if (start.size() < 10 || !start.starts_with(kMagic)) fail("no header of NumPy");
    const bool wide = start[6] >= 2;
    if (wide && start.size() < 12) fail("file ends inside the header");
    const std::size_t length =
        wide ? number_at<std::uint32_t>(start, 8, false) : number_at<std::uint16_t>(start, 8, false);
    at_ += wide ? 12 : 10;
    if (length > end_ - at_) fail("file ends inside the header");
    if (length > kMostHeader) fail(fmt::format("a header of {} bytes: must be at most {}", length, kMostHeader));
    const std::string text = in_->copy(at_, length);
    const std::string_view header = text;
    at_ += length;
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
    if (count * static_cast<double>(item_) > static_cast<double>(end_ - at_)) {
      fail(fmt::format("{:g} values of {} bytes do not fit into {} bytes", count, item_, end_ - at_));
    }
    if (count == 0) {
      file.contents.push_back(fmt::format("'{}': empty", name_));
      return;
    }
    for (const Field& field : fields_) {
      StoredArray array{
          .in = in_, .real = {field.type, at_, item_, field.offset}, .big = field.big, .columns_first = columns_first};
      name_array(array.head, field);
      if (field.complex) array.imaginary = StoredPart{field.type, at_, item_, field.offset + width_of(field.type)};
      if (field.type == NumberType::int64 || field.type == NumberType::uint64) array.head.integers = array.head.name;
      array.shape = shape_;
      take(std::move(array));
    }
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw Error::in_file(in_->name(), 0, fmt::format("array '{}': {}", name_, message));
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
        const auto bytes = number_of<std::size_t>(code.substr(2));
        if (!bytes || *bytes > (std::size_t{1} << 30)) return false;
        item_ += *bytes;
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

  std::shared_ptr<const RandomBytes> in_;
  std::uint64_t at_, end_;
  std::string name_;
  std::vector<Field> fields_;
  std::size_t item_ = 0;
  std::vector<std::size_t> shape_;
};

std::string without_npy(std::string_view name) {
  if (name.ends_with(".npy")) name.remove_suffix(4);
  return std::string(name);
}

std::string inflate_member(const std::string& packed, std::size_t size, std::string_view file, std::string_view name) {
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

/// Members of a ZIP archive by its central directory.
class NpzReader {
 public:
  NpzReader(const std::shared_ptr<const RandomBytes>& in, std::size_t most_unpacked, SignalFile& file,
            const TakeArray& take)
      : in_(in), most_unpacked_(std::min(most_unpacked, kMostUnpacked)), file_(file), take_(take) {}

  void read() {
    // The end record: 22 bytes and a comment of at most 65535.
    const std::uint64_t tail_at = in_->size() - std::min<std::uint64_t>(in_->size(), 22 + 65535);
    const std::string tail = in_->copy(tail_at, static_cast<std::size_t>(in_->size() - tail_at));
    const std::size_t end = tail.rfind(std::string_view("PK\x05\x06", 4));
    if (end == std::string::npos || tail.size() - end < 22) throw fail("ZIP archive without a directory: cut off");
    std::uint64_t at = number_at<std::uint32_t>(tail, end + 16, false);
    std::uint64_t members = number_at<std::uint16_t>(tail, end + 10, false);
    if (end >= 20 && tail.compare(end - 20, 4, "PK\x06\x07") == 0) {  // ZIP64: the place of a longer end record
      const auto wide = number_at<std::uint64_t>(tail, end - 12, false);
      if (wide > in_->size() || in_->size() - wide < 56) throw fail("ZIP archive without a directory: cut off");
      members = in_->number<std::uint64_t>(wide + 32, false);
      at = in_->number<std::uint64_t>(wide + 48, false);
    }
    for (std::uint64_t k = 0; k < members; ++k) at = read_member(at);
  }

 private:
  Error fail(const std::string& message) const { return Error::in_file(in_->name(), 0, message); }

  /// Sizes and place of a member that the entry of the directory at `at` states.
  struct Member {
    std::uint64_t packed, size, local;
  };
  Member member_at(const std::string& entry, std::uint64_t extra_at, std::size_t extra_size) const {
    const auto wide = [&](std::size_t offset) { return std::uint64_t{number_at<std::uint32_t>(entry, offset, false)}; };
    Member m{wide(20), wide(24), wide(42)};
    const std::string extra = in_->copy(extra_at, extra_size);
    for (std::size_t i = 0; i + 4 <= extra.size();) {
      const std::size_t size = number_at<std::uint16_t>(extra, i + 2, false);
      if (size > extra.size() - i - 4) break;
      std::size_t from = i + 4;
      for (std::uint64_t* value : {&m.size, &m.packed, &m.local}) {
        if (number_at<std::uint16_t>(extra, i, false) != 1 || *value != 0xFFFFFFFF || from + 8 > i + 4 + size) continue;
        *value = number_at<std::uint64_t>(extra, from, false);
        from += 8;
      }
      i += 4 + size;
    }
    return m;
  }

  /// Returns the place of the next entry.
  std::uint64_t read_member(std::uint64_t at) {
    const std::uint64_t size = in_->size();
    const std::string entry = at > size || size - at < 46 ? std::string() : in_->copy(at, 46);
    if (entry.empty() || number_at<std::uint32_t>(entry, 0, false) != 0x02014b50)
      throw fail(fmt::format("byte {}: no entry of a ZIP directory", at));
    const auto word = [&](std::size_t offset) { return std::size_t{number_at<std::uint16_t>(entry, offset, false)}; };
    const std::size_t method = word(10), name_size = word(28), extra_size = word(30);
    const std::uint64_t next = at + 46 + name_size + extra_size + word(32);
    if (size - at - 46 < name_size + extra_size) throw fail("file ends inside a ZIP directory");
    const std::string name = in_->copy(at + 46, name_size);
    if ((word(8) & 1) != 0) throw fail(fmt::format("member '{}' is encrypted", name));
    const Member m = member_at(entry, at + 46 + name_size, extra_size);
    if (m.local > size || size - m.local < 30) throw fail(fmt::format("member '{}' lies outside", name));
    const std::uint64_t from = m.local + 30 + in_->number<std::uint16_t>(m.local + 26, false) +
                               in_->number<std::uint16_t>(m.local + 28, false);
    if (from > size || size - from < m.packed) throw fail(fmt::format("member '{}' is cut off", name));
    if (!places_.take(m.local, from + m.packed)) throw fail(fmt::format("member '{}' lies inside another", name));
    if (!name.ends_with(".npy")) {
      file_.contents.push_back(fmt::format("'{}': no array (passed over)", name));
      return next;
    }
    if (method != 0 && method != 8) throw fail(fmt::format("member '{}' is packed by method {}", name, method));
    if (method == 0) {
      NpyReader(in_, from, from + m.packed, without_npy(name)).read(file_, take_);
      return next;
    }
    if (m.packed > m.size + m.size / 100 + 1024) throw fail(fmt::format("member '{}' is damaged", name));
    unpacked_ += m.size;
    if (unpacked_ > most_unpacked_)
      throw fail(fmt::format("its deflated members unpack to more than {} bytes together{}", most_unpacked_,
                             most_unpacked_ == kMostUnpacked
                                 ? ""
                                 : ": they cannot be read in parts; save it with numpy.savez, which does not deflate"));
    const auto unpacked =
        std::make_shared<RandomBytes>(inflate_member(in_->copy(from, static_cast<std::size_t>(m.packed)),
                                                     static_cast<std::size_t>(m.size), in_->name(), name),
                                      in_->name());
    NpyReader(unpacked, 0, unpacked->size(), without_npy(name)).read(file_, take_);
    return next;
  }

  std::shared_ptr<const RandomBytes> in_;
  std::size_t most_unpacked_, unpacked_ = 0;
  SignalFile& file_;
  const TakeArray& take_;
  MemberPlaces places_;
};

void read_numpy_arrays(const std::shared_ptr<const RandomBytes>& in, std::size_t most_unpacked, SignalFile& file,
                       const TakeArray& take) {
  file.source = in->name();
  const bool alone = in->size() >= kMagic.size() && in->view(0, kMagic.size()) == kMagic;
  file.format = alone ? "NPY" : "NPZ";
  if (alone)
    NpyReader(in, 0, in->size(), std::filesystem::path(in->name()).stem().string()).read(file, take);
  else
    NpzReader(in, most_unpacked, file, take).read();
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
  Format f =
      format_of_arrays<read_numpy_arrays>(FileFormat::numpy, "NPY or NPZ", {".npz", ".npy"}, [](std::string_view head) {
        if (head.starts_with(kMagic)) return true;
        if (!head.starts_with(std::string_view("PK\x03\x04", 4)) || head.size() < 30) return false;
        const std::size_t length = number_at<std::uint16_t>(head, 26, false);
        return head.size() >= 30 + length && head.substr(30, length).ends_with(".npy");
      });
  f.write = write_npz;
  f.missing = "NaN";
  return f;
}

}  // namespace whirl::io
