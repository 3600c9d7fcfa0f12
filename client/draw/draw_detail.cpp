#include "client/draw/draw_detail.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet::draw {
namespace {

constexpr float kFullHead_px = 350;  // at which kFullStrands are drawn
constexpr float kFullStrands = 10'000;
constexpr float kStrandsMin = 300;

// 0 up to `from`, 1 from `to` on.
float rise(float x, float from, float to) {
  return std::clamp((x - from) / (to - from), 0.0f, 1.0f);
}

}  // namespace

DrawDetail detail_for(float head_px, float quality, std::size_t strand_count) {
  // What is no number counts as the least.
  const float px = std::max(1e-3f, std::max(0.1f, head_px) * quality);
  DrawDetail detail;
  const float strands = std::max(kFullStrands * std::pow(px / kFullHead_px, 1.3f), kStrandsMin);
  detail.strand_share = std::min(strands / static_cast<float>(std::max<std::size_t>(strand_count, 1)), 1.0f);
  detail.follow_hair_count = 2 * rise(px, 150, 350) + 2 * rise(px, 600, 1200);
  detail.tolerance_m = 0.35f * kHead_m / px;
  detail.quadratic = rise(px, 70, 120);
  return detail;
}

std::size_t drawn_strands(const DrawDetail& detail, std::size_t strand_count) {
  const float share = std::clamp(std::isnan(detail.strand_share) ? 0 : detail.strand_share, 0.0f, 1.0f);
  return std::min(strand_count, static_cast<std::size_t>(std::ceil(share * static_cast<float>(strand_count))));
}

float width_scale(const DrawDetail& detail) {
  const float drawn = std::max(detail.strand_share, 1e-4f) * (1 + 0.8f * detail.follow_hair_count) / 2.6f;
  return std::clamp(std::pow(drawn, -0.8f), 0.5f, 12.0f);
}

}  // namespace hairnet::draw
