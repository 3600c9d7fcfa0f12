#pragma once

#include <cstddef>
#include <string>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::viewer {

// Linear RGB albedo of a named natural colour, or of #rrggbb (sRGB). The error lists the names.
Result<Vec3f> parse_hair_colour(const std::string& text);
// How a server's clients draw hair of that linear RGB albedo, at root and tip alike; rounded to sRGB bytes.
wire::Appearance appearance_of(const Vec3f& hair_colour);
// Linear RGB albedo.
Vec3f linear_of(const wire::Srgb& colour);
// The colour of the n-th character without a given colour, linear RGB: neighbours differ, and every client chooses
// alike.
Vec3f default_hair_colour(std::size_t n);

}  // namespace hairnet::viewer
