#pragma once

#include <string>

#include "client/assets/import/body.hpp"
#include "core/result.hpp"

namespace hairnet {

// Reads the body of a file, one of kBodyFiles. The error begins with the file's name.
Result<ImportedBody> read_body(const std::string& path);

}  // namespace hairnet
