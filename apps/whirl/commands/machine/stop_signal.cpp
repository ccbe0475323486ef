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
  // What nohup ignores stays ignored.
  struct sigaction before {};
  const bool outlives = sigaction(SIGHUP, nullptr, &before) == 0 && before.sa_handler == SIG_IGN;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    if (signal != SIGHUP || !outlives) std::signal(signal, take);
  }
}

int stop_signal() noexcept { return received; }

}  // namespace whirl::app
