#include "tests/load/prop_setter.hpp"

#include <cmath>

namespace hairnet::load {
namespace {

// A cycle of 6 s: the prop moves for 2 s, lies still for 2 s, so that hair comes to rest on it, and is gone for 2 s, in
// which the hair falls down again.
constexpr double kCycle_s = 6, kMoves_s = 2, kLiesUntil_s = 4;
// The ball moves from where it touches no hair towards the nape, into the hair that hangs there. The distances are
// those of its centre from the head joint, to the side and downwards, m.
constexpr double kRadius_m = 0.05, kFrom_m = 0.3, kTo_m = 0.13, kBelow_m = 0.07;

}  // namespace

PropSetter::PropSetter(std::uint32_t client, std::uint8_t prop)
    : phase_s_(0.7 * client),
      // The hair of most hairstyles is behind the head, so the prop is within a radian of there.
      turn_(std::sin(static_cast<double>(client))),
      prop_(prop) {}

std::optional<wire::SetProps> PropSetter::move(std::int64_t captured_ns, const Vec3& head) {
  const double in_cycle_s = std::fmod(static_cast<double>(captured_ns) * 1e-9 + phase_s_, kCycle_s);
  if (in_cycle_s < kMoves_s) {
    const double distance_m = kFrom_m + (kTo_m - kFrom_m) * in_cycle_s / kMoves_s;
    const Vec3 place = head + Vec3(distance_m * std::sin(turn_), -kBelow_m, -distance_m * std::cos(turn_));
    const bool has_jumped = !is_there_;
    is_there_ = true;
    return wire::SetProps{{{prop_, sphere(kRadius_m), {Quat::Identity(), place}, has_jumped}}};
  }
  if (in_cycle_s < kLiesUntil_s || !is_there_) return std::nullopt;
  is_there_ = false;
  return wire::SetProps{{}, {prop_}};
}

}  // namespace hairnet::load
