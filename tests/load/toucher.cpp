#include "tests/load/toucher.hpp"

#include <cmath>
#include <numbers>

namespace hairnet::load {
namespace {

// A hand goes round the head 0.4 times a second.
constexpr double kStrokes_hz = 0.4;
// A hand strokes at this distance from the head joint, m, where it goes through the hair, and a little below the joint.
constexpr double kStroke_m = 0.13;
constexpr double kBelow_m = 0.05;
// Each cycle of 5 s has a stroke of 2 s, a hold of 2 s that pulls the hair by 6 cm, and a stroke of 1 s.
constexpr double kCycle_s = 5, kHoldFrom_s = 2, kHoldUntil_s = 4, kPull_m = 0.06;
constexpr float kHoldRadius_m = 0.06f;
// The numbers of the hands' first shapes. Each hand has six shapes.
constexpr std::uint8_t kRightHand = 0, kLeftHand = 6;

// A palm and five fingers, along y.
Hand hand_at(std::uint8_t first_number, const Vec3& place) {
  Hand hand{first_number, {Quat::Identity(), place}, false, {{{-0.03, 0, 0}, {0.03, 0, 0}, 0.03}}};
  for (int finger = 0; finger < 5; ++finger) {
    const double x = -0.04 + 0.02 * finger;
    hand.shapes.push_back({{x, 0.03, 0}, {x, 0.09, 0}, 0.008});
  }
  return hand;
}

Vec3 round_head(const Vec3& head, double turn, double distance_m) {
  return head + Vec3(distance_m * std::sin(turn), -kBelow_m, -distance_m * std::cos(turn));
}

}  // namespace

void Toucher::see(std::uint32_t member, const Vec3& head) {
  if (!member_) member_ = member;
  if (*member_ == member) head_ = head;
}

void Toucher::begin() {
  holds_ = false;
  member_.reset();
}

std::vector<Hand> Toucher::move(std::int64_t captured_ns, const Vec3& own_head, ProtocolClient& protocol) {
  const double time_s = static_cast<double>(captured_ns) * 1e-9 + phase_s_;
  const double turn = 2 * std::numbers::pi * kStrokes_hz * time_s, in_cycle_s = std::fmod(time_s, kCycle_s);
  const Hand left = hand_at(kLeftHand, round_head(own_head, -turn, kStroke_m));
  if (!member_) return {left};
  const bool wants_hold = in_cycle_s >= kHoldFrom_s && in_cycle_s < kHoldUntil_s;
  // The hand stays where it takes hold, and moves away from there.
  const double held_turn = turn - 2 * std::numbers::pi * kStrokes_hz * (in_cycle_s - kHoldFrom_s);
  const double pulled = wants_hold ? (in_cycle_s - kHoldFrom_s) / (kHoldUntil_s - kHoldFrom_s) : 0;
  const Vec3 place = round_head(head_, wants_hold ? held_turn : turn, kStroke_m + kPull_m * pulled);
  if (wants_hold && !holds_) {
    protocol.take_hold({*member_, kRightHand, Vec3f::Zero(), kHoldRadius_m});
    holds_ = true;
  } else if (!wants_hold && holds_) {
    // Each second hold pins the hair and the next one removes the pin again. Otherwise ever more hair would be pinned.
    if (++hold_count_ % 2 == 0) protocol.let_go({*member_, kRightHand, Release::unpin});
    protocol.let_go({*member_, kRightHand, hold_count_ % 2 == 0 ? Release::drop : Release::pin});
    holds_ = false;
  }
  return {hand_at(kRightHand, place), left};
}

}  // namespace hairnet::load
