// TDMS of LabVIEW, read: the channels of its segments as signals, whole or some of their rows.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>

#include "formats/arrays/arrays.hpp"
#include "formats/waveforms/tdms_layout.hpp"
#include "formats/waveforms/tdms_types.hpp"
#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

class TdmsReader : public RowReader {
 public:
  explicit TdmsReader(std::shared_ptr<const RandomBytes> in) : in_(std::move(in)), layout_(tdms_layout(in_)) {}

  std::string name() const override { return in_->name(); }
  Eigen::Index rows() const override { return rows_; }

  /// Its channels become one record, as long as the longest. Small ones beside it are taken out, with a finding.
  void take_as_record() {
    constexpr Eigen::Index kFew = 65536;
    for (const auto& [path, channel] : layout_.channels) rows_ = std::max(rows_, channel.data.count());
    for (auto& [path, channel] : layout_.channels) {
      const Eigen::Index own = channel.data.count();
      if (own == 0 || own == rows_) continue;
      const std::string what =
          fmt::format("channel '{}' has {} samples, the record {}", tdms_names(path).second, own, rows_);
      if (own > kFew)
        throw Error::in_file(layout_.file.source, 0, what + ": such a file cannot be read in parts, only whole");
      layout_.file.findings.push_back(what + ": left out, as the file is read in parts");
      channel.has_data = false;
    }
  }

  /// Count 0: all of every channel.
  SignalFile read(Eigen::Index first, Eigen::Index count) override {
    const Part part{first, count};
    SignalFile file = layout_.file;
    const std::map<std::string, Times> times = find_times(part);
    for (const std::string& path : layout_.order) add(path, part, times, file);
    return file;
  }

 private:
  struct Part {
    Eigen::Index first, count;
  };

  // The object's own scales, or those of its group or of the file.
  const TdmsProperties& scales_of(const std::string& path) const {
    const std::string group = path.substr(0, path.find("'/'") + 1);
    for (const std::string& owner : {path, group, std::string("/")}) {
      const auto found = layout_.channels.find(owner);
      if (found != layout_.channels.end() && !found->second.scales.numbers.empty()) return found->second.scales;
    }
    static const TdmsProperties none;
    return none;
  }

  // Over time, unless the waveform states another unit of its abscissa.
  static void set_waveform(const TdmsChannel& channel, const std::string& name, SignalTable& table, SignalFile& file) {
    const UnitSuffix* unit = unit_from_label(channel.x_unit);
    const bool named = channel.x_name.find("requency") != std::string::npos;
    Quantity over = unit != nullptr ? unit->quantity : named ? Quantity::frequency : Quantity::time;
    if ((!channel.x_unit.empty() && unit == nullptr) || (over != Quantity::time && over != Quantity::frequency)) {
      file.findings.push_back(
          fmt::format("channel '{}': abscissa in '{}', neither time nor frequency: left out", name, channel.x_unit));
      return;
    }
    table.abscissa = over;
    table.step = unit != nullptr ? unit->to_si(channel.step) : channel.step;
    table.start = unit != nullptr ? unit->to_si(channel.start) : channel.start;
  }

  static Eigen::VectorXd numbers(const RandomBytes& in, const StoredNumbers& stored, const Part& part) {
    return part.count > 0 ? stored.read(in, part.first, part.count) : stored.read(in, 0, stored.count());
  }

  struct Times {
    std::string name;
    Eigen::Index rows = 0;
    Eigen::VectorXd values;
    PartOfAxis part;
  };

  // Of the groups. Channels without a step have their times in a channel called time or in units of time.
  std::map<std::string, Times> find_times(const Part& part) {
    std::map<std::string, Times> times;
    for (const std::string& path : layout_.order) {
      const TdmsChannel& channel = layout_.channels[path];
      const auto [group, name] = tdms_names(path);
      const std::optional<TdmsType> value = tdms_type(channel.type);
      if (name.empty() || !value || value->complex || !channel.has_data || channel.step > 0 || times.contains(group))
        continue;
      const Eigen::Index rows = channel.data.count();
      Eigen::VectorXd ends(2);
      ends << channel.data.read(*in_, 0, 1), channel.data.read(*in_, rows - 1, 1);
      const Signal whole = make_signal(name, channel.unit, std::move(ends));
      if (whole.quantity != Quantity::time) continue;
      times[group] = {name,
                      rows,
                      make_signal(name, channel.unit, numbers(*in_, channel.data, part)).value,
                      {part.first, rows, whole.value[0], whole.value[1]}};
    }
    return times;
  }

  void add(const std::string& path, const Part& part, const std::map<std::string, Times>& all_times, SignalFile& file) {
    const TdmsChannel& channel = layout_.channels[path];
    const auto [group, name] = tdms_names(path);
    if (name.empty() || !channel.has_data) return;
    const std::optional<TdmsType> value = tdms_type(channel.type);
    if (!value) {
      file.contents.push_back(fmt::format("'{}': {}", name, channel.type == kTdmsString ? "text" : "time stamps"));
      return;
    }
    SignalTable table;
    table.name = group;
    if (channel.step > 0) {
      set_waveform(channel, name, table, file);
    } else if (const auto times = all_times.find(group);
               times != all_times.end() && times->second.rows == channel.data.count()) {
      if (times->second.name == name) return;
      set_abscissa(table, Quantity::time, times->second.values, times->second.part);
    }
    Eigen::VectorXd real = numbers(*in_, channel.data, part);
    Eigen::VectorXd imaginary = value->complex ? numbers(*in_, channel.imaginary, part) : Eigen::VectorXd();
    if (value->type == NumberType::int64 || value->type == NumberType::uint64) note_rounding(file, name, real);
    std::string scale, unit = channel.unit;
    std::map<int, Eigen::VectorXd> raw;  // of the scales that a device's numbers go into
    for (const DaqmxScaler& s : channel.daqmx.scalers) {
      const auto more = channel.further.find(s.scale);
      raw[static_cast<int>(s.scale)] = more == channel.further.end() ? real : numbers(*in_, more->second, part);
    }
    const TdmsProperties& scales = scales_of(path);
    if (!scale_tdms(scales, real, scale, raw) || (value->complex && !scale_tdms(scales, imaginary, scale))) {
      file.findings.push_back(fmt::format(
          "channel '{}' has a scale of the kind '{}', which cannot be applied: raw values, without its unit {}", name,
          scale, unit));
      unit.clear();
    }
    Signal signal = make_signal(name, unit, std::move(real));
    signal.imaginary = std::move(imaginary);
    add_signal(file, table, std::move(signal));
  }

  std::shared_ptr<const RandomBytes> in_;
  TdmsLayout layout_;
  Eigen::Index rows_ = 0;
};

}  // namespace

Format tdms_format() {
  Format f{FileFormat::tdms, "TDMS", {".tdms"}, [](std::string_view head) { return head.starts_with("TDSm"); }};
  f.magic = true;
  f.read = [](const std::filesystem::path& path, const CsvOptions&) {
    SignalFile file = TdmsReader(std::make_shared<RandomBytes>(path, kMostRead)).read(0, 0);
    tell_rounding(file);
    return file;
  };
  f.stream = [](const std::filesystem::path& path, const CsvOptions&, const PartRows& rows) {
    auto reader = std::make_unique<TdmsReader>(std::make_shared<RandomBytes>(path));
    reader->take_as_record();
    return stream_rows(std::move(reader), rows);
  };
  return f;
}

}  // namespace whirl::io
