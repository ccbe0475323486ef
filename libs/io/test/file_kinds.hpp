#pragma once
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

#include "whirl/core/recording.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/testing/records/foreign_files.hpp"

/// One record in every kind of file that is read: formats, and the ways in which other programs write them.
namespace whirl::testing {

struct FileKind {
  std::string name;  ///< of the file, which says the format by its ending
  std::string bytes;
  bool plain_lines = false;  ///< text in which nothing says how many lines there are
};

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A table of text. `row` makes a line of the time and two values.
inline std::string text_table(const Recording& r, const std::string& header, const std::string& end,
                              const std::function<std::string(double, double, double)>& row) {
  std::string out = header.empty() ? "" : header + end;
  for (Eigen::Index i = 0; i < r.size(); ++i)
    out += row(r.t0 + r.dt * static_cast<double>(i), r.channels[0].samples[i], r.channels[1].samples[i]) + end;
  return out;
}

inline std::vector<FileKind> text_kinds(const Recording& r) {
  const auto between = [](const char* delimiter, bool comma = false, const char* last = "") {
    return [=](double t, double x, double y) {
      std::string line = fmt::format("{:.6f}{}{:.9e}{}{:.9e}", t, delimiter, x, delimiter, y);
      if (comma) std::replace(line.begin(), line.end(), '.', ',');
      return line + last;
    };
  };
  const auto stamp = [](double t, double x, double y) {
    return fmt::format("2024-03-01 10:00:{:09.6f};{:.9e};{:.9e}", t, x, y);
  };
  return {
      {"comma.csv", text_table(r, "t_s,x_m,y_m", "\n", between(",")), true},
      {"semicolon.csv", text_table(r, "t_s;x_m;y_m", "\n", between(";", true)), true},
      {"tab.tsv", text_table(r, "t_s\tx_m\ty_m", "\n", between("\t")), true},
      {"windows.csv", text_table(r, "t_s,x_m,y_m", "\r\n", between(",")), true},
      {"mark.csv", "\xEF\xBB\xBF" + text_table(r, "t_s,x_m,y_m", "\n", between(",")), true},
      {"trailing.csv", text_table(r, "t_s;x_m;y_m;", "\n", between(";", false, ";")), true},
      {"units.csv", text_table(r, "Time;x;y\ns;m;m", "\n", between(";")), true},
      {"brackets.csv", text_table(r, "\"Time [s]\",\"x [m]\",\"y [m]\"", "\n", between(",")), true},
      {"blanks.txt", text_table(r, "t_s x_m y_m", "\n", between(" ")), true},
      {"stamps.csv", text_table(r, "Time;x [m];y [m]", "\n", stamp), true},
      {"sheet.csv", "sep=;\n" + text_table(r, "t_s;x_m;y_m", "\n", between(";")), true},
  };
}

inline std::string wav_bytes(const Recording& r, const std::string& riff, bool wide, int bits) {
  const bool big = riff == "RIFX";
  const auto rate = static_cast<std::uint32_t>(std::lround(1 / r.dt));
  const auto width = static_cast<std::uint16_t>(2 * bits / 8);
  Bytes data(big), format(big), sizes(big), all(big);
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    for (const std::size_t c : {0U, 1U}) {
      const double v = r.channels[c].samples[i];
      bits == 16 ? data.put(static_cast<std::int16_t>(v * 30000)) : data.put(static_cast<float>(v));
    }
  }
  format.put<std::uint16_t>(bits == 16 ? 1 : 3).put<std::uint16_t>(2).put(rate).put(rate * width);
  format.put(width).put(static_cast<std::uint16_t>(bits));
  sizes.text("ds64").put<std::uint32_t>(28).put<std::uint64_t>(data.str().size() + 72);
  sizes.put<std::uint64_t>(data.str().size()).put(static_cast<std::uint64_t>(r.size())).put<std::uint32_t>(0);
  all.text(riff).put(wide ? 0xFFFFFFFFU : static_cast<std::uint32_t>(36 + data.str().size())).text("WAVE");
  if (wide) all.text(sizes.str());
  all.text("fmt ").put<std::uint32_t>(16).text(format.str()).text("data");
  all.put(wide ? 0xFFFFFFFFU : static_cast<std::uint32_t>(data.str().size())).text(data.str());
  return all.str();
}

/// Wave64: chunks named by GUIDs of 16 bytes, sizes of 64 bits that count the head of 24 bytes too.
inline std::string w64_bytes(const Recording& r) {
  const std::string tail = "\xF3\xAC\xD3\x11\x8C\xD1" + std::string("\x00\xC0\x4F\x8E\xDB\x8A", 6);
  const auto chunk = [&](const std::string& id, const std::string& body) {
    Bytes b;
    return b.text(id + tail).put<std::uint64_t>(24 + body.size()).text(body).str() +
           std::string((8 - body.size() % 8) % 8, '\0');
  };
  const auto rate = static_cast<std::uint32_t>(std::lround(1 / r.dt));
  Bytes data, format, all;
  for (Eigen::Index i = 0; i < r.size(); ++i)
    data.put(static_cast<float>(r.channels[0].samples[i])).put(static_cast<float>(r.channels[1].samples[i]));
  format.put<std::uint16_t>(3).put<std::uint16_t>(2).put(rate).put(rate * 8).put<std::uint16_t>(8).put<std::uint16_t>(
      32);
  const std::string body = chunk("fmt ", format.str()) + chunk("data", data.str());
  all.text("riff" + std::string("\x2E\x91\xCF\x11\xA5\xD6\x28\xDB\x04\xC1\x00\x00", 12));
  all.put<std::uint64_t>(40 + body.size()).text("wave" + tail).text(body);
  return all.str();
}

