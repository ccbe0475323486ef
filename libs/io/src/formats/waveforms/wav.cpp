// WAV by libsndfile. Values are parts of full scale: a WAV file knows no unit unless its comment names the channels as
// ours do.
#include <fmt/format.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "formats/arrays/bytes.hpp"
#include "formats/format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {
namespace {

constexpr std::string_view kComment = "channels: ";

/// A file in memory for libsndfile.
struct Memory {
  std::string_view in;
  std::string out;
  sf_count_t at = 0;

  sf_count_t size() const { return static_cast<sf_count_t>(in.empty() ? out.size() : in.size()); }
};

SF_VIRTUAL_IO virtual_io() {
  SF_VIRTUAL_IO io{};
  io.get_filelen = [](void* user) { return static_cast<Memory*>(user)->size(); };
  io.seek = [](sf_count_t offset, int whence, void* user) {
    Memory& m = *static_cast<Memory*>(user);
    const sf_count_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? m.at : m.size();
    return m.at = std::clamp<sf_count_t>(from + offset, 0, m.size());
  };
  io.read = [](void* to, sf_count_t count, void* user) {
    Memory& m = *static_cast<Memory*>(user);
    const sf_count_t n = std::clamp<sf_count_t>(count, 0, m.size() - m.at);
    std::memcpy(to, m.in.data() + m.at, static_cast<std::size_t>(n));
    m.at += n;
    return n;
  };
  io.write = [](const void* from, sf_count_t count, void* user) {
    Memory& m = *static_cast<Memory*>(user);
    if (m.at + count > static_cast<sf_count_t>(m.out.size())) m.out.resize(static_cast<std::size_t>(m.at + count));
    std::memcpy(m.out.data() + m.at, from, static_cast<std::size_t>(count));
    m.at += count;
    return count;
  };
  io.tell = [](void* user) { return static_cast<Memory*>(user)->at; };
  return io;
}

using Handle = std::unique_ptr<SNDFILE, int (*)(SNDFILE*)>;

// Where the size of an empty `data` chunk stands that something follows which is no chunk: the samples of a writer that
// did not come to its end. 0: no such place.
std::size_t unfinished_data(std::string_view bytes, bool big) {
  for (std::size_t at = 12; at + 8 <= bytes.size();) {
    const std::size_t size = number_at<std::uint32_t>(bytes, at + 4, big);
    if (bytes.substr(at, 4) == "data") {
      const std::string_view rest = bytes.substr(at + 8);
      if (size != 0 || rest.size() < 8) return 0;
      const bool chunk = std::all_of(rest.begin(), rest.begin() + 4, [](char c) { return c >= ' ' && c <= 'z'; }) &&
                         number_at<std::uint32_t>(rest, 4, big) <= rest.size() - 8;
      return chunk ? 0 : at + 4;
    }
    if (size > bytes.size() - at - 8) return 0;
    at += 8 + size + size % 2;
  }
  return 0;
}

/// What the chunks before the samples state.
struct Stated {
  unsigned channels = 0, rate = 0, frame_bytes = 0;
  std::size_t fmt_at = 0;               ///< 0: no chunk `fmt `
  std::uint64_t data = 0, present = 0;  ///< bytes of samples; those that the file holds
  bool unknown = false;                 ///< the writer did not know their number when it began
};

Stated stated_of(std::string_view bytes, bool big) {
  Stated s;
  std::uint64_t wide = 0;  // size of the data of RF64, whose chunk says 0xFFFFFFFF
  for (std::size_t at = 12; at + 8 <= bytes.size();) {
    const std::string_view id = bytes.substr(at, 4), body = bytes.substr(at + 8);
    const std::size_t size = number_at<std::uint32_t>(bytes, at + 4, big);
    if (id == "ds64" && body.size() >= 16) wide = number_at<std::uint64_t>(body, 8, big);
    if (id == "fmt " && body.size() >= 14) {
      s.fmt_at = at;
      s.channels = number_at<std::uint16_t>(body, 2, big);
      s.rate = number_at<std::uint32_t>(body, 4, big);
      s.frame_bytes = number_at<std::uint16_t>(body, 12, big);
    }
    if (id == "data") {
      s.data = size == 0xFFFFFFFF ? wide : size;
      s.present = std::min<std::uint64_t>(s.data, body.size());
      s.unknown = size == 0xFFFFFFFF && wide == 0;
      break;
    }
    if (size > body.size()) break;
    at += 8 + size + size % 2;
  }
  return s;
}

/// Channels and rate: libsndfile refuses a 0 without a name.
void check_stated(const Stated& s, std::string_view name) {
  const auto refuse = [&](const char* field, std::size_t place, unsigned value, const char* allowed) {
    return Error::in_file(name, 0, fmt::format("byte {}: {} = {}: must be {}", place, field, value, allowed));
  };
  if (s.fmt_at == 0) return;
  if (s.channels < 1 || s.channels > 1024) throw refuse("channels", s.fmt_at + 10, s.channels, "1 to 1024");
  if (s.rate < 1) throw refuse("sample rate", s.fmt_at + 12, s.rate, "1 Hz or more");
}

/// The sentence about a file that ends before the samples it states; empty: it does not.
std::string cut_off(const Stated& s) {
  if (s.unknown || s.present >= s.data) return {};
  const std::uint64_t frame = std::max(1U, s.frame_bytes), stated = s.data / frame, present = s.present / frame;
  return fmt::format("cut off: its header states {} samples, {} are present, {} are missing", stated, present,
                     stated - present);
}

}  // namespace

