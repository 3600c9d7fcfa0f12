#pragma once

#include <string>
#include <string_view>

#include "client/assets/import/strands.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace hairnet {

// The extensions of strand files, for messages: ".hair .tfx …".
std::string strand_extensions();

// Reads what a file's extension names, also in capitals; null for a file that holds no strands by its name.
StrandDecoder* strand_decoder_of(std::string_view path);

// Read strands and bodies from their files. An error begins with the file's name.
Result<ImportedStrands> read_strands(const std::string& path);
Result<TriangleMesh> read_mesh(const std::string& path);

}  // namespace hairnet
