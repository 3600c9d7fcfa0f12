#include "client/link/last_known_hair.hpp"

namespace hairnet::link {
namespace {

constexpr std::int64_t kLatticeWait_ns = 1'000'000'000;

}  // namespace

void KeptHair::drop_of(const wire::GroomHash& groom) {
  std::erase_if(kept_, [&](const auto& k) { return k.second.hair.groom == groom; });
}

void KeptHair::on_ready(const wire::GroomHash& groom, std::int64_t now_ns) {
  for (auto& [character, kept] : kept_) {
    if (kept.hair.groom == groom && kept.until_ns == kNever_ns) kept.until_ns = now_ns + kLatticeWait_ns;
  }
}

const Hair* KeptHair::of(std::uint32_t character, std::int64_t now_ns) const {
  const auto found = kept_.find(character);
  return found == kept_.end() || now_ns >= found->second.until_ns ? nullptr : &found->second.hair;
}

}  // namespace hairnet::link
