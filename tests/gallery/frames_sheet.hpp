#pragma once

#include "client/render/renderer.hpp"
#include "core/result.hpp"
#include "tests/gallery/simulate.hpp"

namespace hairnet::gallery {

// Draws five times of a motion in rows of different detail: the finest level's nodes, frames within 1 mm and within 4
// mm of them, the low level within 1 mm, and learnt hair. It learns that hair first, which takes most of a minute.
// Captions state the bytes of each frame's hair. Tiles are `size_px` wide.
Result<render::Image> frames_sheet(render::Renderer& renderer, const Hairstyle& style, const std::string& motion,
                                   int size_px);

}  // namespace hairnet::gallery
