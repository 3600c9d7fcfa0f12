#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/placement.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace hairnet {

// Which point of each strand in a file is its root.
enum class RootEnd : std::uint8_t { guess, first, last };
Result<RootEnd> parse_root_end(std::string_view text);  // "guess", "first", "last"

// What is known of the files of one head. All else is guessed, over all files together.
struct HairImport {
  KnownPlacement strands, body;
  RootEnd roots = RootEnd::guess;
  double hairs_in_all = 100'000;
  // The strands are guides between which others are filled in, up to this number; none for as many as there are.
  std::optional<std::size_t> fill;
  // Refuses hair of which something would be cut, or taken in spite of a doubt.
  bool strict = false;
  // The program's flags up, face, unit and roots begin with it in messages.
  std::string flag_prefix = "--";
};

// The decoded files of one head.
struct HairParts {
  // The groom's name.
  std::string name;
  std::vector<StrandFile> strands;
  std::optional<TriangleMesh> body;
  std::string body_file;
};

// Makes the groom that all programs make of these files: cuts outliers, turns strands root first, finds the placement,
// and assembles. Each warning is a line `FILE: what`; the error is such a line too.
Result<ImportedGroom> import_hair_parts(HairParts parts, const HairImport& import);

}  // namespace hairnet
