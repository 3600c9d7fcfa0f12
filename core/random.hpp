#pragma once

#include <cstdint>

namespace hairnet {

// The generator SplitMix64 with its own mapping to reals, since the standard library's distributions differ between
// vendors. The numbers are for hair and wind and not for secrets: from a few of them all later ones can be computed.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : state_(seed * kStep ^ mix(stream + kStep)) {}

  std::uint64_t next() { return mix(state_ += kStep); }
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }  // [0, 1)
  double symmetric() { return 2 * unit() - 1; }                          // [-1, 1)
  double between(double low, double high) { return low + (high - low) * unit(); }
  // The sum of four uniform numbers: bell-shaped, with standard deviation 1, and never beyond 3.5.
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
