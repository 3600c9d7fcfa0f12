#pragma once

#include <cstdint>
#include <vector>

#include "client/view/light_volume.hpp"

namespace hairnet::view {

// One point of a smoothed strand, as strand.vert reads it.
struct RibbonVertex {
  std::array<float, 3> position;
  std::array<std::int8_t, 4> tangent;  // xyz / 127
  std::array<std::uint8_t, 4> along;   // fraction of the length, light left of ambient, fill, rim; / 255
  std::uint32_t strand;
};

// The strands of a character, ready to draw. Every point comes twice, for the ribbon's two sides.
struct StrandRibbons {
  std::vector<RibbonVertex> vertices;
  std::vector<std::uint32_t> lines;      // pairs of vertices
  std::vector<std::uint32_t> triangles;  // far to near
  std::vector<std::uint32_t> slabs;      // triangles[slabs[i] … slabs[i + 1]) lie at about one depth
  Eigen::AlignedBox3f box;
};

StrandRibbons make_ribbons(const DrawnCharacter& character, const LightVolume& light);

// Fills `triangles` and `slabs`, for blending.
void sort_far_to_near(StrandRibbons& ribbons, const Camera& camera);

}  // namespace hairnet::view
