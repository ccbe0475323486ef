// TDMS of LabVIEW, read. Layout: National Instruments, TDMS File Format Internal Structure: segments, each with a
// lead-in of 28 bytes, new or repeated descriptions of channels, and their raw data in chunks.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include "formats/arrays/bytes.hpp"
#include "formats/format.hpp"
#include "formats/waveforms/tdms_daqmx.hpp"
#include "formats/waveforms/tdms_scale.hpp"
#include "formats/waveforms/tdms_types.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"

namespace whirl::io {
namespace {

enum : std::uint32_t { kMetaData = 2, kNewList = 4, kRawData = 8, kInterleaved = 32, kBigEndian = 64, kDaqmx = 128 };
enum : std::uint32_t {
  kNoData = 0xFFFFFFFF,
  kFormatChanging = 0x1269,
  kDigitalLine = 0x1369,
  kDigitalLineToo = 0x126A
};
constexpr std::size_t kLeadIn = 28;

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
  bool on = false;                                    ///< has data in the segments from here on
  DaqmxIndex daqmx = {};                              ///< rows only of a channel of a DAQmx device
  std::map<std::uint32_t, std::string> further = {};  ///< raw values of its scalers behind the first, by their scale
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
    const auto length = number_at<std::uint64_t>(bytes_, at_ + 12, big_);
    const auto raw = number_at<std::uint64_t>(bytes_, at_ + 20, big_);
    const std::size_t body = at_ + kLeadIn, left = bytes_.size() - body;
    if (length > left) file_.findings.push_back("the last segment is cut off: read as far as it goes");
    const std::size_t end = length > left ? bytes_.size() : body + static_cast<std::size_t>(length);
    if (raw > end - body) fail("raw data lie beyond the end of the file");
    at_ = body;
    if ((contents & kMetaData) != 0) read_descriptions((contents & kNewList) != 0);
    at_ = body + static_cast<std::size_t>(raw);
    const std::string_view data = bytes_.substr(at_, end - at_);
    if ((contents & kRawData) != 0 && (contents & kDaqmx) != 0) read_device(data);
    if ((contents & kRawData) != 0 && (contents & kDaqmx) == 0) read_raw(data, (contents & kInterleaved) != 0);
    at_ = end;
    return true;
  }

