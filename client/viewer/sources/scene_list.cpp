#include "client/viewer/sources/scene_list.hpp"

#include <algorithm>
#include <array>

#include "client/assets/load_groom.hpp"
#include "client/assets/made/made.hpp"
#include "client/assets/made_spec.hpp"
#include "client/viewer/characters/hair_colour.hpp"

namespace hairnet::viewer {
namespace {

// The number of random variants of a motion. Each variant is stored, so the number bounds the memory.
constexpr std::uint32_t kSeeds = 8;
// The last entry of both lists: the characters take all hairstyles, or all motions, one after the other.
constexpr const char* kInTurn = "one after the other";

}  // namespace

SceneList::SceneList(const std::vector<CharacterSetup>& characters) {
  for (const MadeName& made : hairstyle_names()) hair_.emplace_back(made.name);
  for (const MadeName& made : motion_names()) motions_.emplace_back(made.name);
  made_hair_ = hair_.size();
  made_motions_ = motions_.size();
  for (const CharacterSetup& setup : characters) {
    const std::string number = std::to_string(given_.size() + 1);
    given_.push_back({setup.groom->name + " " + number, setup.groom, std::make_shared<const Motion>(setup.motion),
                      Place{}, setup.level, setup.hair_colour, setup.material});
    hair_.push_back("given " + number + ": " + setup.groom->name);
    motions_.push_back("given " + number + ": " + setup.motion.name);
  }
  hair_.emplace_back(kInTurn);
  motions_.emplace_back(kInTurn);
}

Result<std::shared_ptr<const Groom>> SceneList::groom_of(std::size_t hair) {
  if (hair >= made_hair_) return given_[hair - made_hair_].groom;
  std::shared_ptr<const Groom>& groom = grooms_[hair];
  if (groom) return groom;
  // Made hair is loaded as the command line would load it, so both are alike.
  Result<Groom> made = load_groom(std::string(kMadePrefix) + hair_[hair]);
  if (!made) return Refusal(made.error());
  groom = std::make_shared<const Groom>(std::move(*made));
  return groom;
}

Result<std::shared_ptr<const Motion>> SceneList::motion_of(std::size_t motion, std::uint32_t seed) {
  if (motion >= made_motions_) return given_[motion - made_motions_].motion;
  // A pair of motion and seed names a variant.
  std::shared_ptr<const Motion>& moved = moved_[{motion, seed}];
  if (moved) return moved;
  MotionOptions options;
  options.seed = seed;
  Result<Motion> made = make_motion(motions_[motion], options);
  if (!made) return Refusal(made.error());
  moved = std::make_shared<const Motion>(std::move(*made));
  return moved;
}

Result<std::vector<LocalCharacter>> SceneList::make(const Choice& choice) {
  const bool every_level = choice.level == kEveryLevel;
  // The learnt level needs a server, which learns it: a local world has none to show.
  constexpr std::array kLevelsHere{LevelIndex::high, LevelIndex::medium, LevelIndex::low, LevelIndex::ether,
                                   LevelIndex::rigid};
  const auto count =
      every_level ? kLevelsHere.size() : static_cast<std::size_t>(std::clamp(choice.count, 1, kCountMax));
  const std::size_t hair_count = hair_.size() - 1, motion_count = motions_.size() - 1;
  const auto hair = static_cast<std::size_t>(choice.hair), motion = static_cast<std::size_t>(choice.motion);
  if (hair > hair_count || motion > motion_count) return Refusal("no such scene");
  std::vector<LocalCharacter> characters;
  for (std::size_t n = 0; n < count; ++n) {
    // For a comparison of levels, the characters differ only in their level: the same seed moves all alike.
    const std::uint32_t seed = every_level ? 1 : 1 + static_cast<std::uint32_t>(n) % kSeeds;
    const auto groom = groom_of(hair < hair_count ? hair : n % hair_count);
    if (!groom) return Refusal(groom.error());
    const auto moved = motion_of(motion < motion_count ? motion : n % motion_count, seed);
    if (!moved) return Refusal(moved.error());
    LocalCharacter character;
    character.groom = *groom;
    character.motion = *moved;
    // A given motion may already include a place, so a single character is not moved.
    if (count > 1) character.place = side_by_side(n, count);
    character.level = every_level ? kLevelsHere[n] : static_cast<LevelIndex>(choice.level);
    character.name = every_level ? std::string(kLevelNames[static_cast<std::size_t>(character.level)])
                                 : (*groom)->name + " " + std::to_string(n + 1);
    character.hair_colour = default_hair_colour(every_level ? 0 : n);
    characters.push_back(std::move(character));
  }
  return characters;
}

}  // namespace hairnet::viewer
