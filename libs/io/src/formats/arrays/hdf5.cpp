// HDF5 and MAT v7.3 (which is HDF5 with the dimensions reversed) by the HDF5 library.
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>

#include "formats/arrays/arrays.hpp"
#include "formats/arrays/hdf5_chunks.hpp"
#include "formats/format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/apart.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/input.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

// What follows one another in the parcel of the process that reads (read_apart).
enum class Piece : char { array, contents, finding, end };

/// An identifier of the library, closed at the end.
class Id {
 public:
  Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Id() {
    if (id_ >= 0) close_(id_);
  }
  Id(const Id&) = delete;
  Id& operator=(const Id&) = delete;
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

std::string text_attribute(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return {};
  const Id attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  if (H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1) return {};
  if (H5Tis_variable_str(type) > 0) {
    char* text = nullptr;
    const Id memory(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(memory, H5T_VARIABLE);
    H5Tset_cset(memory, H5Tget_cset(type));
    if (H5Aread(attribute, memory, &text) < 0 || text == nullptr) return {};
    std::string out(text);
    H5free_memory(text);
    return out;
  }
  const std::size_t size = H5Tget_size(type);
  if (size > 4096) return {};
  std::string out(size, '\0');
  if (H5Aread(attribute, type, out.data()) < 0) return {};
  return out.c_str();
}

double number_attribute(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return 0;
  const Id attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  const H5T_class_t kind = H5Tget_class(type);
  double value = 0;
  if ((kind != H5T_FLOAT && kind != H5T_INTEGER) || H5Sget_simple_extent_npoints(space) != 1) return 0;
  return H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0 || !std::isfinite(value) ? 0 : value;
}

struct Visit {
  hid_t file;
  std::size_t bytes;  ///< of the file
  ParcelWriter& out;
  std::string problem = {};      ///< to be thrown when the library has returned
  hsize_t first = 0, count = 0;  ///< rows of the channels to be read; count 0: all
  hsize_t length = 0;            ///< of the channels, where rows are chosen
};

void put(ParcelWriter& out, const Eigen::MatrixXd& m) {
  out.value(m.rows());
  out.values(std::span(m.data(), static_cast<std::size_t>(m.size())));
}
void put(ParcelWriter& out, const NamedArray& a) {
  out.value(Piece::array);
  for (const std::string& text : {a.group, a.name, a.unit}) out.text(text);
  put(out, a.value);
  put(out, a.imaginary);
  for (const Eigen::Index n : a.sizes) out.value(n);
  out.value(a.step);
  out.value(a.start);
}
void put(ParcelWriter& out, const std::string& text, Piece piece = Piece::contents) {
  out.value(piece);
  out.text(text);
}

Eigen::MatrixXd take_matrix(ParcelReader& in) {
  const auto rows = in.value<Eigen::Index>();
  const auto size = static_cast<Eigen::Index>(in.count<double>());
  if (rows < 0 || (rows == 0 ? size != 0 : size % rows != 0))
    throw Error("an array of an HDF5 file has no whole columns");
  Eigen::MatrixXd m(rows, rows > 0 ? size / rows : 0);
  in.copy(m.data(), sizeof(double) * static_cast<std::size_t>(size));
  return m;
}
NamedArray take_array(ParcelReader& in) {
  NamedArray a;
  for (std::string* text : {&a.group, &a.name, &a.unit}) *text = in.text();
  a.value = take_matrix(in);
  a.imaginary = take_matrix(in);
  for (Eigen::Index& n : a.sizes) n = in.value<Eigen::Index>();
  const auto& n = a.sizes;
  const bool whole = n[0] > 0 && n[1] > 0 && n[2] > 0 &&
                     static_cast<double>(n[0]) * static_cast<double>(n[1]) * static_cast<double>(n[2]) ==
                         static_cast<double>(a.value.size());
  if (!whole && (n[0] != 0 || n[1] != 0 || n[2] != 0))
    throw Error("an array of an HDF5 file has other sizes than values");
  a.step = in.value<double>();
  a.start = in.value<double>();
  return a;
}

/// Step in s by the words for it and for the sample rate that programs write; 0 = none.
double step_attribute(hid_t object) {
  if (const double step = number_attribute(object, "dt"); step > 0) return step;
  for (const char* name : {"fs", "sample_rate", "sampling_rate", "sampling_frequency", "samplerate"}) {
    if (const double rate = number_attribute(object, name); rate > 0) return 1 / rate;
  }
  return 0;
}

bool matlab_logical(hid_t data) { return text_attribute(data, "MATLAB_class") == "logical"; }

/// Name and attributes of a dataset, without its values.
NamedArray array_head(hid_t data, const std::string& path) {
  NamedArray array;
  const std::size_t slash = path.rfind('/');
  array.group = slash == std::string::npos ? "" : path.substr(0, slash);
  array.name = slash == std::string::npos ? path : path.substr(slash + 1);
  array.unit = text_attribute(data, "unit");
  if (array.unit.empty()) array.unit = text_attribute(data, "units");
  if (matlab_logical(data)) array.unit = split_unit(array.name).unit == nullptr ? "1" : "";
  array.step = step_attribute(data);
  array.start = number_attribute(data, "t0");
  // Failing that, of the groups about it.
  const Id file(H5Iget_file_id(data), H5Fclose);
  for (std::string group = array.group; array.step <= 0; group.resize(group.find_last_of('/') + 1)) {
    while (group.ends_with('/')) group.pop_back();
    const Id parent(H5Oopen(file, group.empty() ? "/" : group.c_str(), H5P_DEFAULT), H5Oclose);
    if (parent >= 0) array.step = step_attribute(parent);
    if (parent >= 0 && array.step > 0) array.start = number_attribute(parent, "t0");
    if (group.empty()) break;
  }
  return array;
}

/// The first filter that packs a dataset and is not there; empty: none.
std::string missing_filter(hid_t created) {
  for (int k = 0; k < H5Pget_nfilters(created); ++k) {
    unsigned flags = 0, settings = 0;
    char name[64] = {};
    std::size_t values = 0;
    const H5Z_filter_t id =
        H5Pget_filter2(created, static_cast<unsigned>(k), &flags, &values, nullptr, sizeof name, name, &settings);
    if (id >= 0 && H5Zfilter_avail(id) <= 0) return fmt::format("{} ({})", name[0] != 0 ? name : "without name", id);
  }
  return {};
}

/// Why the library did not read it.
std::string unreadable(hid_t data, const char* path) {
  const Id created(H5Dget_create_plist(data), H5Pclose);
  const std::string filter = missing_filter(created);
  if (filter.empty()) return fmt::format("dataset '{}' cannot be read: damaged", path);
  return fmt::format(
      "dataset '{}' is packed by the filter {}, which is not installed here: write it with gzip or unpacked", path,
      filter);
}

/// Three dimensions, as frequency responses of several points to several references have. MATLAB's are reversed.
void read_cube(Visit& visit, const char* path, hid_t data, hid_t type, bool complex, std::vector<std::size_t> shape,
               bool reversed) {
  const auto read = [&](hid_t memory) {
    Eigen::VectorXd flat(static_cast<Eigen::Index>(shape[0] * shape[1] * shape[2]));
    if (H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, flat.data()) < 0) visit.problem = unreadable(data, path);
    return flat;
  };
  const auto member = [&](unsigned part) {
    char* name = H5Tget_member_name(type, part);
    const Id memory(H5Tcreate(H5T_COMPOUND, sizeof(double)), H5Tclose);
    H5Tinsert(memory, name, 0, H5T_NATIVE_DOUBLE);
    H5free_memory(name);
    return read(memory);
  };
  NamedArray array = array_head(data, path);
  const Eigen::VectorXd real = complex ? member(0) : read(H5T_NATIVE_DOUBLE);
  const Eigen::VectorXd imaginary = complex ? member(1) : Eigen::VectorXd();
  if (reversed) std::reverse(shape.begin(), shape.end());
  set_values(array, real, imaginary, shape, reversed);
  if (visit.problem.empty()) put(visit.out, array);
}

/// Whether a dataset holds numbers; what else it is goes into the contents.
bool is_numeric(Visit& visit, const char* path, H5T_class_t kind, bool complex, const std::string& matlab) {
  const bool other = !matlab.empty() && matlab != "double" && matlab != "single" && matlab != "logical" &&
                     !matlab.starts_with("int") && !matlab.starts_with("uint");
  if ((kind != H5T_FLOAT && kind != H5T_INTEGER && !complex) || other) {
    put(visit.out, fmt::format("'{}': {} (passed over)", path,
                               kind == H5T_STRING || matlab == "char" ? "text"
                               : matlab == "function_handle"          ? "function handle"
                               : other                                ? matlab
                                                                      : "not numeric"));
    return false;
  }
  return true;
}

/// A number that lies inside the compound (the library copies what a damaged one says).
bool is_number(hid_t type, unsigned part) {
  const Id member(H5Tget_member_type(type, part), H5Tclose);
  const H5T_class_t kind = H5Tget_class(member);
  return (kind == H5T_FLOAT || kind == H5T_INTEGER) &&
         H5Tget_member_offset(type, part) + H5Tget_size(member) <= H5Tget_size(type);
}

std::string member_name(hid_t type, unsigned part) {
  char* raw = H5Tget_member_name(type, part);
  std::string name = raw == nullptr ? "" : raw;
  H5free_memory(raw);
  return name;
}

/// r and i, re and im, real and imag; other pairs are records of two fields.
bool is_complex(hid_t type, H5T_class_t kind) {
  if (kind != H5T_COMPOUND || H5Tget_nmembers(type) != 2) return false;
  const std::string first = member_name(type, 0), second = member_name(type, 1);
  const auto begins = [](const std::string& s, char lower) {
    return !s.empty() && (s[0] == lower || s[0] == lower - 'a' + 'A');
  };
  if (!begins(first, 'r') || !begins(second, 'i')) return false;
  for (const unsigned part : {0U, 1U}) {
    const Id member(H5Tget_member_type(type, part), H5Tclose);
    if (H5Tget_class(member) != H5T_FLOAT || !is_number(type, part)) return false;
  }
  return true;
}

/// A table of records, as PyTables and h5py write structured arrays: its fields are arrays of a group of its name.
void read_records(Visit& visit, const char* path, hid_t data, hid_t type, hsize_t rows) {
  for (int part = 0; part < H5Tget_nmembers(type); ++part) {
    const std::string name = member_name(type, static_cast<unsigned>(part));
    if (!is_number(type, static_cast<unsigned>(part))) {
      put(visit.out, fmt::format("'{}', field '{}': not numeric (passed over)", path, name));
      continue;
    }
    NamedArray array = array_head(data, path);
    array.group = path;
    array.name = name;
    array.unit.clear();
    const Id memory(H5Tcreate(H5T_COMPOUND, sizeof(double)), H5Tclose);
    H5Tinsert(memory, name.c_str(), 0, H5T_NATIVE_DOUBLE);
    array.value.resize(static_cast<Eigen::Index>(rows), 1);
    if (H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, array.value.data()) < 0) {
      visit.problem = unreadable(data, path);
      return;
    }
    put(visit.out, array);
  }
}

