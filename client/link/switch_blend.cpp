#include "client/link/switch_blend.hpp"

#include "core/assert.hpp"
#include "core/smoothstep.hpp"

namespace hairnet::link {

float SwitchBlend::left_after(std::int64_t elapsed_ns) {
  return static_cast<float>(1 - smoothstep(0.0, double{kSwitchBlend_ns}, static_cast<double>(elapsed_ns)));
}

void SwitchBlend::apply(LevelIndex level, std::int64_t time_ns, bool discontinuous, std::span<Vec3f> points_head) {
  if (discontinuous || shown_.size() != points_head.size()) {
    offset_.clear();
  } else if (level != level_) {
    offset_.resize(points_head.size());
    for (std::size_t i = 0; i < points_head.size(); ++i) offset_[i] = shown_[i] - points_head[i];
    switched_ns_ = time_ns;
  }
  level_ = level;
  if (!offset_.empty()) {
    HAIRNET_ASSERT(offset_.size() == points_head.size());
    const float left = left_after(time_ns - switched_ns_);
    for (std::size_t i = 0; i < points_head.size(); ++i) points_head[i] += left * offset_[i];
    if (left <= 0) offset_.clear();
  }
  shown_.assign(points_head.begin(), points_head.end());
}

}  // namespace hairnet::link
