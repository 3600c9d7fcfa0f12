#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/sources/local_world.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// The hair and motions that a local world can use: every made hairstyle and motion, and those of the loaded characters,
// in any number. Makes each on its first use, which takes a moment, and stores it. One thread.
class SceneList {
 public:
  // A limit of the slider: one core steps about 200 heads at the finest level.
  static constexpr int kCountMax = 256;
  // Choice::level has this value to ask for one character of each level, side by side.
  static constexpr int kEveryLevel = static_cast<int>(kLevelCount);
  struct Choice {
    // Are indices into hair() and motions().
    int hair = 0, motion = 0;
    int count = 1;
    // Is a LevelIndex, or kEveryLevel.
    int level = 0;
  };

  explicit SceneList(const std::vector<CharacterSetup>& characters);

  // Names of the choices, for a person; the last one is "one after the other", which gives character n the n-th.
  [[nodiscard]] const std::vector<std::string>& hair() const { return hair_; }
  [[nodiscard]] const std::vector<std::string>& motions() const { return motions_; }

  // The error is one line, for a choice that does not exist or a hairstyle that cannot be made.
  Result<std::vector<LocalCharacter>> make(const Choice& choice);
  // The characters of the command line.
  [[nodiscard]] const std::vector<LocalCharacter>& given() const { return given_; }

 private:
  Result<std::shared_ptr<const Groom>> groom_of(std::size_t hair);
  Result<std::shared_ptr<const Motion>> motion_of(std::size_t motion, std::uint32_t seed);

  std::vector<LocalCharacter> given_;
  std::vector<std::string> hair_, motions_;
  std::size_t made_hair_ = 0, made_motions_ = 0;
  std::map<std::size_t, std::shared_ptr<const Groom>> grooms_;
  std::map<std::pair<std::size_t, std::uint32_t>, std::shared_ptr<const Motion>> moved_;
};

}  // namespace hairnet::viewer
