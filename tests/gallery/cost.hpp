#pragma once

#include "core/result.hpp"
#include "tests/gallery/simulate.hpp"

namespace hairnet::gallery {

// Prints what drawing one character of `style` costs on this machine's OpenGL, beside plain lines through the same
// points, in the same run: milliseconds a picture, strands or cards a millisecond, times the plain lines.
Result<void> print_draw_cost(const Hairstyle& style, int width_px, int height_px);

}  // namespace hairnet::gallery
