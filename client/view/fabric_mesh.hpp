#pragma once

#include <cstdint>
#include <vector>

#include "client/view/light_volume.hpp"

namespace hairnet::view {

// One point of a cloth, strip or thread, as fabric.vert reads it.
struct FabricVertex {
  std::array<float, 3> position;
  std::array<std::int16_t, 4> normal;  // xyz / 32767
  std::array<std::int8_t, 4> fibre;    // xyz / 127: along the hair of a strip; zero on cloth and threads
  std::array<std::uint8_t, 4> light;   // light left of ambient, fill, rim; / 255
  std::array<float, 4> colour;         // linear RGB, opacity
  std::array<float, 3> place;          // on a strip: across 0 … 1, along 0 … 1; and a number of its own
};

// All cloths, strips and threads of a character: first the opaque ones, then those that light comes through.
struct FabricMesh {
  std::vector<FabricVertex> vertices;
  std::vector<std::uint32_t> triangles;  // without those that touch a vertex that is not drawable
  std::size_t opaque_index_count = 0;
  Eigen::AlignedBox3f box;
};

FabricMesh make_fabric(const DrawnCharacter& character, const LightVolume& light);

}  // namespace hairnet::view
