#pragma once
#include <hdf5.h>

#include <string>
#include <utility>

/// What every use of the HDF5 library needs: identifiers that close themselves, attributes, types of numbers.
namespace whirl::io {

/// An identifier of the library, closed at the end.
class Hdf5Id {
 public:
  Hdf5Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Hdf5Id() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Id(Hdf5Id&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Hdf5Id(const Hdf5Id&) = delete;
  Hdf5Id& operator=(const Hdf5Id&) = delete;
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// A text attribute of one value; empty without one.
std::string text_attribute(hid_t object, const char* name);
/// A finite number in an attribute of one value; 0 without one.
double number_attribute(hid_t object, const char* name);

/// Name of a field of a compound type.
std::string member_name(hid_t type, unsigned part);
/// A number that lies inside the compound (the library copies what a damaged one says).
bool is_number(hid_t type, unsigned part);
/// r and i, re and im, real and imag; other pairs are records of two fields.
bool is_complex(hid_t type, H5T_class_t kind);
/// A compound in memory with that field alone, as double.
Hdf5Id double_member(const std::string& name);

/// Why the library did not read a dataset.
std::string unreadable(hid_t data, const char* path);

/// Why the values of a dataset are not all in its own file (external storage, virtual dataset); empty: they are. Such a
/// dataset is not read: whoever made the file would choose which other file of this machine is.
std::string kept_elsewhere(hid_t data);

}  // namespace whirl::io
