#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/arrays/bytes.hpp"
#include "formats/parts/stored_numbers.hpp"

namespace whirl::io {

/// Where the numbers of one scale of a channel stand in the rows that a DAQmx device wrote.
struct DaqmxScaler {
  NumberType type = NumberType::int16;
  std::uint32_t buffer = 0;  ///< raw buffer
  std::uint32_t byte = 0;    ///< of its row
  int bit = -1;              ///< of that byte, of a digital line; -1: the whole number
  std::uint32_t scale = 0;   ///< number of the scale that takes it

  /// Bytes of one number.
  std::size_t width() const { return bit < 0 ? width_of(type) : 1; }
};

/// Description of the raw data of a DAQmx channel. The rows of each buffer stand one behind the other, the buffers too.
struct DaqmxIndex {
  std::uint64_t rows = 0;  ///< a chunk
  std::vector<DaqmxScaler> scalers;
  std::vector<std::uint32_t> widths;  ///< bytes of a row, by buffer
};

/// The types of number of a scaler by its code; nothing for one that is not known.
std::optional<NumberType> daqmx_type(std::uint32_t code);

/// A channel with data in a segment, and where the raw values of its scalers go, in their order.
struct DaqmxTarget {
  const DaqmxIndex* index;
  std::vector<StoredNumbers*> to;
};

/// Appends the places of the raw data of a segment, chunk after chunk, to the targets. Of a last chunk that is cut off
/// the rows that stand in all buffers are kept, and their number is returned. `wrong` says what does not fit; nothing
/// is taken then.
std::optional<std::uint64_t> read_daqmx(std::uint64_t at, std::uint64_t size, const std::vector<DaqmxTarget>& targets,
                                        std::string& wrong);

}  // namespace whirl::io
