#pragma once

#include <string>

#include "client/render/renderer.hpp"
#include "core/result.hpp"
#include "tests/gallery/simulate.hpp"

namespace hairnet::gallery {

// Each draws one picture. Sizes in pixels are those of a tile.
Result<view::Image> hairstyle_sheet(view::Renderer& renderer, const Hairstyle& style, std::size_t number, int size_px);
Result<view::Image> detail_sheet(view::Renderer& renderer, const Hairstyle& style, int size_px);
Result<view::Image> wind_sheet(view::Renderer& renderer, const Hairstyle& style, int size_px);
// `count` characters of the hairstyles in turn, in rows.
Result<view::Image> crowd_picture(view::Renderer& renderer, const std::vector<Hairstyle>& styles, std::size_t count,
                                  int width_px, int height_px, view::StageStatistics& statistics);

Result<void> write_picture(const std::string& path, const view::Image& image);

}  // namespace hairnet::gallery
