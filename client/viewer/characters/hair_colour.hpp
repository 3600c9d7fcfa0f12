#pragma once

#include <cstddef>
#include <string>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Linear RGB albedo of a named natural colour, or of #rrggbb (sRGB).
Result<Vec3f> parse_hair_colour(const std::string& text);
// The colour of the n-th character without a given colour.
Vec3f default_hair_colour(std::size_t n);

}  // namespace hairnet::viewer
