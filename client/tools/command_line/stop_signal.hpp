#pragma once

namespace hairnet::viewer {

// Installs handlers: the first SIGINT or SIGTERM only requests a stop (see asked_to_stop), the second one ends the
// program at once.
void heed_stop_signals();
// Whether one came.
[[nodiscard]] bool asked_to_stop();

}  // namespace hairnet::viewer
