#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "client/draw/draw_detail.hpp"
#include "core/modes/moved_lattice.hpp"
#include "core/pose/pose.hpp"

namespace hairnet::draw {

// One character at one moment, as a caller describes it for a picture. Spans in `lattice` must stay valid until the
// picture is drawn.
struct ShownCharacter {
  // The groom's number in what draws, as render::Stage::add_groom gives it. A number that is not there is not drawn.
  std::size_t groom = 0;
  // World space; the head's transform moves the hair, all bones the body.
  Pose pose;
  // Scales its groom; a negative one mirrors it in each bone, before the pose. The mechanics works in the groom's own
  // metres.
  float scale = 1;
  // The hair moves rigidly with the head if its geometry is null.
  MovedLattice lattice;
  // The albedo at the root, linear RGB, and at the tip; no tip colour means the same as at the root.
  Vec3f hair_colour{0.16f, 0.07f, 0.03f};
  std::optional<Vec3f> hair_tip_colour;
  Vec3f skin_colour{0.75f, 0.52f, 0.42f};
  // The roughness of the hair, 0 to 1: rougher hair has wider highlights. The default, about 0.3, is that of
  // room::default_appearance.
  float roughness = 77.0f / 255;
  // None means that the detail is chosen by the size on the screen.
  std::optional<DrawDetail> detail;
  bool body_shown = true;
  // An average of pictures follows the character's motion by this number (HairMotion); zero means that it does not.
  std::uint64_t id = 0;
};

}  // namespace hairnet::draw
