#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Whether a file of that name holds strands in a form that others use: .hair, .tfx, .data or .obj.
bool is_foreign_hair(std::string_view path);

// A groom of strands that lie in files of others' formats, each file a group; an .obj without lines among them is the
// body they were made on. Without strands the body gets made hair, fitted to it. Units and axes are guessed, and said
// on stderr.
Result<Groom> import_hair(std::span<const std::string> files);

// What files show without a word more: every .groom a character, all foreign files together one, all moved by the
// first .bvh among them, or looking around. All about the origin and of one colour: load_characters says where they
// stand. Refused in one line, with the file's name.
Result<std::vector<CharacterSetup>> characters_of_files(std::span<const std::string> files);

}  // namespace hairnet::viewer
