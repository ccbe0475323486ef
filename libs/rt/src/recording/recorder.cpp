#include "whirl/rt/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>

#include "recording/layout.hpp"
#include "recording/reserve.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/output.hpp"

namespace whirl::rt {
namespace {

using namespace recording;
constexpr hsize_t kChunkRows = 1024;
constexpr std::size_t kBuffered = 256;  // rows between two writes

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
    for (const Field& f : fields()) {
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

}  // namespace whirl::rt
