#pragma once
#include <zlib.h>

#include <complex>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

/// Files as other programs write them, byte by byte after the published layouts; apart from the readers under test.
namespace whirl::testing {

/// Bytes in either order.
class Bytes {
 public:
  explicit Bytes(bool big = false) : big_(big) {}
  template <class T>
  Bytes& put(T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big_) {
      for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
    }
    text_.append(raw, sizeof(T));
    return *this;
  }
  Bytes& text(const std::string& s) {
    text_ += s;
    return *this;
  }
  const std::string& str() const { return text_; }

 private:
  bool big_;
  std::string text_;
};

// MAT v4 ------------------------------------------------------------------------------------------------------------

/// One matrix, column by column; `imaginary` empty for a real one.
inline std::string mat4_matrix(const std::string& name, int rows, int columns, const std::vector<double>& real,
                               const std::vector<double>& imaginary = {}, bool big = false) {
  Bytes b(big);
  b.put<std::int32_t>(big ? 1000 : 0).put<std::int32_t>(rows).put<std::int32_t>(columns);
  b.put<std::int32_t>(imaginary.empty() ? 0 : 1).put<std::int32_t>(static_cast<std::int32_t>(name.size() + 1));
  b.text(name).text(std::string(1, '\0'));
  for (const double v : real) b.put(v);
  for (const double v : imaginary) b.put(v);
  return b.str();
}

// MAT v5 ------------------------------------------------------------------------------------------------------------

inline std::string mat5_element(std::uint32_t type, const std::string& data) {
  Bytes b;
  b.put(type).put(static_cast<std::uint32_t>(data.size())).text(data);
  return b.str() + std::string((8 - data.size() % 8) % 8, '\0');
}

/// An array of a class (6 double, 2 structure, 1 cell, 4 text, 16 function handle) with its parts.
inline std::string mat5_array(unsigned kind, const std::string& name, const std::vector<int>& sizes,
                              const std::string& parts, bool complex = false) {
  Bytes flags, dimensions;
  flags.put<std::uint32_t>(kind | (complex ? 0x800u : 0u)).put<std::uint32_t>(0);
  for (const int n : sizes) dimensions.put<std::int32_t>(n);
  return mat5_element(14,
                      mat5_element(6, flags.str()) + mat5_element(5, dimensions.str()) + mat5_element(1, name) + parts);
}

inline std::string mat5_double(const std::string& name, const std::vector<int>& sizes, const std::vector<double>& real,
                               const std::vector<double>& imaginary = {}) {
  Bytes re, im;
  for (const double v : real) re.put(v);
  for (const double v : imaginary) im.put(v);
  return mat5_array(6, name, sizes, mat5_element(9, re.str()) + (imaginary.empty() ? "" : mat5_element(9, im.str())),
                    !imaginary.empty());
}

/// A 1 x 1 structure; `fields` are arrays without names.
inline std::string mat5_struct(const std::string& name,
                               const std::vector<std::pair<std::string, std::string>>& fields) {
  Bytes width;
  width.put<std::int32_t>(32);
  std::string names, values;
  for (const auto& [field, value] : fields) {
    names += field + std::string(32 - field.size(), '\0');
    values += value;
  }
  return mat5_array(2, name, {1, 1}, mat5_element(5, width.str()) + mat5_element(1, names) + values);
}

inline std::string mat5_file(const std::string& variables) {
  std::string head = "MATLAB 5.0 MAT-file, by a test";
  head.resize(124, ' ');
  Bytes end;
  end.put<std::uint16_t>(0x0100).put<std::uint16_t>(0x4D49);
  return head + end.str() + variables;
}

// NumPy -------------------------------------------------------------------------------------------------------------

inline std::string npy(const std::string& descr, const std::string& shape, const std::string& data,
                       bool fortran = false) {
  std::string header =
      "{'descr': " + descr + ", 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': " + shape + ", }";
  while ((header.size() + 11) % 64 != 0) header += ' ';
  header += '\n';
  Bytes b;
  b.text("\x93NUMPY").put<std::uint8_t>(1).put<std::uint8_t>(0).put(static_cast<std::uint16_t>(header.size()));
  return b.str() + header + data;
}