  void read_descriptions(bool new_list) {
    if (new_list) {
      active_.clear();
      for (auto& [path, channel] : channels_) channel.on = false;
    }
    const auto objects = take<std::uint32_t>();
    for (std::uint32_t i = 0; i < objects; ++i) {
      const std::string path = take_text();
      const auto index = take<std::uint32_t>();
      const bool known = channels_.contains(path);
      TdmsChannel& channel = channels_[path];
      if (!known) order_.push_back(path);
      // An object without data keeps its place in the list: it may come back without a new one.
      channel.on = index != kNoData;
      if (channel.on) {
        if (index == kFormatChanging || index == kDigitalLine || index == kDigitalLineToo) {
          read_daqmx_index(channel, index != kFormatChanging);
        } else if (index != 0) {
          read_index(channel);
        }
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
    if (type == kTdmsString) {
      channel.bytes = take<std::uint64_t>();
      return;
    }
    const std::optional<TdmsType> value = tdms_type(type);
    if (!value && type != kTdmsTimestamp) fail(fmt::format("numbers of type {:#x} cannot be read", type));
    const std::uint64_t width = value ? width_of(value->type) * (value->complex ? 2 : 1) : 16;
    if (channel.count > bytes_.size() / width + 1) fail("a channel has more values than the file can hold");
    channel.bytes = channel.count * width;
  }

  void read_daqmx_index(TdmsChannel& channel, bool digital) {
    constexpr std::uint32_t kMost = 4096;  // scalers of a channel, buffers of a device
    DaqmxIndex index;
    if (take<std::uint32_t>() != kNoData) fail("raw data of a DAQmx device: their type must be 0xFFFFFFFF");
    if (take<std::uint32_t>() != 1) fail("array dimension: must be 1");
    index.rows = take<std::uint64_t>();
    const auto scalers = take<std::uint32_t>();
    if (scalers == 0 || scalers > kMost) fail(fmt::format("{} scalers of a channel: must be 1 to {}", scalers, kMost));
    for (std::uint32_t k = 0; k < scalers; ++k) {
      DaqmxScaler scaler;
      const auto code = take<std::uint32_t>();
      const std::optional<NumberType> type = daqmx_type(code);
      if (!type) fail(fmt::format("numbers of the DAQmx type {} cannot be read", code));
      scaler.type = digital ? NumberType::uint8 : *type;
      scaler.buffer = take<std::uint32_t>();
      scaler.byte = take<std::uint32_t>();
      if (digital) scaler.bit = static_cast<int>(scaler.byte % 8), scaler.byte /= 8;
      digital ? (void)take<std::uint8_t>() : (void)take<std::uint32_t>();  // format of the samples, a bit field
      scaler.scale = take<std::uint32_t>();
      index.scalers.push_back(scaler);
    }
    const auto widths = take<std::uint32_t>();
    if (widths == 0 || widths > kMost) fail(fmt::format("{} raw buffers: must be 1 to {}", widths, kMost));
    for (std::uint32_t k = 0; k < widths; ++k) index.widths.push_back(take<std::uint32_t>());
    for (const DaqmxScaler& scaler : index.scalers) {
      if (scaler.buffer >= widths || scaler.byte + scaler.width() > index.widths[scaler.buffer])
        fail("a number lies outside of the row of its raw buffer");
    }
    constexpr std::uint32_t kCodes[] = {1, 2, 3, 4, 5, 6, 7, 8, 0, 9, 10};  // of TDMS, by NumberType
    const std::uint32_t type = kCodes[static_cast<std::size_t>(index.scalers.front().type)];
    if (!channel.data.empty() && type != channel.type) fail("a channel changes its type of number");
    channel.type = type;
    channel.daqmx = std::move(index);
  }

  void read_property(TdmsChannel& channel) {
    const std::string name = take_text();
    const auto type = take<std::uint32_t>();
    std::string text;
    double number = NAN;
    if (type == kTdmsString) {
      text = take_text();
    } else if (type == kTdmsTimestamp) {
      need(16);
      at_ += 16;
    } else {
      const std::optional<TdmsType> value = tdms_type(type);
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

  void tell_cut(std::uint64_t count, std::uint64_t rows) {
    file_.findings.push_back(
        fmt::format("its last chunk of {} samples is cut off: {} are in all channels and are kept", count, rows));
  }

  // Channels with data in this segment, in the order of the list.
  std::vector<TdmsChannel*> with_data() {
    std::vector<TdmsChannel*> out;
    for (const std::string& path : active_)
      if (TdmsChannel& channel = channels_[path]; channel.on) out.push_back(&channel);
    return out;
  }

  void read_device(std::string_view raw) {
    std::vector<DaqmxTarget> targets;
    for (TdmsChannel* c : with_data()) {
      c->big = big_;
      DaqmxTarget target{&c->daqmx, {}};
      for (const DaqmxScaler& s : c->daqmx.scalers)
        target.to.push_back(target.to.empty() ? &c->data : &c->further[s.scale]);
      targets.push_back(std::move(target));
    }
    std::string wrong;
    if (const auto cut = read_daqmx(raw, targets, wrong)) tell_cut(targets.front().index->rows, *cut);
    if (!wrong.empty()) fail(wrong);
  }

  // The last chunk of a writer that was killed: as many samples as all channels have, where they are equally long.
  bool take_part(std::string_view raw) {
    std::uint64_t offset = 0, rows = 0;
    const std::vector<TdmsChannel*> live = with_data();
    const std::uint64_t count = live.empty() ? 0 : live.front()->count;
    for (const TdmsChannel* c : live) {
      const TdmsChannel& channel = *c;
      if (channel.count != count || count == 0 || channel.type == kTdmsString ||
          (!channel.data.empty() && channel.big != big_))
        return false;
      rows = offset < raw.size() ? (raw.size() - offset) / (channel.bytes / count) : 0;
      offset += channel.bytes;
    }
    offset = 0;
    for (TdmsChannel* c : live) {
      TdmsChannel& channel = *c;
      channel.big = big_;
      if (rows > 0) channel.data += raw.substr(offset, rows * (channel.bytes / count));
      offset += channel.bytes;
    }
    tell_cut(count, rows);
    return true;
  }

  void read_raw(std::string_view raw, bool interleaved) {
    const std::vector<TdmsChannel*> live = with_data();
    std::uint64_t chunk = 0, row = 0;
    for (const TdmsChannel* c : live) {
      const TdmsChannel& channel = *c;
      chunk += channel.bytes;
      row += channel.count > 0 ? channel.bytes / channel.count : 0;
      if (interleaved && channel.type == kTdmsString) fail("interleaved text cannot be read");
    }
    if (chunk == 0) return;
    while (!raw.empty()) {
      if (raw.size() < chunk && !interleaved && take_part(raw)) return;
      std::uint64_t offset = 0;
      for (TdmsChannel* c : live) {
        TdmsChannel& channel = *c;
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
    const std::optional<TdmsType> value = tdms_type(channel.type);
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
      const auto [group, name] = tdms_names(path);
      const std::optional<TdmsType> value = tdms_type(channel.type);
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
    const auto [group, name] = tdms_names(path);
    if (name.empty() || channel.data.empty()) return;
    const std::optional<TdmsType> value = tdms_type(channel.type);
    if (!value) {
      file_.contents.push_back(fmt::format("'{}': {}", name, channel.type == kTdmsString ? "text" : "time stamps"));
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
    std::map<int, Eigen::VectorXd> raw;  // of the scales that a device's numbers go into
    for (const DaqmxScaler& s : channel.daqmx.scalers) {
      const auto more = channel.further.find(s.scale);
      raw[static_cast<int>(s.scale)] =
          more == channel.further.end() ? all : numbers_of(more->second, s.type, channel.big);
    }
    if (!scale_tdms(scales_of(path), all, scale, raw)) {
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
