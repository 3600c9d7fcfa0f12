#pragma once

#include "client/render/renderer.hpp"
#include "core/result.hpp"
#include "tests/gallery/simulate.hpp"

namespace hairnet::gallery {

// The same moments of a motion, a row each: the finest level's nodes; frames within 1 and 4 mm of it; the low level as
// servers send it; and learnt hair, which it learns first (most of a minute). Captions state the bytes of each frame's
// hair.
Result<render::Image> frames_sheet(render::Renderer& renderer, const Hairstyle& style, const std::string& motion,
                                   int size_px);

}  // namespace hairnet::gallery
