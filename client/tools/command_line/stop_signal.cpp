#include "client/tools/command_line/stop_signal.hpp"

#include <csignal>

namespace hairnet {
namespace {

// The only kind of variable that a handler may write portably.
volatile std::sig_atomic_t g_asked = 0;

extern "C" void on_stop(int) {
  g_asked = 1;
}

}  // namespace

void install_stop_signal_handlers() {
  struct sigaction action {};
  action.sa_handler = on_stop;
  // SA_RESETHAND restores the default, which the second signal meets. SA_RESTART keeps the first one from interrupting
  // reads and writes, which would look like errors.
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool stop_requested() {
  return g_asked != 0;
}

}  // namespace hairnet
