// WAV by libsndfile. Values are parts of full scale: a WAV file knows no unit unless its comment names the channels as
// ours do.
#include <fmt/format.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <optional>

#include "formats/arrays/bytes.hpp"
#include "formats/format.hpp"
#include "formats/parts/random_bytes.hpp"
#include "formats/parts/rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {
namespace {

constexpr std::string_view kComment = "channels: ";
// Sony Wave64: names of chunks are GUIDs, sizes have 64 bits.
constexpr std::string_view kW64("riff\x2E\x91\xCF\x11\xA5\xD6\x28\xDB\x04\xC1\x00\x00", 16);

/// What libsndfile reads: bytes at any place, some of them mended, or what it writes: memory.
struct SoundBytes {
  const RandomBytes* in = nullptr;
  std::map<std::uint64_t, char> mended = {};  ///< bytes that stand there instead
  std::string out = {};
  sf_count_t at = 0;

  sf_count_t size() const { return static_cast<sf_count_t>(in == nullptr ? out.size() : in->size()); }
  void read(char* to, std::size_t count) const {
    const auto from = static_cast<std::uint64_t>(at);
    std::memcpy(to, in->view(from, count).data(), count);
    for (auto byte = mended.lower_bound(from); byte != mended.end() && byte->first < from + count; ++byte)
      to[byte->first - from] = byte->second;
  }
};

SF_VIRTUAL_IO virtual_io() {
  SF_VIRTUAL_IO io{};
  io.get_filelen = [](void* user) { return static_cast<SoundBytes*>(user)->size(); };
  io.seek = [](sf_count_t offset, int whence, void* user) {
    SoundBytes& m = *static_cast<SoundBytes*>(user);
    const sf_count_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? m.at : m.size();
    return m.at = std::clamp<sf_count_t>(from + offset, 0, m.size());
  };
  io.read = [](void* to, sf_count_t count, void* user) {
    SoundBytes& m = *static_cast<SoundBytes*>(user);
    const sf_count_t n = std::clamp<sf_count_t>(count, 0, m.size() - m.at);
    if (n > 0) m.read(static_cast<char*>(to), static_cast<std::size_t>(n));
    m.at += n;
    return n;
  };
  io.write = [](const void* from, sf_count_t count, void* user) {
    SoundBytes& m = *static_cast<SoundBytes*>(user);
    if (m.at + count > static_cast<sf_count_t>(m.out.size())) m.out.resize(static_cast<std::size_t>(m.at + count));
    std::memcpy(m.out.data() + m.at, from, static_cast<std::size_t>(count));
    m.at += count;
    return count;
  };
  io.tell = [](void* user) { return static_cast<SoundBytes*>(user)->at; };
  return io;
}

using Handle = std::unique_ptr<SNDFILE, int (*)(SNDFILE*)>;

/// What the chunks before the samples state.
struct Stated {
  unsigned channels = 0, rate = 0, frame_bytes = 0;
  std::uint64_t fmt_at = 0;             ///< 0: no chunk `fmt `
  std::uint64_t data = 0, present = 0;  ///< bytes of samples; those that the file holds
  bool unknown = false;                 ///< the writer did not know their number when it began
  /// Where the size of an empty `data` chunk stands that something follows which is no chunk: the samples of a writer
  /// that did not come to its end. 0: no such place.
  std::uint64_t unfinished = 0;
  std::uint64_t behind = 0;  ///< bytes behind the samples that are no chunk
};

bool is_w64(std::string_view head) { return head.starts_with(kW64); }

/// A chunk that begins at `at`: what its name begins with, its content, and where the next one begins.
struct Chunk {
  std::string id;
  std::uint64_t body, size, next;
};
std::optional<Chunk> chunk_at(const RandomBytes& in, std::uint64_t at, bool big, bool w64) {
  const std::uint64_t head = w64 ? 24 : 8;
  if (at > in.size() || in.size() - at < head) return {};
  const std::uint64_t size = w64 ? in.number<std::uint64_t>(at + 16, false) : in.number<std::uint32_t>(at + 4, big);
  const std::uint64_t own = w64 ? size - std::min<std::uint64_t>(size, head) : size;  // W64 counts the head too
  const std::uint64_t left = in.size() - at - head, filled = own > left ? left
                                                             : w64      ? (own + 7) / 8 * 8
                                                                        : own + own % 2;
  return Chunk{in.copy(at, 4), at + head, own, at + head + filled};
}

/// Nothing that looks like a chunk, but bytes.
bool samples_follow(const RandomBytes& in, std::uint64_t at, bool big) {
  if (in.size() - at < 8) return false;
  const std::string rest = in.copy(at, 8);
  return !(std::all_of(rest.begin(), rest.begin() + 4, [](char c) { return c >= ' ' && c <= 'z'; }) &&
           number_at<std::uint32_t>(rest, 4, big) <= in.size() - at - 8);
}

Stated stated_of(const RandomBytes& in, bool big, bool w64) {
  Stated s;
  std::uint64_t wide = 0;  // size of the data of RF64, whose chunk says 0xFFFFFFFF
  for (std::optional<Chunk> c = chunk_at(in, w64 ? 40 : 12, big, w64); c; c = chunk_at(in, c->next, big, w64)) {
    const std::uint64_t left = in.size() - c->body;
    if (c->id == "ds64" && left >= 16) wide = in.number<std::uint64_t>(c->body + 8, big);
    if (c->id == "fmt " && left >= 14) {
      s.fmt_at = c->body - 8;
      s.channels = in.number<std::uint16_t>(c->body + 2, big);
      s.rate = in.number<std::uint32_t>(c->body + 4, big);
      s.frame_bytes = in.number<std::uint16_t>(c->body + 12, big);
    }
    if (c->id == "data") {
      s.data = c->size == 0xFFFFFFFF && !w64 ? wide : c->size;
      s.present = std::min(s.data, left);
      s.unknown = c->size == 0xFFFFFFFF && wide == 0 && !w64;
      const std::uint64_t end = s.data + s.data % 2;
      if (s.data > 0 && end < left && samples_follow(in, c->body + end, big) && !w64) s.behind = left - end;
      if (c->size == 0 && !w64 && samples_follow(in, c->body, big)) s.unfinished = c->body - 4;
      break;
    }
    if (c->size > left) break;
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

namespace {

/// The names in the comment, as this program writes them.
std::vector<std::string> names_in(const char* comment) {
  std::vector<std::string> names;
  if (comment == nullptr || !std::string_view(comment).starts_with(kComment)) return names;
  std::string word;
  for (const char c : std::string(comment).substr(kComment.size()) + ' ') {
    if (c != ' ') {
      word += c;
    } else if (!word.empty()) {
      names.push_back(std::move(word));
      word.clear();
    }
  }
  return names;
}

class WavReader : public RowReader {
 public:
  explicit WavReader(std::shared_ptr<const RandomBytes> in) : in_(std::move(in)) {
    if (in_->size() < 44) throw fail(fmt::format("byte {}: file ends inside the WAV header", in_->size()));
    const std::string head = in_->copy(0, 44), riff = head.substr(0, 4);
    const bool w64 = is_w64(head), big = riff == "RIFX";
    if (!w64 && ((riff != "RIFF" && !big && riff != "RF64" && riff != "BW64") || head.compare(8, 4, "WAVE") != 0))
      throw fail("byte 0: not a WAV file");
    stated_ = stated_of(*in_, big, w64);
    check_stated(stated_, in_->name());
    bytes_.in = in_.get();
    if (riff == "BW64") bytes_.mended = {{0, 'R'}, {1, 'F'}};  // RF64: the same layout (ITU-R BS.2088)
    if (stated_.unfinished > 0) {
      const auto size =
          static_cast<std::uint32_t>(std::min<std::uint64_t>(in_->size() - stated_.unfinished - 4, 0xFFFFFFFE));
      for (std::size_t i = 0; i < 4; ++i)
        bytes_.mended[stated_.unfinished + (big ? 3 - i : i)] = static_cast<char>(size >> (8 * i) & 0xFF);
    }
    SF_VIRTUAL_IO io = virtual_io();
    file_.reset(sf_open_virtual(&io, SFM_READ, &info_, &bytes_));
    if (file_ == nullptr) throw fail(fmt::format("byte {}: {}", bytes_.at, sf_strerror(nullptr)));
    if (info_.channels < 1 || info_.channels > 1024 || info_.samplerate < 1) {
      throw fail(fmt::format("{} channels at {} Hz: must be 1 to 1024 channels at 1 Hz or more", info_.channels,
                             info_.samplerate));
    }
    names_ = names_in(sf_get_string(file_.get(), SF_STR_COMMENT));
  }

  std::string name() const override { return in_->name(); }
  Eigen::Index rows() const override { return static_cast<Eigen::Index>(info_.frames); }

  /// A count beyond the end reads until the data end: that in the header may lie.
  SignalFile read(Eigen::Index first, Eigen::Index count) override {
    if (first != at_ && sf_seek(file_.get(), first, SEEK_SET) != first)
      throw fail(fmt::format("sample {} cannot be reached: {}", first, sf_strerror(file_.get())));
    at_ = first;
    const auto channels = static_cast<std::size_t>(info_.channels);
    std::vector<double> values, block(channels * 4096);
    while (at_ - first < count) {
      const sf_count_t frames =
          sf_readf_double(file_.get(), block.data(), std::min<Eigen::Index>(4096, count - (at_ - first)));
      if (frames <= 0) break;
      values.insert(values.end(), block.begin(), block.begin() + frames * info_.channels);
      at_ += frames;
    }
    if (values.empty()) throw fail("holds no samples");
    if (at_ - first < std::min(count, rows() - first) && count <= rows())
      throw fail(fmt::format("sample {}: the data end, its header states {}", at_, info_.frames));
    return signals(values, first == 0 && count > rows() ? at_ : rows());
  }

 private:
  Error fail(const std::string& message) const { return Error::in_file(in_->name(), 0, message); }

  /// `rows` of the whole file.
  SignalFile signals(const std::vector<double>& values, Eigen::Index rows) const {
    const auto channels = static_cast<std::size_t>(info_.channels);
    SignalFile result{.source = in_->name(), .format = "WAV"};
    if (stated_.unfinished > 0)
      result.findings.push_back(
          fmt::format("its header states no samples, as of a writer that did not come to its end: {} were read", rows));
    if (std::string cut = stated_.unfinished > 0 ? "" : cut_off(stated_); !cut.empty())
      result.findings.push_back(std::move(cut));
    else if (rows < info_.frames)
      result.findings.push_back(fmt::format("header declares {} samples, {} are present", info_.frames, rows));
    if (stated_.behind > 0)
      result.findings.push_back(fmt::format(
          "{} bytes behind the samples that its header states are left out: written beyond 4 GiB?", stated_.behind));
    const bool named = names_.size() == channels;
    SignalTable table{.abscissa = Quantity::time, .step = 1.0 / info_.samplerate};
    for (std::size_t c = 0; c < channels; ++c) {
      const Eigen::Map<const Eigen::VectorXd, 0, Eigen::InnerStride<>> column(
          values.data() + c, static_cast<Eigen::Index>(values.size() / channels), Eigen::InnerStride<>(info_.channels));
      if (!column.allFinite()) throw fail(fmt::format("channel {}: values that are not finite", c + 1));
      table.signals.push_back(make_signal(named ? names_[c] : std::to_string(c + 1), "", column));
    }
    if (!named)
      result.findings.push_back(
          "values are parts of full scale: a calibration is required (--columns 1:name_unit*FACTOR)");
    result.tables.push_back(std::move(table));
    return result;
  }

  std::shared_ptr<const RandomBytes> in_;
  Stated stated_;
  SoundBytes bytes_;
  SF_INFO info_{};
  Handle file_{nullptr, sf_close};
  std::vector<std::string> names_;
  Eigen::Index at_ = 0;
};

SignalFile read_wav(std::shared_ptr<const RandomBytes> in) {
  return WavReader(std::move(in)).read(0, std::numeric_limits<Eigen::Index>::max());
}

}  // namespace

SignalFile parse_wav(std::string_view bytes, std::string_view name) {
  return read_wav(std::make_shared<RandomBytes>(std::string(bytes), std::string(name)));
}

void write_wav(const std::filesystem::path& path, const Recording& recording) {
  const double rate = recording.rate();
  if (std::abs(rate - std::round(rate)) > 1e-6 * rate || rate > 1e9) {
    throw Error(
        fmt::format("{}: a WAV file states whole numbers of Hz, the record has {:.9g} Hz", path.string(), rate));
  }
  SoundBytes memory;
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
             if (is_w64(head)) return true;
             return head.size() >= 12 && head.substr(8, 4) == "WAVE" &&
                    (head.starts_with("RIFF") || head.starts_with("RIFX") || head.starts_with("RF64") ||
                     head.starts_with("BW64"));
           }};
  f.magic = true;
  f.read = [](const std::filesystem::path& path, const CsvOptions&) {
    return read_wav(std::make_shared<RandomBytes>(path, kMostRead));
  };
  f.stream = [](const std::filesystem::path& path, const CsvOptions&, const PartRows& rows) {
    return stream_rows(std::make_unique<WavReader>(std::make_shared<RandomBytes>(path)), rows);
  };
  f.write = write_wav;
  return f;
}

}  // namespace whirl::io
