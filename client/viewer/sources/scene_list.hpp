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

// The hair and motions from which a local world may choose: every made hairstyle and motion, and those of the loaded
// characters. Each is made on its first use, which takes a moment, and then stored. One thread.
class SceneList {
 public:
  // A limit of the slider: one core steps about 200 heads at the finest level.
  static constexpr int kCountMax = 256;
  // Choice::level has this value to ask for one character of each level, side by side.
  static constexpr int kEveryLevel = static_cast<int>(kLevelCount);
  struct Choice {
    // Indices into hair() and motions().
    int hair = 0, motion = 0;
    int count = 1;
    // A LevelIndex as a number, or kEveryLevel.
    int level = 0;
  };

  explicit SceneList(const std::vector<CharacterSetup>& characters);

  // The names of the choices, for a person. The last one is "one after the other", which gives each character another
  // one.
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
  // How many entries at the beginning of hair_ and motions_ are made ones; given ones follow.
  std::size_t made_hair_ = 0, made_motions_ = 0;
  // The made grooms by their index in hair_, and the made motions by index and seed.
  std::map<std::size_t, std::shared_ptr<const Groom>> grooms_;
  std::map<std::pair<std::size_t, std::uint32_t>, std::shared_ptr<const Motion>> moved_;
};

}  // namespace hairnet::viewer
