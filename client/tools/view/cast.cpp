#include "client/tools/view/cast.hpp"

#include <map>
#include <utility>

#include "client/tools/load/load_groom.hpp"
#include "client/tools/load/load_motion.hpp"
#include "client/tools/view/hair_colour.hpp"

namespace hairnet::viewer {

Result<std::vector<Actor>> load_cast(const std::vector<CharacterOptions>& characters) {
  std::map<std::pair<std::string, std::size_t>, std::shared_ptr<const Groom>> grooms;
  std::vector<Actor> cast;
  for (const CharacterOptions& options : characters) {
    std::shared_ptr<const Groom>& groom = grooms[{options.groom, options.hairstyle.strand_count}];
    if (!groom) {
      Result<Groom> loaded = load_groom(options.groom, options.hairstyle);
      if (!loaded) return Refusal(options.groom + ": " + loaded.error());
      groom = std::make_shared<const Groom>(std::move(*loaded));
    }
    Result<Motion> motion = load_motion(options.motion, options.bvh, &groom->body);
    if (!motion) return Refusal(options.motion + ": " + motion.error());
    cast.push_back({groom, std::move(*motion), options.level, options.colour.value_or(default_hair_colour(cast.size())),
                    options.material});
  }
  return cast;
}

}  // namespace hairnet::viewer
