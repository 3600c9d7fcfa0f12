#pragma once

#include "client/viewer/characters/options.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Runs the window until the user closes it, a stop signal comes, the duration is over or the server is lost. Call it
// from the program's first thread. Refused with one line where no window can be opened, and in a build without the
// renderer.
Result<void> run_window(const ViewOptions& options);

}  // namespace hairnet::viewer