SignalFile parse_wav(std::string_view bytes, std::string_view name) {
  const auto fail = [&](const std::string& message) { return Error::in_file(name, 0, message); };
  if (bytes.size() < 44) throw fail(fmt::format("byte {}: file ends inside the WAV header", bytes.size()));
  const std::string_view riff = bytes.substr(0, 4);
  if ((riff != "RIFF" && riff != "RIFX" && riff != "RF64" && riff != "BW64") || bytes.substr(8, 4) != "WAVE")
    throw fail("byte 0: not a WAV file");
  const Stated stated = stated_of(bytes, riff == "RIFX");
  check_stated(stated, name);
  const std::size_t unfinished = unfinished_data(bytes, riff == "RIFX");
  std::string mended;
  if (riff == "BW64" || unfinished > 0) {
    mended = bytes;
    if (riff == "BW64") mended.replace(0, 4, "RF64");  // the same layout by another name (ITU-R BS.2088)
    const auto size = static_cast<std::uint32_t>(std::min<std::size_t>(bytes.size() - unfinished - 4, 0xFFFFFFFE));
    for (std::size_t i = 0; i < 4 && unfinished > 0; ++i)
      mended[unfinished + (riff == "RIFX" ? 3 - i : i)] = static_cast<char>(size >> (8 * i) & 0xFF);
    bytes = mended;
  }
  Memory memory{bytes, {}, 0};
  SF_VIRTUAL_IO io = virtual_io();
  SF_INFO info{};
  const Handle file(sf_open_virtual(&io, SFM_READ, &info, &memory), sf_close);
  if (file == nullptr) throw fail(fmt::format("byte {}: {}", memory.at, sf_strerror(nullptr)));
  if (info.channels < 1 || info.channels > 1024 || info.samplerate < 1) {
    throw fail(fmt::format("{} channels at {} Hz: must be 1 to 1024 channels at 1 Hz or more", info.channels,
                           info.samplerate));
  }
  // Read until the data end: the count in the header may lie.
  const auto channels = static_cast<std::size_t>(info.channels);
  std::vector<double> values, block(channels * 4096);
  while (true) {
    const sf_count_t frames = sf_readf_double(file.get(), block.data(), 4096);
    if (frames <= 0) break;
    values.insert(values.end(), block.begin(), block.begin() + frames * info.channels);
  }
  if (values.empty()) throw fail("holds no samples");
  const auto rows = static_cast<Eigen::Index>(values.size() / channels);
  SignalFile result;
  result.source = name;
  result.format = "WAV";
  if (unfinished > 0)
    result.findings.push_back(
        fmt::format("its header states no samples, as of a writer that did not come to its end: {} were read", rows));
  if (std::string cut = unfinished > 0 ? "" : cut_off(stated); !cut.empty())
    result.findings.push_back(std::move(cut));
  else if (rows < info.frames)
    result.findings.push_back(fmt::format("header declares {} samples, {} are present", info.frames, rows));
  std::vector<std::string> names;
  const char* comment = sf_get_string(file.get(), SF_STR_COMMENT);
  if (comment != nullptr && std::string_view(comment).starts_with(kComment)) {
    std::string word;
    for (const char c : std::string(comment).substr(kComment.size()) + ' ') {
      if (c != ' ') {
        word += c;
      } else if (!word.empty()) {
        names.push_back(std::move(word));
        word.clear();
      }
    }
  }
  const bool named = names.size() == channels;
  SignalTable table;
  table.abscissa = Quantity::time;
  table.step = 1.0 / info.samplerate;
  for (std::size_t c = 0; c < channels; ++c) {
    const Eigen::Map<const Eigen::VectorXd, 0, Eigen::InnerStride<>> column(values.data() + c, rows,
                                                                            Eigen::InnerStride<>(info.channels));
    if (!column.allFinite()) throw fail(fmt::format("channel {}: values that are not finite", c + 1));
    table.signals.push_back(make_signal(named ? names[c] : std::to_string(c + 1), "", column));
  }
  if (!named)
    result.findings.push_back(
        "values are parts of full scale: a calibration is required (--columns 1:name_unit*FACTOR)");
  result.tables.push_back(std::move(table));
  return result;
}

