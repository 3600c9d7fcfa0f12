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

struct MaterialOptions {
  // Replaces the material of all hair; none: the groom's own.
  std::optional<Material> material;
  // Replaces materials by the group's name.
  std::vector<std::pair<std::string, Material>> group_materials;
};
// The error names a missing group.
Result<void> apply_materials(const MaterialOptions& options, Groom& groom);

struct ImportOptions {
  HairFiles files;
  HairImport import;
  std::optional<double> root_length_m;  // overrides that of the material
  double root_spread = 0;               // random share by which each strand's own root length differs
  MaterialOptions materials;
  std::string out;
  // Prints one object of JSON on stdout instead of lines.
  bool json = false;
};
// The files may be folders and patterns.
Result<void> import_groom(const ImportOptions& options);

struct ExportOptions {
  std::string groom;  // a groom file, a strand file, or made:STYLE
  HairstyleOptions hairstyle;
  HairImport import;
  std::string out;  // its extension is the format (exported_extensions)
};
// Writes the strands for other programs, in m, y up, face +z. Prints what stays behind on stderr.
Result<void> export_groom(const ExportOptions& options);

struct MakeOptions {
  std::string style, out;
  HairstyleOptions hairstyle;
  MaterialOptions materials;
};
Result<void> make_groom(const MakeOptions& options);

struct InspectOptions {
  std::string groom;
  HairstyleOptions hairstyle;  // for made:STYLE
  bool levels = false;         // builds them and prints statistics
};
Result<void> inspect_groom(const InspectOptions& options);

struct LevelsOptions {
  std::string groom;  // a groom file
  std::string out;    // empty: beside it, with the extension .levels
};
// Builds the levels of a groom for programs that simulate it themselves.
Result<void> write_levels(const LevelsOptions& options);

struct LearnOptions {
  std::vector<std::string> grooms;   // groom files
  std::string levels;                // the folder of a server's level cache; empty: none
  std::string embed;                 // a folder for copies of the files with the learnt hair inside; empty: none
  bool again = false;                // also hair that is already learnt
  std::function<bool()> is_stopped;  // asked often; empty: never
  ModeTraining training;
  HairLearning learning;
};
// Learns the hair of each groom and writes it, with its levels and modes into the one folder, inside a copy of the
// groom's file into the other, whole or not at all. All files are read before the first is learnt. The error names the
// file; also where the hair of a groom is refused.
Result<void> learn_grooms(const LearnOptions& options);

void list_made();

}  // namespace hairnet::groom
