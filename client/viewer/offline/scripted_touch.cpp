#include "client/viewer/offline/scripted_touch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "client/assets/upright.hpp"
#include "client/viewer/drawing/mouse_hand.hpp"
#include "client/viewer/sources/motion_timeline.hpp"
#include "core/geometry/rotation_between.hpp"
#include "core/world/grab.hpp"

namespace hairnet::viewer {
namespace {

// The script's hand is that of a person, so it has any id but kRoomToucher, the room's own. Only one script runs.
constexpr ToucherId kScript = 1;
constexpr TouchKey kHoldingHand{.toucher = kScript, .number = 0};
// The hand takes hold at this time. The heads are upright and the hair is at rest until then, so a lock is where it is
// in the groom.
constexpr double kTakes_s = 0;

// When a hand that takes hold of hair lets it go, and how. Motions of the default length have an end after that.
struct Holding {
  // The time at which the hand lets go, s. It is less than the default duration, 6 s (ViewOptions).
  double until_s;
  Release release;
};

std::optional<Holding> holding_of(TouchScript script) {
  if (script == TouchScript::hold) return Holding{4.5, Release::drop};
  if (script == TouchScript::pin) return Holding{3, Release::pin};
  return {};
}

// A place in the axes of scripted_bodies(): +X to the head's left, +Y up, +Z where the face looks, from the head joint.
struct PathPoint {
  double time_s;
  Vec3 place;
};

// Eases from each point to the next, so that the hand's speed has no jumps, which would show in the hair.
Vec3 along(std::span<const PathPoint> path, double time_s) {
  const auto next = std::ranges::upper_bound(path, time_s, {}, &PathPoint::time_s);
  // Before the first and after the last point the hand waits there.
  if (next == path.begin()) return path.front().place;
  if (next == path.end()) return path.back().place;
  const PathPoint& last = *std::prev(next);
  const double s = (time_s - last.time_s) / (next->time_s - last.time_s);
  return last.place + s * s * (3 - 2 * s) * (next->place - last.place);
}

// The hand's way: it takes the lock, and pulls it aside until it lets go.
std::vector<PathPoint> hold_path(const Vec3& lock) {
  // The hand comes from 25 cm beside the lock, and pulls it 12 cm to the left.
  const Vec3 aside = lock + Vec3(0.12, 0.03, 0.06);
  return {{-MotionTimeline::kLeadIn_s, lock + Vec3(0.25, 0.05, 0.1)},
          {kTakes_s, lock},
          // The hand rests for a moment, because the hold begins with a tick.
          {0.3, lock},
          {1.3, aside},
          {holding_of(TouchScript::hold)->until_s, aside},
          {5.3, aside + Vec3(0.25, 0.1, 0.1)}};
}

// The hand's way: it takes the lock, lays it behind the shoulder, and goes away.
std::vector<PathPoint> pin_path(const Vec3& lock) {
  // A place 16 cm below the head joint, 12 cm to its left and 14 cm behind it.
  const Vec3 behind_shoulder(0.12, -0.16, -0.14);
  return {{-MotionTimeline::kLeadIn_s, lock + Vec3(0.25, 0.05, 0.1)},
          {kTakes_s, lock},
          {0.3, lock},
          {1.2, lock + Vec3(0.08, 0.04, -0.02)},
          {2.4, behind_shoulder},
          {holding_of(TouchScript::pin)->until_s, behind_shoulder},
          {3.8, behind_shoulder + Vec3(0.25, 0.1, -0.1)}};
}

// A ball of 1 cm radius.
TouchBody fingertips(const Vec3& place) {
  return {kHoldingHand, sphere(0.01), {Quat::Identity(), place}};
}

// A palm and five fingers that point at the head. They go round: down through the hair, and up again beside it.
std::vector<TouchBody> stroking_hand(const HairToTouch& hair, double time_s) {
  // A round takes kRound_s. The hand moves between kHigh_m and at most kLowest_m, heights over the head joint. Fingers
  // are capsules of half length kFinger_m, kFingersApart_m from one to the next.
  constexpr double kRound_s = 3, kHigh_m = 0.12, kLowest_m = -0.35;
  constexpr double kFinger_m = 0.035, kFingersApart_m = 0.022;
  const double angle = 2 * std::numbers::pi * time_s / kRound_s;
  // Long hair is stroked down to the chest, short hair to its ends.
  const double low_m = std::clamp(hair.low_m, kLowest_m, kHigh_m);
  const Vec3 palm(0.27 - 0.1 * std::sin(angle), (kHigh_m + low_m + (kHigh_m - low_m) * std::cos(angle)) / 2, 0);
  const auto towards = [](const Vec3& axis) { return rotation_between<double>(Vec3::UnitY(), axis); };
  // The palm is a capsule of half length 5 cm and radius 12 mm; fingers have a radius of 7 mm.
  std::vector<TouchBody> hand{{{kScript, 0}, capsule(0.05, 0.012), {towards(Vec3::UnitZ()), palm}}};
  for (int finger = 0; finger < 5; ++finger) {
    const Vec3 middle = palm + Vec3(-0.05, 0, kFingersApart_m * (finger - 2));
    hand.push_back({{kScript, static_cast<std::uint8_t>(finger + 1)},
                    capsule(kFinger_m, 0.007),
                    {towards(-Vec3::UnitX()), middle}});
  }
  return hand;
}

// A chair's back that comes to the hair behind the head, and stays. It is a prop of the room, not anyone's hand.
TouchBody chair_back(double time_s) {
  // The chair comes from 50 cm to 15 cm behind the head joint within 1.5 s. Its back is 44 cm wide, 40 cm high and 3 cm
  // thick.
  const std::array<PathPoint, 2> path{{{0, {0, -0.22, -0.5}}, {1.5, {0, -0.22, -0.15}}}};
  return {{kRoomToucher, 0}, box({0.22, 0.2, 0.015}), {Quat::Identity(), along(path, time_s)}};
}

class ScriptedTouch {
 public:
  ScriptedTouch(TouchScript script, const CharacterSetup& touched, double duration_s, LocalWorld& world)
      : script_(script),
        hair_(*touched.groom),
        timeline_(touched.motion, duration_s),
        heading_(upright(touched.motion.poses.front()).head().rotation),
        world_(world),
        // The world must have the touched character, as its first one.
        id_(world.viewed_characters().front().id) {}

