#pragma once

#include <string>

#include "client/assets/import/bvh.hpp"
#include "client/assets/made/made.hpp"
#include "core/result.hpp"

namespace hairnet {

// Loads what a command line names as a motion: a .bvh file's path, read with `import` and `body` (decode_bvh), or
// `made:NAME` with the options `made`. The importer's warnings go to stderr.
Result<Motion> load_motion(const std::string& spec, const BvhImport& import = {}, const Body* body = nullptr,
                           const MotionOptions& made = {});

}  // namespace hairnet
