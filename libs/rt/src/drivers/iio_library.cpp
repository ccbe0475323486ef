#include "iio_library.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>

namespace whirl::rt::iio {
namespace {

constexpr double kMilli = 1e-3;  // IIO states voltages in mV

}  // namespace

Library::Library(const std::string& name) : library(name.empty() ? "libiio.so.0" : name) {
  library.find("iio_create_context_from_uri", create);
  library.find("iio_context_destroy", destroy);
  library.find("iio_context_set_timeout", set_timeout);
  library.find("iio_context_get_devices_count", devices);
  library.find("iio_context_get_device", device);
  library.find("iio_device_get_id", device_id);
  library.find("iio_device_get_name", device_name);
  library.find("iio_device_is_trigger", is_trigger);
  library.find("iio_device_set_trigger", set_trigger);
  library.find("iio_device_find_attr", find_device_attr);
  library.find("iio_device_attr_write_double", write_device_attr);
  library.find("iio_device_attr_read_double", read_device_attr);
  library.find("iio_device_get_channels_count", channels);
  library.find("iio_device_get_channel", channel);
  library.find("iio_channel_get_id", channel_id);
  library.find("iio_channel_get_name", channel_name);
  library.find("iio_channel_is_output", is_output);
  library.find("iio_channel_is_scan_element", is_scan_element);
  library.find("iio_channel_find_attr", find_attr);
  library.find("iio_channel_attr_read_double", read_double);
  library.find("iio_channel_attr_read_longlong", read_count);
  library.find("iio_channel_attr_write_longlong", write_count);
  library.find("iio_channel_enable", enable);
  library.find("iio_channel_get_data_format", format);
  library.find("iio_channel_convert", convert);
  library.find("iio_device_set_kernel_buffers_count", set_kernel_buffers);
  library.find("iio_device_create_buffer", create_buffer);
  library.find("iio_buffer_destroy", destroy_buffer);
  library.find("iio_buffer_refill", refill);
  library.find("iio_buffer_cancel", cancel);
  library.find("iio_buffer_first", first);
  library.find("iio_buffer_step", step);
  library.find("iio_buffer_end", end);
}

Connection::Connection(const Library& library, const std::string& uri) : api_(library), uri_(uri) {
  // Version 0.24 cuts an address with a port in the caller's own text.
  std::string scratch = uri.c_str();
  context_ = api_.create(scratch.c_str());
  if (!context_) throw Error(fmt::format("board iio {}: {}", uri, std::strerror(errno)));
}

void Connection::refuse(const std::string& what) const { throw Error(fmt::format("board iio {}: {}", uri_, what)); }

void Connection::check(int code, const std::string& what) const {
  if (code < 0) refuse(fmt::format("{}: {}", what, std::strerror(-code)));
}

std::string Connection::name_of(const Device* device) const {
  const char* name = api_.device_name(device);
  return name ? name : api_.device_id(device);
}

Device* Connection::find(const std::string& name, bool trigger, const char* key) const {
  std::string there;
  for (unsigned i = 0; i < api_.devices(context_); ++i) {
    Device* device = api_.device(context_, i);
    if (api_.is_trigger(device) != trigger) continue;
    if (!name.empty() && (name_of(device) == name || api_.device_id(device) == name)) return device;
    there += fmt::format("{}{} ({})", there.empty() ? "" : ", ", name_of(device), api_.device_id(device));
  }
  refuse(fmt::format("iio.{} = \"{}\": no such {}; there {}", key, name, trigger ? "trigger" : "device",
                     there.empty() ? "is none" : "is " + there));
}

Device* Connection::device(const std::string& name, const char* key) const { return find(name, false, key); }
Device* Connection::trigger(const std::string& name) const { return find(name, true, "trigger"); }

Channel* Connection::channel(const Device* device, const std::string& name, bool output, const char* key) const {
  std::string there;
  for (unsigned i = 0; i < api_.channels(device); ++i) {
    Channel* channel = api_.channel(device, i);
    if (api_.is_output(channel) != output) continue;
    const char* label = api_.channel_name(channel);
    if (name == api_.channel_id(channel) || (label && name == label)) return channel;
    there += (there.empty() ? "" : ", ") + std::string(api_.channel_id(channel));
  }
  refuse(fmt::format("iio.{} = \"{}\": no such {} channel of {}; there {}", key, name, output ? "output" : "input",
                     name_of(device), there.empty() ? "is none" : "is " + there));
}

Connection::Scale Connection::scale(const Channel* channel, double given, double given_offset, const char* key) const {
  if (given != 0) return {given, given_offset};
  Scale out;
  if (!api_.find_attr(channel, "scale")) {
    refuse(fmt::format("channel {} states no scale: set iio.{}", api_.channel_id(channel), key));
  }
  check(api_.read_double(channel, "scale", &out.volts), fmt::format("scale of {}", api_.channel_id(channel)));
  if (!std::isfinite(out.volts) || out.volts == 0) {
    refuse(fmt::format("channel {} states the scale {:g}: set iio.{}", api_.channel_id(channel), out.volts, key));
  }
  out.volts *= kMilli;
  if (api_.find_attr(channel, "offset")) {
    check(api_.read_double(channel, "offset", &out.offset), fmt::format("offset of {}", api_.channel_id(channel)));
  }
  return out;
}

bool Connection::set_rate(const Device* device, double rate) const {
  if (!api_.find_device_attr(device, "sampling_frequency")) return false;
  const std::string what = "sampling_frequency of " + name_of(device);
  check(api_.write_device_attr(device, "sampling_frequency", rate), fmt::format("{} = {:g}", what, rate));
  double got = 0;
  check(api_.read_device_attr(device, "sampling_frequency", &got), what);
  if (!(std::abs(got - rate) <= 1e-3 * rate)) {
    refuse(
        fmt::format("{} is {:g} Hz instead of the {:g} Hz set: take loop.rate_hz from those it has", what, got, rate));
  }
  return true;
}

}  // namespace whirl::rt::iio
