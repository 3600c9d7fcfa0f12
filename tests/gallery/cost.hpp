#pragma once

#include "core/result.hpp"
#include "tests/gallery/simulate.hpp"

namespace hairnet::gallery {

// Measures how long this machine's OpenGL draws one character of `style` in several ways, and plain lines through the
// same points. Prints milliseconds for each frame, strands for each millisecond, and the time divided by that of plain
// lines.
Result<void> print_draw_cost(const Hairstyle& style, int width_px, int height_px);

// Measures how long it takes to compute the nodes of 1, 32 and 500 lattices of the finest level from the coefficients
// of their modes: by this machine's OpenGL, by one thread of the processor, and while the hair is at rest.
Result<void> print_lattice_cost(const Hairstyle& style);

}  // namespace hairnet::gallery
