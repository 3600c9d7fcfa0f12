#include "tests/load/assets.hpp"

#include <utility>

#include "client/assets/load_groom.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::load {

Result<Assets> load_assets(const Plan& plan) {
  Assets assets;
  // A plan's files are taken as they show themselves; another program has the flags.
  HairImport import;
  import.flag_prefix = "hairnet-groom import --";
  for (const std::string& spec : plan.grooms) {
    const Result<Groom> groom = load_groom(spec, {}, import);
    if (!groom) return Refusal(groom.error());
    const Result<std::shared_ptr<const LearntHair>> learnt = load_learnt(spec);
    if (!learnt) return Refusal(learnt.error());
    auto bytes = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(*groom, learnt->get()));
    if (bytes->empty()) return Refusal(spec + ": is too large to be sent");
    const wire::GroomHash hash = wire::hash_groom(*bytes);
    assets.grooms.push_back({spec, hash, std::move(bytes)});
  }
  auto motions = MotionBank::load(plan.motions, plan.pose_hz);
  if (!motions) return Refusal(motions.error());
  assets.motions = std::move(*motions);
  return assets;
}

}  // namespace hairnet::load
