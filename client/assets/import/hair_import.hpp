#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/imported_body.hpp"
#include "client/assets/import/placement.hpp"
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

// The decoded files of one head. The caller moves it into the import, which changes the strands.
struct HairParts {
  // The groom's name.
  std::string name;
  // Strands are in the order of the files; each part has its group.
  std::vector<StrandFile> strands;
  std::optional<ImportedBody> body;
  std::string body_file;
};

// What is known of a body's placement: what is given, else what its file states. A stated unit in which its top is no
// head is guessed instead, with a line in `doubts`. The head joint has a line in `notes`.
KnownPlacement known_of_body(const HairParts& parts, const KnownPlacement& given, std::vector<std::string>& notes,
                             std::vector<std::string>& doubts);

// Makes the groom that all programs make of these files: cuts outliers, turns strands root first, finds the placement,
// and assembles. Each warning is a line `FILE: what`, the first of which says what the strands were taken as; the error
// is such a line too. The result depends on the files and their order alone. It takes no lock and reads no file, so
// threads may import several heads at once.
Result<ImportedGroom> import_hair_parts(HairParts parts, const HairImport& import);

}  // namespace hairnet
