#include "whirl/rt/recorder.hpp"

#include <fcntl.h>
#include <hdf5.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstring>

#include "whirl/core/error.hpp"
#include "whirl/io/apart.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/input.hpp"
#include "whirl/io/output.hpp"

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

void prepare_library() {
  // A file that could not be finished stays open for ever; the library must not try again when the program ends.
  [[maybe_unused]] static const herr_t once = H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are ours to tell
}

/// Room on the disk that is taken before the library needs it: it does not survive a disk that becomes full under it.
/// With the room of the last step the file can still be closed.
class Reserve {
 public:
  void open(const std::filesystem::path& path) { descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC); }
  ~Reserve() { give_back(); }
  /// Makes sure of some megabytes behind what is there. 0, or the system's reason.
  int ensure() {
    const off_t size = lseek(descriptor_, 0, SEEK_END);
    if (descriptor_ < 0 || size < 0) return errno;
    if (size + kLeast <= end_) return 0;
    int code;
    do {
      code = fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, 0, size + 2 * kLeast);
    } while (code != 0 && errno == EINTR);
    if (code == 0) {
      end_ = size + 2 * kLeast;
      return 0;
    }
    if (errno != EOPNOTSUPP && errno != ENOSYS) return errno;
    struct statvfs space {};  // a file system that cannot reserve: ask each time
    if (fstatvfs(descriptor_, &space) != 0) return errno;
    return space.f_bavail * space.f_frsize < static_cast<fsblkcnt_t>(4 * kLeast) ? ENOSPC : 0;
  }
  /// 0, or the system's reason.
  int sync() const { return descriptor_ < 0 || fdatasync(descriptor_) == 0 || errno == EINTR ? 0 : errno; }
  void give_back() {
    if (descriptor_ < 0) return;
    const off_t size = lseek(descriptor_, 0, SEEK_END);
    if (size >= 0 && ftruncate(descriptor_, size) != 0) errno = 0;  // costs room, not data
    (void)fsync(descriptor_);
    ::close(std::exchange(descriptor_, -1));
  }

 private:
  static constexpr off_t kLeast = off_t{1} << 21;
  int descriptor_ = -1;
  off_t end_ = 0;
};

}  // namespace

struct LoopRecorder::State {
  std::filesystem::path path, temporary;
  Reserve reserve;
  Handle file{-1, H5Fclose}, cycles{-1, H5Dclose}, events{-1, H5Dclose}, cycle{cycle_type()}, event{event_type()};
  std::vector<LoopSample> buffer;
  hsize_t cycle_rows = 0, event_rows = 0;
  double interval;
  std::chrono::steady_clock::time_point flushed = std::chrono::steady_clock::now();
  std::string failure;
  long lost = 0;

  Error failed(const char* what) const {
    return Error::in_file(
        path.string(), 0,
        fmt::format("{} failed{}{}", what, errno != 0 ? ": " : "", errno != 0 ? strerror(errno) : ""));
  }

  State(const std::filesystem::path& p, const RecordingHead& head, double flush_interval)
      : path(p), interval(flush_interval) {
    const std::filesystem::path target = io::regular_target(p);
    temporary = target.parent_path() / fmt::format(".whirl-{}-recording.part", getpid());
    buffer.reserve(kBuffered);
    try {
      create(head);
      if (std::rename(temporary.c_str(), target.c_str()) != 0) throw failed("creating the recording");
    } catch (...) {
      abandon();
      unlink(temporary.c_str());
      throw;
    }
  }

