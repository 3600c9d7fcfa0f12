#pragma once

#include <memory>
#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/characters/options.hpp"
#include "client/viewer/offline/stream.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Draws the pictures of a stream's moments, off-screen. Create it before streaming, so that a machine that cannot draw
// fails at once.
class Pictures {
 public:
  virtual ~Pictures() = default;
  // Writes options.sheet (the first of `streamed` moments, one for each of options.times_s) and options.out (the last
  // moment). The moments must be those of moment_times_s in main.cpp, which is not checked. The error is one line with
  // the file.
  virtual Result<void> write(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                             const StreamResult& streamed) = 0;
};

// Refuses in a build without the renderer, and where the machine has no OpenGL ES 3.
Result<std::unique_ptr<Pictures>> make_pictures();

}  // namespace hairnet::viewer
