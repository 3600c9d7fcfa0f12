#pragma once

#include <cstdint>
#include <vector>

#include "core/groom/body.hpp"
#include "core/groom/material_scale.hpp"
#include "core/pose/pose.hpp"
#include "core/solver/wind.hpp"

namespace hairnet {

// A few seconds of motion from which a basis learns what the hair can do. Real motion is in its span when it has held
// postures, sharp starts and stops, displaced necks and shoulders, wind and changed material. Each number gives another
// motion; every sixteen together have all of these.
struct TrainingMotion {
  // One pose a tick; no step between them is a teleport.
  std::vector<Pose> poses;
  Wind wind;
  MaterialScale material;
};

// The motion of that number, with one pose a tick from rest on. The same number gives the same motion for the same
// body.
TrainingMotion make_training_motion(std::uint32_t number, const Body& body, double tick_s, std::size_t tick_count);

}  // namespace hairnet
