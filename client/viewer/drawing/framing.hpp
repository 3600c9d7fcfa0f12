#pragma once

#include <optional>
#include <span>

#include "client/viewer/characters/options.hpp"
#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/sources/hair_source.hpp"

namespace hairnet::viewer {

// Returns the middle of a head in the world, m. Cameras look at this place, and the mouse picks a ball about it.
Vec3 head_middle(const Pose& pose);

// The direction from the head to the eye before a heading about +Y turns it; its length is about 1. All views look a
// little down.
Vec3 direction_of(View view);

// The mean place of the heads; none without characters.
std::optional<Vec3> middle_of(std::span<const ViewedCharacter> viewed);

// Frames all heads and their hair, from the side that `view` names relative to the mean direction of the faces. `width`
// and `height` are those of the picture's part that should show them, pixels. Hair counts as it is at rest.
void frame_all(std::span<const ViewedCharacter> viewed, View view, int width, int height, OrbitCamera& camera);

}  // namespace hairnet::viewer
