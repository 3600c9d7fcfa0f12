#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>

#include "tests/whole/player.hpp"

namespace hairnet::whole {

// Returns one line about a player that has not recovered from the disturbances. It is empty when all players have. Each
// player must know all characters of its room and the room's wind, and have frames of the characters that are newer
// than the last disturbance. `winds_m_per_s` holds the mean wind by room; the air of all other rooms is still.
std::string unsettled(std::span<const std::unique_ptr<Player>> players,
                      const std::map<std::string, Vec3>& winds_m_per_s = {});

}  // namespace hairnet::whole
