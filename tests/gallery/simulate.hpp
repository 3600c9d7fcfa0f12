#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/render/stage.hpp"
#include "core/levels/level.hpp"
#include "core/pose/motion.hpp"
#include "core/result.hpp"
#include "core/solver/step.hpp"

namespace hairnet::gallery {

// A hairstyle with its levels, ready to be stepped.
struct Hairstyle {
  std::string name;
  std::shared_ptr<const Groom> groom;
  std::shared_ptr<const LevelSet> levels;
};
Result<Hairstyle> load_hairstyle(const std::string& name);

// One character at one moment.
struct Moment {
  Pose pose;
  // Belongs to the hairstyle's levels; null means rigid.
  const LevelGeometry* geometry = nullptr;
  std::vector<Vec3f> grid_displacements;
};

// Steps a character of `style` through `motion`, after a second of easing into it, and copies out the moments at
// `times_s` (ascending, from the motion's beginning; a negative time is at rest).
Result<std::vector<Moment>> simulate_motion(const Hairstyle& style, const std::string& motion, LevelIndex level,
                                            const std::vector<double>& times_s, const Environment& environment = {});

// The stage's input for a moment, which must outlive the result.
draw::ShownCharacter shown(std::size_t groom, const Moment& moment);

// Hair colours that distinguish hairstyles; linear RGB.
Vec3f hair_colour(std::size_t number);

}  // namespace hairnet::gallery
