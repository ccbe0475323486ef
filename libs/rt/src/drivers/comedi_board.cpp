#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "shared_library.hpp"
#include "whirl/rt/drivers/vendor_boards.hpp"

namespace whirl::rt {

// Signatures and constants of comedilib 0.11 (comedilib.h, comedi.h).
struct ComediBoard::Api {
  struct Range {
    double low, high;
    unsigned unit;
  };
  enum : int { kInput = 1, kOutput = 2, kCounter = 6 };
  enum : unsigned { kGround = 0 };
  SharedLibrary library;
  void* (*open)(const char*) = nullptr;
  int (*close)(void*) = nullptr;
  int (*find_subdevice)(void*, int, unsigned) = nullptr;
  unsigned (*get_maxdata)(void*, unsigned, unsigned) = nullptr;
  Range* (*get_range)(void*, unsigned, unsigned, unsigned) = nullptr;
  int (*data_read)(void*, unsigned, unsigned, unsigned, unsigned, unsigned*) = nullptr;
  int (*data_write)(void*, unsigned, unsigned, unsigned, unsigned, unsigned) = nullptr;
  double (*to_phys)(unsigned, Range*, unsigned) = nullptr;
  unsigned (*from_phys)(double, Range*, unsigned) = nullptr;

  void* device = nullptr;
  unsigned input = 0, output = 0, counter = 0;
  std::array<Range*, 4> input_range{};
  std::array<unsigned, 4> input_most{};
  std::array<Range*, 2> output_range{};
  std::array<unsigned, 2> output_most{};

  explicit Api(const std::string& name) : library(name) {
    library.find("comedi_open", open);
    library.find("comedi_close", close);
    library.find("comedi_find_subdevice_by_type", find_subdevice);
    library.find("comedi_get_maxdata", get_maxdata);
    library.find("comedi_get_range", get_range);
    library.find("comedi_data_read", data_read);
    library.find("comedi_data_write", data_write);
    library.find("comedi_to_phys", to_phys);
    library.find("comedi_from_phys", from_phys);
  }
  ~Api() {
    if (device) close(device);
  }
  bool write(const VendorBoardOptions& o, const std::array<double, 2>& volts) noexcept {
    bool good = true;
    for (std::size_t i = 0; i < 2; ++i) {
      const double v = std::clamp(volts[i], output_range[i]->low, output_range[i]->high);
      good = data_write(device, output, o.outputs[i], 0, kGround, from_phys(v, output_range[i], output_most[i])) >= 0 &&
             good;
    }
    return good;
  }
};

ComediBoard::ComediBoard(const VendorBoardOptions& options)
    : VendorBoard(options), api_(std::make_unique<Api>(options.library.empty() ? "libcomedi.so.0" : options.library)) {
  api_->device = api_->open(options.device.c_str());
  if (!api_->device) throw Error::in_file(options.device, 0, "is no Comedi device, or may not be opened");
  const auto subdevice = [&](int type, const char* what) {
    const int found = api_->find_subdevice(api_->device, type, 0);
    if (found < 0) throw Error::in_file(options.device, 0, std::string("has no ") + what);
    return static_cast<unsigned>(found);
  };
  api_->input = subdevice(Api::kInput, "analogue input");
  api_->output = subdevice(Api::kOutput, "analogue output");
  api_->counter = subdevice(Api::kCounter, "counter for the encoder");
  const auto range = [&](unsigned sub, unsigned channel, Api::Range*& r, unsigned& most) {
    r = api_->get_range(api_->device, sub, channel, 0);
    most = api_->get_maxdata(api_->device, sub, channel);
    if (!r || most == 0)
      throw Error::in_file(options.device, 0, fmt::format("has no channel {} in subdevice {}", channel, sub));
  };
  for (std::size_t i = 0; i < 4; ++i) range(api_->input, options.inputs[i], api_->input_range[i], api_->input_most[i]);
  for (std::size_t i = 0; i < 2; ++i)
    range(api_->output, options.outputs[i], api_->output_range[i], api_->output_most[i]);
  // A counter of fewer bits than 32 fills the upper ones, so that both wrap at the same place.
  const unsigned most = api_->get_maxdata(api_->device, api_->counter, options.encoder);
  if (most == 0) throw Error::in_file(options.device, 0, fmt::format("has no counter {}", options.encoder));
  shift_ = 32 - std::bit_width(most);
  angle_ = AngleTracker(std::ldexp(options.counts, shift_), options.bandwidth, options.sample_time);
  if (!api_->write(options_, {})) throw Error::in_file(options.device, 0, "does not take zero volts on its outputs");
}

ComediBoard::~ComediBoard() { api_->write(options_, {}); }

bool ComediBoard::read(BoardReading& out) noexcept {
  unsigned raw = 0;
  bool good = true;
  for (std::size_t i = 0; i < 4; ++i) {
    good = api_->data_read(api_->device, api_->input, options_.inputs[i], 0, Api::kGround, &raw) >= 0 && good;
    out.analog[i] = api_->to_phys(raw, api_->input_range[i], api_->input_most[i]);
  }
  good = api_->data_read(api_->device, api_->counter, options_.encoder, 0, Api::kGround, &raw) >= 0 && good;
  if (!good) {
    lose("reading an input");
    ++ticks_;
    return false;
  }
  count(static_cast<std::int32_t>(raw << shift_), out);
  return true;
}

void ComediBoard::write(const BoardCommand& command) noexcept {
  output_ = command.armed && connected_;
  if (!api_->write(options_, output_ ? command.volts : std::array<double, 2>{})) lose("writing an output");
  answered_ = command.answers;
}

std::string ComediBoard::failure() const {
  return connected_ ? "" : fmt::format("comedi {}: {} failed", options_.device, failed_at_);
}

}  // namespace whirl::rt
