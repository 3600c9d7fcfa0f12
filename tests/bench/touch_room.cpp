#include "tests/bench/touch_room.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/assert.hpp"
#include "core/touch/hand.hpp"
#include "tests/bench/state_hash.hpp"
#include "tests/bench/workload.hpp"

namespace hairnet::bench {
namespace {

// The room that is counted, and another one of the same World.
constexpr std::uint32_t kRoom = 0, kOtherRoom = 1;
// The default of a server (tick_rate_hz).
constexpr std::size_t kTouchTicks_hz = 30;
// The hair moves as in the middle of the motion after one second.
constexpr std::size_t kTouchLeadTicks = kTouchTicks_hz;
// People stand in rows of five, which fill a rectangle with kPeople, and so far apart that they touch one another only
// on purpose.
constexpr std::size_t kRow = 5;
constexpr double kApart_m = 1.5;
// Every third hand is at somebody's hair.
constexpr std::size_t kStrokesEach = 3;
// A hand strokes as those of hairnet-load do (tests/load/toucher.cpp): 0.4 times a second round the head joint, 13 cm
// from it and 5 cm below.
constexpr double kStrokesOfHand_hz = 0.4, kStrokeOfHand_m = 0.13, kBelowJoint_m = 0.05;
// The other hands gesture half an arm's length (0.7 m) in front of the trunk, chest high, which is 35 cm below the head
// joint, on a circle of 10 cm.
constexpr double kInFront_m = 0.35, kChest_m = -0.35, kGesture_m = 0.1;
// No hair is so long.
constexpr double kOutOfReach_m = 100;

// A palm and five fingers, along y, with the sizes of hairnet-load's hands.
Hand hand_of_six(const RigidTransform& place) {
  Hand hand{0, place, false, {{{-0.03, 0, 0}, {0.03, 0, 0}, 0.03}}};
  for (int finger = 0; finger < 5; ++finger) {
    const double x = -0.04 + 0.02 * finger;
    hand.shapes.push_back({{x, 0.03, 0}, {x, 0.09, 0}, 0.008});
  }
  return hand;
}

bool strokes_hair(std::size_t person) {
  return person % kStrokesEach == 0;
}

// The number of people whose hair is stroked: each hand that strokes has a neighbour of its own.
std::uint32_t stroked_count() {
  std::uint32_t count = 0;
  for (std::size_t p = 0; p < TouchRoom::kPeople; ++p) count += strokes_hair(p);
  return count;
}

// A person's hand at a time, world: at the hair of the next person, or in front of the own trunk.
Hand hand_of(std::size_t person, double time_s, const std::vector<Pose>& poses) {
  // The hands of two people are at different places of their circles, by the shift that hairnet-load's have.
  const double turn = 2 * std::numbers::pi * kStrokesOfHand_hz * (time_s + 0.7 * static_cast<double>(person));
  if (strokes_hair(person)) {
    const Vec3 place(kStrokeOfHand_m * std::sin(turn), -kBelowJoint_m, -kStrokeOfHand_m * std::cos(turn));
    return hand_of_six(poses[(person + 1) % poses.size()].head() * RigidTransform{Quat::Identity(), place});
  }
  const Vec3 place(kGesture_m * std::sin(turn), kChest_m + kGesture_m * std::cos(turn), kInFront_m);
  return hand_of_six(poses[person][Bone::upper_trunk] * RigidTransform{Quat::Identity(), place});
}

// The number by which a person owns a character and touches others; 0 is the room's.
ToucherId toucher_of(std::size_t person) {
  return static_cast<ToucherId>(person + 1);
}

std::vector<TouchBody> bodies_of_all(double time_s, const std::vector<Pose>& poses, double up_m) {
  std::vector<TouchBody> bodies;
  for (std::size_t p = 0; p < poses.size(); ++p) append_bodies(hand_of(p, time_s, poses), toucher_of(p), bodies);
  for (TouchBody& body : bodies) body.place.position.y() += up_m;
  return bodies;
}

WorldDef def_of_room() {
  WorldDef def;
  def.tick_s = 1.0 / kTouchTicks_hz;
  return def;
}

// The poses of all people, `time_s` after each one's own start.
std::vector<Pose> poses_at(const Motion& motion, double time_s, double run_s) {
  std::vector<Pose> poses;
  for (std::size_t p = 0; p < TouchRoom::kPeople; ++p) {
    Pose& pose = poses.emplace_back(motion.sample(start_time_s(motion, p, TouchRoom::kPeople, run_s) + time_s));
    const Vec3 shift(kApart_m * static_cast<double>(p % kRow), 0, kApart_m * static_cast<double>(p / kRow));
    for (RigidTransform& bone : pose.bones) bone.position += shift;
  }
  return poses;
}

}  // namespace

TouchRoom::TouchRoom(const std::shared_ptr<const LevelSet>& levels, const Motion& motion, HandsAt hands,
                     std::size_t tick_count)
    : hands_(hands), world_(def_of_room()) {
  const auto time_of = [](std::size_t tick) { return static_cast<double>(tick) / kTouchTicks_hz; };
  const double run_s = time_of(kTouchLeadTicks + tick_count);
  const std::vector<Pose> first = poses_at(motion, 0, run_s);
  for (std::size_t p = 0; p < kPeople; ++p) {
    ids_.push_back(world_.add({levels, LevelIndex::low, first[p], kRoom, toucher_of(p)}));
    world_.set_touch_rule(ids_.back(), {TouchAudience::everyone, {}});
  }
  for (std::size_t tick = 1; tick <= kTouchLeadTicks + tick_count; ++tick) {
    Tick& next = ticks_.emplace_back(Tick{poses_at(motion, time_of(tick), run_s), {}});
    const bool is_lead = tick <= kTouchLeadTicks;
    if (hands == HandsAt::room) next.bodies = bodies_of_all(time_of(tick), next.poses, 0);
    if (hands == HandsAt::gone && is_lead) next.bodies = bodies_of_all(time_of(tick), next.poses, kOutOfReach_m);
  }
  if (hands == HandsAt::elsewhere) {
    std::vector<TouchBody> bodies;
    append_bodies(hand_of(0, 0, first), toucher_of(0), bodies);
    world_.set_bodies(kOtherRoom, bodies);
  }
  for (std::size_t tick = 0; tick < kTouchLeadTicks; ++tick) step();
  if (hands == HandsAt::gone) world_.set_bodies(kRoom, {});
  touched_ = resets_ = 0;
  stepped_least_ = touched_least_ = kPeople;
}

void TouchRoom::step() {
  HAIRNET_ASSERT(next_ < ticks_.size());
  const Tick& tick = ticks_[next_++];
  for (std::size_t p = 0; p < kPeople; ++p) world_.set_pose(ids_[p], tick.poses[p]);
  // A server leaves a room alone in which no hand has moved (server/tick/touch.cpp).
  if (!tick.bodies.empty()) world_.set_bodies(kRoom, tick.bodies);
  const StepReport report = world_.step();
  touched_ += report.touched;
  resets_ += report.lattices_reset;
  stepped_least_ = std::min(stepped_least_, report.stepped);
  touched_least_ = std::min(touched_least_, report.touched);
}

double TouchRoom::touched_mean() const {
  return static_cast<double>(touched_) / static_cast<double>(next_ - kTouchLeadTicks);
}

std::string TouchRoom::fault() const {
  if (resets_ > 0) return std::to_string(resets_) + " lattices were reset";
  if (stepped_least_ < kPeople) return "only " + std::to_string(stepped_least_) + " characters were stepped in a tick";
  if (hands_ != HandsAt::room && touched_ > 0) return "hair was touched where no hand is";
  if (hands_ == HandsAt::room && touched_least_ < stroked_count())
    return "only " + std::to_string(touched_least_) + " characters were touched in a tick, and hands stroke " +
           std::to_string(stroked_count());
  return {};
}

std::string TouchRoom::hash() const {
  StateHash hash;
  for (const CharacterId id : ids_) hash.add(world_.state(id));
  return hash.text();
}

}  // namespace hairnet::bench
