#include "whirl/io/temporary.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "disk/temporary_slots.hpp"
#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

/// Fixed memory: a signal may come at any instant and may neither allocate nor lock.
struct Slot {
  enum : int { kFree, kClaimed, kFile, kFolder };
  std::atomic<int> state{kFree};
  std::array<char, 4096> path{};
};
std::array<Slot, 128> slots;  // an OutputGroup holds as many files as a report has figures
static_assert(std::atomic<int>::is_always_lock_free);

constexpr std::array kEnds{SIGINT, SIGTERM, SIGHUP};

void remove_folder(const char* path) {
  // Reading a folder allocates; another program may. A compiler that still runs there may write a file between the
  // listing and the end of the folder: until it is gone, for 10 s at most.
  const pid_t child = _Fork();
  if (child == 0) {
    execl("/bin/sh", "sh", "-c",
          "n=0; while rm -rf -- \"$0\" 2>/dev/null; [ -e \"$0\" ] && [ $n -lt 100 ]; do n=$((n+1)); sleep 0.1; done",
          path, static_cast<char*>(nullptr));
    _exit(127);
  }
}

void clean_up(int signal) {
  const int kept = errno;
  for (Slot& slot : slots) {
    const int what = slot.state.load(std::memory_order_acquire);
    if (what == Slot::kFile) unlink(slot.path.data());
    if (what == Slot::kFolder) remove_folder(slot.path.data());
  }
  errno = kept;
  std::signal(signal, SIG_DFL);
  raise(signal);
}

}  // namespace

int remember_temporary(const std::string& path, bool folder) {
  for (std::size_t i = 0; i < slots.size() && path.size() < slots[i].path.size(); ++i) {
    int free = Slot::kFree;
    if (!slots[i].state.compare_exchange_strong(free, Slot::kClaimed)) continue;
    std::memcpy(slots[i].path.data(), path.c_str(), path.size() + 1);
    slots[i].state.store(folder ? Slot::kFolder : Slot::kFile, std::memory_order_release);
    return static_cast<int>(i);
  }
  return -1;
}

void forget_temporary(int slot) {
  if (slot >= 0) slots[static_cast<std::size_t>(slot)].state.store(Slot::kFree, std::memory_order_release);
}

void clean_up_on_signals() {
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond `ulimit -f` is a failed write (EFBIG), not the end of the program
  for (const int signal : kEnds) {
    struct sigaction now {};
    if (sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN) continue;  // nohup stays nohup
    struct sigaction action {};
    action.sa_handler = clean_up;
    sigemptyset(&action.sa_mask);
    action.sa_flags = SA_RESTART;
    sigaction(signal, &action, nullptr);
  }
}

TemporaryFolder::TemporaryFolder(std::string_view purpose) {
  std::error_code failed;
  const std::filesystem::path below = std::filesystem::temp_directory_path(failed);
  std::string name =
      ((failed ? std::filesystem::path("/tmp") : below) / fmt::format("whirl-{}-XXXXXX", purpose)).string();
  // A signal between the two would leave the folder.
  sigset_t ends, before;
  sigemptyset(&ends);
  for (const int signal : kEnds) sigaddset(&ends, signal);
  pthread_sigmask(SIG_BLOCK, &ends, &before);
  const bool made = mkdtemp(name.data()) != nullptr;
  const int error = errno;
  if (made) slot_ = remember_temporary(name, true);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (!made) throw Error(fmt::format("{}: no temporary folder can be made: {}", name, std::strerror(error)));
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
  forget_temporary(slot_);
}

}  // namespace whirl::io
