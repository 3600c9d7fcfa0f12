#pragma once

#include <cstddef>

namespace hairnet::render {

inline constexpr float kHead_m = 0.24f;  // a head's height, for what its size on the screen decides
inline constexpr float kFollowHairsMax = 15;

// How finely one character's hair is drawn; chosen apart from its mechanical level.
struct DrawDetail {
  float strand_share = 1;       // of the groom's strands, 0 ... 1; what is drawn is wider in turn
  float follow_hair_count = 2;  // beside every strand, 0 ... kFollowHairsMax; a fraction is the last one's opacity
  float tolerance_m = 0;        // how far a strand's drawn line may be from its points
  float quadratic = 1;          // 1: quadratic FFD; 0: linear; between: so much of each
  float cards = 0;              // 0: strands; 1: cards; between: both, faded
};

// `head_px`: a head's height on the screen, in pixels. `quality` multiplies it. Continuous in both.
// `waviness`: of the groom; cards pass for straight hair at a larger size than for curls.
DrawDetail detail_for(float head_px, float quality, std::size_t strand_count, float waviness);

// The factor by which strands are drawn wider, so that fewer strands and follow hairs cover about the same area.
float width_scale(const DrawDetail& detail);

}  // namespace hairnet::render
