#pragma once

#include "core/world.hpp"
#include "server/room/room.hpp"
#include "server/tick/simulation.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

// One character's lattice as it is sent: the pose the step used, and the displacements quantised. `key` must be placed.
wire::Frame make_frame(CharacterKey key, const Character& character, const LatticeView& lattice);

// Makes the frames of all placed characters and leaves them in their observers' outlets. A sleeping character has one
// frame that says so, then none until it wakes.
void publish(Room& room, const Simulation& simulation, const wire::RecordedTick& tick, const ParallelFor& parallel_for,
             TickCounters& counters);

}  // namespace hairnet::server
