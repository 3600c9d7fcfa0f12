#pragma once

#include <string>

#include "client/render/renderer.hpp"
#include "core/result.hpp"
#include "tests/gallery/simulate.hpp"

namespace hairnet::gallery {

// Each draws one picture. Sizes in pixels are those of a tile.
Result<render::Image> hairstyle_sheet(render::Renderer& renderer, const Hairstyle& style, std::size_t number,
                                      int size_px);
Result<render::Image> detail_sheet(render::Renderer& renderer, const Hairstyle& style, int size_px);
Result<render::Image> wind_sheet(render::Renderer& renderer, const Hairstyle& style, int size_px);
// `count` characters of the hairstyles in turn, in rows.
Result<render::Image> crowd_picture(render::Renderer& renderer, const std::vector<Hairstyle>& styles, std::size_t count,
                                    int width_px, int height_px, render::StageStatistics& statistics);

// Looks at a head from a bearing: 0 from the front, 90 from its left side.
draw::Camera camera_about(const Vec3& head, const Groom& groom, double bearing_deg, double distance_scale = 1);

Result<void> write_picture(const std::string& path, const render::Image& image);

}  // namespace hairnet::gallery
