#pragma once

#include <algorithm>
#include <cmath>

namespace hairnet::viewer {

// Lowers the drawing quality while pictures take too long, and raises it again up to the chosen quality. Changes
// gradually.
class AdaptiveQuality {
 public:
  static constexpr double kSlow_ms = 40, kFast_ms = 20;
  static constexpr double kMin = 0.02;

  // Takes the time of the last picture. Returns the factor for the chosen quality from now on.
  double take(double picture_ms) {
    if (picture_ms > kSlow_ms)
      share_ *= std::max(0.6, std::pow(kSlow_ms / picture_ms, 0.4));
    else if (picture_ms < kFast_ms)
      share_ *= 1.03;
    share_ = std::clamp(share_, kMin, 1.0);
    return share_;
  }
  [[nodiscard]] double share() const { return share_; }

 private:
  double share_ = 1;
};

}  // namespace hairnet::viewer
