#pragma once

#include <cstddef>

namespace hairnet::draw {

inline constexpr float kHead_m = 0.24f;  // the height of a head, for its size on the screen
inline constexpr float kFollowHairsMax = 15;

// The drawing detail of one character's hair; independent of its mechanical level.
struct DrawDetail {
  // So much of the groom's strands is drawn, 0 ... 1; the drawn ones are wider in turn.
  float strand_share = 1;
  // They are made beside every strand on the GPU, 0 ... kFollowHairsMax; a fraction is the opacity of the last one.
  float follow_hair_count = 2;
  // The largest distance between a strand's drawn line and its points.
  float tolerance_m = 0;
  // 1 is quadratic FFD, 0 linear; between, the two are blended.
  float quadratic = 1;
};

// `head_px`: a head's height on the screen, in pixels. `quality` multiplies it. The result is continuous in both.
DrawDetail detail_for(float head_px, float quality, std::size_t strand_count);

// The number of strands to draw.
std::size_t drawn_strands(const DrawDetail& detail, std::size_t strand_count);

// The factor by which strands are drawn wider, so that fewer strands and follow hairs cover about the same area.
float width_scale(const DrawDetail& detail);

}  // namespace hairnet::draw