/// What is stored of the dataset can be as many values as it says; else `visit.problem` says so.
bool holds(Visit& visit, const char* path, hid_t data, hid_t type, hid_t space, double rows, double columns) {
  const double stored = static_cast<double>(std::min<hsize_t>(H5Dget_storage_size(data), visit.bytes));
  const Id created(H5Dget_create_plist(data), H5Pclose);
  const bool chunked = H5Pget_layout(created) == H5D_CHUNKED;
  // No more than what is stored can be unpacked into: deflate gains a factor of 1032 at most.
  const double most = chunked ? 1100 * stored : stored;
  if (rows * columns * static_cast<double>(H5Tget_size(type)) > most || rows * columns > 1e9) {
    visit.problem =
        fmt::format("dataset '{}': {:g} x {:g} values cannot stand in {:g} bytes", path, rows, columns, stored);
  } else if (chunked && visit.first == 0 && rows * columns > 0 &&
             !chunks_are_whole(data, created, type, space, visit.bytes)) {
    visit.problem = fmt::format("dataset '{}' cannot be read: a part of it is shorter than it says", path);
  }
  return visit.problem.empty();
}

void read_dataset(Visit& visit, const char* path) {
  const Id data(H5Dopen2(visit.file, path, H5P_DEFAULT), H5Dclose);
  if (data < 0) {
    visit.problem = fmt::format("dataset '{}' cannot be opened", path);
    return;
  }
  const Id type(H5Dget_type(data), H5Tclose), space(H5Dget_space(data), H5Sclose);
  const H5T_class_t kind = H5Tget_class(type);
  const bool complex = is_complex(type, kind);
  const std::string matlab = text_attribute(data, "MATLAB_class");
  if (kind == H5T_COMPOUND && !complex && visit.count == 0 && H5Sget_simple_extent_ndims(space) == 1) {
    const hssize_t rows = H5Sget_simple_extent_npoints(space);
    if (rows > 0 && holds(visit, path, data, type, space, static_cast<double>(rows), 1))
      read_records(visit, path, data, type, static_cast<hsize_t>(rows));
    return;
  }
  if (!is_numeric(visit, path, kind, complex, matlab)) return;
  const int rank = H5Sget_simple_extent_ndims(space);
  hsize_t sizes[H5S_MAX_RANK] = {};
  if (rank < 0 || rank > 3 || H5Sget_simple_extent_dims(space, sizes, nullptr) < 0) {
    put(visit.out, fmt::format("'{}': {} dimensions (passed over)", path, rank), Piece::finding);
    return;
  }
  const double rows = rank > 0 ? static_cast<double>(sizes[0]) : 1,
               columns =
                   (rank > 1 ? static_cast<double>(sizes[1]) : 1) * (rank > 2 ? static_cast<double>(sizes[2]) : 1);
  if (!holds(visit, path, data, type, space, rows, columns)) return;
  if (rows * columns == 0 || H5Aexists(data, "MATLAB_empty") > 0) return;
  if (rank == 3) {
    read_cube(visit, path, data, type, complex, {sizes, sizes + 3}, !matlab.empty());
    return;
  }
  NamedArray array = array_head(data, path);
  hid_t from = H5S_ALL, into = H5S_ALL;
  const int axis = columns > rows ? 1 : 0;  // the longer side is the time
  if (visit.count > 0 && rank > 0 && sizes[axis] > 1) {
    if (visit.length == 0) visit.length = sizes[axis];
    if (sizes[axis] != visit.length) {
      visit.problem = fmt::format("dataset '{}' has {} samples, others {}: such a file cannot be read part by part",
                                  path, sizes[axis], visit.length);
      return;
    }
    if (visit.first >= visit.length) return;
    hsize_t start[2] = {0, 0};
    start[axis] = visit.first;
    sizes[axis] = std::min(visit.count, visit.length - visit.first);
    array.start += static_cast<double>(visit.first) * array.step;
    H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, sizes, nullptr);
    from = space;
  }
  const Id chosen(H5Screate_simple(rank, sizes, nullptr), H5Sclose);
  if (from != H5S_ALL) into = chosen;
  // Stored row by row: read as the transpose.
  const auto r = static_cast<Eigen::Index>(rank > 0 ? sizes[0] : 1),
             c = static_cast<Eigen::Index>(rank > 1 ? sizes[1] : 1);
  const auto read = [&](hid_t memory, Eigen::MatrixXd& to) {
    Eigen::MatrixXd transposed(c, r);
    if (H5Dread(data, memory, into, from, H5P_DEFAULT, transposed.data()) < 0) {
      visit.problem = unreadable(data, path);
      return;
    }
    to = transposed.transpose();
  };
  if (complex) {
    for (unsigned part : {0u, 1u}) {
      char* member = H5Tget_member_name(type, part);
      const Id memory(H5Tcreate(H5T_COMPOUND, sizeof(double)), H5Tclose);
      H5Tinsert(memory, member, 0, H5T_NATIVE_DOUBLE);
      H5free_memory(member);
      read(memory, part == 0 ? array.value : array.imaginary);
    }
  } else {
    read(H5T_NATIVE_DOUBLE, array.value);
  }
  if (visit.problem.empty()) put(visit.out, array);
}

