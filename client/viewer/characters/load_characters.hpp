#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/viewer/characters/options.hpp"
#include "core/groom/groom.hpp"
#include "core/pose/motion.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// One loaded character. Characters with the same groom share it, on the GPU and in the upload, too.
struct CharacterSetup {
  std::shared_ptr<const Groom> groom;
  // World space, at the character's place.
  Motion motion;
  LevelIndex level = LevelIndex::high;
  // Linear RGB.
  Vec3f hair_colour = Vec3f::Zero();
  // The material in place of the groom's base material while the character is simulated; none: as built.
  std::optional<Material> material;
  // Empty without a name.
  std::string name = {};
  // Learnt hair from the groom's file; null: none.
  std::shared_ptr<const LearntHair> learnt = nullptr;
};

// Returns the characters that `options` names, then those of its files. Characters without a given place stand side by
// side. The error is one line with the file's name; then nothing is returned.
Result<std::vector<CharacterSetup>> load_characters(const ViewOptions& options);

}  // namespace hairnet::viewer
