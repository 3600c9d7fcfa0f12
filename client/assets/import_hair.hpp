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

// The files of one head. A file without strands among `files` is the body that they were made on. It describes what a
// user names on a command line; paths are not opened before `import_hair`.
struct HairFiles {
  std::vector<std::string> files;
  // There is one group for each file, or none: then those that the files name, or else their stems.
  std::vector<std::string> groups;
  // One of kBodyFiles; empty: there is none, or it is among `files`.
  std::string body;
  // The groom's name; empty: it is the first group's.
  std::string name;
};

// Makes a groom of the strands in files of other programs; each file becomes a group, or several if it names them.
// Without strands the body gets made hair, fitted to it. What was guessed and cut stands in the warnings. The error
// begins with a file's name. The files share one placement, so all of one head must be imported together. It reads
// whole files into memory.
Result<ImportedGroom> import_hair(const HairFiles& files, const HairImport& import = {});
// Does the same and prints the warnings as lines on stderr.
Result<Groom> load_hair(const HairFiles& files, const HairImport& import = {});

// Replaces each folder by the strand files and bodies in it, but not .txt, and each pattern with * or ? that is no
// file's name by the files that match it, all in the order of their names. Returns an error for a folder or a pattern
// with none. The order of names decides the order of groups, so it does not depend on the file system.
Result<std::vector<std::string>> hair_files_of(std::span<const std::string> names);

}  // namespace hairnet
