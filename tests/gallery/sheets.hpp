#pragma once

#include <string>

#include "client/render/renderer.hpp"
#include "core/result.hpp"
#include "tests/gallery/simulate.hpp"

namespace hairnet::gallery {

// Each sheet is one picture of tiles, which are `size_px` wide.

// Draws a hairstyle at rest and moving, from three sides. `number` chooses the colour (hair_colour).
Result<render::Image> hairstyle_sheet(render::Renderer& renderer, const Hairstyle& style, std::size_t number,
                                      int size_px);
// Draws a hairstyle at six distances, and below each tile the same detail from nearby.
Result<render::Image> detail_sheet(render::Renderer& renderer, const Hairstyle& style, int size_px);
// Draws a hairstyle at five moments of a gusty wind.
Result<render::Image> wind_sheet(render::Renderer& renderer, const Hairstyle& style, int size_px);
// Draws `count` characters in rows, which have the hairstyles in turn. `statistics` gets the cost of the picture.
Result<render::Image> crowd_picture(render::Renderer& renderer, const std::vector<Hairstyle>& styles, std::size_t count,
                                    int width_px, int height_px, render::StageStatistics& statistics);

// Returns a camera that shows the whole head, whose place in the world is `head`, with its hair: from the front at a
// bearing of 0 degrees, from its left side at 90 degrees. `distance_scale` multiplies the distance.
draw::Camera camera_about(const Vec3& head, const Groom& groom, double bearing_deg, double distance_scale = 1);

// Writes a file of PNG.
Result<void> write_picture(const std::string& path, const render::Image& image);

}  // namespace hairnet::gallery
