#pragma once

#include <string>

#include "client/assets/import/bvh.hpp"
#include "client/assets/made/made.hpp"
#include "core/result.hpp"

namespace hairnet {

// What moves a character for whom no motion is named.
inline constexpr const char* kDefaultMotion = "made:look_around";

// Loads what a command line names as a motion: a .bvh file's path, read with `import` and `body` (decode_bvh), or
// `made:NAME` with the options `made`. The importer's warnings go to stderr. Any path is read as .bvh, whatever its
// extension. `body` may be null. The motion gets the file's name without its extension. The error does not name the
// file.
Result<Motion> load_motion(const std::string& spec, const BvhImport& import = {}, const Body* body = nullptr,
                           const MotionOptions& made = {});

}  // namespace hairnet
