#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "schema/codec/bits.hpp"

// The coefficients of a basis as bits, the most important first, so that any prefix of the bits is a coarser hair.
namespace hairnet::codec {

// Coefficients are multiples of a step of the frame's: kFinestStep_m * 2^step, step < kStepCount.
inline constexpr float kFinestStep_m = 1.0f / (1 << 14);
inline constexpr unsigned kStepCount = 8;

// How many bits a coefficient is likely to need, from the deviations of a basis. Immutable.
class CoefficientCode {
 public:
  // Takes the deviation of each coefficient, m. Asserts that they are finite and positive.
  explicit CoefficientCode(std::span<const float> deviation_m);
  [[nodiscard]] std::size_t mode_count() const { return parameters_.size(); }
  // The bits of coefficient k that come as they are, when hair moves 2^-calm of what is usual.
  [[nodiscard]] unsigned parameter(std::size_t k, unsigned step, unsigned calm) const;

 private:
  // They are for step and calm 0. A negative one stands for less than a bit.
  std::vector<int> parameters_;
};

// How much of a frame's coefficients is sent.
struct Detail {
  std::size_t count = 0;
  unsigned step = 0;
};
// The number of coefficients (m) and the step that take the fewest bits of all whose errors, left out and rounded, are
// together at most `tolerance_m` RMS over the hair. All and the finest step, where the tolerance is less than that.
// Asserts that there are not more coefficients than modes.
Detail detail_for(const CoefficientCode& code, std::span<const float> coefficients, float tolerance_m);

// An upper bound of the bytes of one coefficient.
inline constexpr std::size_t kCoefficientBytesMax = 6;
inline constexpr std::size_t kCoefficientHeaderBits = 6;

// Writes the coefficients, m; each errs by at most half a step, or is clamped to 2^19 steps. `ends` gets the number of
// bits of the header and the coefficients up to and with each. Asserts that there are not more than modes, and that all
// are finite.
void encode_coefficients(const CoefficientCode& code, std::span<const float> coefficients, unsigned step,
                         BitWriter& writer, std::vector<std::uint32_t>& ends);

// Reads as many coefficients as there are whole ones, m, and returns their number. Asserts that `out` has room for all
// modes. Any bits are valid.
std::size_t decode_coefficients(const CoefficientCode& code, BitReader& reader, std::span<float> out);

}  // namespace hairnet::codec
