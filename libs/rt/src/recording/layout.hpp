#pragma once
#include <hdf5.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "whirl/rt/recorder.hpp"

/// How a recording of a loop lies in its HDF5 file (docs/formats.md, whirl.loop/1): what writer and reader share.
namespace whirl::rt::recording {

constexpr const char* kSchema = "whirl.loop/1";

/// A handle of the library, closed by the function that fits.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(Handle&& o) noexcept : id_(std::exchange(o.id_, -1)), close_(o.close_) {}
  Handle& operator=(Handle&& o) noexcept {
    std::swap(id_, o.id_);
    std::swap(close_, o.close_);
    return *this;
  }
  hid_t get() const { return id_; }
  explicit operator bool() const { return id_ >= 0; }
  /// It stays open: closing it would end the program.
  void leave() { id_ = -1; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

struct EventRow {
  std::int64_t tick;
  double t;
  std::array<char, 120> text;
};

/// A column of the table of cycles beside its tick.
struct Field {
  const char* name;
  std::size_t offset;
  bool real;  // double, otherwise int32
  const char* unit;
};
std::span<const Field> fields();

/// The rows of the two tables as the library knows them.
Handle cycle_type();
Handle event_type();

/// An attribute's text; empty when there is none.
std::string read_text(hid_t at, const char* name);

/// To be called before anything else of the library.
void prepare_library();

}  // namespace whirl::rt::recording
