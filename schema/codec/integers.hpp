#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/geometry/rigid_transform.hpp"
#include "schema/codec/golomb.hpp"

// Points and rotations as three signed integers, in the zigzag form of golomb.hpp.
namespace hairnet::codec {

using Integers = std::array<std::int32_t, 3>;

// The most bits of an integer, and the bits in which a point says how many its integers have.
inline constexpr unsigned kWidthMax = 30, kPointWidthBits = 5;
// The bits of each of three components of any rotation.
inline constexpr unsigned kRotationBits = 14;

// The nearest multiples of `step`, or the nearest that kWidthMax bits hold.
inline Integers to_integers(const Vec3& x, double step) {
  // The zigzag of these bounds has kWidthMax bits.
  constexpr double kMax = (1 << (kWidthMax - 1)) - 1;
  Integers out;
  for (int c = 0; c < 3; ++c) {
    out[static_cast<std::size_t>(c)] = static_cast<std::int32_t>(std::clamp(std::nearbyint(x[c] / step), -kMax, kMax));
  }
  return out;
}

inline Vec3 from_integers(const Integers& integers, double step) {
  return step * Vec3(integers[0], integers[1], integers[2]);
}

// How many bits the largest of the three integers takes.
inline unsigned width_of(const Integers& integers) {
  std::uint32_t bits = 0;
  for (const std::int32_t integer : integers) bits |= zigzag(integer);
  return static_cast<unsigned>(std::bit_width(bits));
}

inline void put_integers(const Integers& integers, unsigned width, BitWriter& writer) {
  for (const std::int32_t integer : integers) writer.put(zigzag(integer), width);
}

inline Integers take_integers(BitReader& reader, unsigned width) {
  Integers integers;
  for (std::int32_t& integer : integers) integer = unzigzag(static_cast<std::uint32_t>(reader.take(width)));
  return integers;
}

// A point is the width of its integers, followed by the three integers.
inline void put_point(const Integers& integers, BitWriter& writer) {
  const unsigned width = width_of(integers);
  writer.put(width, kPointWidthBits);
  put_integers(integers, width, writer);
}

inline Integers take_point(BitReader& reader) {
  // Five bits can say 31; the format defines that as 30, so that no width is invalid.
  const auto width = std::min(static_cast<unsigned>(reader.take(kPointWidthBits)), kWidthMax);
  return take_integers(reader, width);
}

// The quaternion of length 1 whose component with the index `largest` (of x y z w) is positive and follows from the
// three other components.
inline Quat completed(std::size_t largest, const Vec3& others) {
  std::array<double, 4> xyzw{};
  int next = 0;
  for (std::size_t c = 0; c < 4; ++c) xyzw[c] = c == largest ? 0 : others[next++];
  // Rounded or forged components may be longer than 1 together; the largest is 0 then, and normalized() restores the
  // length.
  xyzw[largest] = std::sqrt(std::max(1 - others.squaredNorm(), 0.0));
  return Quat(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).normalized();
}

// The three components beside `largest`, in the sign of q for which `largest` is positive: q and -q are the same
// rotation.
inline Vec3 others_of(const Quat& q, std::size_t largest) {
  const double sign = q.coeffs()[static_cast<Eigen::Index>(largest)] < 0 ? -1 : 1;
  Vec3 out;
  int next = 0;
  for (Eigen::Index c = 0; c < 4; ++c) {
    if (c != static_cast<Eigen::Index>(largest)) out[next++] = sign * q.coeffs()[c];
  }
  return out;
}

// The step of a component of any rotation. The three smaller components of a unit quaternion are at most sqrt(1/2),
// which becomes the largest integer of kRotationBits bits.
inline const double kAnyRotationStep = std::sqrt(0.5) / ((1 << (kRotationBits - 1)) - 1);

// Writes any rotation of unit length, and returns it as take_rotation gives it.
inline Quat put_rotation(const Quat& q, BitWriter& writer) {
  Eigen::Index largest = 0;
  q.coeffs().cwiseAbs().maxCoeff(&largest);
  const auto index = static_cast<std::size_t>(largest);
  const Integers integers = to_integers(others_of(q, index), kAnyRotationStep);
  writer.put(index, 2);
  put_integers(integers, kRotationBits, writer);
  return completed(index, from_integers(integers, kAnyRotationStep));
}

inline Quat take_rotation(BitReader& reader) {
  const auto index = static_cast<std::size_t>(reader.take(2));
  return completed(index, from_integers(take_integers(reader, kRotationBits), kAnyRotationStep));
}

}  // namespace hairnet::codec
