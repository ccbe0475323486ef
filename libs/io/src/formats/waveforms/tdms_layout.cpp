// The segments of a TDMS file. Layout: National Instruments, TDMS File Format Internal Structure: segments, each with a
// lead-in of 28 bytes, new or repeated descriptions of channels, and their raw data in chunks.
#include "formats/waveforms/tdms_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/format.hpp"
#include "formats/waveforms/tdms_types.hpp"
#include "whirl/core/error.hpp"

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
constexpr std::uint32_t kMostText = 1 << 24;  // bytes
constexpr std::size_t kMostPieces = 1 << 21;  // that the values of a large file stand in

class TdmsSegments {
 public:
  explicit TdmsSegments(const std::shared_ptr<const RandomBytes>& in) : in_(in) {
    out_.file.source = in_->name();
    out_.file.format = "TDMS";
  }

  TdmsLayout read() {
    while (at_ < in_->size() && read_segment()) {
    }
    return std::move(out_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw Error::in_file(out_.file.source, 0, fmt::format("byte {}: {}", at_, message));
  }
  void need(std::size_t count) const {
    if (in_->size() - at_ < count) fail("file ends inside a description");
  }
  template <class T>
  T take() {
    need(sizeof(T));
    const T value = in_->number<T>(at_, big_);
    at_ += sizeof(T);
    return value;
  }
  std::string take_text() {
    const auto length = take<std::uint32_t>();
    need(length);
    if (length > kMostText) fail(fmt::format("a text of {} bytes: must be at most {}", length, kMostText));
    std::string text = in_->copy(at_, length);
    at_ += length;
    return text;
  }

  bool read_segment() {
    if (in_->size() - at_ < kLeadIn) {
      out_.file.findings.push_back("the last segment is cut off inside its lead-in");
      return false;
    }
    const std::string lead = in_->copy(at_, kLeadIn);
    if (!lead.starts_with("TDSm")) fail("a segment must begin with TDSm");
    const auto contents = number_at<std::uint32_t>(lead, 4, false);
    big_ = (contents & kBigEndian) != 0;
    const auto length = number_at<std::uint64_t>(lead, 12, big_), raw = number_at<std::uint64_t>(lead, 20, big_);
    const std::uint64_t body = at_ + kLeadIn, left = in_->size() - body;
    if (length > left) out_.file.findings.push_back("the last segment is cut off: read as far as it goes");
    const std::uint64_t end = length > left ? in_->size() : body + length;
    if (raw > end - body) fail("raw data lie beyond the end of the file");
    at_ = body;
    if ((contents & kMetaData) != 0) read_descriptions((contents & kNewList) != 0);
    at_ = body + raw;
    if ((contents & kRawData) != 0 && (contents & kDaqmx) != 0) read_device(end - at_);
    if ((contents & kRawData) != 0 && (contents & kDaqmx) == 0) read_raw(end - at_, (contents & kInterleaved) != 0);
    at_ = end;
    if (pieces_ > kMostPieces && in_->size() > kMostRead)
      fail(fmt::format("the values are in more than {} pieces: such a file cannot be read in parts", kMostPieces));
    return true;
  }

  void read_descriptions(bool new_list) {
    if (new_list) {
      active_.clear();
      for (auto& [path, channel] : out_.channels) channel.on = false;
    }
    const auto objects = take<std::uint32_t>();
    for (std::uint32_t i = 0; i < objects; ++i) {
      const std::string path = take_text();
      const auto index = take<std::uint32_t>();
      const bool known = out_.channels.contains(path);
      TdmsChannel& channel = out_.channels[path];
      if (!known) out_.order.push_back(path);
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
    if (channel.has_data && type != channel.type) fail("a channel changes its type of number");
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
    if (channel.count > in_->size() / width + 1) fail("a channel has more values than the file can hold");
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
    if (channel.has_data && type != channel.type) fail("a channel changes its type of number");
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
      number = numbers_of(in_->copy(at_, width_of(value->type)), value->type, big_)[0];
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
    out_.file.findings.push_back(
        fmt::format("its last chunk of {} samples is cut off: {} are in all channels and are kept", count, rows));
  }

  // Channels with data in this segment, in the order of the list.
  std::vector<TdmsChannel*> with_data() {
    std::vector<TdmsChannel*> out;
    for (const std::string& path : active_)
      if (TdmsChannel& channel = out_.channels[path]; channel.on) out.push_back(&channel);
    return out;
  }

  // Runs of a channel in this segment, all of one byte order.
  void append(StoredNumbers& to, const NumberRun& run) {
    const std::size_t before = to.pieces();
    to.add(run);
    pieces_ += to.pieces() - before;
  }
  void append(TdmsChannel& channel, NumberRun run) {
    if (run.rows * run.stretches == 0) return;
    if (channel.has_data && channel.big != big_) fail("a channel changes its byte order");
    const std::optional<TdmsType> value = tdms_type(channel.type);
    if (!channel.has_data && value) channel.data = channel.imaginary = StoredNumbers(value->type, big_);
    channel.has_data = true;
    channel.big = big_;
    if (!value) return;
    append(channel.data, run);
    run.offset += width_of(value->type);
    if (value->complex) append(channel.imaginary, run);
  }

  void read_device(std::uint64_t size) {
    std::vector<DaqmxTarget> targets;
    for (TdmsChannel* c : with_data()) {
      DaqmxTarget target{&c->daqmx, {}};
      for (const DaqmxScaler& s : c->daqmx.scalers) {
        StoredNumbers& to = target.to.empty() ? c->data : c->further[s.scale];
        if (to.count() == 0) to = StoredNumbers(s.type, big_, s.bit);
        target.to.push_back(&to);
      }
      targets.push_back(std::move(target));
    }
    std::string wrong;
    if (const auto cut = read_daqmx(at_, size, targets, wrong)) tell_cut(targets.front().index->rows, *cut);
    if (!wrong.empty()) fail(wrong);
    for (TdmsChannel* c : with_data()) {
      c->has_data = c->data.count() > 0;
      c->big = big_;
      pieces_ += 1 + c->further.size();
    }
  }

  // The last chunk of a writer that was killed: as many samples as all channels have, where they are equally long.
  bool take_part(std::uint64_t from, std::uint64_t size) {
    std::uint64_t offset = 0, rows = 0;
    const std::vector<TdmsChannel*> live = with_data();
    const std::uint64_t count = live.empty() ? 0 : live.front()->count;
    for (const TdmsChannel* c : live) {
      if (c->count != count || count == 0 || c->type == kTdmsString || (c->has_data && c->big != big_)) return false;
      rows = offset < size ? (size - offset) / (c->bytes / count) : 0;
      offset += c->bytes;
    }
    offset = 0;
    for (TdmsChannel* c : live) {
      append(*c, {.at = from + offset, .rows = rows, .width = c->bytes / count});
      offset += c->bytes;
    }
    tell_cut(count, rows);
    return true;
  }

  void read_raw(std::uint64_t size, bool interleaved) {
    const std::vector<TdmsChannel*> live = with_data();
    std::uint64_t chunk = 0, row = 0;
    for (const TdmsChannel* c : live) {
      chunk += c->bytes;
      row += c->count > 0 ? c->bytes / c->count : 0;
      if (interleaved && c->type == kTdmsString) fail("interleaved text cannot be read");
    }
    if (chunk == 0) return;
    if (interleaved) return read_rows(size, row);
    const std::uint64_t whole = size / chunk, rest = size % chunk;
    std::uint64_t offset = 0;
    for (TdmsChannel* c : live) {
      const std::uint64_t width = c->type == kTdmsString ? 1 : c->count > 0 ? c->bytes / c->count : 1;
      append(*c, {.at = at_ + offset, .rows = c->bytes / width, .width = width, .stretches = whole, .distance = chunk});
      offset += c->bytes;
    }
    if (rest == 0 || take_part(at_ + whole * chunk, rest)) return;
    offset = 0;
    for (TdmsChannel* c : live) {
      const std::uint64_t width = c->type == kTdmsString ? 1 : c->count > 0 ? c->bytes / c->count : 1;
      const std::uint64_t present = offset < rest ? std::min(rest - offset, c->bytes) : 0;
      append(*c, {.at = at_ + whole * chunk + offset, .rows = present / width, .width = width});
      offset += c->bytes;
    }
  }

  // Interleaved: one value of each channel after the other. A last row that is cut off is left out.
  void read_rows(std::uint64_t size, std::uint64_t row) {
    std::uint64_t offset = 0;
    for (TdmsChannel* c : with_data()) {
      const std::uint64_t width = c->count > 0 ? c->bytes / c->count : 0;
      if (width > 0) append(*c, {.at = at_, .rows = size / row, .width = row, .offset = offset});
      offset += width;
    }
  }

  std::shared_ptr<const RandomBytes> in_;
  TdmsLayout out_;
  std::uint64_t at_ = 0;
  bool big_ = false;
  std::size_t pieces_ = 0;
  std::vector<std::string> active_;
};

}  // namespace

TdmsLayout tdms_layout(const std::shared_ptr<const RandomBytes>& in) { return TdmsSegments(in).read(); }

}  // namespace whirl::io