  void create(const RecordingHead& head) {
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_libver_bounds(access.get(), H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
    errno = 0;
    file = Handle(H5Fcreate(temporary.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()), H5Fclose);
    if (!file) throw failed("creating the recording");
    reserve.open(temporary);
    if (const int code = reserve.ensure(); code != 0) errno = code, throw failed("creating the recording");
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
    if (H5Fflush(root, H5F_SCOPE_LOCAL) < 0) throw failed("writing the head");
    if (const int code = reserve.sync(); code != 0) errno = code, throw failed("writing the head");
  }

  /// The library would end the program on a second try.
  void abandon() {
    cycles.leave();
    events.leave();
    file.leave();
  }
  /// Nothing more is written. `open`: the library still stands, and what it has can be closed.
  void give_up(int code, bool open) {
    if (!failure.empty()) return;
    failure = code != 0 ? std::strerror(code) : "writing failed";
    lost += static_cast<long>(buffer.size());
    buffer.clear();
    if (open) {
      EventRow row{static_cast<std::int64_t>(cycle_rows), 0, {}};
      const std::string text = "recording stopped: " + failure;
      std::memcpy(row.text.data(), text.data(), std::min(text.size(), row.text.size() - 1));
      open = append_rows(events.get(), event.get(), event_rows, 1, &row) && H5Dflush(cycles.get()) >= 0 &&
             H5Dflush(events.get()) >= 0;
    }
    if (!open) abandon();
  }
  bool room() {
    const int code = failure.empty() ? reserve.ensure() : 0;
    if (code != 0) give_up(code, true);
    return failure.empty();
  }
  void write_buffer() {
    if (!room()) return;
    errno = 0;
    if (!buffer.empty() && !append_rows(cycles.get(), cycle.get(), cycle_rows, buffer.size(), buffer.data()))
      return give_up(errno, false);
    buffer.clear();
  }
  void flush() {
    write_buffer();
    if (!failure.empty()) return;
    errno = 0;
    // Values before the length that counts them: H5Dflush writes the chunks first.
    if (H5Dflush(cycles.get()) < 0 || H5Dflush(events.get()) < 0) return give_up(errno, false);
    if (const int code = reserve.sync(); code != 0) return give_up(code, false);
    flushed = std::chrono::steady_clock::now();
  }
};

LoopRecorder::LoopRecorder(const std::filesystem::path& path, const RecordingHead& head, double flush_interval) {
  prepare_library();
  state_ = std::make_unique<State>(path, head, flush_interval);
}

LoopRecorder::~LoopRecorder() { close(); }

void LoopRecorder::close() {
  if (std::exchange(closed_, true)) return;
  event({state_->cycle_rows == 0 ? 0 : rows() - 1, 0, "end of recording"});
  state_->flush();
  if (state_->failure.empty() && H5Fflush(state_->file.get(), H5F_SCOPE_GLOBAL) < 0) state_->give_up(errno, false);
}

long LoopRecorder::rows() const { return static_cast<long>(state_->cycle_rows + state_->buffer.size()); }
const std::string& LoopRecorder::failure() const { return state_->failure; }
long LoopRecorder::lost() const { return state_->lost; }

void LoopRecorder::append(const LoopSample& sample) {
  if (!state_->failure.empty()) {
    ++state_->lost;
    return;
  }
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
  if (!state_->room()) return;
  errno = 0;
  if (!append_rows(state_->events.get(), state_->event.get(), state_->event_rows, 1, &row))
    return state_->give_up(errno, false);
  state_->flush();
}

void LoopRecorder::flush() { state_->flush(); }

const std::string* LoopRecord::text(const std::string& name) const {
  const auto at = std::find_if(head.texts.begin(), head.texts.end(), [&](const auto& t) { return t.first == name; });
  return at == head.texts.end() ? nullptr : &at->second;
}

namespace {

LoopRecord read_in_this_process(const std::filesystem::path& path) {
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

void put(io::ParcelWriter& out, const LoopRecord& record) {
  out.value(record.head.sample_time);
  out.value(static_cast<char>(record.closed));
  out.value(record.head.texts.size());
  for (const auto& [name, text] : record.head.texts) out.text(name), out.text(text);
  out.values(std::span(record.cycles.data(), record.cycles.size()));
  out.value(record.events.size());
  for (const LoopEvent& e : record.events) out.value(e.tick), out.value(e.t), out.text(e.text);
}

LoopRecord take(io::ParcelReader& in) {
  LoopRecord out;
  out.head.sample_time = in.value<double>();
  out.closed = in.value<char>() != 0;
  for (auto n = in.value<std::size_t>(); n > 0; --n) {
    std::string name = in.text();
    out.head.texts.emplace_back(std::move(name), in.text());
  }
  out.cycles.resize(in.count<LoopSample>());
  in.copy(out.cycles.data(), sizeof(LoopSample) * out.cycles.size());
  for (auto n = in.value<std::size_t>(); n > 0; --n) {
    LoopEvent e;
    e.tick = in.value<decltype(e.tick)>();
    e.t = in.value<double>();
    e.text = in.text();
    out.events.push_back(std::move(e));
  }
  return out;
}

}  // namespace

LoopRecord read_loop_record(const std::filesystem::path& path) {
  // What says that it is being written and is damaged besides makes the library look again without end.
  const std::filesystem::path kept = io::input_path(path);
  std::error_code none;
  const std::uintmax_t size = std::filesystem::file_size(kept, none);
  LoopRecord out;
  const auto read = [&](io::ParcelWriter& parcel) {
    prepare_library();
    put(parcel, read_in_this_process(kept));
  };
  io::read_apart(path.string(), none ? 0 : size, read, [&](io::ParcelReader& in) { out = take(in); });
  return out;
}

}  // namespace whirl::rt
