#include "whirl/hardware/io_settings.hpp"

#include <fmt/format.h>

#include <cmath>
#include <type_traits>

#include "whirl/core/error.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/rt/drivers/udp_board.hpp"

namespace whirl::hardware {
namespace {

constexpr double kMm = 1e-3, kMs = 1e-3, kMilliVolt = 1e-3;
constexpr const char* kAxisName[] = {"x", "y"};

}  // namespace

template <class Visitor>
static void visit_iio(rt::IioBoardOptions& iio, Visitor& visit) {
  visit("iio.input_device", iio.input_device, 1.0);
  for (std::size_t i = 0; i < 4; ++i) visit(fmt::format("iio.input_{}", i), iio.inputs[i], 1.0);
  visit("iio.input_scale_mV", iio.input_scale, kMilliVolt);
  visit("iio.input_offset", iio.input_offset, 1.0);
  visit("iio.output_device", iio.output_device, 1.0);
  for (std::size_t i = 0; i < 2; ++i) visit(fmt::format("iio.output_{}", kAxisName[i]), iio.outputs[i], 1.0);
  visit("iio.output_scale_mV", iio.output_scale, kMilliVolt);
  visit("iio.output_offset", iio.output_offset, 1.0);
  visit("iio.angle_device", iio.angle_device, 1.0);
  visit("iio.angle", iio.angle, 1.0);
  visit("iio.angle_bits", iio.angle_bits, 1.0);
  visit("iio.buffer", iio.buffer, 1.0);
  visit("iio.trigger", iio.trigger, 1.0);
}

// Found by `apply` by its argument.
template <class Io, class Visitor>
static void visit_fields(Io& io, Visitor&& visit) {
  visit("loop.rate_hz", io.rate, 1.0);
  visit("loop.clock", io.clock, 1.0);
  visit("loop.dt", io.dt, 1.0);
  visit("loop.overrun", io.overrun, 1.0);
  visit("loop.max_catch_up", io.max_catch_up, 1.0);
  visit("loop.trip_after", io.trip_after, 1.0);
  visit("loop.settle_ticks", io.settle, 1.0);
  visit("loop.wait_ms", io.hardware.grace, kMs);
  visit("realtime.priority", io.realtime.priority, 1.0);
  visit("realtime.cpu", io.realtime.cpu, 1.0);
  visit("realtime.lock_memory", io.realtime.lock_memory, 1.0);
  visit("realtime.no_deep_idle", io.realtime.no_deep_idle, 1.0);
  visit("safety.force_N", io.safety.force, 1.0);
  visit("safety.slew_N", io.safety.slew, 1.0);
  visit("safety.displacement_mm", io.safety.displacement, kMm);
  visit("safety.stale_ms", io.stale, kMs);
  visit("safety.max_age_ms", io.hardware.max_age, kMs);
  visit("safety.stuck_ms", io.hardware.stuck, kMs);
  visit("safety.watchdog_ms", io.watchdog, kMs);
  visit("safety.release_ms", io.release, kMs);
  visit("board.driver", io.driver, 1.0);
  visit("board.address", io.address, 1.0);
  visit("board.key_file", io.key_file, 1.0);
  visit("board.library", io.vendor.library, 1.0);
  visit("board.card", io.vendor.card, 1.0);
  visit("board.device", io.vendor.device, 1.0);
  for (std::size_t i = 0; i < 4; ++i) visit(fmt::format("board.input_{}", i), io.vendor.inputs[i], 1.0);
  for (std::size_t i = 0; i < 2; ++i) visit(fmt::format("board.output_{}", kAxisName[i]), io.vendor.outputs[i], 1.0);
  visit("board.encoder", io.vendor.encoder, 1.0);
  visit("board.counts", io.vendor.counts, 1.0);
  visit("board.tracking_hz", io.vendor.bandwidth, 1.0);
  visit_iio(io.iio, visit);
  visit("tacho.analog", io.tacho.analog, 1.0);
  visit("tacho.pulses", io.tacho.pulses, 1.0);
  visit("tacho.missing", io.tacho.missing, 1.0);
  visit("tacho.edge", io.tacho.edge, 1.0);
  visit("tacho.learn_s", io.tacho.learn, 1.0);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto key = [&](const char* table, const char* name) {
      return fmt::format("{}.{}.{}", table, kAxisName[i], name);
    };
    auto& s = io.hardware.position[i];
    visit(key("sensor", "device"), s.laser.device, 1.0);
    visit(key("sensor", "baud"), s.laser.baud, 1.0);
    visit(key("sensor", "rate_hz"), s.laser.measuring_rate, 1.0);
    visit(key("sensor", "range_mm"), s.laser.range, kMm);
    visit(key("sensor", "mastering"), s.laser.mastering, 1.0);
    visit(key("sensor", "timeout_s"), s.laser.timeout, 1.0);
    visit(key("sensor", "analog"), s.analog, 1.0);
    visit(key("sensor", "shunt_ohm"), s.shunt, 1.0);
    visit(key("sensor", "offset_mm"), s.offset, kMm);
    visit(key("sensor", "gain"), s.gain, 1.0);
    visit(key("sensor", "direction"), s.direction, 1.0);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const auto key = [&](const char* name) { return fmt::format("actuator.{}.{}", kAxisName[i], name); };
    auto& a = io.hardware.force[i];
    visit(key("force_N_V"), a.force_per_volt, 1.0);
    visit(key("offset_V"), a.offset, 1.0);
    visit(key("limit_V"), a.limit, 1.0);
    visit(key("direction"), a.direction, 1.0);
  }
}

