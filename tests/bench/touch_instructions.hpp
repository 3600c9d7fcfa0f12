#pragma once

#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// Counts what touch adds to the tick of a room (TouchRoom): steps the same ticks without hands, with hands, after hands
// have gone, and with a hand in another room, each in a call of perform_steps. Prints the instructions of a tick, which
// it reads from valgrind's dumps (Options::dumps), and their ratio to those without hands. Returns the exit code: 1
// when hair that no hand touches has other bits than without hands, when the room is not as TouchRoom promises, and
// when a dump is missing.
int count_touch_instructions(const Subject& subject, const Options& options);

}  // namespace hairnet::bench
