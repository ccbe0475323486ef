#include <algorithm>
#include <span>

#include "recording/layout.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"
#include "whirl/io/apart.hpp"
#include "whirl/io/input.hpp"

namespace whirl::rt {

const std::string* LoopRecord::text(const std::string& name) const {
  const auto at = std::find_if(head.texts.begin(), head.texts.end(), [&](const auto& t) { return t.first == name; });
  return at == head.texts.end() ? nullptr : &at->second;
}

namespace {

using namespace recording;

/// A link into another file is none, nor are values that stand in one.
bool stands_here(hid_t file, const char* name) {
  H5L_info_t link{};
  if (H5Lget_info(file, name, &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) return false;
  const Handle data(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
  if (!data) return false;
  const Handle created(H5Dget_create_plist(data.get()), H5Pclose);
  return H5Pget_external_count(created.get()) == 0 && H5Pget_layout(created.get()) != H5D_VIRTUAL;
}

template <class Row>
std::vector<Row> read_rows(hid_t file, const char* name, const Handle& type) {
  if (!stands_here(file, name)) return {};
  const Handle data(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
  const Handle space(H5Dget_space(data.get()), H5Sclose);
  const hssize_t count = H5Sget_simple_extent_npoints(space.get());
  std::vector<Row> rows(count > 0 ? static_cast<std::size_t>(count) : 0);
  if (!rows.empty() && H5Dread(data.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, rows.data()) < 0) rows.clear();
  return rows;
}

LoopRecord read_in_this_process(const std::filesystem::path& path) {
  // A file whose writer was killed still says that it is being written.
  // Between two looks at what a writer may be changing HDF5 sleeps twice as long each time, from 1 ns on: by default a
  // hundred times, longer than anybody waits for a damaged file. These come to 0.1 s.
  constexpr unsigned kLooks = 26;
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_metadata_read_attempts(access.get(), kLooks);
  Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access.get()), H5Fclose);
  if (!file) file = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (std::error_code ec; !file && !std::filesystem::exists(path, ec))
    throw Error::in_file(path.string(), 0, "cannot be opened: No such file or directory");
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
    e.text = one_line(in.text());
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
