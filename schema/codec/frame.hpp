#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/pose/pose.hpp"
#include "schema/codec/coefficient_code.hpp"

// One character's frame as bits: its pose, then the coefficients of its groom's basis. A frame refers to no other, and
// any prefix with the whole pose is a frame with fewer coefficients. Pure: no clock, no state except the arguments.
namespace hairnet::codec {

struct EncodedFrame {
  std::vector<std::uint8_t> bytes;
  // The number of bits of the frame up to and with each coefficient.
  std::vector<std::uint32_t> ends;
  // The number of bits of the pose.
  std::uint32_t pose_bits = 0;

  // The bytes of the pose and the first `count` coefficients, or of all when there are fewer.
  [[nodiscard]] std::span<const std::uint8_t> prefix(std::size_t count) const;
};

// Coefficients are in m, errors at most half of kFinestStep_m * 2^step. `code` may be null when there are none.
// Asserts that the pose is valid and within the wire's bounds, and the coefficients finite and not more than modes.
void encode_frame(const Pose& pose, const CoefficientCode* code, std::span<const float> coefficients, unsigned step,
                  EncodedFrame& out);

struct DecodedFrame {
  Pose pose;
  // The coefficients, m. Those that the frame lacks are 0.
  std::vector<float> coefficients;
};
// Returns false when the pose is incomplete or out of bounds, or when bytes are left over after all coefficients.
// `code` is null while the groom's basis is not known, and then only the pose is decoded.
[[nodiscard]] bool decode_frame(std::span<const std::uint8_t> bytes, const CoefficientCode* code, DecodedFrame& out);

}  // namespace hairnet::codec
