#include "stop_signal.hpp"

#include <csignal>
#include <initializer_list>

namespace whirl::app {
namespace {

volatile std::sig_atomic_t received = 0;

void take(int signal) {
  received = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void catch_stop_signals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, take);
}

int stop_signal() noexcept { return received; }

}  // namespace whirl::app
