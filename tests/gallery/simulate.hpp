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

// The state of one character at one time.
struct Moment {
  Pose pose;
  // The lattice of the character's level, which Hairstyle::levels owns; null means that the hair is rigid.
  const LevelGeometry* geometry = nullptr;
  std::vector<Vec3f> grid_displacements;
};

// Steps a character of `style` through `motion` at 60 Hz and returns its state at each of `times_s`, which ascend and
// count from the motion's beginning. A second before it the head moves from upright rest to the motion's first pose;
// negative times show this second.
Result<std::vector<Moment>> simulate_motion(const Hairstyle& style, const std::string& motion, LevelIndex level,
                                            const std::vector<double>& times_s, const Environment& environment = {});

// Returns the stage's input for a character with the groom of this number. `moment` must outlive the result.
draw::ShownCharacter shown(std::size_t groom, const Moment& moment);

// Hair colours that distinguish hairstyles; linear RGB.
Vec3f hair_colour(std::size_t number);

}  // namespace hairnet::gallery
