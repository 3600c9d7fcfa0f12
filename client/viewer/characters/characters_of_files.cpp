#include "client/viewer/characters/characters_of_files.hpp"

#include <utility>

#include "client/assets/import/head_files.hpp"
#include "client/assets/import_hair.hpp"
#include "client/assets/load_groom.hpp"
#include "client/assets/load_motion.hpp"
#include "core/file_name.hpp"

namespace hairnet::viewer {

Result<std::vector<CharacterSetup>> characters_of_files(std::span<const std::string> files, const HairImport& import) {
  HairFiles foreign;
  std::vector<std::string> motions;
  std::vector<std::shared_ptr<const Groom>> grooms;
  for (const std::string& file : files) {
    // A file is known by its ending alone; what is in it is checked when it is read.
    if (is_foreign_file(file)) {
      foreign.files.push_back(file);
    } else if (extension_of(file) == ".bvh") {
      motions.push_back(file);
    } else if (extension_of(file) == ".groom") {
      Result<Groom> groom = load_groom(file);
      if (!groom) return Refusal(groom.error());
      grooms.push_back(std::make_shared<const Groom>(std::move(*groom)));
    } else {
      return Refusal(file + ": not one of " + strand_extensions() + " .glb .gltf .vrm .groom .bvh");
    }
  }
  // One motion moves all characters: with two it would be unclear which.
  if (motions.size() > 1) return Refusal(motions[1] + ": a second motion beside " + motions[0]);
  // All files of other programs are one head: hair in several files, and a body.
  if (!foreign.files.empty()) {
    Result<Groom> groom = load_hair(foreign, import);
    if (!groom) return Refusal(groom.error());
    grooms.push_back(std::make_shared<const Groom>(std::move(*groom)));
  }
  // A motion alone still needs someone to move.
  if (grooms.empty()) {
    Result<Groom> groom = load_groom("made:long_straight");
    if (!groom) return Refusal(groom.error());
    grooms.push_back(std::make_shared<const Groom>(std::move(*groom)));
  }
  std::vector<CharacterSetup> characters;
  for (const std::shared_ptr<const Groom>& groom : grooms) {
    const std::string spec = motions.empty() ? kDefaultMotion : motions[0];
    // Each groom has a body of its own, with which the motion is read.
    Result<Motion> motion = load_motion(spec, {}, &groom->body);
    if (!motion) return Refusal(spec + ": " + motion.error());
    characters.push_back({groom, std::move(*motion), LevelIndex::high, Vec3f::Zero(), {}});
  }
  return characters;
}

}  // namespace hairnet::viewer
