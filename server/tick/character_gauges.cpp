#include "server/tick/character_gauges.hpp"

#include <array>

#include "core/assert.hpp"

namespace hairnet::server {

void update_character_gauges(const Rooms& rooms, const Simulation& simulation, TickGauges& gauges) {
  std::array<double, kLevelCount> at_level{};
  double stepped = 0, asleep = 0, suspended = 0, waiting = 0;
  for (const auto& [key, character] : rooms.characters()) {
    // A character beyond the World's limit is never stepped and counts as waiting.
    if (!character.in_world || !simulation.contains(key)) {
      ++waiting;
      continue;
    }
    const LatticeView lattice = simulation.lattice(key);
    HAIRNET_ASSERT(static_cast<std::size_t>(lattice.level) < kLevelCount);
    ++at_level[static_cast<std::size_t>(lattice.level)];
    ++(character.suspended ? suspended : lattice.asleep ? asleep : stepped);
  }
  for (std::size_t i = 0; i < kLevelCount; ++i) gauges.characters[static_cast<LevelIndex>(i)].set(at_level[i]);
  gauges.characters_by_state_stepped.set(stepped);
  gauges.characters_by_state_asleep.set(asleep);
  gauges.characters_by_state_suspended.set(suspended);
  std::size_t prop_count = 0;
  for (const Room& room : rooms.rooms()) prop_count += room.touch.props.size();
  gauges.props.set(static_cast<double>(prop_count));
  gauges.rooms.set(static_cast<double>(rooms.room_count()));
  gauges.characters_by_state_waiting.set(waiting);
}

}  // namespace hairnet::server
