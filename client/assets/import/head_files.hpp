#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "client/assets/import/hair_import.hpp"
#include "client/assets/import/imported_body.hpp"
#include "client/assets/import/strands.hpp"
#include "core/result.hpp"

namespace hairnet {

// The extensions of strand files, for messages: ".hair .tfx …".
std::string strand_extensions();

// Reads what a file's extension names, also in capitals; null for a file that holds no strands by its name.
StrandDecoder* strand_decoder_of(std::string_view file);

// The extensions of the files of bodies.
inline constexpr std::string_view kBodyFiles = ".glb .gltf .vrm .obj .ply .usd .usda .usdc .usdz";

// Whether a file holds a body and never strands, by its extension: .glb .gltf .vrm.
bool is_body_file(std::string_view file);
// Whether a file may hold a body: one of kBodyFiles.
bool may_hold_body(std::string_view file);

// Decodes the body of a file that may hold one and is not glTF. The error begins with the file's name.
Result<ImportedBody> decode_body(const std::string& file, std::span<const std::byte> bytes);

// Adds the body of a file, if there is none yet. A head has one body: a second one is refused, because nothing says
// which is meant.
Result<void> add_body(const std::string& file, Result<ImportedBody> body, HairParts& parts);

// Adds what a file that is not glTF holds: strands, or where it has none the body that they were made on. The strands
// make the group of that name; empty: those that the file names, or else one with its stem. The error begins with the
// file's name.
Result<void> add_file(const std::string& file, std::span<const std::byte> bytes, const std::string& group,
                      HairParts& parts);

}  // namespace hairnet
