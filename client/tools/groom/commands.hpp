#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/assets/import_hair.hpp"
#include "client/assets/made/made.hpp"
#include "core/learning/learn_hair.hpp"
#include "core/result.hpp"

namespace hairnet::groom {

// The materials that a command line names, for groups or all hair.
struct MaterialOptions {
  // The material of all hair; none: the groom's own.
  std::optional<Material> material;
  // The materials of single groups, by the group's name.
  std::vector<std::pair<std::string, Material>> group_materials;
};
// Sets the material of all hair first, then those of groups, so that a group's own wins. Root lengths follow the
// material. The error names a missing group and the groups that there are.
Result<void> apply_materials(const MaterialOptions& options, Groom& groom);

struct ImportOptions {
  HairFiles files;
  HairImport import;
  // The root length of all strands, m, in place of the material's.
  std::optional<double> root_length_m;
  // A random share by which each strand's own root length differs.
  double root_spread = 0;
  MaterialOptions materials;
  std::string out;
  // Prints one object of JSON on stdout instead of lines, with the warnings in it.
  bool json = false;
};
// Reads strand files of one head into a groom file. The files may be folders and patterns. Nothing is written after an
// error, which is one line.
Result<void> import_groom(const ImportOptions& options);

struct ExportOptions {
  // A groom file, a strand file, or made:STYLE.
  std::string groom;
  HairstyleOptions hairstyle;
  HairImport import;
  // Its extension is the format (exported_extensions).
  std::string out;
};
// Writes the strands for other programs, in m, y up, face +z, at rest. Prints what stays behind on stderr.
Result<void> export_groom(const ExportOptions& options);

// One of our own hairstyles, to a groom file.
struct MakeOptions {
  std::string style, out;
  HairstyleOptions hairstyle;
  MaterialOptions materials;
};
Result<void> make_groom(const MakeOptions& options);

struct InspectOptions {
  std::string groom;
  // Used for made:STYLE.
  HairstyleOptions hairstyle;
  // Also builds the levels and modes and prints their statistics.
  bool levels = false;
};
// Prints on stdout, for people; its format may change.
Result<void> inspect_groom(const InspectOptions& options);

struct LevelsOptions {
  std::string groom;  // a groom file
  // Empty: beside the groom, with the extension .levels.
  std::string out;
};
// Builds the levels of a groom for programs that simulate it themselves. The file fits this very groom file and this
// version of the build alone.
Result<void> write_levels(const LevelsOptions& options);

struct LearnOptions {
  std::vector<std::string> grooms;  // groom files
  // The folder of a server's level cache; empty: none.
  std::string levels;
  // A folder for copies of the files with the learnt hair inside; empty: none.
  std::string embed;
  // Learns also hair that is already learnt.
  bool again = false;
  // Asked often, also while it learns; empty: never stopped.
  std::function<bool()> is_stopped;
  ModeTraining training;
  HairLearning learning;
};
// Learns the hair of each groom and writes it, with its levels and modes into the one folder, inside a copy of the
// groom's file into the other, whole or not at all. All files are read before the first is learnt, since each takes a
// minute or more. The error names the file; also where the hair of a groom is refused, because it errs more than level
// low.
Result<void> learn_grooms(const LearnOptions& options);

// Prints the names for `make` and for motions on stdout.
void list_made();

}  // namespace hairnet::groom
