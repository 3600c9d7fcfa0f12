#pragma once

#include <nlohmann/json.hpp>

namespace hairnet::codec {

// Frames of all orders, strides and classes, random ones and those of a moving lattice: each with the grid (`dims`,
// `active_nodes`), the earlier frames (`history`, newest first), whether it `has_velocities`, its `content` in
// hexadecimal and what that decodes to.
nlohmann::ordered_json codec_cases();

}  // namespace hairnet::codec
