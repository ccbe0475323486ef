#include "whirl/rt/recorder.hpp"

#include <hdf5.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstring>

#include "whirl/core/error.hpp"

namespace whirl::rt {
namespace {

constexpr hsize_t kChunkRows = 1024;
constexpr std::size_t kBuffered = 256;  // rows between two writes
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

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

struct EventRow {
  std::int64_t tick;
  double t;
  std::array<char, 120> text;
};

struct Field {
  const char* name;
  std::size_t offset;
  bool real;  // double, otherwise int32
  const char* unit;
};
#define WHIRL_FIELD(name, unit) \
  Field { #name, offsetof(LoopSample, name), sizeof(LoopSample::name) == 8, unit }
constexpr Field kFields[] = {WHIRL_FIELD(t, "s"),
                             WHIRL_FIELD(scheduled, "s"),
                             WHIRL_FIELD(started, "s"),
                             WHIRL_FIELD(x, "m"),
                             WHIRL_FIELD(y, "m"),
                             WHIRL_FIELD(beta, "rad"),
                             WHIRL_FIELD(omega, "rad/s"),
                             WHIRL_FIELD(omega_dot, "rad/s^2"),
                             WHIRL_FIELD(x_est, "m"),
                             WHIRL_FIELD(y_est, "m"),
                             WHIRL_FIELD(vx_est, "m/s"),
                             WHIRL_FIELD(vy_est, "m/s"),
                             WHIRL_FIELD(dx_est, "m/s^2"),
                             WHIRL_FIELD(dy_est, "m/s^2"),
                             WHIRL_FIELD(s_x, "m/s"),
                             WHIRL_FIELD(s_y, "m/s"),
                             WHIRL_FIELD(ux_requested, "N"),
                             WHIRL_FIELD(uy_requested, "N"),
                             WHIRL_FIELD(ux, "N"),
                             WHIRL_FIELD(uy, "N"),
                             WHIRL_FIELD(flags, ""),
                             WHIRL_FIELD(trip, ""),
                             WHIRL_FIELD(missed, "")};
#undef WHIRL_FIELD

Handle cycle_type() {
  Handle type(H5Tcreate(H5T_COMPOUND, sizeof(LoopSample)), H5Tclose);
  H5Tinsert(type.get(), "tick", offsetof(LoopSample, tick), H5T_NATIVE_INT64);
  for (const Field& f : kFields) H5Tinsert(type.get(), f.name, f.offset, f.real ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT32);
  return type;
}

Handle event_type() {
  Handle type(H5Tcreate(H5T_COMPOUND, sizeof(EventRow)), H5Tclose);
  const Handle text(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(text.get(), sizeof(EventRow::text));
  H5Tinsert(type.get(), "tick", offsetof(EventRow, tick), H5T_NATIVE_INT64);
  H5Tinsert(type.get(), "t", offsetof(EventRow, t), H5T_NATIVE_DOUBLE);
  H5Tinsert(type.get(), "text", offsetof(EventRow, text), text.get());
  return type;
}

void write_text(hid_t at, const char* name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
  H5Tset_size(type.get(), std::max<std::size_t>(value.size(), 1));
  const Handle attribute(H5Acreate2(at, name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!attribute || H5Awrite(attribute.get(), type.get(), value.empty() ? " " : value.data()) < 0) {
    throw Error(fmt::format("attribute '{}' cannot be written", name));
  }
}

void write_number(hid_t at, const char* name, double value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(at, name, H5T_NATIVE_DOUBLE, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!attribute || H5Awrite(attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0) {
    throw Error(fmt::format("attribute '{}' cannot be written", name));
  }
}

std::string read_text(hid_t at, const char* name) {
  const Handle attribute(H5Aopen(at, name, H5P_DEFAULT), H5Aclose);
  if (!attribute) return {};
  const Handle type(H5Aget_type(attribute.get()), H5Tclose);
  if (H5Tget_class(type.get()) != H5T_STRING || H5Tis_variable_str(type.get()) > 0) return {};
  std::string value(H5Tget_size(type.get()), '\0');
  H5Aread(attribute.get(), type.get(), value.data());
  return value;
}

/// A dataset that grows; its fill value marks rows of which nothing was written.
Handle growing(hid_t file, const char* name, hid_t type, hsize_t chunk, const void* fill) {
  const hsize_t none = 0, unlimited = H5S_UNLIMITED;
  const Handle space(H5Screate_simple(1, &none, &unlimited), H5Sclose), list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_chunk(list.get(), 1, &chunk);
  H5Pset_fill_value(list.get(), type, fill);
  return Handle(H5Dcreate2(file, name, type, space.get(), H5P_DEFAULT, list.get(), H5P_DEFAULT), H5Dclose);
}

bool append_rows(hid_t dataset, hid_t type, hsize_t& size, hsize_t count, const void* rows) {
  const hsize_t total = size + count;
  if (H5Dset_extent(dataset, &total) < 0) return false;
  const Handle file_space(H5Dget_space(dataset), H5Sclose), memory(H5Screate_simple(1, &count, nullptr), H5Sclose);
  if (H5Sselect_hyperslab(file_space.get(), H5S_SELECT_SET, &size, nullptr, &count, nullptr) < 0) return false;
  if (H5Dwrite(dataset, type, memory.get(), file_space.get(), H5P_DEFAULT, rows) < 0) return false;
  size = total;
  return true;
}

template <class Row>
std::vector<Row> read_rows(hid_t file, const char* name, const Handle& type) {
  const Handle data(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
  if (!data) return {};
  const Handle space(H5Dget_space(data.get()), H5Sclose);
  const hssize_t count = H5Sget_simple_extent_npoints(space.get());
  std::vector<Row> rows(count > 0 ? static_cast<std::size_t>(count) : 0);
  if (!rows.empty() && H5Dread(data.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, rows.data()) < 0) rows.clear();
  return rows;
}

// Errors are told by exceptions alone.
void quiet() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

}  // namespace

struct LoopRecorder::State {
  std::filesystem::path path, temporary;
  Handle file{-1, H5Fclose}, cycles{-1, H5Dclose}, events{-1, H5Dclose}, cycle{cycle_type()}, event{event_type()};
  std::vector<LoopSample> buffer;
  hsize_t cycle_rows = 0, event_rows = 0;
  double interval;
  std::chrono::steady_clock::time_point flushed = std::chrono::steady_clock::now();

  Error failed(const char* what) const { return Error::in_file(path.string(), 0, fmt::format("{} failed", what)); }

  State(const std::filesystem::path& p, const RecordingHead& head, double flush_interval)
      : path(p), temporary(p.string() + ".new"), interval(flush_interval) {
    quiet();
    buffer.reserve(kBuffered);
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_libver_bounds(access.get(), H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
    file = Handle(H5Fcreate(temporary.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()), H5Fclose);
    if (!file) throw failed("creating the recording");
    const hid_t root = file.get();
    write_text(root, "schema", kSchema);
    std::string names;
    for (const auto& [name, text] : head.texts) {
      names += (names.empty() ? "" : " ") + name;
      // Attributes end at 64 KiB; texts are datasets of bytes.
      const hsize_t size = std::max<std::size_t>(text.size(), 1);
      const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
      const Handle data(
          H5Dcreate2(root, name.c_str(), H5T_NATIVE_UINT8, space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
          H5Dclose);
      if (!data ||
          H5Dwrite(data.get(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.empty() ? " " : text.data()) < 0) {
        throw failed("writing the head");
      }
    }
    write_text(root, "texts", names);
    write_number(root, "sample_time_s", head.sample_time);
    const LoopSample empty;
    const EventRow no_event{-1, 0, {}};
    cycles = growing(root, "cycles", cycle.get(), kChunkRows, &empty);
    events = growing(root, "events", event.get(), 64, &no_event);
    if (!cycles || !events) throw failed("creating the tables");
    for (const Field& f : kFields) {
      if (*f.unit) write_text(cycles.get(), fmt::format("unit_{}", f.name).c_str(), f.unit);
    }
    if (H5Fstart_swmr_write(file.get()) < 0) throw failed("starting to record");
    H5Fflush(root, H5F_SCOPE_LOCAL);
    std::filesystem::rename(temporary, path);
  }

  void write_buffer() {
    if (!buffer.empty() && !append_rows(cycles.get(), cycle.get(), cycle_rows, buffer.size(), buffer.data())) {
      throw failed("writing");
    }
    buffer.clear();
  }
  void flush() {
    write_buffer();
    // Values before the length that counts them: H5Dflush writes the chunks first.
    if (H5Dflush(cycles.get()) < 0 || H5Dflush(events.get()) < 0) throw failed("writing");
    flushed = std::chrono::steady_clock::now();
  }
};

LoopRecorder::LoopRecorder(const std::filesystem::path& path, const RecordingHead& head, double flush_interval)
    : state_(std::make_unique<State>(path, head, flush_interval)) {}

LoopRecorder::~LoopRecorder() {
  try {
    event({state_->cycle_rows == 0 ? 0 : rows() - 1, 0, "end of recording"});
    flush();
  } catch (const Error&) {
    // The file keeps what it has.
  }
}

long LoopRecorder::rows() const { return static_cast<long>(state_->cycle_rows + state_->buffer.size()); }

void LoopRecorder::append(const LoopSample& sample) {
  state_->buffer.push_back(sample);
  if (std::chrono::duration<double>(std::chrono::steady_clock::now() - state_->flushed).count() >= state_->interval) {
    state_->flush();
  } else if (state_->buffer.size() >= kBuffered) {
    state_->write_buffer();
  }
}

void LoopRecorder::event(const LoopEvent& e) {
  EventRow row{e.tick, e.t, {}};
  std::memcpy(row.text.data(), e.text.data(), std::min(e.text.size(), row.text.size() - 1));
  if (!append_rows(state_->events.get(), state_->event.get(), state_->event_rows, 1, &row))
    throw state_->failed("writing");
  state_->flush();
}

void LoopRecorder::flush() { state_->flush(); }

const std::string* LoopRecord::text(const std::string& name) const {
  const auto at = std::find_if(head.texts.begin(), head.texts.end(), [&](const auto& t) { return t.first == name; });
  return at == head.texts.end() ? nullptr : &at->second;
}

LoopRecord read_loop_record(const std::filesystem::path& path) {
  quiet();
  // A file whose writer was killed still says that it is being written.
  Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, H5P_DEFAULT), H5Fclose);
  if (!file) file = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file || read_text(file.get(), "schema") != kSchema) {
    throw Error::in_file(path.string(), 0, "is no recording of a loop (schema whirl.loop/1)");
  }
  LoopRecord out;
  const Handle dt(H5Aopen(file.get(), "sample_time_s", H5P_DEFAULT), H5Aclose);
  if (dt) H5Aread(dt.get(), H5T_NATIVE_DOUBLE, &out.head.sample_time);
  std::string names = read_text(file.get(), "texts") + " ";
  const Handle byte(H5Tcopy(H5T_NATIVE_UINT8), H5Tclose);
  for (std::size_t space; (space = names.find(' ')) != std::string::npos; names.erase(0, space + 1)) {
    const std::string name = names.substr(0, space);
    if (name.empty()) continue;
    const std::vector<char> bytes = read_rows<char>(file.get(), name.c_str(), byte);
    out.head.texts.emplace_back(name, std::string(bytes.begin(), bytes.end()));
  }
  out.cycles = read_rows<LoopSample>(file.get(), "cycles", cycle_type());
  // The table may have grown without its last rows.
  while (!out.cycles.empty() && out.cycles.back().tick < 0) out.cycles.pop_back();
  for (const EventRow& row : read_rows<EventRow>(file.get(), "events", event_type())) {
    if (row.tick < 0) continue;
    out.events.push_back({row.tick, row.t, std::string(row.text.data())});
    out.closed = out.events.back().text == "end of recording";
  }
  return out;
}

}  // namespace whirl::rt
