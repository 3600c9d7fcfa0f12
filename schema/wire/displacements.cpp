#include <algorithm>
#include <cassert>
#include <cmath>

#include "schema/wire/messages.hpp"

namespace hairnet::wire {
namespace {

constexpr double kIntegerMax = 32767;  // symmetric: -32768 is never sent

float quantum_for(float largest_m) {
  float quantum_m = kQuantumMin_m;
  while (quantum_m < kQuantumMax_m && largest_m > kIntegerMax * quantum_m) quantum_m *= 2;
  return quantum_m;
}

std::int16_t quantise(float coordinate_m, double quantum_m) {
  const double integer = std::clamp(std::nearbyint(coordinate_m / quantum_m), -kIntegerMax, kIntegerMax);
  return static_cast<std::int16_t>(integer);
}

}  // namespace

void encode_displacements(std::span<const Vec3f> displacement, Frame& frame) {
  frame.quantum_m = 0;
  frame.displacements.clear();
  if (displacement.empty()) return;
  float largest_m = 0;
  for (const Vec3f& d : displacement) {
    assert(d.allFinite());
    largest_m = std::max(largest_m, d.cwiseAbs().maxCoeff());
  }
  frame.quantum_m = quantum_for(largest_m);
  frame.displacements.reserve(3 * displacement.size());
  for (const Vec3f& d : displacement) {
    for (const float coordinate_m : d) frame.displacements.push_back(quantise(coordinate_m, frame.quantum_m));
  }
}

void decode_displacements(const Frame& frame, std::vector<Vec3f>& displacement) {
  displacement.resize(frame.displacements.size() / 3);
  const std::int16_t* integer = frame.displacements.data();
  for (Vec3f& d : displacement) {
    for (float& coordinate_m : d) coordinate_m = frame.quantum_m * static_cast<float>(*integer++);
  }
}

}  // namespace hairnet::wire
