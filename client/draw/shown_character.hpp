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
  // Its number at who draws, as render::Stage::add_groom gives it.
  std::size_t groom = 0;
  // World space; the head's transform moves the hair, all bones the body.
  Pose pose;
  // Scales its groom; a negative one mirrors it in each bone, before the pose.
  float scale = 1;
  // The hair is rigid if its geometry is null.
  MovedLattice lattice;
  // The albedo at the root, linear RGB, and at the tip; none there means the same.
  Vec3f hair_colour{0.16f, 0.07f, 0.03f};
  std::optional<Vec3f> hair_tip_colour;
  Vec3f skin_colour{0.75f, 0.52f, 0.42f};
  // The hair's, 0 to 1: rougher hair has wider highlights.
  float roughness = 77.0f / 255;
  // None means that it is chosen by its size on the screen.
  std::optional<DrawDetail> detail;
  bool body_shown = true;
  // A picture follows its motion by this number; zero means that it does not.
  std::uint64_t id = 0;
};

}  // namespace hairnet::draw
