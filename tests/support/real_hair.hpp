#pragma once

#include <ostream>

#include "client/assets/import/placement.hpp"
#include "core/result.hpp"
#include "tests/support/import_files.hpp"

// Lists hairstyles that others have made, in ../shared/data beside the checkout. A number is the length of a file's
// unit in metres.
namespace hairnet::test {

struct RealHair {
  const char* name;
  const char* path;
  StrandDecoder* decode;
  Placement placement;

  friend void PrintTo(const RealHair& hair, std::ostream* out) { *out << hair.name; }
};

// The styles are straight and long, tied back, wavy to curly, and layered. The placement holds the axis that is up,
// the axis of the face, and the metres of a unit.
inline const RealHair kRealHair[] = {
    {"straight", "hair/yuksel_straight/straight.hair", decode_yuksel_hair, {Axis::plus_z, Axis::plus_y, 0.0033, {}}},
    {"tail", "hair/amd_ponytail/tail.tfx", decode_tressfx, {Axis::plus_y, Axis::minus_z, 0.00254, {}}},
    {"wavy", "hair/harolongo/harolongo.data", decode_usc_data, {Axis::plus_y, Axis::plus_z, 0.01, {}}},
    {"layered", "hair/sintel/SintelHairOriginal-sintel_hair.16points.tfx", decode_tressfx, {}},
};

// Imports a hairstyle without its body, so a skull is fitted to the roots. The error is one line.
inline Result<Groom> import_real(const RealHair& hair) {
  auto strands = hair.decode(file_bytes(shared_data() / hair.path));
  if (!strands) return Refusal(strands.error());
  GroomDef def;
  def.name = hair.name;
  def.files.push_back({std::move(*strands), "hair"});
  def.placement = hair.placement;
  auto imported = assemble_groom(def);
  if (!imported) return Refusal(imported.error());
  return std::move(imported->groom);
}

}  // namespace hairnet::test