rt::PaceOptions IoSettings::pace() const {
  rt::PaceOptions out;
  out.period = std::llround(1e9 / rate);
  out.overrun = overrun == "catch-up" ? rt::OverrunPolicy::catch_up
                : overrun == "trip"   ? rt::OverrunPolicy::trip
                                      : rt::OverrunPolicy::skip;
  out.max_catch_up = max_catch_up;
  out.trip_after = trip_after;
  return out;
}

rt::LoopOptions IoSettings::loop() const {
  rt::LoopOptions out;
  out.armed = false;
  out.dt = dt == "fill" ? rt::DtPolicy::fill : rt::DtPolicy::nominal;
  out.sample_time = 1 / rate;
  out.release = std::lround(release * rate);
  return out;
}

rt::SafetyLimits IoSettings::limits() const {
  rt::SafetyLimits out = safety;
  out.stale = std::lround(stale * rate);
  return out;
}

std::unique_ptr<rt::Board> IoSettings::board() const {
  if (driver == "iio") {
    rt::IioBoardOptions o = iio;
    o.library = vendor.library;
    o.uri = address;
    o.counts = vendor.counts;
    o.bandwidth = vendor.bandwidth;
    o.sample_time = 1 / rate;
    o.watchdog = watchdog;
    o.priority = realtime.priority;
    return std::make_unique<rt::IioBoard>(o);
  }
  rt::VendorBoardOptions o = vendor;
  o.sample_time = 1 / rate;
  o.watchdog = watchdog;
  if (driver == "comedi") return std::make_unique<rt::ComediBoard>(o);
  if (driver == "quanser") return std::make_unique<rt::QuanserBoard>(o);
  if (key_file.empty()) return std::make_unique<rt::UdpBoard>(address);
  // `/` keeps an absolute path as it is.
  return std::make_unique<rt::UdpBoard>(address,
                                        rt::board::read_key(std::filesystem::path(source).parent_path() / key_file));
}

static void check_iio(const IoSettings& io) {
  const rt::IioBoardOptions& o = io.iio;
  if (io.clock == "lockstep") throw Error::in_field("loop.clock", io.clock, "sample or wall with an IIO board");
  for (const auto& [key, value] : {std::pair{"iio.input_device", &o.input_device},
                                   {"iio.output_device", &o.output_device},
                                   {"iio.output_x", &o.outputs[0]},
                                   {"iio.output_y", &o.outputs[1]},
                                   {"iio.angle", &o.angle}}) {
    if (value->empty()) throw Error::in_field(key, "", "a name that iio_info lists");
  }
  if (!o.buffer && !o.trigger.empty())
    throw Error::in_field("iio.trigger", o.trigger, "none without iio.buffer = true");
  require_range("iio.angle_bits", o.angle_bits, 0, 32);
  for (const rt::PositionInput& p : io.hardware.position) {
    if (!p.laser.device.empty() || p.analog < 0 || p.analog > 3) continue;
    if (const std::size_t i = static_cast<std::size_t>(p.analog); o.inputs[i].empty()) {
      throw Error::in_field(fmt::format("iio.input_{}", i), "", "the channel that a sensor names as its analog input");
    }
  }
}

