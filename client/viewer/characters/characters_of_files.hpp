#pragma once

#include <span>
#include <string>
#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Makes the characters of plain files: each .groom is one character, all files of other programs together are one
// (import_hair). One .bvh moves all of them, and two are refused; without one they have the default motion. All stand
// at the origin in one colour; load_characters gives them places. A refusal is one line with the file's name.
Result<std::vector<CharacterSetup>> characters_of_files(std::span<const std::string> files,
                                                        const HairImport& import = {});

}  // namespace hairnet::viewer
