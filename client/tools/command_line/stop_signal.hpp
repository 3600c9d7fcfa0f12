#pragma once

namespace hairnet {

// Installs handlers: the first SIGINT or SIGTERM only requests a stop (see stop_requested), the second one ends the
// program at once. So a program can finish its files, and one that hangs can still be ended.
void install_stop_signal_handlers();
// Whether a stop was requested. It costs nothing, so long work should ask often.
[[nodiscard]] bool stop_requested();

}  // namespace hairnet