/// An archive as numpy.savez (stored) and numpy.savez_compressed (deflated) write it.
inline std::string zip(const std::vector<std::pair<std::string, std::string>>& members, bool deflated) {
  std::string out, directory;
  for (const auto& [name, data] : members) {
    std::string packed = data;
    if (deflated) {
      packed.resize(compressBound(data.size()));
      z_stream z{};
      deflateInit2(&z, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
      z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
      z.avail_in = static_cast<uInt>(data.size());
      z.next_out = reinterpret_cast<Bytef*>(packed.data());
      z.avail_out = static_cast<uInt>(packed.size());
      deflate(&z, Z_FINISH);
      packed.resize(z.total_out);
      deflateEnd(&z);
    }
    const auto crc = static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(data.data()), static_cast<uInt>(data.size())));
    const std::uint16_t method = deflated ? 8 : 0;
    const auto at = static_cast<std::uint32_t>(out.size());
    Bytes local, central;
    local.text("PK\x03\x04").put<std::uint16_t>(20).put<std::uint16_t>(0).put(method).put<std::uint32_t>(0);
    local.put(crc).put(static_cast<std::uint32_t>(packed.size())).put(static_cast<std::uint32_t>(data.size()));
    local.put(static_cast<std::uint16_t>(name.size())).put<std::uint16_t>(0).text(name).text(packed);
    out += local.str();
    central.text("PK\x01\x02").put<std::uint16_t>(20).put<std::uint16_t>(20).put<std::uint16_t>(0).put(method);
    central.put<std::uint32_t>(0).put(crc).put(static_cast<std::uint32_t>(packed.size()));
    central.put(static_cast<std::uint32_t>(data.size())).put(static_cast<std::uint16_t>(name.size()));
    central.put<std::uint16_t>(0).put<std::uint16_t>(0).put<std::uint16_t>(0).put<std::uint16_t>(0);
    central.put<std::uint32_t>(0).put(at).text(name);
    directory += central.str();
  }
  Bytes end;
  end.text("PK\x05\x06").put<std::uint16_t>(0).put<std::uint16_t>(0);
  end.put(static_cast<std::uint16_t>(members.size())).put(static_cast<std::uint16_t>(members.size()));
  end.put(static_cast<std::uint32_t>(directory.size())).put(static_cast<std::uint32_t>(out.size()));
  end.put<std::uint16_t>(0);
  return out + directory + end.str();
}

// TDMS --------------------------------------------------------------------------------------------------------------

struct TdmsChannel {
  std::string name, unit;
  std::vector<double> values;
};

/// Segments of one group of double channels with the waveform properties; the second and later segments repeat the
/// description ("same as before"). `cut` bytes are missing at the end, as when the writer was killed. The values of a
/// segment come in so many chunks.
inline std::string tdms(const std::vector<TdmsChannel>& channels, double step, int segments = 1,
                        bool interleaved = false, std::size_t cut = 0, int chunks = 1) {
  std::string file;
  const auto string_of = [](const std::string& s) {
    Bytes b;
    b.put(static_cast<std::uint32_t>(s.size())).text(s);
    return b.str();
  };
  const std::size_t each = channels.front().values.size() / static_cast<std::size_t>(segments);
  for (int segment = 0; segment < segments; ++segment) {
    Bytes meta, raw;
    meta.put(static_cast<std::uint32_t>(channels.size()));
    for (const TdmsChannel& c : channels) {
      meta.text(string_of("/'Untitled'/'" + c.name + "'"));
      if (segment == 0) {
        meta.put<std::uint32_t>(20).put<std::uint32_t>(10).put<std::uint32_t>(1);
        meta.put(static_cast<std::uint64_t>(each) / static_cast<std::uint64_t>(chunks));
        meta.put<std::uint32_t>(3);
        meta.text(string_of("wf_increment")).put<std::uint32_t>(10).put(step);
        meta.text(string_of("wf_start_offset")).put<std::uint32_t>(10).put(0.0);
        meta.text(string_of("unit_string")).put<std::uint32_t>(0x20).text(string_of(c.unit));
      } else {
        meta.put<std::uint32_t>(0).put<std::uint32_t>(0);
      }
    }
    const std::size_t first = static_cast<std::size_t>(segment) * each;
    if (interleaved) {
      for (std::size_t i = 0; i < each; ++i) {
        for (const TdmsChannel& c : channels) raw.put(c.values[first + i]);
      }
    } else {
      const std::size_t own = each / static_cast<std::size_t>(chunks);
      for (std::size_t begin = first; begin + own <= first + each; begin += own) {
        for (const TdmsChannel& c : channels) {
          for (std::size_t i = 0; i < own; ++i) raw.put(c.values[begin + i]);
        }
      }
    }
    Bytes lead;
    lead.text("TDSm").put<std::uint32_t>(2u | 8u | (segment == 0 ? 4u : 0u) | (interleaved ? 32u : 0u));
    lead.put<std::uint32_t>(4713).put<std::uint64_t>(meta.str().size() + raw.str().size());
    lead.put<std::uint64_t>(meta.str().size());
    file += lead.str() + meta.str() + raw.str();
  }
  file.resize(file.size() - cut);
  return file;
}

}  // namespace whirl::testing
