#include "formats/waveforms/tdms_daqmx.hpp"

#include <algorithm>
#include <string>

namespace whirl::io {
namespace {

void append(std::string_view rows, std::uint64_t count, std::uint32_t width, const DaqmxScaler& scaler,
            std::string& out) {
  for (std::uint64_t row = 0; row < count; ++row) {
    const std::string_view number = rows.substr(row * width + scaler.byte, scaler.width());
    if (scaler.bit < 0) {
      out += number;
    } else {
      out += static_cast<char>((static_cast<unsigned char>(number[0]) >> scaler.bit) & 1);
    }
  }
}

}  // namespace

std::optional<NumberType> daqmx_type(std::uint32_t code) {
  constexpr NumberType kTypes[] = {NumberType::uint8,   NumberType::int8,   NumberType::uint16, NumberType::int16,
                                   NumberType::uint32,  NumberType::int32,  NumberType::uint64, NumberType::int64,
                                   NumberType::float32, NumberType::float64};
  if (code >= std::size(kTypes)) return std::nullopt;
  return kTypes[code];
}

std::optional<std::uint64_t> read_daqmx(std::string_view raw, const std::vector<DaqmxTarget>& targets,
                                        std::string& wrong) {
  if (targets.empty()) return std::nullopt;
  const std::vector<std::uint32_t>& widths = targets.front().index->widths;
  std::vector<std::uint64_t> rows(widths.size());  // of each buffer
  for (const DaqmxTarget& t : targets) {
    if (t.index->widths.empty() || t.index->widths != widths) {
      wrong = "channels of one segment state different raw buffers";
      return std::nullopt;
    }
    for (const DaqmxScaler& s : t.index->scalers) rows[s.buffer] = std::max(rows[s.buffer], t.index->rows);
  }
  std::vector<std::uint64_t> start;
  std::uint64_t chunk = 0;
  for (std::size_t b = 0; b < rows.size(); ++b) {
    start.push_back(chunk);
    // A count that no file holds must not overflow; the data end before it.
    rows[b] = std::min<std::uint64_t>(rows[b], raw.size() + 1);
    chunk += rows[b] * widths[b];
  }
  while (chunk > 0 && !raw.empty()) {
    const bool cut = raw.size() < chunk;
    std::uint64_t whole = raw.size();
    for (std::size_t b = 0; cut && b < rows.size(); ++b) {
      if (rows[b] > 0 && widths[b] > 0)
        whole = std::min<std::uint64_t>(whole, raw.size() > start[b] ? (raw.size() - start[b]) / widths[b] : 0);
    }
    for (const DaqmxTarget& t : targets) {
      const std::uint64_t own = std::min(t.index->rows, whole);
      for (std::size_t k = 0; k < t.to.size(); ++k) {
        const DaqmxScaler& s = t.index->scalers[k];
        append(raw.substr(std::min<std::size_t>(raw.size(), start[s.buffer])), own, widths[s.buffer], s, *t.to[k]);
      }
    }
    if (cut) return whole;
    raw.remove_prefix(chunk);
  }
  return std::nullopt;
}

}  // namespace whirl::io
