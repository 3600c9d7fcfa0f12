#pragma once

#include "core/result.hpp"
#include "tests/gallery/simulate.hpp"

namespace hairnet::gallery {

// Prints what drawing one character of `style` costs on this machine's OpenGL, beside plain lines through the same
// points, in the same run: milliseconds a picture, strands a millisecond, times the plain lines.
Result<void> print_draw_cost(const Hairstyle& style, int width_px, int height_px);

// Prints what the nodes of 1, 32 and 500 lattices of the finest level cost: summed up from the modes of a basis by this
// machine's OpenGL, and on one thread of the processor.
Result<void> print_lattice_cost(const Hairstyle& style);

}  // namespace hairnet::gallery
