#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "schema/codec/bits.hpp"

// The coefficients of a basis as bits, the most important first, so that any prefix of the bits is a coarser hair.
namespace hairnet::codec {

// Coefficients are multiples of the frame's step, which is kFinestStep_m * 2^step with step < kStepCount.
inline constexpr float kFinestStep_m = 1.0f / (1 << 14);
inline constexpr unsigned kStepCount = 8;

// How many bits a coefficient is likely to need, from the deviations of a basis. Immutable.
class CoefficientCode {
 public:
  // `deviation_m`: the deviation of each coefficient over the training motions (Basis). Asserts that they are finite
  // and positive.
  explicit CoefficientCode(std::span<const float> deviation_m);
  [[nodiscard]] std::size_t mode_count() const { return parameters_.size(); }
  // The Rice parameter of coefficient k: the number of its low bits that come as they are. `calm`: the hair moves
  // 2^-calm of what is usual, so all parameters are less by it.
  [[nodiscard]] unsigned parameter(std::size_t k, unsigned step, unsigned calm) const;

 private:
  // The parameter of each coefficient for step and calm 0. It is negative where a coefficient needs less than a bit.
  std::vector<int> parameters_;
};

// How much of a frame's coefficients is sent: the first `count`, as multiples of the step of this number.
struct Detail {
  std::size_t count = 0;
  unsigned step = 0;
};
// The number of coefficients and the step that take the fewest bits, of all whose error is at most `tolerance_m`, as an
// RMS over the hair. The error comes from coefficients that are left out and from rounding. Where no choice is within
// the tolerance, the result is all coefficients and the finest step. `coefficients`: m. Asserts that there are not more
// than modes.
Detail detail_for(const CoefficientCode& code, std::span<const float> coefficients, float tolerance_m);

// An upper bound of the bytes of one coefficient, and the bits of the header before the first one.
inline constexpr std::size_t kCoefficientBytesMax = 6;
inline constexpr std::size_t kCoefficientHeaderBits = 6;

// Writes the coefficients, m. Each errs by at most half a step, or is clamped to 2^19 steps. ends[k] becomes the number
// of bits of the header and the coefficients up to k: a frame may be cut there. Asserts that there are not more
// coefficients than modes, and that all are finite.
void encode_coefficients(const CoefficientCode& code, std::span<const float> coefficients, unsigned step,
                         BitWriter& writer, std::vector<std::uint32_t>& ends);

// Reads as many coefficients as there are whole ones, m, and returns their number. Asserts that `out` has room for all
// modes. Any bits are valid.
std::size_t decode_coefficients(const CoefficientCode& code, BitReader& reader, std::span<float> out);

}  // namespace hairnet::codec