void write_wav(const std::filesystem::path& path, const Recording& recording) {
  const double rate = recording.rate();
  if (std::abs(rate - std::round(rate)) > 1e-6 * rate || rate > 1e9) {
    throw Error(
        fmt::format("{}: a WAV file states whole numbers of Hz, the record has {:.9g} Hz", path.string(), rate));
  }
  Memory memory;
  SF_VIRTUAL_IO io = virtual_io();
  SF_INFO info{};
  info.samplerate = static_cast<int>(std::lround(rate));
  info.channels = static_cast<int>(recording.channels.size());
  info.format = SF_FORMAT_WAV | SF_FORMAT_DOUBLE;
  {
    const Handle file(sf_open_virtual(&io, SFM_WRITE, &info, &memory), sf_close);
    if (file == nullptr) throw Error::in_file(path.string(), 0, sf_strerror(nullptr));
    sf_command(file.get(), SFC_SET_ADD_PEAK_CHUNK, nullptr, SF_FALSE);  // it holds the date: other bytes each time
    std::string comment(kComment);
    for (const Channel& channel : recording.channels) {
      std::string name = channel.name;
      std::replace(name.begin(), name.end(), ' ', '_');
      comment += fmt::format("{}_{} ", name, si_suffix(channel.quantity).suffix);
    }
    sf_set_string(file.get(), SF_STR_COMMENT, comment.c_str());
    std::vector<double> frame(recording.channels.size());
    for (Eigen::Index i = 0; i < recording.size(); ++i) {
      for (std::size_t c = 0; c < frame.size(); ++c) frame[c] = recording.channels[c].samples[i];
      sf_writef_double(file.get(), frame.data(), 1);
    }
  }
  write_text(path, memory.out);
}

Format wav_format() {
  Format f{FileFormat::wav, "WAV", {".wav"}, [](std::string_view head) {
             return head.size() >= 12 && head.substr(8, 4) == "WAVE" &&
                    (head.starts_with("RIFF") || head.starts_with("RIFX") || head.starts_with("RF64") ||
                     head.starts_with("BW64"));
           }};
  f.magic = true;
  f.read = [](const std::filesystem::path& path, const CsvOptions&) {
    return parse_wav(read_text(path), path.string());
  };
  f.write = write_wav;
  return f;
}

}  // namespace whirl::io
