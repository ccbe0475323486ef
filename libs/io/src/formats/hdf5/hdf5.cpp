// HDF5 and MAT v7.3 (which is HDF5 with the dimensions reversed) by the HDF5 library.
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>

#include "formats/arrays/arrays.hpp"
#include "formats/format.hpp"
#include "formats/hdf5/hdf5_dataset.hpp"
#include "formats/hdf5/hdf5_length.hpp"
#include "formats/hdf5/hdf5_library.hpp"
#include "formats/hdf5/hdf5_write.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/input.hpp"

namespace whirl::io {
namespace {

/// The numeric arrays of the opened file, into the parcel.
void collect(hid_t file, Hdf5Visit& visit, std::string_view name, bool matlab) {
  visit.file = file;
  visit.out.text(matlab ? "MAT v7.3" : "HDF5");
  const bool whole = walk(visit);
  if (!visit.problem.empty()) throw Error::in_file(name, 0, visit.problem);
  if (!whole) throw Error::in_file(name, 0, "the tree of groups is damaged");
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
  Hdf5Visit visit{.file = -1, .bytes = bytes.size(), .out = out};
  collect(file, visit, name, bytes.starts_with("MATLAB 7.3"));
  out.value(Piece::end);
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

namespace {

class Hdf5RowReader : public RowReader {
 public:
  explicit Hdf5RowReader(const std::filesystem::path& path) : name_(path.string()), kept_(input_path(path)) {
    std::error_code none;
    const std::uintmax_t size = std::filesystem::file_size(kept_, none);
    bytes_ = none ? 0 : size;
    refuse_cut_hdf5(kept_, name_);
    read_apart(
        name_, bytes_,
        [&](ParcelWriter& out) {
          Hdf5Visit visit{.file = -1, .bytes = bytes_, .out = out, .measures = true};
          walk_file(visit);
          out.value(Piece::end);
          out.value(visit.length);
        },
        [&](ParcelReader& in) {
          in.text();
          while (in.value<Piece>() != Piece::end) in.text();
          rows_ = static_cast<Eigen::Index>(in.value<hsize_t>());
        });
  }
  std::string name() const override { return name_; }
  Eigen::Index rows() const override { return rows_; }
  SignalFile read(Eigen::Index first, Eigen::Index count) override {
    return read_by(name_, bytes_, [&](ParcelWriter& out) {
      Hdf5Visit visit{.file = -1,
                      .bytes = bytes_,
                      .out = out,
                      .first = static_cast<hsize_t>(first),
                      .count = static_cast<hsize_t>(count),
                      .length = static_cast<hsize_t>(rows_)};
      walk_file(visit);
      out.value(Piece::end);
    });
  }

 private:
  void walk_file(Hdf5Visit& visit) const {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    const Hdf5Id file(H5Fopen(kept_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (file < 0) throw Error::in_file(name_, 0, "is no HDF5 file, or damaged or cut off");
    const Hdf5Id created(H5Fget_create_plist(file), H5Pclose);
    hsize_t block = 0;  // before the file of the library: MATLAB's header
    H5Pget_userblock(created, &block);
    collect(file, visit, name_, block > 0);
  }

  std::string name_;
  std::filesystem::path kept_;
  std::size_t bytes_ = 0;
  Eigen::Index rows_ = 0;
};

}  // namespace

SignalFile read_hdf5_rows(const std::filesystem::path& path, Eigen::Index first, Eigen::Index count) {
  Hdf5RowReader reader(path);
  if (first + 1 >= reader.rows()) return {.source = path.string()};
  SignalFile file = reader.read(first, std::min(count, reader.rows() - first));
  for (SignalTable& table : file.tables) table.start += static_cast<double>(first) * table.step;
  tell_rounding(file);
  return file;
}

SignalFile parse_hdf5(std::string_view bytes, std::string_view name) {
  refuse_cut_hdf5(bytes, name);
  SignalFile file =
      read_by(std::string(name), bytes.size(), [&](ParcelWriter& out) { collect_memory(bytes, name, out); });
  tell_rounding(file);
  return file;
}

namespace {

SignalFile read_whole(const std::filesystem::path& path, const ResponseOptions* wanted) {
  const std::filesystem::path kept = input_path(path);
  const std::string name = path.string();
  refuse_cut_hdf5(kept, name);
  SignalFile file = read_by(
      name, std::filesystem::file_size(kept), [&](ParcelWriter& out) { collect_memory(read_text(kept), name, out); },
      wanted);
  tell_rounding(file);
  return file;
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
  f.missing = "NaN";
  f.write_parts = write_hdf5_parts;
  f.stream = [](const std::filesystem::path& path, const CsvOptions&, const PartRows& rows) {
    return stream_rows(std::make_unique<Hdf5RowReader>(path), rows);
  };
  f.read_responses = [](const std::filesystem::path& path, const ResponseOptions& options) {
    return responses_of(read_whole(path, &options), options);
  };
  return f;
}

}  // namespace whirl::io
