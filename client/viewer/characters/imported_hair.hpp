#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Whether the name is that of a strand file of another program: .hair, .tfx, .data or .obj.
bool is_foreign_hair(std::string_view path);

// Makes a groom of the strands in files of other programs; each file becomes a group. An .obj without lines among them
// is the body that they were made on. Without strands the body gets made hair, fitted to it. Guesses units and axes,
// and prints the guesses on stderr.
Result<Groom> import_hair(std::span<const std::string> files);

// Makes the characters of plain files: each .groom is one character, all imported files together are one. The first
// .bvh moves all of them; without one they look around. All stand at the origin in one colour; load_characters gives
// them places. A refusal is one line with the file's name.
Result<std::vector<CharacterSetup>> characters_of_files(std::span<const std::string> files);

}  // namespace hairnet::viewer
