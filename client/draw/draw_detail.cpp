#include "client/draw/draw_detail.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet::draw {
namespace {

// A head of this height on the screen has kFullStrands.
constexpr float kFullHead_px = 350;
constexpr float kFullStrands = 10'000;
// Even the furthest head has this many strands, or all that it has: fewer strands, though wider, would leave the skin
// bare.
constexpr float kStrandsMin = 300;

// 0 up to `from`, 1 from `to` on.
float rise(float x, float from, float to) {
  return std::clamp((x - from) / (to - from), 0.0f, 1.0f);
}

}  // namespace

DrawDetail detail_for(float head_px, float quality, std::size_t strand_count) {
  // std::max keeps its first argument when the second is no number, so a size that is no number counts as the smallest
  // one.
  const float px = std::max(1e-3f, std::max(0.1f, head_px) * quality);
  DrawDetail detail;
  // Strands grow faster than the head's height, but slower than its area: so a nearer head has fewer strands for each
  // pixel.
  const float strands = std::max(kFullStrands * std::pow(px / kFullHead_px, 1.3f), kStrandsMin);
  detail.strand_share = std::min(strands / static_cast<float>(std::max<std::size_t>(strand_count, 1)), 1.0f);
  // Follow hairs need no FFD of their own, but each is drawn: heads of up to 150 pixels have none.
  detail.follow_hair_count = 2 * rise(px, 150, 350) + 2 * rise(px, 600, 1200);
  // A head of px pixels has kHead_m / px metres a pixel: the error stays within about a third of a pixel.
  detail.tolerance_m = 0.35f * kHead_m / px;
  // Linear FFD bends hair at the faces of cells; heads below 70 pixels are too small to show it.
  detail.quadratic = rise(px, 70, 120);
  return detail;
}

std::size_t drawn_strands(const DrawDetail& detail, std::size_t strand_count) {
  // clamp() passes what is no number, and the cast of it to an integer is undefined.
  const float share = std::clamp(std::isnan(detail.strand_share) ? 0 : detail.strand_share, 0.0f, 1.0f);
  return std::min(strand_count, static_cast<std::size_t>(std::ceil(share * static_cast<float>(strand_count))));
}

float width_scale(const DrawDetail& detail) {
  // A follow hair is drawn 0.8 times as wide as its strand; 2.6 is the sum for a strand with two.
  const float drawn = std::max(detail.strand_share, 1e-4f) * (1 + 0.8f * detail.follow_hair_count) / 2.6f;
  // The exponent is below 1: hair that overlaps covers less than the sum of its widths. The limits keep single hairs
  // from becoming ribbons.
  return std::clamp(std::pow(drawn, -0.8f), 0.5f, 12.0f);
}

}  // namespace hairnet::draw
