#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/hair_import.hpp"
#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet {

// Whether the name is that of a file of another program, of strands or of a body: one of kHairFiles or kBodyFiles.
bool is_foreign_hair(std::string_view path);

// The files of one head. A file without strands among `files` is the body that they were made on.
struct HairFiles {
  std::vector<std::string> files;
  std::vector<std::string> groups;  // one for each file, or none: those that the files name, or else their stems
  std::string body;                 // one of kBodyFiles; empty: none, or among `files`
  std::string name;                 // the groom's; empty: the first group's
};

// Makes a groom of the strands in files of other programs; each file becomes a group, or several if it names them.
// Without strands the body gets made hair, fitted to it. Prints what was guessed and cut as lines on stderr. The error
// begins with a file's name.
Result<Groom> import_hair(const HairFiles& files, const HairImport& import = {});

}  // namespace hairnet
