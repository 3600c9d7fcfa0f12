#pragma once

#include <cstddef>

namespace hairnet::draw {

// The height of a head, by which its size on the screen is measured.
inline constexpr float kHead_m = 0.24f;
// The shaders take 16 random numbers a strand: one for itself and one for each follow hair.
inline constexpr float kFollowHairsMax = 15;

// The drawing detail of one character's hair. It is independent of the mechanical level, which the server chooses by
// what it can compute: drawing costs the client alone.
struct DrawDetail {
  // The share of the groom's strands that is drawn, 0 ... 1; the drawn ones are wider in turn. Strands are in a random
  // order, so the first n are an even sample.
  float strand_share = 1;
  // Follow hairs are made beside every strand on the GPU, 0 ... kFollowHairsMax; a fraction is the opacity of the last
  // one.
  float follow_hair_count = 2;
  // The largest distance between a strand's drawn line and its points, m; zero draws all of them.
  float tolerance_m = 0;
  // 1 means quadratic FFD, 0 linear FFD, and numbers between blend the two. A linear FFD reads 8 nodes a point instead
  // of 27.
  float quadratic = 1;
};

// Chooses the detail of a head whose height on the screen is `head_px`, pixels. `quality` multiplies that height. The
// result is continuous in both: hair must not jump when a head comes nearer.
DrawDetail detail_for(float head_px, float quality, std::size_t strand_count);

// The number of strands to draw, at most all; a share that is no number draws none.
std::size_t drawn_strands(const DrawDetail& detail, std::size_t strand_count);

// The factor by which strands are drawn wider, so that fewer strands and follow hairs cover about the same area. It is
// 1 for all strands with two follow hairs each, and stays within 0.5 ... 12.
float width_scale(const DrawDetail& detail);

}  // namespace hairnet::draw
