#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "client/draw/draw_detail.hpp"
#include "core/modes/moved_lattice.hpp"
#include "core/pose/pose.hpp"

namespace hairnet::draw {

// One character at one moment.
struct ShownCharacter {
  std::size_t groom = 0;                   // its number at who draws, as from render::Stage::add_groom
  Pose pose;                               // world; the head's transform moves the hair, all bones the body
  float scale = 1;                         // of its groom; negative: mirrored in each bone, before the pose
  MovedLattice lattice;                    // its geometry null: the hair is rigid
  Vec3f hair_colour{0.16f, 0.07f, 0.03f};  // linear RGB albedo, at the root
  std::optional<Vec3f> hair_tip_colour;    // none: as hair_colour
  Vec3f skin_colour{0.75f, 0.52f, 0.42f};
  float roughness = 77.0f / 255;     // of the hair, 0 to 1: its highlights are wider
  std::optional<DrawDetail> detail;  // none: chosen by its size on the screen
  bool body_shown = true;
  std::uint64_t id = 0;  // by which a picture follows its motion; 0: it does not
};

}  // namespace hairnet::draw
