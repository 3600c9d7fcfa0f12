#pragma once

#include <nlohmann/json.hpp>

#include "tests/support/codec_frames.hpp"

namespace hairnet::codec {

// Frames of all orders, strides and classes, random ones and those of a moving lattice: each with the grid (`dims`,
// `active_nodes`), the earlier frames (`history`, newest first), whether it `has_velocities`, its `content` in
// hexadecimal and what that decodes to.
nlohmann::ordered_json codec_cases();

// The frames of one character tick by tick, of rising order and with velocities: their `contents` in hexadecimal, and
// the `nodes` that they decode to. `geometry` is the lattice's.
nlohmann::ordered_json frame_sequence(const MovingLattice& moving);

}  // namespace hairnet::codec
