#include "whirl/io/apart.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>

#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

constexpr rlim_t kBytesPerSecond = 20'000'000;
// Deflate gains a factor of 1032 at most, and a byte becomes a double.
constexpr rlim_t kSmallest = rlim_t{1} << 26, kGain = 9000;
// Waiting for its turn or for the disk does not count: so many times longer it may take by the clock.
constexpr rlim_t kPatience = 30;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMemoryIsCounted = false;  // the sanitizers' own memory counts too
#else
constexpr bool kMemoryIsCounted = true;
#endif
constexpr std::size_t kPipeBuffer = 1 << 16;
enum : char { kFailed = 'E', kValues = 'V' };

/// Memory that both processes see.
class SharedMemory {
 public:
  explicit SharedMemory(const std::string& name) : descriptor_(memfd_create("whirl", MFD_CLOEXEC)) {
    if (descriptor_ < 0) throw Error::in_file(name, 0, std::string("cannot be examined: ") + std::strerror(errno));
  }
  ~SharedMemory() {
    if (at_ != MAP_FAILED) munmap(at_, size_);
    close(descriptor_);
  }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
  int descriptor() const { return descriptor_; }
  std::span<const std::byte> content() {
    struct stat s {};
    if (fstat(descriptor_, &s) != 0 || s.st_size <= 0) return {};
    size_ = static_cast<std::size_t>(s.st_size);
    at_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor_, 0);
    if (at_ == MAP_FAILED) return {};
    return {static_cast<const std::byte*>(at_), size_};
  }

 private:
  int descriptor_;
  void* at_ = MAP_FAILED;
  std::size_t size_ = 0;
};

void limit(int what, rlim_t most) {
  rlimit now{};
  if (getrlimit(what, &now) != 0) return;
  now.rlim_cur = std::min(now.rlim_cur, most);
  now.rlim_max = std::min(now.rlim_max, most);
  setrlimit(what, &now);
}

/// Bytes that the process may write to now, its stack included (Linux, proc(5)); 0: not known.
rlim_t memory_in_use() {
  std::ifstream in("/proc/self/statm");
  rlim_t pages[6] = {};
  for (rlim_t& p : pages) in >> p;
  return in ? pages[5] * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) : 0;
}

/// What a file of this size can come to in memory, three quarters of the machine's at most.
rlim_t most_memory(std::size_t file_bytes) {
  const rlim_t machine = static_cast<rlim_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
  return std::min(machine / 4 * 3, 4 * kSmallest + kGain * static_cast<rlim_t>(file_bytes));
}

[[noreturn]] void tell(int descriptor, std::string_view message) {
  if (ftruncate(descriptor, 0) != 0 || lseek(descriptor, 0, SEEK_SET) != 0) _exit(1);
  try {
    ParcelWriter out(descriptor);
    out.value(static_cast<char>(kFailed));
    out.text(message);
    out.flush();
  } catch (const std::exception&) {
    _exit(1);
  }
  _exit(0);
}

[[noreturn]] void work(const std::string& name, int descriptor, std::size_t file_bytes, rlim_t seconds,
                       const std::function<void(ParcelWriter&)>& read) {
  for (const int signal : {SIGALRM, SIGINT, SIGTERM, SIGHUP, SIGSEGV, SIGBUS, SIGABRT, SIGXFSZ, SIGXCPU})
    std::signal(signal, SIG_DFL);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, seconds);
  const rlim_t most = most_memory(file_bytes), used = memory_in_use();
  limit(RLIMIT_FSIZE, std::min(most, kSmallest + kGain * file_bytes));
  if (kMemoryIsCounted && used > 0) limit(RLIMIT_DATA, used + most);
  alarm(static_cast<unsigned>(kPatience * seconds));  // it may also sleep without end
  try {
    ParcelWriter out(descriptor);
    out.value(static_cast<char>(kValues));
    read(out);
    out.flush();
  } catch (const Error& e) {
    tell(descriptor, e.what());
  } catch (const std::bad_alloc&) {
    tell(descriptor,
         fmt::format("{}: needs more memory than the {} MB it may have", name, most_memory(file_bytes) >> 20));
  } catch (const std::exception& e) {
    tell(descriptor, fmt::format("{}: cannot be read: {}", name, e.what()));
  }
  _exit(0);
}

/// Asleep by its own will (proc(5)): not waiting for a processor or the disk.
bool is_asleep(pid_t process) {
  std::ifstream in(fmt::format("/proc/{}/stat", process));
  std::string text;
  std::getline(in, text);
  const std::size_t name = text.rfind(')');
  return name != std::string::npos && name + 2 < text.size() && text[name + 2] == 'S';
}

/// Ends a process that sleeps so many seconds in all: the library can wait for a writer that does not come.
void watch_sleep(pid_t child, rlim_t seconds) {
  const auto ended = static_cast<int>(syscall(SYS_pidfd_open, child, 0));
  if (ended < 0) return;  // its alarm is left
  pollfd wait{ended, POLLIN, 0};
  for (rlim_t slept = 0; slept < seconds;) {
    const int ready = poll(&wait, 1, 1000);
    if (ready > 0) break;
    if (ready == 0 && is_asleep(child) && ++slept == seconds) kill(child, SIGKILL);
  }
  (void)close(ended);
}

}  // namespace

void ParcelWriter::bytes(std::span<const std::byte> b) {
  const std::string_view more(reinterpret_cast<const char*>(b.data()), b.size());
  if (more.size() >= kPipeBuffer) flush();
  if (more.size() >= kPipeBuffer) return write(more);
  buffer_.append(more);
  if (buffer_.size() >= kPipeBuffer) flush();
}

void ParcelWriter::write(std::string_view left) const {
  while (!left.empty()) {
    const ssize_t n = ::write(descriptor_, left.data(), left.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw Error(std::string("values cannot be handed over: ") + std::strerror(errno));
    left.remove_prefix(static_cast<std::size_t>(n));
  }
}

void ParcelWriter::flush() {
  write(buffer_);
  buffer_.clear();
}

void ParcelReader::require(std::uint64_t n, std::size_t size) const {
  if (n > left_.size() / size) {
    throw Error::in_file(name_, 0, "is damaged: the values read of it end before their number");
  }
}

void ParcelReader::copy(void* to, std::size_t size) {
  require(size, 1);
  if (size > 0) std::memcpy(to, left_.data(), size);
  left_ = left_.subspan(size);
}

void read_apart(const std::string& name, std::size_t file_bytes, const std::function<void(ParcelWriter&)>& read,
                const std::function<void(ParcelReader&)>& take, unsigned least_seconds) {
  SharedMemory memory(name);
  const rlim_t seconds = least_seconds + file_bytes / kBytesPerSecond;
  const pid_t child = fork();
  if (child < 0) throw Error::in_file(name, 0, std::string("cannot be examined: ") + std::strerror(errno));
  if (child == 0) work(name, memory.descriptor(), file_bytes, seconds, read);
  watch_sleep(child, seconds);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    const bool endless = signal == SIGALRM || signal == SIGXCPU || signal == SIGKILL;
    throw Error::in_file(
        name, 0,
        endless
            ? fmt::format("is damaged: the HDF5 library does not come to an end within {} s of computing or sleeping",
                          seconds)
            : std::string("is damaged: the HDF5 library fails on it"));
  }
  ParcelReader parcel(name, memory.content());
  if (parcel.value<char>() == kFailed) throw Error(parcel.text());
  take(parcel);
}

}  // namespace whirl::io
