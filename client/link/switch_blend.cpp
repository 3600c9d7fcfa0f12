#include "client/link/switch_blend.hpp"

#include <algorithm>

namespace hairnet::link {

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
    const double t = static_cast<double>(time_ns - switched_ns_) / static_cast<double>(kSwitchBlend_ns);
    const double gone = std::clamp(t, 0.0, 1.0);
    const auto left = static_cast<float>(1 - gone * gone * (3 - 2 * gone));
    for (std::size_t i = 0; i < points_head.size(); ++i) points_head[i] += left * offset_[i];
    if (left <= 0) offset_.clear();
  }
  shown_.assign(points_head.begin(), points_head.end());
}

}  // namespace hairnet::link
