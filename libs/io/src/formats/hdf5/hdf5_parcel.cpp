#include "formats/hdf5/hdf5_parcel.hpp"

#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

void put(ParcelWriter& out, const Eigen::MatrixXd& m) {
  out.value(m.rows());
  out.values(std::span(m.data(), static_cast<std::size_t>(m.size())));
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

}  // namespace

void put(ParcelWriter& out, const NamedArray& a) {
  out.value(Piece::array);
  for (const std::string& text : {a.group, a.name, a.unit}) out.text(text);
  put(out, a.value);
  put(out, a.imaginary);
  for (const Eigen::Index n : a.sizes) out.value(n);
  out.value(a.step);
  out.value(a.start);
  out.text(a.integers);
  out.value(a.part.has_value());
  out.value(a.part.value_or(PartOfAxis{}));
}
void put(ParcelWriter& out, const std::string& text, Piece piece) {
  out.value(piece);
  out.text(text);
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
  a.integers = in.text();
  const bool is_part = in.value<char>() != 0;
  const auto part = in.value<PartOfAxis>();
  if (is_part) a.part = part;
  return a;
}

}  // namespace whirl::io