inline std::vector<FileKind> binary_kinds(const Recording& r) {
  const auto rows = static_cast<int>(r.size());
  const auto values = [](const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); };
  const std::vector<double> t = values(r.times()), x = values(r.channels[0].samples), y = values(r.channels[1].samples);
  const std::vector<TdmsChannel> channels = {{"x", "m", x}, {"y", "m", y}};
  const std::string time = mat5_double("t_s", {rows, 1}, t), motion = mat5_double("x_m", {rows, 1}, x);
  Bytes column, lines;
  for (const double v : x) column.put(v);
  for (std::size_t i = 0; i < x.size(); ++i) lines.put(t[i]).put(x[i]).put(y[i]);
  const std::string one = npy("'<f8'", fmt::format("({},)", rows), column.str());
  const auto packed = [](const std::string& variable) {
    std::string bytes(compressBound(variable.size()), '\0');
    uLongf size = bytes.size();
    compress(reinterpret_cast<Bytef*>(bytes.data()), &size, reinterpret_cast<const Bytef*>(variable.data()),
             variable.size());
    bytes.resize(size);
    return Bytes().put<std::uint32_t>(15).put(static_cast<std::uint32_t>(size)).text(bytes).str();
  };
  return {
      {"chunks.tdms", tdms(channels, r.dt)},
      {"segments.tdms", tdms(channels, r.dt, 4)},
      {"rows.tdms", tdms(channels, r.dt, 1, true)},
      {"plain.mat", mat5_file(time + motion)},
      {"struct.mat",
       mat5_file(mat5_struct("run", {{"t_s", mat5_double("", {rows, 1}, t)}, {"x_m", mat5_double("", {rows, 1}, x)}}))},
      {"packed.mat", mat5_file(packed(time) + packed(motion))},
      {"v4.mat", mat4_matrix("x_m", rows, 1, x)},
      {"v4_big.mat", mat4_matrix("x_m", rows, 1, x, {}, true)},
      {"x_m.npy", one},
      {"fields.npy", npy("[('t_s', '<f8'), ('x_m', '<f8'), ('y_m', '<f8')]", fmt::format("({},)", rows), lines.str())},
      {"stored.npz", zip({{"x_m.npy", one}, {"y_m.npy", one}}, false)},
      {"deflated.npz", zip({{"x_m.npy", one}, {"y_m.npy", one}}, true)},
      {"pcm.wav", wav_bytes(r, "RIFF", false, 16)},
      {"big.wav", wav_bytes(r, "RIFX", false, 16)},
      {"rf64.wav", wav_bytes(r, "RF64", true, 32)},
      {"bw64.wav", wav_bytes(r, "BW64", true, 32)},
      {"wave64.wav", w64_bytes(r)},
  };
}

/// A chunked and packed dataset, as h5py and MATLAB (behind its block of 512 bytes) write it.
inline std::string packed_hdf5(const Recording& r, const std::filesystem::path& path, bool matlab) {
  const hid_t created = H5Pcreate(H5P_FILE_CREATE), plist = H5Pcreate(H5P_DATASET_CREATE);
  if (matlab) H5Pset_userblock(created, 512);
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, created, H5P_DEFAULT);
  const hsize_t size = static_cast<hsize_t>(r.size()), side = 64;
  H5Pset_chunk(plist, 1, &side);
  H5Pset_deflate(plist, 4);
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  for (const Channel& c : r.channels) {
    const hid_t data =
        H5Dcreate2(file, (c.name + "_m").c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, plist, H5P_DEFAULT);
    H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, c.samples.data());
    H5Dclose(data);
  }
  H5Sclose(space), H5Fclose(file), H5Pclose(plist), H5Pclose(created);
  std::string bytes = file_bytes(path);
  if (matlab) bytes.replace(0, 30, "MATLAB 7.3 MAT-file, by a test");
  return bytes;
}

inline std::string atfx_text(const Recording& r) {
  std::string values;
  for (const double v : r.channels[0].samples) values += fmt::format("{:.9e} ", v);
  const auto attribute = [](const char* name, const char* base) {
    return fmt::format(
        "<application_attribute><name>{}</name><base_attribute>{}</base_attribute></application_attribute>", name,
        base);
  };
  return "<atfx_file><application_model><application_element><name>lc</name><basetype>AoLocalColumn</basetype>" +
         attribute("n", "name") + attribute("v", "values") +
         "</application_element></application_model><instance_data><lc><n>x</n><v><A_FLOAT64>" + values +
         "</A_FLOAT64></v></lc></instance_data></atfx_file>\n";
}

/// `folder`: for what writers leave on the way. The record has two displacements.
inline std::vector<FileKind> readable_kinds(const Recording& record, const std::filesystem::path& folder) {
  std::vector<FileKind> kinds = text_kinds(record);
  for (FileKind& kind : binary_kinds(record)) kinds.push_back(std::move(kind));
  for (const char* ending : {".csv.gz", ".h5", ".mat", ".npz", ".wav", ".lvm", ".lvm.gz", ".uff", ".uff.gz"}) {
    const std::string name = std::string("own") + ending;
    io::write_recording(folder / name, record);
    kinds.push_back({name, file_bytes(folder / name)});
  }
  kinds.push_back({"packed.h5", packed_hdf5(record, folder / "packed.h5", false)});
  kinds.push_back({"v73.mat", packed_hdf5(record, folder / "v73.mat", true)});
  kinds.push_back({"inline.atfx", atfx_text(record)});
  return kinds;
}

}  // namespace whirl::testing
