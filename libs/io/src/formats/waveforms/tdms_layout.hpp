#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/parts/random_bytes.hpp"
#include "formats/parts/stored_numbers.hpp"
#include "formats/waveforms/tdms_daqmx.hpp"
#include "formats/waveforms/tdms_scale.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {

struct TdmsChannel {
  std::uint32_t type = 0;
  std::uint64_t count = 0;  ///< values a chunk
  std::uint64_t bytes = 0;  ///< of a chunk
  std::string unit = {};
  double step = 0, start = 0;
  std::string x_unit = {}, x_name = {};  ///< of the waveform's abscissa; empty: time in s
  TdmsProperties scales = {};
  bool has_data = false, big = false;                   ///< raw values are there, all of one byte order
  StoredNumbers data = {}, imaginary = {};              ///< none of text and time stamps
  bool on = false;                                      ///< has data in the segments from here on
  DaqmxIndex daqmx = {};                                ///< rows only of a channel of a DAQmx device
  std::map<std::uint32_t, StoredNumbers> further = {};  ///< of its scalers behind the first, by their scale
};

/// What the segments of a file describe, and where the values stand. `file` has what is suspicious in it. Throws Error
/// naming the byte.
struct TdmsLayout {
  SignalFile file = {};
  std::map<std::string, TdmsChannel> channels = {};
  std::vector<std::string> order = {};  ///< of the objects, by their paths
};
TdmsLayout tdms_layout(const std::shared_ptr<const RandomBytes>& in);

}  // namespace whirl::io
