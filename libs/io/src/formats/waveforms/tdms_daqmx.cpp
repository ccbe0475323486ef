#include "formats/waveforms/tdms_daqmx.hpp"

#include <algorithm>
#include <string>

namespace whirl::io {
std::optional<NumberType> daqmx_type(std::uint32_t code) {
  constexpr NumberType kTypes[] = {NumberType::uint8,   NumberType::int8,   NumberType::uint16, NumberType::int16,
                                   NumberType::uint32,  NumberType::int32,  NumberType::uint64, NumberType::int64,
                                   NumberType::float32, NumberType::float64};
  if (code >= std::size(kTypes)) return std::nullopt;
  return kTypes[code];
}

std::optional<std::uint64_t> read_daqmx(std::uint64_t at, std::uint64_t size, const std::vector<DaqmxTarget>& targets,
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
    rows[b] = std::min<std::uint64_t>(rows[b], size + 1);
    chunk += rows[b] * widths[b];
  }
  if (chunk == 0) return std::nullopt;
  const auto append = [&](std::uint64_t from, std::uint64_t most, std::uint64_t chunks) {
    for (const DaqmxTarget& t : targets) {
      for (std::size_t k = 0; k < t.to.size(); ++k) {
        const DaqmxScaler& s = t.index->scalers[k];
        t.to[k]->add({.at = from + start[s.buffer],
                      .rows = std::min(t.index->rows, most),
                      .width = widths[s.buffer],
                      .offset = s.byte,
                      .stretches = chunks,
                      .distance = chunk});
      }
    }
  };
  append(at, size, size / chunk);
  const std::uint64_t rest = size % chunk;
  if (rest == 0) return std::nullopt;
  std::uint64_t whole = rest;  // rows of the last chunk that stand in all buffers
  for (std::size_t b = 0; b < rows.size(); ++b) {
    if (rows[b] > 0 && widths[b] > 0)
      whole = std::min<std::uint64_t>(whole, rest > start[b] ? (rest - start[b]) / widths[b] : 0);
  }
  append(at + size - rest, whole, 1);
  return whole;
}

}  // namespace whirl::io
