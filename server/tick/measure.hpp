#pragma once

#include "core/world.hpp"
#include "server/room/room.hpp"
#include "server/tick/simulation.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

// Counts the characters by level and state, after a step. A walk over all of them: once a second will do.
void measure(const Rooms& rooms, const Simulation& simulation, TickGauges& gauges);

}  // namespace hairnet::server
