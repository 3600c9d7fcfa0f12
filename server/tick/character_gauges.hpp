#pragma once

#include "core/world/simulation.hpp"
#include "core/world/world.hpp"
#include "server/room/room.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

// Sets the gauges that count characters by level and state. Visits all characters, so call it about once a second.
void update_character_gauges(const Rooms& rooms, const Simulation& simulation, TickGauges& gauges);

}  // namespace hairnet::server
