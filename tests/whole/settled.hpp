#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>

#include "tests/whole/player.hpp"

namespace hairnet::whole {

// One line about a player who does not have all that there is to know of the room after disturbances; empty: all have.
// Each must know all characters of its room, have frames of them since all is calm, and know the wind of its room.
// `winds_m_per_s`: the means, by room; the air of others is still.
std::string unsettled(std::span<const std::unique_ptr<Player>> players,
                      const std::map<std::string, Vec3>& winds_m_per_s = {});

}  // namespace hairnet::whole
