#pragma once
#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "whirl/testing/compiled.hpp"

#ifdef __SANITIZE_THREAD__
// libiio throws received bytes away by recv to address 0 with MSG_TRUNC, which looks like two threads that write there.
extern "C" inline __attribute__((used)) const char* __tsan_default_suppressions() { return "race:libiio.so.0\n"; }
#endif

namespace whirl::testing {

/// A real `iiod` on loopback over an IIO tree of files: an analogue input "adc" with a buffer (two voltages, a count,
/// a timestamp), an output "dac", triggers "hrtimer0" and "fixed". The tree lies over /sys/bus and /dev in a name space
/// of the daemon's own, so that nothing else sees it. The test plays the kernel: it writes attributes and samples.
class IioTree {
 public:
  /// Why no daemon can run here; empty when one can.
  static std::string missing() {
    for (const char* program : {"iiod", "unshare", "iio_info"}) {
      if (!has_program(program)) return std::string(program) + " is not installed";
    }
    if (std::system("unshare --map-root-user --mount mount -t tmpfs none /sys/bus >/dev/null 2>&1") != 0)
      return "this system does not let a program mount in a name space of its own";
    return {};
  }

  IioTree() {
    make_input();
    set("iio:device1/name", "dac");
    for (const char* channel : {"0", "1"}) {
      set(std::string("iio:device1/out_voltage") + channel + "_raw", "7777");
      set(std::string("iio:device1/out_voltage") + channel + "_offset", "-32768");
    }
    set("iio:device1/out_voltage_scale", "0.30517578125");
    set("trigger0/name", "hrtimer0");
    set("trigger0/sampling_frequency", "100");
    set("trigger1/name", "fixed");
    std::filesystem::create_symlink("/proc/version", root() / "trigger1/sampling_frequency");  // not to be written
    std::filesystem::create_directories(folder_.path() / "dev");
    const std::string device = (folder_.path() / "dev" / "iio:device0").string();
    if (::mkfifo(device.c_str(), 0600) != 0) throw std::runtime_error("no FIFO");
    samples_ = ::open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    start();
  }
  ~IioTree() {
    kill();
    ::close(samples_);
  }
  IioTree(const IioTree&) = delete;
  IioTree& operator=(const IioTree&) = delete;

  std::string uri() const { return "ip:127.0.0.1:" + std::to_string(port_); }
  /// Replaces an attribute as a whole.
  void set(const std::string& attribute, const std::string& value) const {
    folder_.write("next", value + "\n");
    const std::filesystem::path to = root() / attribute;
    std::filesystem::create_directories(to.parent_path());
    std::filesystem::rename(folder_.path() / "next", to);
  }
  void remove(const std::string& attribute) const { std::filesystem::remove(root() / attribute); }
  std::string get(const std::string& attribute) const {
    std::ifstream in(root() / attribute);
    std::string value;
    in >> value;
    return value.c_str();  // libiio writes the end of its text too
  }
  /// Waits until an attribute has the value; false after five seconds.
  bool becomes(const std::string& attribute, const std::string& value) const {
    for (int i = 0; i < 500 && get(attribute) != value; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return get(attribute) == value;
  }
  /// One sample of the buffer: two signed voltages (16 bits little-endian; 12 bits big-endian, four bits up), an
  /// unsigned count of 16 bits, a time in ns.
  void sample(int voltage0, int voltage1, unsigned count, std::int64_t time) const {
    std::array<unsigned char, 16> bytes{};
    const auto low = static_cast<std::uint16_t>(voltage0);
    const auto high = static_cast<std::uint16_t>(static_cast<unsigned>(voltage1) << 4U);
    const auto turn = static_cast<std::uint16_t>(count);
    bytes[0] = static_cast<unsigned char>(low & 255U), bytes[1] = static_cast<unsigned char>(low >> 8U);
    bytes[2] = static_cast<unsigned char>(high >> 8U), bytes[3] = static_cast<unsigned char>(high & 255U);
    bytes[4] = static_cast<unsigned char>(turn & 255U), bytes[5] = static_cast<unsigned char>(turn >> 8U);
    for (unsigned i = 0; i < 8; ++i)
      bytes[8 + i] = static_cast<unsigned char>((static_cast<std::uint64_t>(time) >> (8 * i)) & 255U);
    (void)!::write(samples_, bytes.data(), bytes.size());
  }
  void kill() {
    if (daemon_ <= 0) return;
    ::kill(daemon_, SIGKILL);
    ::waitpid(daemon_, nullptr, 0);
    daemon_ = -1;
  }

 private:
  std::filesystem::path root() const { return folder_.path() / "tree"; }

  void make_input() const {
    const std::string adc = "iio:device0/", scan = adc + "scan_elements/in_";
    set(adc + "name", "adc");
    struct Element {
      const char *name, *index, *type;
    };
    for (const Element& e : {Element{"voltage0", "0", "le:s16/16>>0"}, Element{"voltage1", "1", "be:s12/16>>4"},
                             Element{"count0", "2", "le:u16/16>>0"}, Element{"timestamp", "3", "le:s64/64>>0"}}) {
      set(scan + e.name + "_en", "0");
      set(scan + e.name + "_index", e.index);
      set(scan + e.name + "_type", e.type);
    }
    for (const char* channel : {"voltage0", "voltage1", "voltage2", "count0"}) set(adc + "in_" + channel + "_raw", "0");
    set(adc + "in_voltage0_scale", "0.5");
    set(adc + "in_voltage1_scale", "5");
    set(adc + "in_voltage1_offset", "10");
    set(adc + "buffer/enable", "0");
    set(adc + "buffer/length", "1");
    set(adc + "trigger/current_trigger", "");
  }
  /// Another program may take the port between its choice and the daemon's: then the daemon ends, and another port will
  /// do.
  void start() {
    for (int trial = 0; trial < 5; ++trial) {
      launch();
      for (int i = 0; i < 200 && !ended(); ++i) {
        if (shell(folder_.path(), "iio_info -u " + uri()).exit_code == 0) return;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
      kill();
    }
    throw std::runtime_error("iiod did not start");
  }
  bool ended() {
    if (::waitpid(daemon_, nullptr, WNOHANG) == 0) return false;
    daemon_ = -1;
    return true;
  }
  void launch() {
    const std::string at = folder_.path().string();
    port_ = free_port();
    folder_.write("run.sh", "set -e\nmount -t tmpfs none /sys/bus\nmkdir -p /sys/bus/iio/devices\nmount --bind '" + at +
                                "/tree' /sys/bus/iio/devices\nmount --bind '" + at +
                                "/dev' /dev\nexec iiod -u local: -p " + std::to_string(port_) + "\n");
    daemon_ = ::fork();
    if (daemon_ == 0) {
      const int log = ::open((at + "/log").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
      ::dup2(log, 1), ::dup2(log, 2);
      const std::string script = at + "/run.sh";
      ::execlp("unshare", "unshare", "--map-root-user", "--mount", "sh", script.c_str(), nullptr);
      ::_exit(127);
    }
  }
  static int free_port() {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof a;
    const bool bound = ::bind(fd, reinterpret_cast<const sockaddr*>(&a), sizeof a) == 0 &&
                       ::getsockname(fd, reinterpret_cast<sockaddr*>(&a), &size) == 0;
    ::close(fd);
    if (!bound) throw std::runtime_error("no free port");
    return ntohs(a.sin_port);
  }

  TemporaryFolder folder_;
  int samples_ = -1, port_ = 0;
  pid_t daemon_ = -1;
};

}  // namespace whirl::testing
