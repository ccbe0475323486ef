// HDF5 and MAT v7.3 (which is HDF5 with the dimensions reversed) by the HDF5 library.
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>

#include "formats/arrays/arrays.hpp"
#include "formats/format.hpp"
#include "formats/hdf5/hdf5_dataset.hpp"
#include "formats/hdf5/hdf5_library.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/input.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

/// The numeric arrays of the opened file, into the parcel.
void collect(hid_t file, Hdf5Visit visit, std::string_view name, bool matlab) {
  visit.file = file;
  visit.out.text(matlab ? "MAT v7.3" : "HDF5");
  const bool whole = walk(visit);
  if (!visit.problem.empty()) throw Error::in_file(name, 0, visit.problem);
  if (!whole) throw Error::in_file(name, 0, "the tree of groups is damaged");
  visit.out.value(Piece::end);
}

void collect_memory(std::string_view bytes, std::string_view name, ParcelWriter& out) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are ours to print
  const Hdf5Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access, 1 << 16, false);
  H5Pset_file_image(access, const_cast<char*>(bytes.data()), bytes.size());
  const Hdf5Id file(bytes.empty() ? hid_t{-1} : H5Fopen("memory", H5F_ACC_RDONLY, access), H5Fclose);
  if (file < 0) {
    // Byte 11 of superblock 3: 1 open for writing, 4 for one writer and many readers.
    if (bytes.starts_with("\x89HDF\r\n\x1a\n") && bytes.size() > 12 && bytes[8] == 3 && (bytes[11] & 5) != 0) {
      throw Error::in_file(name, 0,
                           "its writer did not come to its end, or is at work: `whirl replay` reads such a recording "
                           "of a loop, `h5clear -s` opens it for other programs");
    }
    throw Error::in_file(name, 0, fmt::format("{} bytes that are no HDF5 file, or damaged or cut off", bytes.size()));
  }
  collect(file, {.file = -1, .bytes = bytes.size(), .out = out}, name, bytes.starts_with("MATLAB 7.3"));
}

/// This process never opens the file with the library: another one does and hands the values over.
SignalFile read_by(const std::string& name, std::size_t bytes, const std::function<void(ParcelWriter&)>& collected,
                   const ResponseOptions* wanted = nullptr) {
  SignalFile file;
  file.source = name;
  read_apart(name, bytes, collected, [&](ParcelReader& in) {
    file.format = in.text();
    std::vector<NamedArray> arrays;
    while (true) {
      const auto piece = in.value<Piece>();
      if (piece == Piece::end) break;
      if (piece == Piece::array) {
        arrays.push_back(take_array(in));
      } else {
        (piece == Piece::finding ? file.findings : file.contents).push_back(in.text());
      }
    }
    add_arrays(file, std::move(arrays), wanted);
  });
  return file;
}

}  // namespace

SignalFile read_hdf5_rows(const std::filesystem::path& path, Eigen::Index first, Eigen::Index count) {
  const std::filesystem::path kept = input_path(path);
  std::error_code none;
  const std::uintmax_t size = std::filesystem::file_size(kept, none);
  const std::size_t bytes = none ? 0 : size;
  return read_by(path.string(), bytes, [&](ParcelWriter& out) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    const Hdf5Id file(H5Fopen(kept.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (file < 0) throw Error::in_file(path.string(), 0, "is no HDF5 file, or damaged or cut off");
    collect(file,
            {.file = -1,
             .bytes = bytes,
             .out = out,
             .first = static_cast<hsize_t>(first),
             .count = static_cast<hsize_t>(count)},
            path.string(), false);
  });
}

SignalFile parse_hdf5(std::string_view bytes, std::string_view name) {
  return read_by(std::string(name), bytes.size(), [&](ParcelWriter& out) { collect_memory(bytes, name, out); });
}

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
    std::string name = channel.name;
    for (char& c : name) c = c == '/' ? '_' : c;
    const hsize_t size = static_cast<hsize_t>(channel.samples.size());
    const Hdf5Id space(H5Screate_simple(1, &size, nullptr), H5Sclose), scalar(H5Screate(H5S_SCALAR), H5Sclose);
    const Hdf5Id data(H5Dcreate2(file, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, plain, H5P_DEFAULT), H5Dclose);
    good = good && H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, channel.samples.data()) >= 0;
    const std::string unit(si_unit(channel.quantity));
    const Hdf5Id text(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(text, unit.size() + 1);
    const Hdf5Id attribute(H5Acreate2(data, "unit", text, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    good = good && H5Awrite(attribute, text, unit.c_str()) >= 0;
    for (const auto& [key, value] : {std::pair{"dt", recording.dt}, {"t0", recording.t0}}) {
      const Hdf5Id number(H5Acreate2(data, key, H5T_IEEE_F64LE, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
      good = good && H5Awrite(number, H5T_NATIVE_DOUBLE, &value) >= 0;
    }
  }
  good = good && H5Fflush(file, H5F_SCOPE_GLOBAL) >= 0;
  const ssize_t size = good ? H5Fget_file_image(file, nullptr, 0) : -1;
  std::string bytes(static_cast<std::size_t>(std::max<ssize_t>(size, 0)), '\0');
  if (size <= 0 || H5Fget_file_image(file, bytes.data(), bytes.size()) != size)
    throw Error::in_file(path.string(), 0, "cannot be put together in memory");
  sink.write(bytes);
  sink.close();
}

namespace {

SignalFile read_whole(const std::filesystem::path& path, const ResponseOptions* wanted) {
  const std::filesystem::path kept = input_path(path);
  const std::string name = path.string();
  return read_by(
      name, std::filesystem::file_size(kept), [&](ParcelWriter& out) { collect_memory(read_text(kept), name, out); },
      wanted);
}

}  // namespace

Format hdf5_format() {
  Format f{FileFormat::hdf5, "HDF5", {".h5", ".hdf5", ".mat"}, [](std::string_view head) {
             // Behind a user block of 512 bytes or a power of two times that.
             for (std::size_t at = 0; at < head.size(); at = at == 0 ? 512 : 2 * at) {
               if (head.substr(at).starts_with(std::string_view("\x89HDF\r\n\x1a\n", 8))) return true;
             }
             return head.starts_with("MATLAB 7.3");
           }};
  f.magic = true;
  f.read = [](const std::filesystem::path& path, const CsvOptions&) { return read_whole(path, nullptr); };
  f.write = write_hdf5;
  f.stream = stream_hdf5;
  f.read_responses = [](const std::filesystem::path& path, const ResponseOptions& options) {
    return responses_of(read_whole(path, &options), options);
  };
  return f;
}

}  // namespace whirl::io
