#pragma once

#include <string>
#include <string_view>

#include "client/assets/import/body.hpp"
#include "client/assets/import/strands.hpp"
#include "core/result.hpp"

namespace hairnet {

// The extensions of strand files, for messages: ".hair .tfx …".
std::string strand_extensions();

// Reads what a file's extension names, also in capitals; null for a file that holds no strands by its name.
StrandDecoder* strand_decoder_of(std::string_view path);

// The extensions of the files of bodies.
inline constexpr std::string_view kBodyFiles = ".glb .gltf .vrm .obj .ply .usd .usda .usdc .usdz";

// Whether a file holds a body and never strands, by its extension: .glb .gltf .vrm.
bool is_body_file(std::string_view path);
// Whether a file may hold a body: one of kBodyFiles.
bool may_hold_body(std::string_view path);

// Read strands and bodies from their files. An error begins with the file's name.
Result<ImportedStrands> read_strands(const std::string& path);
Result<ImportedBody> read_body(const std::string& path);

}  // namespace hairnet