herr_t visit_object(hid_t, const char* path, const H5O_info_t* info, void* user) {
  Visit& visit = *static_cast<Visit*>(user);
  if (std::string_view(path).starts_with("#refs#")) return 0;  // what MATLAB's cells point to
  if (info->type == H5O_TYPE_DATASET) {
    try {
      read_dataset(visit, path);
    } catch (const std::exception& e) {  // not through the C library
      visit.problem = e.what();
    }
  }
  return visit.problem.empty() ? 0 : 1;
}

}  // namespace

namespace {

/// The numeric arrays of the opened file, into the parcel.
void collect(hid_t file, Visit visit, std::string_view name, bool matlab) {
  visit.file = file;
  visit.out.text(matlab ? "MAT v7.3" : "HDF5");
  const herr_t status = H5Ovisit(file, H5_INDEX_NAME, H5_ITER_INC, visit_object, &visit);
  if (!visit.problem.empty()) throw Error::in_file(name, 0, visit.problem);
  if (status < 0) throw Error::in_file(name, 0, "the tree of groups is damaged");
  visit.out.value(Piece::end);
}

void collect_memory(std::string_view bytes, std::string_view name, ParcelWriter& out) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are ours to print
  const Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access, 1 << 16, false);
  H5Pset_file_image(access, const_cast<char*>(bytes.data()), bytes.size());
  const Id file(bytes.empty() ? hid_t{-1} : H5Fopen("memory", H5F_ACC_RDONLY, access), H5Fclose);
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
    const Id file(H5Fopen(kept.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
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
  const Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access, 1 << 20, false);
  const Id file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  if (file < 0) throw Error::in_file(path.string(), 0, "cannot be written");
  bool good = true;
  const Id plain(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(plain, false);  // the same record gives the same bytes
  for (const Channel& channel : recording.channels) {
    std::string name = channel.name;
    for (char& c : name) c = c == '/' ? '_' : c;
    const hsize_t size = static_cast<hsize_t>(channel.samples.size());
    const Id space(H5Screate_simple(1, &size, nullptr), H5Sclose), scalar(H5Screate(H5S_SCALAR), H5Sclose);
    const Id data(H5Dcreate2(file, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, plain, H5P_DEFAULT), H5Dclose);
    good = good && H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, channel.samples.data()) >= 0;
    const std::string unit(si_unit(channel.quantity));
    const Id text(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(text, unit.size() + 1);
    const Id attribute(H5Acreate2(data, "unit", text, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    good = good && H5Awrite(attribute, text, unit.c_str()) >= 0;
    for (const auto& [key, value] : {std::pair{"dt", recording.dt}, {"t0", recording.t0}}) {
      const Id number(H5Acreate2(data, key, H5T_IEEE_F64LE, scalar, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
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
