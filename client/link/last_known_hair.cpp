#include "client/link/last_known_hair.hpp"

#include <utility>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

// A server that has the groom sends its lattice within some ticks, unless it keeps the character rigid. Hair that is
// shown for longer would look frozen.
constexpr std::int64_t kLatticeWait_ns = 1'000'000'000;

}  // namespace

void LastKnownHair::keep(std::uint32_t character, HairSnapshot hair) {
  HAIRNET_ASSERT(hair.basis);
  last_known_[character] = {std::move(hair)};
}

void LastKnownHair::drop_of(const wire::GroomHash& groom) {
  std::erase_if(last_known_, [&](const auto& k) { return k.second.hair.groom == groom; });
}

void LastKnownHair::on_lost() {
  for (auto& [character, kept] : last_known_) kept = {std::move(kept.hair)};
}

void LastKnownHair::on_ready(const wire::GroomHash& groom) {
  for (auto& [character, kept] : last_known_) kept.is_ready |= kept.hair.groom == groom;
}

const HairSnapshot* LastKnownHair::of(std::uint32_t character, LevelIndex level, std::int64_t now_ns) {
  const auto found = last_known_.find(character);
  if (found == last_known_.end()) return nullptr;
  Kept& kept = found->second;
  if (level != LevelIndex::rigid) return &kept.hair;
  // The time begins at the first rigid frame after the groom is ready: before it, the character may have no pose yet.
  if (kept.is_ready && kept.until_ns == kNever_ns) kept.until_ns = now_ns + kLatticeWait_ns;
  if (now_ns < kept.until_ns) return &kept.hair;
  last_known_.erase(found);
  return nullptr;
}

}  // namespace hairnet::link
