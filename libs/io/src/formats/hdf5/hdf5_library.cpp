#include "formats/hdf5/hdf5_library.hpp"

#include <fmt/format.h>

#include <cmath>

namespace whirl::io {
namespace {

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

}  // namespace

std::string text_attribute(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return {};
  const Hdf5Id attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Hdf5Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  if (H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1) return {};
  if (H5Tis_variable_str(type) > 0) {
    char* text = nullptr;
    const Hdf5Id memory(H5Tcopy(H5T_C_S1), H5Tclose);
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
  const Hdf5Id attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Hdf5Id type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  const H5T_class_t kind = H5Tget_class(type);
  double value = 0;
  if ((kind != H5T_FLOAT && kind != H5T_INTEGER) || H5Sget_simple_extent_npoints(space) != 1) return 0;
  return H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0 || !std::isfinite(value) ? 0 : value;
}

bool is_number(hid_t type, unsigned part) {
  const Hdf5Id member(H5Tget_member_type(type, part), H5Tclose);
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

bool is_complex(hid_t type, H5T_class_t kind) {
  if (kind != H5T_COMPOUND || H5Tget_nmembers(type) != 2) return false;
  const std::string first = member_name(type, 0), second = member_name(type, 1);
  const auto begins = [](const std::string& s, char lower) {
    return !s.empty() && (s[0] == lower || s[0] == lower - 'a' + 'A');
  };
  if (!begins(first, 'r') || !begins(second, 'i')) return false;
  for (const unsigned part : {0U, 1U}) {
    const Hdf5Id member(H5Tget_member_type(type, part), H5Tclose);
    if (H5Tget_class(member) != H5T_FLOAT || !is_number(type, part)) return false;
  }
  return true;
}

Hdf5Id double_member(const std::string& name) {
  Hdf5Id memory(H5Tcreate(H5T_COMPOUND, sizeof(double)), H5Tclose);
  H5Tinsert(memory, name.c_str(), 0, H5T_NATIVE_DOUBLE);
  return memory;
}

std::string unreadable(hid_t data, const char* path) {
  const Hdf5Id created(H5Dget_create_plist(data), H5Pclose);
  const std::string filter = missing_filter(created);
  if (filter.empty()) return fmt::format("dataset '{}' cannot be read: damaged", path);
  return fmt::format(
      "dataset '{}' is packed by the filter {}, which is not installed here: write it with gzip or unpacked", path,
      filter);
}

std::string kept_elsewhere(hid_t data) {
  const Hdf5Id created(H5Dget_create_plist(data), H5Pclose);
  const char* what = H5Pget_external_count(created) > 0      ? "keeps its values in another file"
                     : H5Pget_layout(created) == H5D_VIRTUAL ? "is put together from other files"
                                                             : nullptr;
  return what == nullptr ? std::string() : fmt::format("{}: copy it into one file, e.g. with h5repack", what);
}

}  // namespace whirl::io
