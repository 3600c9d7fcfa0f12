#include "client/link/last_known_hair.hpp"

#include <utility>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

constexpr std::int64_t kLatticeWait_ns = 1'000'000'000;

}  // namespace

void LastKnownHair::keep(std::uint32_t character, HairSnapshot hair) {
  HAIRNET_ASSERT(hair.basis);
  last_known_[character] = {std::move(hair), kNever_ns};
}

void LastKnownHair::drop_of(const wire::GroomHash& groom) {
  std::erase_if(last_known_, [&](const auto& k) { return k.second.hair.groom == groom; });
}

void LastKnownHair::on_lost() {
  for (auto& [character, kept] : last_known_) kept.until_ns = kNever_ns;
}

void LastKnownHair::on_ready(const wire::GroomHash& groom, std::int64_t now_ns) {
  for (auto& [character, kept] : last_known_) {
    if (kept.hair.groom == groom && kept.until_ns == kNever_ns) kept.until_ns = now_ns + kLatticeWait_ns;
  }
}

const HairSnapshot* LastKnownHair::of(std::uint32_t character, LevelIndex level, std::int64_t now_ns) {
  const auto found = last_known_.find(character);
  if (found == last_known_.end()) return nullptr;
  if (level != LevelIndex::rigid || now_ns < found->second.until_ns) return &found->second.hair;
  last_known_.erase(found);
  return nullptr;
}

}  // namespace hairnet::link
