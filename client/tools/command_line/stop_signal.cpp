#include "client/tools/command_line/stop_signal.hpp"

#include <csignal>

namespace hairnet {
namespace {

volatile std::sig_atomic_t g_asked = 0;

extern "C" void on_stop(int) {
  g_asked = 1;
}

}  // namespace

void install_stop_signal_handlers() {
  struct sigaction action {};
  action.sa_handler = on_stop;
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool stop_requested() {
  return g_asked != 0;
}

}  // namespace hairnet
