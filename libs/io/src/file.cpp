#include "whirl/io/file.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/io/input.hpp"
#include "whirl/io/temporary.hpp"

namespace whirl::io {

namespace {

struct FileCloser {
  void operator()(std::FILE* f) const { std::fclose(f); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

constexpr std::size_t kChunk = std::size_t{1} << 16;
// Noise does not pack: a file that packs better is made to fill the memory.
constexpr std::uint64_t kUnpackedFreely = 64 << 20, kMostRatio = 200;

}  // namespace

// zlib's gzread stops at damage without a word in some cases and cannot read memory; inflate reports every
// one.
struct ByteSource::State {
  std::string name;
  File file;
  std::string_view memory;
  std::vector<char> input;  // raw bytes read ahead from the file
  std::string_view raw;     // what is left of them
  bool end = false;         // no more raw bytes
  bool gzip = false;
  bool inflating = false;
  bool member_done = false;
  std::uint64_t packed = 0, unpacked = 0, taken = 0;  // bytes
  z_stream z{};

  ~State() {
    if (inflating) inflateEnd(&z);
  }

  void fill() {
    if (!raw.empty() || end) return;
    if (!file) {
      end = true;
      return;
    }
    input.resize(kChunk);
    const std::size_t n = std::fread(input.data(), 1, input.size(), file.get());
    if (n < input.size()) {
      if (std::ferror(file.get())) throw Error::in_file(name, 0, "cannot be read");
      end = true;
    }
    raw = {input.data(), n};
    taken += n;
  }

  void start() {
    fill();
    gzip = raw.size() >= 2 && raw[0] == '\x1f' && raw[1] == '\x8b';
    if (gzip) begin_member();
  }

  void begin_member() {
    if (inflating) inflateEnd(&z);
    z = {};
    if (inflateInit2(&z, 15 + 16) != Z_OK) throw Error::in_file(name, 0, "not enough memory to decompress");
    inflating = true;
    member_done = false;
  }

  std::size_t read_plain(char* to, std::size_t size) {
    std::size_t done = 0;
    while (done < size) {
      fill();
      if (raw.empty()) break;
      const std::size_t n = std::min(size - done, raw.size());
      std::memcpy(to + done, raw.data(), n);
      raw.remove_prefix(n);
      done += n;
    }
    return done;
  }

