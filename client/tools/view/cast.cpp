#include "client/tools/view/cast.hpp"

#include <map>
#include <span>
#include <utility>

#include "client/tools/load/load_groom.hpp"
#include "client/tools/load/load_motion.hpp"
#include "client/tools/load/made_spec.hpp"
#include "client/tools/view/hair_colour.hpp"
#include "client/tools/view/imported_hair.hpp"
#include "client/tools/view/place.hpp"

namespace hairnet::viewer {

Result<std::vector<Actor>> load_cast(const std::vector<CharacterOptions>& characters) {
  std::map<std::pair<std::string, std::size_t>, std::shared_ptr<const Groom>> grooms;
  std::vector<Actor> cast;
  for (const CharacterOptions& options : characters) {
    std::shared_ptr<const Groom>& groom = grooms[{options.groom, options.hairstyle.strand_count}];
    if (!groom) {
      const bool foreign = !is_made_spec(options.groom) && is_foreign_hair(options.groom);
      Result<Groom> loaded =
          foreign ? import_hair(std::span(&options.groom, 1)) : load_groom(options.groom, options.hairstyle);
      if (!loaded && foreign) return Refusal(loaded.error());
      if (!loaded) return Refusal(options.groom + ": " + loaded.error());
      groom = std::make_shared<const Groom>(std::move(*loaded));
    }
    Result<Motion> motion = load_motion(options.motion, options.bvh, &groom->body);
    if (!motion) return Refusal(options.motion + ": " + motion.error());
    move_to(options.place.value_or(side_by_side(cast.size(), characters.size())), *motion);
    cast.push_back({groom, std::move(*motion), options.level, options.colour.value_or(default_hair_colour(cast.size())),
                    options.material});
  }
  return cast;
}

}  // namespace hairnet::viewer
