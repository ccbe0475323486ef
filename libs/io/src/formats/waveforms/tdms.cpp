// TDMS of LabVIEW, read. Layout: National Instruments, TDMS File Format Internal Structure: segments, each with a
// lead-in of 28 bytes, new or repeated descriptions of channels, and their raw data in chunks.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include "formats/arrays/bytes.hpp"
#include "formats/format.hpp"
#include "formats/waveforms/tdms_scale.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"

namespace whirl::io {
namespace {

enum : std::uint32_t { kMetaData = 2, kNewList = 4, kRawData = 8, kInterleaved = 32, kBigEndian = 64, kDaqmx = 128 };
enum : std::uint32_t { kString = 0x20, kBoolean = 0x21, kTimestamp = 0x44 };
constexpr std::size_t kLeadIn = 28;

struct ValueType {
  NumberType type;
  bool complex = false;
};

std::optional<ValueType> value_type(std::uint32_t code) {
  switch (code) {
    case 1:
      return ValueType{NumberType::int8};
    case 2:
      return ValueType{NumberType::int16};
    case 3:
      return ValueType{NumberType::int32};
    case 4:
      return ValueType{NumberType::int64};
    case 5:
    case kBoolean:
      return ValueType{NumberType::uint8};
    case 6:
      return ValueType{NumberType::uint16};
    case 7:
      return ValueType{NumberType::uint32};
    case 8:
      return ValueType{NumberType::uint64};
    case 9:
    case 0x19:
      return ValueType{NumberType::float32};
    case 10:
    case 0x1A:
      return ValueType{NumberType::float64};
    case 0x08000C:
      return ValueType{NumberType::float32, true};
    case 0x10000D:
      return ValueType{NumberType::float64, true};
    default:
      return {};
  }
}

struct TdmsChannel {
  std::uint32_t type = 0;
  std::uint64_t count = 0;  ///< values a chunk
  std::uint64_t bytes = 0;  ///< of a chunk
  std::string unit = {};
  double step = 0, start = 0;
  std::string x_unit = {}, x_name = {};  ///< of the waveform's abscissa; empty: time in s
  TdmsProperties scales = {};
  std::string data = {};  ///< raw values, all of one byte order
  bool big = false;
};

class TdmsReader {
 public:
  TdmsReader(std::string_view bytes, std::string_view name) : bytes_(bytes) {
    file_.source = name;
    file_.format = "TDMS";
  }

