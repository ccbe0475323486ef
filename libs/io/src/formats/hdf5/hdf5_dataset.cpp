#include "formats/hdf5/hdf5_dataset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
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

/// Remembers that these are integers whose last digits may be lost.
void mark_integers(NamedArray& array, const std::string& name, hid_t type) {
  if (H5Tget_class(type) == H5T_INTEGER && H5Tget_size(type) >= 8) array.integers = name;
}

/// The rows of a dataset that are to be read.
struct Hdf5Rows {
  int axis = 0;  ///< along the time
  bool chosen = false;
  hsize_t first = 0, count = 0;
};

/// Those of a dataset of these sizes; none where it is measured only, or no channel of the record: then nothing more is
/// to be read of it.
std::optional<Hdf5Rows> rows_wanted(Hdf5Visit& visit, const char* path, int rank, const hsize_t* sizes) {
  constexpr hsize_t kFew = 65536;  // values beside a record
  Hdf5Rows rows{.axis = rank == 2 && sizes[1] > sizes[0] ? 1 : 0};
  hsize_t total = 1;
  for (int d = 0; d < rank; ++d) total *= sizes[d];
  if (visit.measures) {
    if (rank == 1 || rank == 2) visit.length = std::max(visit.length, sizes[rows.axis]);
    return {};
  }
  rows.count = rank > 0 ? sizes[rows.axis] : 1;
  if (visit.count == 0 || total <= 1) return rows;
  if (rank < 3 && sizes[rows.axis] == visit.length) {
    rows.chosen = true;
    rows.first = visit.first;
    rows.count = std::min(visit.count, visit.length - visit.first);
    return rows;
  }
  const std::string what = fmt::format("'{}' has {} values, the record {}", path, total, visit.length);
  if (total > kFew) {
    visit.problem = fmt::format("dataset {} samples: such a file cannot be read in parts, only whole", what);
  } else {
    put(visit.out, what + " samples: left out, as the file is read in parts", Piece::finding);
  }
  return {};
}

/// Selects the rows in the file; what they come into.
Hdf5Id select_rows(hid_t space, const Hdf5Rows& rows, int rank, const hsize_t* sizes) {
  hsize_t start[2] = {0, 0}, count[2] = {rank > 0 ? sizes[0] : 1, rank > 1 ? sizes[1] : 1};
  start[rows.axis] = rows.first;
  count[rows.axis] = rows.count;
  if (rank > 0) H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, count, nullptr);
  return {H5Screate_simple(rank, count, nullptr), H5Sclose};
}

/// Where the rows stand in the whole of a vector.
PartOfAxis ends_of(hid_t data, hid_t space, const Hdf5Rows& rows, int rank, const hsize_t* sizes) {
  const auto number = [&](hsize_t row) {
    double value = 0;
    const Hdf5Id one = select_rows(space, {rows.axis, true, row, 1}, rank, sizes);
    if (H5Dread(data, H5T_NATIVE_DOUBLE, one, space, H5P_DEFAULT, &value) < 0) value = NAN;
    return value;
  };
  const hsize_t n = sizes[rows.axis];
  return {static_cast<Eigen::Index>(rows.first), static_cast<Eigen::Index>(n), number(0), number(n - 1)};
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
  mark_integers(array, path, type);
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
void read_records(Hdf5Visit& visit, const char* path, hid_t data, hid_t type, hid_t space, const Hdf5Rows& rows,
                  hsize_t length) {
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
    array.value.resize(static_cast<Eigen::Index>(rows.count), 1);
    const Hdf5Id memory = double_member(name);
    const auto read = [&](hsize_t first, hsize_t count, double* to) {
      const Hdf5Id into = select_rows(space, {0, true, first, count}, 1, &length);
      if (H5Dread(data, memory, into, space, H5P_DEFAULT, to) < 0) visit.problem = unreadable(data, path);
    };
    read(rows.first, rows.count, array.value.data());
    if (rows.chosen) {
      array.part = {static_cast<Eigen::Index>(rows.first), static_cast<Eigen::Index>(length)};
      read(0, 1, &array.part->head);
      read(length - 1, 1, &array.part->tail);
    }
    if (!visit.problem.empty()) return;
    const Hdf5Id field(H5Tget_member_type(type, static_cast<unsigned>(part)), H5Tclose);
    mark_integers(array, name, field);
    put(visit.out, array);
  }
}

double chunk_bytes(hid_t created, hid_t type) {
  hsize_t side[H5S_MAX_RANK] = {};
  double bytes = static_cast<double>(H5Tget_size(type));
  const int rank = H5Pget_chunk(created, H5S_MAX_RANK, side);
  for (int k = 0; k < rank; ++k) bytes *= static_cast<double>(side[k]);
  return bytes;
}

