#include "formats/hdf5/hdf5_write.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "formats/hdf5/hdf5_library.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/io/temporary.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

/// A dataset for a channel, with its unit and times; its values are still to come.
Hdf5Id make_dataset(hid_t file, const Channel& channel, const Recording& of, hsize_t rows, hid_t plist, bool& good) {
  std::string name = channel.name;
  for (char& c : name) c = c == '/' ? '_' : c;
  const Hdf5Id space(H5Screate_simple(1, &rows, nullptr), H5Sclose), scalar(H5Screate(H5S_SCALAR), H5Sclose);
  Hdf5Id data(H5Dcreate2(file, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, plist, H5P_DEFAULT), H5Dclose);
  const std::string unit(si_unit(channel.quantity));
  const Hdf5Id text(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(text, unit.size() + 1);
  const Hdf5Id attribute(H5Acreate2(data, "unit", text, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  good = good && H5Awrite(attribute, text, unit.c_str()) >= 0;
  for (const auto& [key, value] : {std::pair{"dt", of.dt}, {"t0", of.t0}}) {
    const Hdf5Id number(H5Acreate2(data, key, H5T_IEEE_F64LE, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    good = good && H5Awrite(number, H5T_NATIVE_DOUBLE, &value) >= 0;
  }
  return data;
}

/// The bytes of a file into another one, without its holes.
void copy_written(const std::filesystem::path& from, ByteSink& sink) {
  const int descriptor = open(from.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw Error::in_file(from.string(), 0, "cannot be read");
  std::string bytes(std::size_t{1} << 16, '\0');
  for (off_t at = 0; (at = lseek(descriptor, at, SEEK_DATA)) >= 0;) {
    const off_t hole = lseek(descriptor, at, SEEK_HOLE);
    const ssize_t n = pread(descriptor, bytes.data(), bytes.size(), at);
    if (n <= 0) break;
    const off_t end = std::min(hole, at + n);
    sink.write_at(static_cast<std::uint64_t>(at), {bytes.data(), static_cast<std::size_t>(end - at)});
    at = end;
  }
  (void)close(descriptor);
}

/// A file with the datasets of these channels, whose values are a hole. Their places; none where it cannot be written.
std::vector<haddr_t> make_frame(const std::filesystem::path& path, const Recording& of, hsize_t rows) {
  std::vector<haddr_t> places;
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  bool good = file >= 0;
  {
    const Hdf5Id plain(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_obj_track_times(plain, false);
    H5Pset_alloc_time(plain, H5D_ALLOC_TIME_EARLY);
    H5Pset_fill_time(plain, H5D_FILL_TIME_NEVER);
    for (const Channel& channel : of.channels) {
      const Hdf5Id data = make_dataset(file, channel, of, rows, plain, good);
      places.push_back(H5Dget_offset(data));
      good = good && places.back() != HADDR_UNDEF;
    }
  }
  good = good && H5Fflush(file, H5F_SCOPE_GLOBAL) >= 0;
  good = H5Fclose(file) >= 0 && good;
  return good ? places : std::vector<haddr_t>();
}

}  // namespace

void write_hdf5(const std::filesystem::path& path, const Recording& recording) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  ByteSink sink(path);
  // In memory: the library does not survive a disk that becomes full under it.
  const Hdf5Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access, 1 << 20, false);
  const Hdf5Id file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  if (file < 0) throw Error::in_file(path.string(), 0, "cannot be written");
  bool good = true;
  const Hdf5Id plain(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(plain, false);  // the same record gives the same bytes
  for (const Channel& channel : recording.channels) {
    const Hdf5Id data =
        make_dataset(file, channel, recording, static_cast<hsize_t>(channel.samples.size()), plain, good);
    good = good && H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, channel.samples.data()) >= 0;
  }
  good = good && H5Fflush(file, H5F_SCOPE_GLOBAL) >= 0;
  const ssize_t size = good ? H5Fget_file_image(file, nullptr, 0) : -1;
  std::string bytes(static_cast<std::size_t>(std::max<ssize_t>(size, 0)), '\0');
  if (size <= 0 || H5Fget_file_image(file, bytes.data(), bytes.size()) != size)
    throw Error::in_file(path.string(), 0, "cannot be put together in memory");
  sink.write(bytes);
  sink.close();
}

void write_hdf5_parts(const std::filesystem::path& path, const Recording& first, RecordStream& rest,
                      Eigen::Index rows) {
  H5dont_atexit();  // the library would write again what a full disk has refused, and crash
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  ByteSink sink(path);
  const TemporaryFolder folder("hdf5");  // for all but the values
  const std::filesystem::path frame = folder.path() / "frame.h5";
  const std::vector<haddr_t> places = make_frame(frame, first, static_cast<hsize_t>(rows));
  if (places.empty())
    throw Error::in_file(path.string(), 0,
                         fmt::format("cannot be put together in {}: is the disk full?", folder.path().string()));
  copy_written(frame, sink);
  Recording part = first;
  Eigen::Index at = 0;
  do {
    if (part.channels.size() != places.size() || at + part.size() > rows)
      throw Error::in_file(part.source, 0, "its channels change inside the file");
    for (std::size_t c = 0; c < places.size(); ++c) {
      const auto* values = reinterpret_cast<const char*>(part.channels[c].samples.data());
      sink.write_at(places[c] + 8 * static_cast<std::uint64_t>(at),
                    {values, 8 * static_cast<std::size_t>(part.size())});
    }
    at += part.size();
  } while (rest.next(part));
  if (at != rows)
    throw Error::in_file(part.source, 0,
                         fmt::format("{} samples of {}: it has become shorter while it is read", at, rows));
  sink.close();
}

}  // namespace whirl::io
