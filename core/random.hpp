#pragma once

#include <cstdint>

namespace hairnet {

// SplitMix64 with its own mapping to reals: the standard library's distributions differ between vendors. The numbers
// are for hair and wind, not for secrets: a few of them tell all later ones.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : state_(seed * kStep ^ mix(stream + kStep)) {}

  std::uint64_t next() { return mix(state_ += kStep); }
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }  // [0, 1)
  double symmetric() { return 2 * unit() - 1; }                          // [-1, 1)
  double between(double low, double high) { return low + (high - low) * unit(); }
  // Bell-shaped, standard deviation 1, never beyond 3.5.
  double bell() { return (unit() + unit() + unit() + unit() - 2) * 1.7320508075688772; }

 private:
  static constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15u;
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

}  // namespace hairnet
