#pragma once

#include <algorithm>
#include <cmath>

namespace hairnet::viewer {

// Lowers the drawing quality while pictures take too long, and raises it again up to the chosen quality. Changes
// gradually, so that hair does not flicker between two qualities. One thread.
class AdaptiveQuality {
 public:
  // Between both times nothing changes, so that quality does not swing.
  static constexpr double kSlow_ms = 40, kFast_ms = 20;
  // Even a slow machine shows some hair.
  static constexpr double kMin = 0.02;

  // Takes the time of the last picture, ms. Returns the factor for the chosen quality from now on, kMin ... 1.
  double take(double picture_ms) {
    if (picture_ms > kSlow_ms)
      // The exponent is below 1, so that several pictures share the way down; 0.6 bounds the effect of a single long
      // picture, as while a groom is uploaded.
      share_ *= std::max(0.6, std::pow(kSlow_ms / picture_ms, 0.4));
    else if (picture_ms < kFast_ms)
      // Up more slowly than down: a single fast picture says little.
      share_ *= 1.03;
    share_ = std::clamp(share_, kMin, 1.0);
    return share_;
  }
  [[nodiscard]] double share() const { return share_; }

 private:
  double share_ = 1;
};

}  // namespace hairnet::viewer
