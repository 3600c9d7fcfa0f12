#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/hair_import.hpp"
#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet {

// Whether the name is that of a file of another program, of strands or of a body.
bool is_foreign_file(std::string_view path);

// The files of one head. A file without strands among `files` is the body that they were made on.
struct HairFiles {
  std::vector<std::string> files;
  std::vector<std::string> groups;  // one for each file, or none: those that the files name, or else their stems
  std::string body;                 // one of kBodyFiles; empty: none, or among `files`
  std::string name;                 // the groom's; empty: the first group's
};

// Makes a groom of the strands in files of other programs; each file becomes a group, or several if it names them.
// Without strands the body gets made hair, fitted to it. What was guessed and cut stands in the warnings. The error
// begins with a file's name.
Result<ImportedGroom> import_hair(const HairFiles& files, const HairImport& import = {});
// Does the same and prints the warnings as lines on stderr.
Result<Groom> load_hair(const HairFiles& files, const HairImport& import = {});

// Replaces each folder by the strand files and bodies in it, but not .txt, and each pattern with * or ? that is no
// file's name by the files that match it, all in the order of their names. Returns an error for a folder or a pattern
// with none.
Result<std::vector<std::string>> hair_files_of(std::span<const std::string> names);

}  // namespace hairnet
