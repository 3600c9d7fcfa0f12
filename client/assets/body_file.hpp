#pragma once

#include <string>

#include "client/assets/import/imported_body.hpp"
#include "core/result.hpp"

namespace hairnet {

// Reads the body of a file, one of kBodyFiles. The error begins with the file's name. Buffers that a .gltf names are
// read from its folder. The body is in the file's axes and unit.
Result<ImportedBody> read_body(const std::string& path);

}  // namespace hairnet
