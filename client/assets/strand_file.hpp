#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "client/assets/import/strands.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace hairnet {

// The extensions of strand files, for messages.
inline constexpr std::string_view kHairFiles = ".hair .tfx .txt .data .abc .usd .usda .usdc .usdz .ply .npy .npz .obj";

// The format that a file's extension names, also in capitals: one of kHairFiles but .obj, which may be a body; none for
// any other.
std::optional<StrandFormat> strand_format_of(std::string_view path);

// Read strands and bodies from their files. An error begins with the file's name.
Result<ImportedStrands> read_strands(const std::string& path);
Result<TriangleMesh> read_mesh(const std::string& path);

}  // namespace hairnet
