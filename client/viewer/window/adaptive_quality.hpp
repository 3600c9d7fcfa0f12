#pragma once

#include <algorithm>
#include <cmath>

namespace hairnet::viewer {

// Lowers the drawing quality while pictures take too long, and raises it again up to the chosen quality. Changes
// gradually, so that hair does not flicker between two qualities. One thread.
class AdaptiveQuality {
 public:
  // Pictures that take longer than kSlow_ms (25 a second) lower the quality; pictures that take less than kFast_ms (50
  // a second) raise it. Between both times nothing changes, so that the quality does not go up and down.
  static constexpr double kSlow_ms = 40, kFast_ms = 20;
  // The smallest factor: even a slow machine shows some hair.
  static constexpr double kMin = 0.02;

  // Takes the time of the last picture, ms. Returns the factor for the chosen quality from now on, kMin ... 1.
  double take(double picture_ms) {
    if (picture_ms > kSlow_ms)
      // The exponent is below 1, so that several pictures share the way down; 0.6 bounds the effect of a single long
      // picture, as while a groom is uploaded.
      share_ *= std::max(0.6, std::pow(kSlow_ms / picture_ms, 0.4));
    else if (picture_ms < kFast_ms)
      // The quality rises more slowly than it falls, 3 % a picture: a single fast picture says little.
      share_ *= 1.03;
    share_ = std::clamp(share_, kMin, 1.0);
    return share_;
  }
  [[nodiscard]] double share() const { return share_; }

 private:
  double share_ = 1;
};

}  // namespace hairnet::viewer
