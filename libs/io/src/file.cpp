#include "whirl/io/file.hpp"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

#include "whirl/core/error.hpp"

namespace whirl::io {

namespace {

struct FileCloser {
  void operator()(std::FILE* f) const { std::fclose(f); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

constexpr std::size_t kChunk = std::size_t{1} << 16;

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
      if (rc == Z_STREAM_END) {
        member_done = true;
      } else if (rc != Z_OK && rc != Z_BUF_ERROR) {
        throw Error::in_file(name, 0, std::string("damaged gzip data: ") + (z.msg ? z.msg : "unknown reason"));
      }
    }
    return done;
  }
};

ByteSource::ByteSource(const std::filesystem::path& path) : state_(std::make_unique<State>()) {
  state_->name = path.string();
  std::error_code ec;
  if (std::filesystem::is_directory(path, ec)) throw Error::in_file(state_->name, 0, "is a folder, not a file");
  state_->file.reset(std::fopen(path.c_str(), "rb"));
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
  return read_all(ByteSource(path), limit);
}
std::string decompress(std::string_view bytes, std::string_view name, std::size_t limit) {
  return read_all(ByteSource(bytes, std::string(name)), limit);
}

struct ByteSink::State {
  std::filesystem::path path, temporary;
  File file;
  gzFile gz = nullptr;

  ~State() {
    if (gz) gzclose(gz);
    if (file || gz) {
      file.reset();
      std::error_code ec;
      std::filesystem::remove(temporary, ec);
    }
  }
  [[noreturn]] void fail() const {
    throw Error::in_file(path.string(), 0, std::string("cannot be written: ") + std::strerror(errno));
  }
};

ByteSink::ByteSink(const std::filesystem::path& path) : state_(std::make_unique<State>()) {
  state_->path = path;
  state_->temporary = path;
  state_->temporary += ".part";
  errno = 0;
  if (path.extension() == ".gz") {
    state_->gz = gzopen(state_->temporary.c_str(), "wb6");
    if (!state_->gz) state_->fail();
  } else {
    state_->file.reset(std::fopen(state_->temporary.c_str(), "wb"));
    if (!state_->file) state_->fail();
  }
}

ByteSink::~ByteSink() = default;

void ByteSink::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t n = std::min<std::size_t>(bytes.size(), std::size_t{1} << 30);
    if (state_->gz) {
      if (gzwrite(state_->gz, bytes.data(), static_cast<unsigned>(n)) != static_cast<int>(n)) state_->fail();
    } else if (std::fwrite(bytes.data(), 1, n, state_->file.get()) != n) {
      state_->fail();
    }
    bytes.remove_prefix(n);
  }
}

void ByteSink::close() {
  bool good = true;
  if (state_->gz) {
    good = gzclose(state_->gz) == Z_OK;
    state_->gz = nullptr;
  } else if (state_->file) {
    good = std::fclose(state_->file.release()) == 0;
  }
  std::error_code ec;
  if (good) std::filesystem::rename(state_->temporary, state_->path, ec);
  if (!good || ec) {
    std::error_code ignored;
    std::filesystem::remove(state_->temporary, ignored);
    if (ec) throw Error::in_file(state_->path.string(), 0, "cannot be written: " + ec.message());
    state_->fail();
  }
}

void write_text(const std::filesystem::path& path, std::string_view text) {
  ByteSink sink(path);
  sink.write(text);
  sink.close();
}

}  // namespace whirl::io
