#pragma once

namespace hairnet {

// The nearest float, as a double. `volatile`, because g++ 12 leaves the rounding out where it puts two of them into one
// register: optimised builds would have other bits.
inline double rounded_to_float(double x) {
  const volatile float rounded = static_cast<float>(x);
  return static_cast<double>(rounded);
}

}  // namespace hairnet
