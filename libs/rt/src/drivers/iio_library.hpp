#pragma once
#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "shared_library.hpp"

namespace whirl::rt::iio {

// Types and signatures of libiio 0.24 (iio.h).
struct Context;
struct Device;
struct Channel;
struct Buffer;
struct DataFormat {
  unsigned length, bits, shift;
  bool is_signed, is_fully_defined, is_be, with_scale;
  double scale;
  unsigned repeat;
};

struct Library {
  SharedLibrary library;
  Context* (*create)(const char*) = nullptr;
  void (*destroy)(Context*) = nullptr;
  int (*set_timeout)(Context*, unsigned) = nullptr;
  unsigned (*devices)(const Context*) = nullptr;
  Device* (*device)(const Context*, unsigned) = nullptr;
  const char* (*device_id)(const Device*) = nullptr;
  const char* (*device_name)(const Device*) = nullptr;
  bool (*is_trigger)(const Device*) = nullptr;
  int (*set_trigger)(const Device*, const Device*) = nullptr;
  const char* (*find_device_attr)(const Device*, const char*) = nullptr;
  int (*write_device_attr)(const Device*, const char*, double) = nullptr;
  int (*read_device_attr)(const Device*, const char*, double*) = nullptr;
  unsigned (*channels)(const Device*) = nullptr;
  Channel* (*channel)(const Device*, unsigned) = nullptr;
  const char* (*channel_id)(const Channel*) = nullptr;
  const char* (*channel_name)(const Channel*) = nullptr;
  bool (*is_output)(const Channel*) = nullptr;
  bool (*is_scan_element)(const Channel*) = nullptr;
  const char* (*find_attr)(const Channel*, const char*) = nullptr;
  int (*read_double)(const Channel*, const char*, double*) = nullptr;
  int (*read_count)(const Channel*, const char*, long long*) = nullptr;
  int (*write_count)(const Channel*, const char*, long long) = nullptr;
  void (*enable)(Channel*) = nullptr;
  const DataFormat* (*format)(const Channel*) = nullptr;
  void (*convert)(const Channel*, void*, const void*) = nullptr;
  int (*set_kernel_buffers)(const Device*, unsigned) = nullptr;
  Buffer* (*create_buffer)(const Device*, std::size_t, bool) = nullptr;
  void (*destroy_buffer)(Buffer*) = nullptr;
  ssize_t (*refill)(Buffer*) = nullptr;
  void (*cancel)(Buffer*) = nullptr;
  void* (*first)(const Buffer*, const Channel*) = nullptr;
  std::ptrdiff_t (*step)(const Buffer*) = nullptr;
  void* (*end)(const Buffer*) = nullptr;

  explicit Library(const std::string& name);
};

/// One connection to the devices, closed at the end. Used by one thread at a time.
class Connection {
 public:
  Connection(const Library& library, const std::string& uri);
  ~Connection() { api_.destroy(context_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Each throws Error with what there is when it finds nothing.
  Device* device(const std::string& name, const char* key) const;
  Device* trigger(const std::string& name) const;
  Channel* channel(const Device* device, const std::string& name, bool output, const char* key) const;
  /// V a count and counts to add: those given, or what the channel states in mV.
  struct Scale {
    double volts = 1, offset = 0;
  };
  Scale scale(const Channel* channel, double given, double given_offset, const char* key) const;
  /// Asks for `rate`, Hz, where the device knows rates; false when it does not.
  bool set_rate(const Device* device, double rate) const;
  void check(int code, const std::string& what) const;
  void set_timeout(unsigned milliseconds) const { check(api_.set_timeout(context_, milliseconds), "timeout"); }
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  std::string name_of(const Device* device) const;
  Device* find(const std::string& name, bool trigger, const char* key) const;

  const Library& api_;
  std::string uri_;
  Context* context_ = nullptr;
};

}  // namespace whirl::rt::iio