  std::size_t read_gzip(char* to, std::size_t size) {
    std::size_t done = 0;
    while (done < size) {
      fill();
      if (member_done) {
        if (raw.empty()) break;
        if (raw[0] != '\x1f') throw Error::in_file(name, 0, "bytes after the end of the gzip data");
        begin_member();
      }
      if (raw.empty()) throw Error::in_file(name, 0, "gzip data are cut off");
      z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(raw.data()));
      z.avail_in = static_cast<uInt>(std::min<std::size_t>(raw.size(), 1u << 30));
      z.next_out = reinterpret_cast<Bytef*>(to + done);
      const uInt room = static_cast<uInt>(std::min<std::size_t>(size - done, 1u << 30));
      const uInt offered = z.avail_in;
      z.avail_out = room;
      const int rc = inflate(&z, Z_NO_FLUSH);
      raw.remove_prefix(offered - z.avail_in);
      done += room - z.avail_out;
      packed += offered - z.avail_in;
      unpacked += room - z.avail_out;
      if (unpacked > kUnpackedFreely && unpacked / kMostRatio > packed) {
        throw Error::in_file(name, 0,
                             fmt::format("unpacks to more than {} times its size: no record does; unpack it with gzip "
                                         "when that is meant",
                                         kMostRatio));
      }
      if (rc == Z_STREAM_END) {
        member_done = true;
      } else if (rc != Z_OK && rc != Z_BUF_ERROR) {
        throw Error::in_file(name, 0, std::string("damaged gzip data: ") + (z.msg ? z.msg : "unknown reason"));
      }
    }
    return done;
  }
};

namespace {

constexpr std::size_t kMaxPiped = std::size_t{1} << 30;  // bytes

/// Everything that comes out of a pipe, in a file.
void drain(const std::filesystem::path& from, std::FILE* in, const std::filesystem::path& to) {
  ByteSink sink(to);
  std::string chunk(kChunk, '\0');
  for (std::size_t total = 0;;) {
    const std::size_t n = std::fread(chunk.data(), 1, chunk.size(), in);
    if (std::ferror(in)) throw Error::in_file(from.string(), 0, std::string("cannot be read: ") + std::strerror(errno));
    total += n;
    if (total > kMaxPiped)
      throw Error::in_file(from.string(), 0,
                           fmt::format("larger than the limit of {} bytes of a pipe or device", kMaxPiped));
    sink.write({chunk.data(), n});
    if (n < chunk.size()) break;
  }
  sink.close();
}

}  // namespace

std::filesystem::path input_path(const std::filesystem::path& path) {
  struct stat there {};
  const bool standard = path == "-";
  if (!standard && (stat(path.c_str(), &there) != 0 || S_ISREG(there.st_mode))) return path;
  if (!standard && S_ISDIR(there.st_mode)) throw Error::in_file(path.string(), 0, "is a folder, not a file");
  if (!standard && (S_ISBLK(there.st_mode) || S_ISSOCK(there.st_mode)))
    throw Error::in_file(path.string(), 0, "is a block device or a socket, not a file or a pipe");
  static std::mutex mutex;
  static std::optional<TemporaryFolder> folder;
  static std::map<std::string, std::filesystem::path> known;
  const std::lock_guard lock(mutex);
  if (const auto at = known.find(path.string()); at != known.end()) return at->second;
  const File opened(standard ? nullptr : std::fopen(path.c_str(), "rb"));
  if (!standard && !opened)
    throw Error::in_file(path.string(), 0, std::string("cannot be opened: ") + std::strerror(errno));
  if (!folder) folder.emplace("input");
  const std::filesystem::path kept = folder->path() / fmt::format("{}{}", known.size(), path.extension().string());
  drain(path, standard ? stdin : opened.get(), kept);
  known[path.string()] = kept;
  return kept;
}

ByteSource::ByteSource(const std::filesystem::path& path) : state_(std::make_unique<State>()) {
  state_->name = path.string();
  state_->file.reset(std::fopen(input_path(path).c_str(), "rb"));
  if (!state_->file) throw Error::in_file(state_->name, 0, std::string("cannot be opened: ") + std::strerror(errno));
  state_->start();
}

ByteSource::ByteSource(std::string_view bytes, std::string name) : state_(std::make_unique<State>()) {
  state_->name = std::move(name);
  state_->raw = bytes;
  state_->start();
}

ByteSource::~ByteSource() = default;
ByteSource::ByteSource(ByteSource&&) noexcept = default;
ByteSource& ByteSource::operator=(ByteSource&&) noexcept = default;

std::size_t ByteSource::read(char* to, std::size_t size) {
  return state_->gzip ? state_->read_gzip(to, size) : state_->read_plain(to, size);
}
const std::string& ByteSource::name() const { return state_->name; }
bool ByteSource::compressed() const { return state_->gzip; }
std::uint64_t ByteSource::taken() const { return state_->taken; }

namespace {

std::string read_all(ByteSource source, std::size_t limit) {
  std::string text;
  while (true) {
    const std::size_t old = text.size();
    text.resize(old + kChunk);
    const std::size_t n = source.read(text.data() + old, kChunk);
    text.resize(old + n);
    if (text.size() > limit)
      throw Error::in_file(source.name(), 0, fmt::format("larger than the limit of {} bytes", limit));
    if (n < kChunk) return text;
  }
}

}  // namespace

std::string read_text(const std::filesystem::path& path, std::size_t limit) {
  ByteSource source(path);
  std::error_code none;
  const std::uintmax_t size = std::filesystem::file_size(path, none);  // before anything is read of it
  if (!none && size > limit && !source.compressed())
    throw Error::in_file(source.name(), 0, fmt::format("{} bytes: larger than the limit of {} bytes", size, limit));
  return read_all(std::move(source), limit);
}
std::string decompress(std::string_view bytes, std::string_view name, std::size_t limit) {
  return read_all(ByteSource(bytes, std::string(name)), limit);
}

}  // namespace whirl::io
