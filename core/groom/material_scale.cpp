#include "core/groom/material_scale.hpp"

#include <cmath>

namespace hairnet {
namespace {

struct Range {
  const char* name;
  float MaterialScale::*value;
  float low, high;
};
constexpr Range kRanges[] = {
    {"stiffness", &MaterialScale::stiffness, 0.01f, 100}, {"damping", &MaterialScale::damping, 0, 100},
    {"density", &MaterialScale::density, 0.1f, 10},       {"ether_damping", &MaterialScale::ether_damping, 0, 100},
    {"air_drag", &MaterialScale::air_drag, 0, 100},       {"gel_per_s2", &MaterialScale::gel_per_s2, 0, 10'000}};

}  // namespace

std::string validate(const MaterialScale& scale) {
  for (const Range& range : kRanges) {
    const float value = scale.*range.value;
    if (value >= range.low && value <= range.high) continue;
    return std::string("material scale ") + range.name + " is " + std::to_string(value) + ", must be from " +
           std::to_string(range.low) + " to " + std::to_string(range.high);
  }
  return {};
}

}  // namespace hairnet