/// What is stored of the dataset can be as many values as it says; else `visit.problem` says so.
bool holds(Hdf5Visit& visit, const char* path, hid_t data, hid_t type, hid_t space, double rows, double columns,
           const Hdf5Rows& wanted) {
  constexpr double kMostChunk = 1 << 26;  // bytes, of a file that is read in parts: a chunk is unpacked whole
  const double stored = static_cast<double>(std::min<hsize_t>(H5Dget_storage_size(data), visit.bytes));
  const Hdf5Id created(H5Dget_create_plist(data), H5Pclose);
  const bool chunked = H5Pget_layout(created) == H5D_CHUNKED;
  // No more than what is stored can be unpacked into: deflate gains a factor of 1032 at most.
  const double most = chunked ? 1100 * stored : stored;
  if (rows * columns * static_cast<double>(H5Tget_size(type)) > most || (!wanted.chosen && rows * columns > 1e9)) {
    visit.problem =
        fmt::format("dataset '{}': {:g} x {:g} values do not fit into {:g} bytes", path, rows, columns, stored);
  } else if (const double chunk = chunked && wanted.chosen ? chunk_bytes(created, type) : 0; chunk > kMostChunk) {
    visit.problem =
        fmt::format("dataset '{}' is packed in chunks of {:g} bytes: it cannot be read in parts", path, chunk);
  } else if (chunked && rows * columns > 0 &&
             !chunks_are_whole(data, created, type, space, visit.bytes, wanted.axis, wanted.first,
                               wanted.first + wanted.count)) {
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
  const int rank = H5Sget_simple_extent_ndims(space);
  hsize_t sizes[H5S_MAX_RANK] = {};
  const bool sized = rank >= 0 && rank <= 3 && H5Sget_simple_extent_dims(space, sizes, nullptr) >= 0;
  if (kind == H5T_COMPOUND && !complex && rank == 1 && sized) {
    const std::optional<Hdf5Rows> rows = sizes[0] > 0 ? rows_wanted(visit, path, rank, sizes) : std::nullopt;
    if (rows && holds(visit, path, data, type, space, static_cast<double>(sizes[0]), 1, *rows))
      read_records(visit, path, data, type, space, *rows, sizes[0]);
    return;
  }
  if (!is_numeric(visit, path, kind, complex, matlab)) return;
  if (!sized) {
    put(visit.out, fmt::format("'{}': {} dimensions (passed over)", path, rank), Piece::finding);
    return;
  }
  const double rows = rank > 0 ? static_cast<double>(sizes[0]) : 1,
               columns =
                   (rank > 1 ? static_cast<double>(sizes[1]) : 1) * (rank > 2 ? static_cast<double>(sizes[2]) : 1);
  const bool empty = rows * columns == 0 || H5Aexists(data, "MATLAB_empty") > 0;
  const std::optional<Hdf5Rows> wanted = empty ? Hdf5Rows{} : rows_wanted(visit, path, rank, sizes);
  if (!wanted || !holds(visit, path, data, type, space, rows, columns, *wanted) || empty) return;
  if (rank == 3) return read_cube(visit, path, data, type, complex, {sizes, sizes + 3}, !matlab.empty());
  NamedArray array = array_head(data, path);
  mark_integers(array, path, type);
  if (wanted->chosen && rows * columns == static_cast<double>(visit.length))
    array.part = ends_of(data, space, *wanted, rank, sizes);
  else if (wanted->chosen)
    array.part = PartOfAxis{static_cast<Eigen::Index>(wanted->first), static_cast<Eigen::Index>(visit.length)};
  const Hdf5Id into = select_rows(space, *wanted, rank, sizes);
  if (rank > 0) sizes[wanted->axis] = wanted->count;
  // Stored row by row: read as the transpose. Of a part the rows are the samples.
  const auto r = static_cast<Eigen::Index>(rank > 0 ? sizes[0] : 1),
             c = static_cast<Eigen::Index>(rank > 1 ? sizes[1] : 1);
  const auto read = [&](hid_t memory, Eigen::MatrixXd& to) {
    Eigen::MatrixXd transposed(c, r);
    if (H5Dread(data, memory, into, space, H5P_DEFAULT, transposed.data()) < 0) {
      visit.problem = unreadable(data, path);
      return;
    }
    to = wanted->chosen && wanted->axis == 1 ? transposed : Eigen::MatrixXd(transposed.transpose());
  };
  if (complex) {
    for (unsigned part : {0u, 1u}) {
      read(double_member(member_name(type, part)), part == 0 ? array.value : array.imaginary);
    }
  } else {
    read(H5T_NATIVE_DOUBLE, array.value);
  }
  if (visit.problem.empty()) put(visit.out, array);
}

}  // namespace whirl::io
