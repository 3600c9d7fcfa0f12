#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "client/assets/import/body.hpp"
#include "client/assets/import/strands.hpp"
#include "core/result.hpp"

namespace hairnet {

// The extensions of strand files, for messages.
inline constexpr std::string_view kHairFiles = ".hair .tfx .txt .data .abc .usd .usda .usdc .usdz .ply .npy .npz .obj";

// The extensions of the files of bodies.
inline constexpr std::string_view kBodyFiles = ".glb .gltf .vrm .obj .ply .usd .usda .usdc .usdz";

// Whether a file holds a body and never strands, by its extension: .glb .gltf .vrm.
bool is_body_file(std::string_view path);

// The format that a file's extension names, also in capitals: one of kHairFiles but .obj, which may be a body; none for
// any other.
std::optional<StrandFormat> strand_format_of(std::string_view path);

// Read strands and bodies from their files. An error begins with the file's name.
Result<ImportedStrands> read_strands(const std::string& path);
Result<ImportedBody> read_body(const std::string& path);

}  // namespace hairnet
