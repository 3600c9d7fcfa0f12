#pragma once

#include <csignal>

namespace hairnet {

// For programs that write to pipes or sockets, first of all in main(). A write whose reader is gone then fails, and its
// writer decides; otherwise the system ends the program.
inline void ignore_broken_pipes() {
  std::signal(SIGPIPE, SIG_IGN);
}

}  // namespace hairnet
