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

// One loaded character. Characters with the same groom share it.
struct CharacterSetup {
  std::shared_ptr<const Groom> groom;
  Motion motion;  // at the character's place
  LevelIndex level = LevelIndex::high;
  Vec3f hair_colour = Vec3f::Zero();  // linear RGB
  std::optional<Material> material;
  std::string name = {};                               // empty: none
  std::shared_ptr<const LearntHair> learnt = nullptr;  // in the groom's file; null: none
};

// Returns the characters that `options` names, then those of its files. Characters without a given place stand side by
// side.
Result<std::vector<CharacterSetup>> load_characters(const ViewOptions& options);

}  // namespace hairnet::viewer
