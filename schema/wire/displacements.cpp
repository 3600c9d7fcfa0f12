#include <algorithm>
#include <cassert>

#include "schema/wire/messages.hpp"

namespace hairnet::wire {
namespace {

constexpr float kIntegerMax = 32767;  // symmetric: -32768 is never sent

float quantum_for(float largest_m) {
  float quantum_m = kQuantumMin_m;
  while (quantum_m < kQuantumMax_m && largest_m > kIntegerMax * quantum_m) quantum_m *= 2;
  return quantum_m;
}

// To the nearest integer, for any float up to 2^22: beyond 2^23 floats have no fraction left. Unlike std::nearbyint it
// is four lanes wide in the instruction set that we build for.
float nearest(float x) {
  constexpr float kNoFraction = 1.5f * (1 << 23);
  return (x + kNoFraction) - kNoFraction;
}

}  // namespace

void encode_displacements(std::span<const Vec3f> displacement, Frame& frame) {
  frame.quantum_m = 0;
  frame.displacements.resize(3 * displacement.size());
  if (displacement.empty()) return;
  const Eigen::Map<const Eigen::ArrayXf> coordinates(displacement.front().data(),
                                                     static_cast<Eigen::Index>(frame.displacements.size()));
  assert(coordinates.allFinite());
  const float quantum_m = quantum_for(coordinates.abs().maxCoeff());
  const float* coordinate_m = coordinates.data();
  for (std::int16_t& integer : frame.displacements) {
    const float quanta = std::min(std::max(*coordinate_m++ / quantum_m, -kIntegerMax), kIntegerMax);
    integer = static_cast<std::int16_t>(nearest(quanta));
  }
  frame.quantum_m = quantum_m;
}

void decode_displacements(const Frame& frame, std::vector<Vec3f>& displacement) {
  displacement.resize(frame.displacements.size() / 3);
  const std::int16_t* integer = frame.displacements.data();
  for (Vec3f& d : displacement) {
    for (float& coordinate_m : d) coordinate_m = frame.quantum_m * static_cast<float>(*integer++);
  }
}

}  // namespace hairnet::wire
