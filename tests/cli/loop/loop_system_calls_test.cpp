// The real program over real wires, its loop thread followed call by call (ptrace): armed, it asks the system for
// nothing but input, output and sleep. That the follower sees other calls is shown by those of the same thread before
// arming.
#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <set>
#include <vector>

#include "served.hpp"

namespace whirl::testing {
namespace {

struct Call {
  std::uint64_t number = 0;
  bool armed = false;  ///< sends a command with the armed flag
};

/// Calls of every thread but the first, by thread.
struct Trace {
  std::map<pid_t, std::vector<Call>> threads;
  bool possible = true;
};

bool is_armed_command(pid_t thread, std::uint64_t address) {
  std::array<char, 16> head{};
  const iovec here{head.data(), head.size()}, there{reinterpret_cast<void*>(address), head.size()};
  if (::process_vm_readv(thread, &here, 1, &there, 1, 0) != static_cast<ssize_t>(head.size())) return false;
  return std::memcmp(head.data(), "WHC1", 4) == 0 && (head[12] & 1) != 0;
}

Trace follow(const std::string& shell_command) {
  Trace trace;
  const pid_t child = ::fork();
  if (child == 0) {
    ::setenv("ASAN_OPTIONS", "detect_leaks=0", 1);  // its leak search follows threads itself
    if (::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) ::_exit(77);
    ::execl("/bin/sh", "sh", "-c", shell_command.c_str(), nullptr);
    ::_exit(78);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  const auto options = PTRACE_O_TRACESYSGOOD | PTRACE_O_TRACECLONE | PTRACE_O_EXITKILL;
  trace.possible = WIFSTOPPED(status) && ::ptrace(PTRACE_SETOPTIONS, child, nullptr, options) == 0;
  if (!trace.possible) return trace;
  ::ptrace(PTRACE_CONT, child, nullptr, nullptr);
  for (pid_t at; (at = ::waitpid(-1, &status, __WALL)) > 0;) {
    if (!WIFSTOPPED(status)) {
      if (at == child) break;
      continue;
    }
    const int signal = WSTOPSIG(status);
    int deliver = 0;
    if (signal == (SIGTRAP | 0x80)) {
      __ptrace_syscall_info info;
      if (::ptrace(PTRACE_GET_SYSCALL_INFO, at, sizeof info, &info) <= 0) {
        trace.possible = false;
        ::kill(child, SIGKILL);
      } else if (info.op == PTRACE_SYSCALL_INFO_ENTRY) {
        const bool armed = info.entry.nr == SYS_sendto && is_armed_command(at, info.entry.args[1]);
        trace.threads[at].push_back({info.entry.nr, armed});
      }
    } else if (signal != SIGSTOP && signal != SIGTRAP) {
      deliver = signal;
    }
    ::ptrace(at == child ? PTRACE_CONT : PTRACE_SYSCALL, at, nullptr, deliver);
  }
  return trace;
}

struct LoopSystemCallsE2e : ::testing::TestWithParam<const char*> {};

TEST_P(LoopSystemCallsE2e, NothingButInputOutputAndSleepWhileArmed) {
  const std::string clock = GetParam();
  Folder folder;
  io::save(folder / "controller.json", pd_design());
  folder.write("rig.toml", kRig);
  const Served rig(folder, "--lockstep --rig rig.toml");
  std::string io = slurp(folder / "io.toml");
  const std::string written = "\"lockstep\"";
  const std::size_t at = io.find(written);
  ASSERT_NE(at, std::string::npos);
  io.replace(at, written.size(), "\"" + clock + "\"");
  folder.write("io.toml", io);
  const Trace trace = follow("cd '" + (folder / "").string() + "' && exec '" + program() +
                             "' run controller.json --io io.toml --record run.h5 --seconds 1 >run.out 2>run.err");
  if (!trace.possible) GTEST_SKIP() << "this system lets no process follow another (ptrace)";

  // Input and output of sockets and lines, the sleeps, and the clock where it is no function of the vDSO.
  std::set<std::uint64_t> allowed{SYS_read,  SYS_write,           SYS_recvfrom,     SYS_sendto,
                                  SYS_ppoll, SYS_clock_nanosleep, SYS_clock_gettime};
#ifdef SYS_poll
  allowed.insert(SYS_poll);
#endif
  long loops = 0;
  for (const auto& [thread, calls] : trace.threads) {
    const auto armed = [](const Call& c) { return c.armed; };
    const auto first = std::find_if(calls.begin(), calls.end(), armed);
    if (first == calls.end()) continue;
    ++loops;
    const auto last = std::find_if(calls.rbegin(), calls.rend(), armed).base();
    EXPECT_GT(std::count_if(first, last, armed), 100);
    std::map<std::uint64_t, long> counts;
    for (auto c = first; c != last; ++c) ++counts[c->number];
    for (const auto& [number, count] : counts) {
      EXPECT_TRUE(allowed.count(number)) << "system call " << number << ", " << count << " times";
    }
    EXPECT_TRUE(std::any_of(calls.begin(), first, [&](const Call& c) { return !allowed.count(c.number); }))
        << "the follower must see what the thread does before";
    // On a busy machine the next sample, or the next period, is often there already: then the loop does not wait.
    // Followed, a process is so slow that in lockstep the other side may always be ahead: then it reads without
    // waiting.
    EXPECT_GT(clock == "wall" ? counts[SYS_clock_nanosleep] : counts[SYS_ppoll] + counts[SYS_recvfrom], 0);
  }
  EXPECT_EQ(loops, 1) << slurp(folder / "run.err");
}

INSTANTIATE_TEST_SUITE_P(Clocks, LoopSystemCallsE2e, ::testing::Values("sample", "wall", "lockstep"),
                         [](const auto& i) { return std::string(i.param); });

}  // namespace
}  // namespace whirl::testing