  std::vector<TouchBody> tick(double from_s, double to_s) {
    hold(from_s);
    // The bodies move with the head's place at its heading at the beginning, but do not turn with the head: a person
    // who turns would sweep the hand through the air.
    const RigidTransform frame{heading_, timeline_.at(to_s).head().position};
    std::vector<TouchBody> bodies = scripted_bodies(script_, hair_, to_s);
    for (TouchBody& body : bodies) {
      body.place = frame * body.place;
      // A head that jumps takes the hand along; the hand must not sweep through the hair.
      body.has_jumped = timeline_.teleports(from_s, to_s);
    }
    return bodies;
  }

 private:
  void hold(double time_s) {
    const std::optional<Holding> holding = holding_of(script_);
    if (!holding) return;
    // The hand tries once only, also where it finds no hair: a later hold would come too late for the script.
    if (time_s >= kTakes_s && !std::exchange(has_tried_, true) &&
        world_.take_hair(id_, {kHoldingHand, Vec3::Zero(), MouseHand::kHoldRadius_m}) == 0)
      std::fputs("hairnet-view: the hand of --touch finds no hair that moves to hold\n", stderr);
    if (time_s >= holding->until_s && !std::exchange(has_let_go_, true))
      world_.let_go_of_hair(id_, kHoldingHand, holding->release);
  }

  TouchScript script_;
  HairToTouch hair_;
  MotionTimeline timeline_;
  Quat heading_;
  LocalWorld& world_;
  std::uint64_t id_;
  bool has_tried_ = false, has_let_go_ = false;
};

}  // namespace

HairToTouch::HairToTouch(const Groom& groom) {
  // The lock is searched in a band about a height 5 cm above the shoulder, or above the ends of shorter hair.
  constexpr double kShoulder_m = -0.25, kAboveEnds_m = 0.05, kHalfBand_m = 0.05;
  for (const Vec3f& p : groom.points) low_m = std::min(low_m, static_cast<double>(p.y()));
  const double height_m = std::max(low_m, kShoulder_m) + kAboveEnds_m;
  double farthest_m = -std::numeric_limits<double>::infinity();
  for (const Vec3f& point : groom.points) {
    const Vec3 p = point.cast<double>();
    // The farthest hair to the left, and half as much to the front: a lock at the face's side.
    const double out_m = p.x() + 0.5 * p.z();
    if (std::abs(p.y() - height_m) > kHalfBand_m || out_m <= farthest_m) continue;
    farthest_m = out_m;
    lock = p;
  }
}

std::vector<TouchBody> scripted_bodies(TouchScript script, const HairToTouch& hair, double time_s) {
  switch (script) {
    case TouchScript::stroke:
      return stroking_hand(hair, time_s);
    case TouchScript::hold:
      return {fingertips(along(hold_path(hair.lock), time_s))};
    case TouchScript::pin:
      return {fingertips(along(pin_path(hair.lock), time_s))};
    case TouchScript::prop:
      return {chair_back(time_s)};
  }
  return {};
}

void touch_by_script(TouchScript script, const CharacterSetup& touched, double duration_s, LocalWorld& world) {
  const auto touch = std::make_shared<ScriptedTouch>(script, touched, duration_s, world);
  // The callback owns the script, which then lives as long as the world needs it.
  world.touch_by([touch](double from_s, double to_s) { return touch->tick(from_s, to_s); });
}

}  // namespace hairnet::viewer
