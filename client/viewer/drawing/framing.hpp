#pragma once

#include <optional>
#include <span>

#include "client/viewer/characters/options.hpp"
#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/sources/hair_source.hpp"

namespace hairnet::viewer {

// Where a view looks from, before a heading about +Y turns it; about 1 long.
Vec3 direction_of(View view);

// The mean place of the heads; none without characters.
std::optional<Vec3> middle_of(std::span<const ViewedCharacter> viewed);

// Looks at all heads and their hair, from the side that `view` names of where they face in the mean.
void frame_all(std::span<const ViewedCharacter> viewed, View view, int width, int height, OrbitCamera& camera);

}  // namespace hairnet::viewer
