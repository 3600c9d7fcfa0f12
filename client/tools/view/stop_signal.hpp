#pragma once

namespace hairnet::viewer {

// From now on SIGINT and SIGTERM ask the program to end, in place of ending it; a second one of either ends it at once.
void heed_stop_signals();
// Whether one came.
[[nodiscard]] bool asked_to_stop();

}  // namespace hairnet::viewer
