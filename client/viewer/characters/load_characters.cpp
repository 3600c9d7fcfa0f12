#include "client/viewer/characters/load_characters.hpp"

#include <iterator>
#include <map>
#include <span>
#include <utility>

#include "client/assets/load_groom.hpp"
#include "client/assets/load_motion.hpp"
#include "client/viewer/characters/characters_of_files.hpp"
#include "client/viewer/characters/hair_colour.hpp"
#include "client/viewer/characters/place.hpp"

namespace hairnet::viewer {

namespace {

// Grooms by their name and number of strands: a file that several characters have is loaded once.
using Grooms = std::map<std::pair<std::string, std::size_t>, std::shared_ptr<const Groom>>;

// Loads the character at the origin. Learnt hair is read beside the groom, since it travels in the groom's file.
Result<CharacterSetup> load_character(const CharacterOptions& options, const HairImport& import, Grooms& grooms) {
  std::shared_ptr<const Groom>& groom = grooms[{options.groom, options.hairstyle.strand_count}];
  if (!groom) {
    Result<Groom> loaded = load_groom(options.groom, options.hairstyle, import);
    if (!loaded) return Refusal(loaded.error());
    groom = std::make_shared<const Groom>(std::move(*loaded));
  }
  Result<std::shared_ptr<const LearntHair>> learnt = load_learnt(options.groom);
  if (!learnt) return Refusal(learnt.error());
  Result<Motion> motion = load_motion(options.motion, options.bvh, &groom->body);
  if (!motion) return Refusal(options.motion + ": " + motion.error());
  // The colour is set when all characters are known.
  return CharacterSetup{groom,        std::move(*motion), options.level, Vec3f::Zero(), options.material,
                        options.name, std::move(*learnt)};
}

}  // namespace

Result<std::vector<CharacterSetup>> load_characters(const ViewOptions& options) {
  Grooms grooms;
  std::vector<CharacterSetup> characters;
  for (const CharacterOptions& character : options.characters) {
    Result<CharacterSetup> setup = load_character(character, options.hair, grooms);
    if (!setup) return Refusal(setup.error());
    characters.push_back(std::move(*setup));
  }
  if (!options.files.empty()) {
    Result<std::vector<CharacterSetup>> more = characters_of_files(options.files, options.hair);
    if (!more) return Refusal(more.error());
    std::move(more->begin(), more->end(), std::back_inserter(characters));
  }
  for (std::size_t i = 0; i < characters.size(); ++i) {
    const CharacterOptions* named = i < options.characters.size() ? &options.characters[i] : nullptr;
    characters[i].hair_colour = named && named->colour ? *named->colour : default_hair_colour(i);
    // The place becomes a part of the motion: sources need not know of places.
    move_to(named && named->place ? *named->place : side_by_side(i, characters.size()), characters[i].motion);
  }
  return characters;
}

}  // namespace hairnet::viewer
