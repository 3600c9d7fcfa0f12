#pragma once

#include "client/viewer/characters/options.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// The window and all that goes on in it, until it is closed, a stop signal comes, the duration is over or the server is
// lost. Refused in one line where no window can be opened, and in a build without the renderer.
Result<void> run_window(const ViewOptions& options);

}  // namespace hairnet::viewer
