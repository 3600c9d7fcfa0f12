#pragma once

namespace hairnet {

// Installs handlers: the first SIGINT or SIGTERM only requests a stop (see stop_requested), the second one ends the
// program at once.
void install_stop_signal_handlers();
// Whether a stop was requested.
[[nodiscard]] bool stop_requested();

}  // namespace hairnet