  SignalFile read() {
    while (at_ < bytes_.size() && read_segment()) {
    }
    find_times();
    for (const std::string& path : order_) add(path);
    return std::move(file_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw Error::in_file(file_.source, 0, fmt::format("byte {}: {}", at_, message));
  }
  void need(std::size_t count) const {
    if (bytes_.size() - at_ < count) fail("file ends inside a description");
  }
  template <class T>
  T take() {
    need(sizeof(T));
    const T value = number_at<T>(bytes_, at_, big_);
    at_ += sizeof(T);
    return value;
  }
  std::string take_text() {
    const auto length = take<std::uint32_t>();
    need(length);
    std::string text(bytes_.substr(at_, length));
    at_ += length;
    return text;
  }

  bool read_segment() {
    if (bytes_.size() - at_ < kLeadIn) {
      file_.findings.push_back("the last segment is cut off inside its lead-in");
      return false;
    }
    if (bytes_.substr(at_, 4) != "TDSm") fail("a segment must begin with TDSm");
    const auto contents = number_at<std::uint32_t>(bytes_, at_ + 4, false);
    big_ = (contents & kBigEndian) != 0;
    if ((contents & kDaqmx) != 0) fail("raw data of DAQmx devices cannot be read: save them as waveforms");
    const auto length = number_at<std::uint64_t>(bytes_, at_ + 12, big_);
    const auto raw = number_at<std::uint64_t>(bytes_, at_ + 20, big_);
    const std::size_t body = at_ + kLeadIn, left = bytes_.size() - body;
    if (length > left) file_.findings.push_back("the last segment is cut off: read as far as it goes");
    const std::size_t end = length > left ? bytes_.size() : body + static_cast<std::size_t>(length);
    if (raw > end - body) fail("raw data lie beyond the end of the file");
    at_ = body;
    if ((contents & kMetaData) != 0) read_descriptions((contents & kNewList) != 0);
    at_ = body + static_cast<std::size_t>(raw);
    if ((contents & kRawData) != 0) read_raw(bytes_.substr(at_, end - at_), (contents & kInterleaved) != 0);
    at_ = end;
    return true;
  }

  void read_descriptions(bool new_list) {
    if (new_list) active_.clear();
    const auto objects = take<std::uint32_t>();
    for (std::uint32_t i = 0; i < objects; ++i) {
      const std::string path = take_text();
      const auto index = take<std::uint32_t>();
      const bool known = channels_.contains(path);
      TdmsChannel& channel = channels_[path];
      if (!known) order_.push_back(path);
      if (index == 0x00001269 || index == 0x00001369) fail("raw data of DAQmx devices cannot be read");
      if (index != 0xFFFFFFFF) {
        if (index != 0) read_index(channel);
        if (std::find(active_.begin(), active_.end(), path) == active_.end()) active_.push_back(path);
      }
      const auto properties = take<std::uint32_t>();
      for (std::uint32_t p = 0; p < properties; ++p) read_property(channel);
    }
  }

  void read_index(TdmsChannel& channel) {
    const auto type = take<std::uint32_t>();
    if (!channel.data.empty() && type != channel.type) fail("a channel changes its type of number");
    channel.type = type;
    if (take<std::uint32_t>() != 1) fail("array dimension: must be 1");
    channel.count = take<std::uint64_t>();
    if (type == kString) {
      channel.bytes = take<std::uint64_t>();
      return;
    }
    const std::optional<ValueType> value = value_type(type);
    if (!value && type != kTimestamp) fail(fmt::format("numbers of type {:#x} cannot be read", type));
    const std::uint64_t width = value ? width_of(value->type) * (value->complex ? 2 : 1) : 16;
    if (channel.count > bytes_.size() / width + 1) fail("a channel has more values than the file can hold");
    channel.bytes = channel.count * width;
  }

  void read_property(TdmsChannel& channel) {
    const std::string name = take_text();
    const auto type = take<std::uint32_t>();
    std::string text;
    double number = NAN;
    if (type == kString) {
      text = take_text();
    } else if (type == kTimestamp) {
      need(16);
      at_ += 16;
    } else {
      const std::optional<ValueType> value = value_type(type);
      if (!value) fail(fmt::format("property '{}' of type {:#x}", name, type));
      const std::size_t width = width_of(value->type) * (value->complex ? 2 : 1);
      need(width);
      number = numbers_of(bytes_.substr(at_, width_of(value->type)), value->type, big_)[0];
      at_ += width;
    }
    if (name == "wf_increment" && number > 0) channel.step = number;
    if (name == "wf_start_offset" && std::isfinite(number)) channel.start = number;
    if (name == "unit_string") channel.unit = text;
    if (name == "wf_xunit_string") channel.x_unit = text;
    if (name == "wf_xname") channel.x_name = text;
    if (name.starts_with("NI_") && std::isfinite(number)) channel.scales.numbers[name] = number;
    if (name.starts_with("NI_") && !text.empty()) channel.scales.texts[name] = text;
  }

  // The last chunk of a writer that was killed: as many samples as all channels have, where they are equally long.
  bool take_part(std::string_view raw) {
    std::uint64_t offset = 0, rows = 0;
    const std::uint64_t count = active_.empty() ? 0 : channels_[active_.front()].count;
    for (const std::string& path : active_) {
      const TdmsChannel& channel = channels_[path];
      if (channel.count != count || count == 0 || channel.type == kString ||
          (!channel.data.empty() && channel.big != big_))
        return false;
      rows = offset < raw.size() ? (raw.size() - offset) / (channel.bytes / count) : 0;
      offset += channel.bytes;
    }
    offset = 0;
    for (const std::string& path : active_) {
      TdmsChannel& channel = channels_[path];
      channel.big = big_;
      if (rows > 0) channel.data += raw.substr(offset, rows * (channel.bytes / count));
      offset += channel.bytes;
    }
    file_.findings.push_back(
        fmt::format("its last chunk of {} samples is cut off: {} are in all channels and are kept", count, rows));
    return true;
  }

  void read_raw(std::string_view raw, bool interleaved) {
    std::uint64_t chunk = 0, row = 0;
    for (const std::string& path : active_) {
      const TdmsChannel& channel = channels_[path];
      chunk += channel.bytes;
      row += channel.count > 0 ? channel.bytes / channel.count : 0;
      if (interleaved && channel.type == kString) fail("interleaved text cannot be read");
    }
    if (chunk == 0) return;
    while (!raw.empty()) {
      if (raw.size() < chunk && !interleaved && take_part(raw)) return;
      std::uint64_t offset = 0;
      for (const std::string& path : active_) {
        TdmsChannel& channel = channels_[path];
        if (!channel.data.empty() && channel.big != big_) fail("a channel changes its byte order");
        channel.big = big_;
        if (interleaved) {
          const std::uint64_t width = channel.count > 0 ? channel.bytes / channel.count : 0;
          for (std::uint64_t at = offset; width > 0 && at + width <= std::min<std::uint64_t>(raw.size(), chunk);
               at += row)
            channel.data += raw.substr(at, width);
          offset += width;
        } else {
          if (offset < raw.size()) channel.data += raw.substr(offset, channel.bytes);
          offset += channel.bytes;
        }
      }
      raw.remove_prefix(std::min<std::size_t>(raw.size(), chunk));
    }
  }

  // "/'group'/'channel'"
  static std::pair<std::string, std::string> names_of(const std::string& path) {
    std::vector<std::string> parts;
    for (std::size_t i = 0; i < path.size(); ++i) {
      if (path[i] != '\'') continue;
      std::string part;
      for (++i; i < path.size(); ++i) {
        if (path[i] == '\'' && (i + 1 >= path.size() || path[i + 1] != '\'')) break;
        if (path[i] == '\'') ++i;
        part += path[i];
      }
      parts.push_back(part);
    }
    parts.resize(2);
    return {parts[0], parts[1]};
  }

  // The object's own scales, or those of its group or of the file.
  const TdmsProperties& scales_of(const std::string& path) const {
    const std::string group = path.substr(0, path.find("'/'") + 1);
    for (const std::string& owner : {path, group, std::string("/")}) {
      const auto found = channels_.find(owner);
      if (found != channels_.end() && !found->second.scales.numbers.empty()) return found->second.scales;
    }
    static const TdmsProperties none;
    return none;
  }

  static Eigen::Index channel_rows(const TdmsChannel& channel) {
    const std::optional<ValueType> value = value_type(channel.type);
    if (!value) return 0;
    return static_cast<Eigen::Index>(channel.data.size() / (width_of(value->type) * (value->complex ? 2 : 1)));
  }

  // Over time, unless the waveform states another unit of its abscissa.
  void set_waveform(const TdmsChannel& channel, const std::string& name, SignalTable& table) {
    const UnitSuffix* unit = unit_from_label(channel.x_unit);
    const bool named = channel.x_name.find("requency") != std::string::npos;
    Quantity over = unit != nullptr ? unit->quantity : named ? Quantity::frequency : Quantity::time;
    if ((!channel.x_unit.empty() && unit == nullptr) || (over != Quantity::time && over != Quantity::frequency)) {
      file_.findings.push_back(
          fmt::format("channel '{}': abscissa in '{}', neither time nor frequency: left out", name, channel.x_unit));
      return;
    }
    table.abscissa = over;
    table.step = unit != nullptr ? unit->to_si(channel.step) : channel.step;
    table.start = unit != nullptr ? unit->to_si(channel.start) : channel.start;
  }

  // Channels without a step have their times in a channel of their group, called time or in units of time.
  void find_times() {
    for (const std::string& path : order_) {
      const TdmsChannel& channel = channels_[path];
      const auto [group, name] = names_of(path);
      const std::optional<ValueType> value = value_type(channel.type);
      if (name.empty() || !value || value->complex || channel.data.empty() || channel.step > 0 ||
          times_.contains(group))
        continue;
      const Signal s = make_signal(name, channel.unit, numbers_of(channel.data, value->type, channel.big));
      if (s.quantity != Quantity::time) continue;
      times_[group] = {name, s.value.size(), s.value};
    }
  }

  void add(const std::string& path) {
    const TdmsChannel& channel = channels_[path];
    const auto [group, name] = names_of(path);
    if (name.empty() || channel.data.empty()) return;
    const std::optional<ValueType> value = value_type(channel.type);
    if (!value) {
      file_.contents.push_back(fmt::format("'{}': {}", name, channel.type == kString ? "text" : "time stamps"));
      return;
    }
    SignalTable table;
    table.name = group;
    if (channel.step > 0) {
      set_waveform(channel, name, table);
    } else if (const auto times = times_.find(group);
               times != times_.end() && times->second.rows == channel_rows(channel)) {
      if (times->second.name == name) return;
      set_abscissa(table, Quantity::time, times->second.values);
    }
    Eigen::VectorXd all = numbers_of(channel.data, value->type, channel.big);
    if (value->type == NumberType::int64 || value->type == NumberType::uint64) {
      if (std::string rounded = rounding_of_integers(name, all); !rounded.empty())
        file_.findings.push_back(std::move(rounded));
    }
    std::string scale, unit = channel.unit;
    if (!scale_tdms(scales_of(path), all, scale)) {
      file_.findings.push_back(fmt::format(
          "channel '{}' has a scale of the kind '{}', which cannot be applied: raw values, without its unit {}", name,
          scale, unit));
      unit.clear();
    }
    const Eigen::Index n = all.size() / (value->complex ? 2 : 1);
    Eigen::VectorXd real(n), imaginary(value->complex ? n : 0);
    for (Eigen::Index i = 0; i < n; ++i) {
      real[i] = all[value->complex ? 2 * i : i];
      if (value->complex) imaginary[i] = all[2 * i + 1];
    }
    Signal signal = make_signal(name, unit, std::move(real));
    signal.imaginary = std::move(imaginary);
    add_signal(file_, table, std::move(signal));
  }

  std::string_view bytes_;
  SignalFile file_;
  std::size_t at_ = 0;
  bool big_ = false;
  std::map<std::string, TdmsChannel> channels_;
  struct Times {
    std::string name;
    Eigen::Index rows = 0;
    Eigen::VectorXd values;
  };
  std::map<std::string, Times> times_;  ///< of the groups
  std::vector<std::string> order_, active_;
};

}  // namespace

Format tdms_format() {
  Format f{FileFormat::tdms, "TDMS", {".tdms"}, [](std::string_view head) { return head.starts_with("TDSm"); }};
  f.magic = true;
  f.read = [](const std::filesystem::path& path, const CsvOptions&) {
    return TdmsReader(read_text(path), path.string()).read();
  };
  return f;
}

}  // namespace whirl::io