static void check_tacho(const IoSettings& io) {
  require_range("tacho.analog", io.tacho.analog, -1, 3);
  require_range("tacho.pulses", io.tacho.pulses, 0, 1000);
  require_range("tacho.missing", io.tacho.missing, -1, 100);
  require_range("tacho.learn_s", io.tacho.learn, 0.5, 60, "s");
  if (io.tacho.analog < 0) return;
  for (std::size_t i = 0; i < 2; ++i) {
    const rt::PositionInput& p = io.hardware.position[i];
    if (p.laser.device.empty() && p.analog == io.tacho.analog)
      throw Error::in_field("tacho.analog", fmt::format("{}", io.tacho.analog),
                            fmt::format("another input than that of sensor.{}", kAxisName[i]));
  }
  require_range("board.tracking_hz", io.vendor.bandwidth, 0.1, 0.1 * io.rate, "Hz");
  if (io.driver == "iio" && io.iio.inputs[static_cast<std::size_t>(io.tacho.analog)].empty())
    throw Error::in_field(fmt::format("iio.input_{}", io.tacho.analog), "", "the channel of the tacho");
}

IoSettings read_io(const std::filesystem::path& path) {
  const io::Settings settings = io::read_settings(path);
  IoSettings io;
  io.source = path.string();
  settings.text("loop.clock", io.clock, {"sample", "wall", "lockstep"});
  settings.text("loop.overrun", io.overrun, {"skip", "catch-up", "trip"});
  settings.text("loop.dt", io.dt, {"nominal", "fill"});
  settings.text("board.driver", io.driver, {"udp", "comedi", "quanser", "iio"});
  settings.text("tacho.edge", io.tacho.edge, {"automatic", "rising", "falling", "both"});
  io::apply(settings, io);
  settings.finish();
  io.hardware.sample_time = 1 / io.rate;
  io.hardware.board_timeout = io.watchdog;
  io.hardware.tacho = io.tacho.analog;
  try {
    require_range("loop.rate_hz", io.rate, 10, 10000, "Hz");
    require_range("loop.settle_ticks", io.settle, 10, 100000);
    require_range("loop.max_catch_up", io.max_catch_up, 1, 100);
    require_range("loop.trip_after", io.trip_after, 1, 100000);
    require_range("loop.wait_ms", 1e3 * io.hardware.grace, 0, 1000, "ms");
    require_range("realtime.priority", io.realtime.priority, 0, 99);
    require_range("safety.stale_ms", 1e3 * io.stale, 1e3 / io.rate, 1e4, "ms");
    require_range("safety.watchdog_ms", 1e3 * io.watchdog, 1e3 / io.rate, 1e4, "ms");
    const auto& inputs = io.hardware.position;
    const bool asked_at_each_tick = io.driver == "comedi" || io.driver == "quanser";
    if (io.clock != "wall" && asked_at_each_tick && inputs[0].laser.device.empty() && inputs[1].laser.device.empty()) {
      throw Error::in_field("loop.clock", io.clock, "wall: neither a laser nor the board has a clock of its own here");
    }
    if (io.driver != "udp") {
      require_range("board.counts", std::abs(io.vendor.counts), 1, 1e7);
      require_range("board.tracking_hz", io.vendor.bandwidth, 0.1, 0.1 * io.rate, "Hz");
    }
    if (io.driver != "udp" && !io.key_file.empty())
      throw Error::in_field("board.key_file", io.key_file, "left out: only the driver \"udp\" has a key");
    if (io.driver == "iio") check_iio(io);
    check_tacho(io);
    require_range("safety.release_ms", 1e3 * io.release, 0, 6e4, "ms");
  } catch (const Error& e) {
    throw Error::in_file(path.string(), 0, e.what());
  }
  return io;
}

std::string io_toml(const IoSettings& settings) {
  std::vector<io::TomlEntry> entries;
  IoSettings copy = settings;
  visit_fields(copy, [&](const std::string& full_key, auto& field, double unit) {
    const std::size_t dot = full_key.rfind('.');
    io::TomlEntry entry{full_key.substr(0, dot), full_key.substr(dot + 1), {}, ""};
    using Field = std::decay_t<decltype(field)>;
    if constexpr (std::is_same_v<Field, double>) {
      entry.value = field / unit;
    } else if constexpr (std::is_integral_v<Field> && !std::is_same_v<Field, bool>) {
      entry.value = static_cast<long>(field);
    } else {
      entry.value = field;
    }
    entries.push_back(std::move(entry));
  });
  return io::to_toml(entries);
}

}  // namespace whirl::hardware
