#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/import/placement.hpp"
#include "core/made/made.hpp"
#include "core/result.hpp"

namespace hairnet::groom {

struct ImportOptions {
  std::vector<std::string> files;   // strands; the format is told by the file's name
  std::vector<std::string> groups;  // one a file, or none: the files' stems
  std::string body;                 // OBJ; empty: the skull is fitted from the roots
  Placement placement;
  std::optional<Axis> body_up, body_face;  // where the mesh differs from the strands
  std::optional<double> body_unit_m;
  double hairs_in_all = 100'000;
  double root_length_m = 0.02;
  double root_spread = 0;  // of each strand's own root length, a share
  std::string name, out;
};
Result<void> import_groom(const ImportOptions& options);

struct MakeOptions {
  std::string style, out;
  HairstyleOptions hairstyle;
};
Result<void> make_groom(const MakeOptions& options);

struct InspectOptions {
  std::string groom;
  HairstyleOptions hairstyle;  // for made:STYLE
  bool levels = false;         // build them and say how
};
Result<void> inspect_groom(const InspectOptions& options);

void list_made();

}  // namespace hairnet::groom
