#include "formats/hdf5/hdf5_dataset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "formats/arrays/bytes.hpp"
#include "formats/hdf5/hdf5_chunks.hpp"
#include "formats/hdf5/hdf5_library.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

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
  const Hdf5Id file(H5Iget_file_id(data), H5Fclose);
  for (std::string group = array.group; array.step <= 0; group.resize(group.find_last_of('/') + 1)) {
    while (group.ends_with('/')) group.pop_back();
    const Hdf5Id parent(H5Oopen(file, group.empty() ? "/" : group.c_str(), H5P_DEFAULT), H5Oclose);
    if (parent >= 0) array.step = step_attribute(parent);
    if (parent >= 0 && array.step > 0) array.start = number_attribute(parent, "t0");
    if (group.empty()) break;
  }
  return array;
}

void put_rounding(Hdf5Visit& visit, const std::string& name, hid_t type, const Eigen::MatrixXd& values) {
  if (H5Tget_class(type) != H5T_INTEGER || H5Tget_size(type) < 8) return;
  if (const std::string rounded = rounding_of_integers(name, values); !rounded.empty())
    put(visit.out, rounded, Piece::finding);
}

/// Three dimensions, as frequency responses of several points to several references have. MATLAB's are reversed.
void read_cube(Hdf5Visit& visit, const char* path, hid_t data, hid_t type, bool complex, std::vector<std::size_t> shape,
               bool reversed) {
  const auto read = [&](hid_t memory) {
    Eigen::VectorXd flat(static_cast<Eigen::Index>(shape[0] * shape[1] * shape[2]));
    if (H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, flat.data()) < 0) visit.problem = unreadable(data, path);
    return flat;
  };
  const auto member = [&](unsigned part) { return read(double_member(member_name(type, part))); };
  NamedArray array = array_head(data, path);
  const Eigen::VectorXd real = complex ? member(0) : read(H5T_NATIVE_DOUBLE);
  const Eigen::VectorXd imaginary = complex ? member(1) : Eigen::VectorXd();
  if (reversed) std::reverse(shape.begin(), shape.end());
  put_rounding(visit, path, type, real);
  set_values(array, real, imaginary, shape, reversed);
  if (visit.problem.empty()) put(visit.out, array);
}

/// Whether a dataset holds numbers; what else it is goes into the contents.
bool is_numeric(Hdf5Visit& visit, const char* path, H5T_class_t kind, bool complex, const std::string& matlab) {
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

/// A table of records, as PyTables and h5py write structured arrays: its fields are arrays of a group of its name.
void read_records(Hdf5Visit& visit, const char* path, hid_t data, hid_t type, hsize_t rows) {
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
    array.value.resize(static_cast<Eigen::Index>(rows), 1);
    if (H5Dread(data, double_member(name), H5S_ALL, H5S_ALL, H5P_DEFAULT, array.value.data()) < 0) {
      visit.problem = unreadable(data, path);
      return;
    }
    const Hdf5Id field(H5Tget_member_type(type, static_cast<unsigned>(part)), H5Tclose);
    put_rounding(visit, name, field, array.value);
    put(visit.out, array);
  }
}

/// What is stored of the dataset can be as many values as it says; else `visit.problem` says so.
bool holds(Hdf5Visit& visit, const char* path, hid_t data, hid_t type, hid_t space, double rows, double columns) {
  const double stored = static_cast<double>(std::min<hsize_t>(H5Dget_storage_size(data), visit.bytes));
  const Hdf5Id created(H5Dget_create_plist(data), H5Pclose);
  const bool chunked = H5Pget_layout(created) == H5D_CHUNKED;
  // No more than what is stored can be unpacked into: deflate gains a factor of 1032 at most.
  const double most = chunked ? 1100 * stored : stored;
  if (rows * columns * static_cast<double>(H5Tget_size(type)) > most || rows * columns > 1e9) {
    visit.problem =
        fmt::format("dataset '{}': {:g} x {:g} values do not fit into {:g} bytes", path, rows, columns, stored);
  } else if (chunked && visit.first == 0 && rows * columns > 0 &&
             !chunks_are_whole(data, created, type, space, visit.bytes)) {
    visit.problem = fmt::format("dataset '{}' cannot be read: a part of it is shorter than it says", path);
  }
  return visit.problem.empty();
}

}  // namespace

void read_dataset(Hdf5Visit& visit, const char* path) {
  const Hdf5Id data(H5Dopen2(visit.file, path, H5P_DEFAULT), H5Dclose);
  if (data < 0) {
    visit.problem = fmt::format("dataset '{}' cannot be opened", path);
    return;
  }
  if (const std::string why = kept_elsewhere(data); !why.empty()) {
    visit.problem = fmt::format("dataset '{}' {}", path, why);
    return;
  }
  const Hdf5Id type(H5Dget_type(data), H5Tclose), space(H5Dget_space(data), H5Sclose);
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
  const Hdf5Id chosen(H5Screate_simple(rank, sizes, nullptr), H5Sclose);
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
      read(double_member(member_name(type, part)), part == 0 ? array.value : array.imaginary);
    }
  } else {
    read(H5T_NATIVE_DOUBLE, array.value);
    put_rounding(visit, path, type, array.value);
  }
  if (visit.problem.empty()) put(visit.out, array);
}

}  // namespace whirl::io
