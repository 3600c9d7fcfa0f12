#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "client/assets/made/made.hpp"
#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"
#include "core/world/world.hpp"

// Tests what hands and props do to long hair at the finest level, on the strands as they are drawn.
namespace hairnet {
namespace {

// A point of a strand counts as too deep when it is 5 mm inside a body.
constexpr double kTooDeep_m = 0.005;
constexpr ToucherId kSomeone = 1;

const Groom& long_hair() {
  static const Groom groom = [] {
    HairstyleOptions options;
    options.strand_count = 1500;
    return *make_hairstyle("long_straight", options);
  }();
  return groom;
}

std::shared_ptr<const LevelSet> levels() {
  static const std::shared_ptr<const LevelSet> set = [] {
    auto made = std::make_shared<LevelSet>();
    made->levels[0] = *build_level(long_hair(), kLevelSpecs[0]);
    return made;
  }();
  return set;
}

// Makes a palm of four capsules side by side, 8 cm wide, whose axes lie across its way, and a thumb and a finger.
std::vector<TouchBody> hand(const Vec3& place, bool has_jumped = false) {
  const Quat along_z(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()));
  std::vector<TouchBody> bodies;
  for (int i = 0; i < 4; ++i) {
    bodies.push_back({{kSomeone, static_cast<std::uint8_t>(i)},
                      capsule(0.035, 0.012),
                      {along_z, place + Vec3(0, 0.02 * i, 0)},
                      has_jumped});
  }
  bodies.push_back({{kSomeone, 4}, capsule(0.03, 0.009), {along_z, place + Vec3(0, 0.02, 0.08)}, has_jumped});
  bodies.push_back({{kSomeone, 5}, capsule(0.03, 0.009), {along_z, place + Vec3(0, 0.04, 0.08)}, has_jumped});
  return bodies;
}

// Returns how deep a point is in the body that has it deepest; it is not positive outside all of them.
double deepest_m(std::span<const TouchBody> bodies, const Vec3& point) {
  double deepest = -1;
  for (const TouchBody& body : bodies)
    deepest = std::max(deepest, -shape_distance(body.shape, body.place.inverse().point(point)));
  return deepest;
}

class TouchHair : public testing::Test {
 protected:
  TouchHair()
      : id_(world_.add({levels(), LevelIndex::high, {}})), deformer_(long_hair(), lattice(), FfdKind::quadratic) {
    world_.set_touch_rule(id_, {TouchAudience::everyone});
  }
  void tick(std::span<const TouchBody> bodies, const Pose& pose = {}) {
    world_.set_bodies(0, bodies);
    world_.set_pose(id_, pose);
    world_.step();
    pose_ = pose;
  }
  // Hair points, world.
  [[nodiscard]] std::vector<Vec3> points() const {
    std::vector<Vec3f> grid(lattice().node_count()), in_head(long_hair().points.size());
    expand_displacements(world_.lattice(id_).model->geometry, world_.lattice(id_).displacement, grid);
    deformer_.deform(grid, in_head);
    std::vector<Vec3> places;
    for (const Vec3f& point : in_head) places.push_back(pose_.head().point(point.cast<double>()));
    return places;
  }
  static std::vector<Vec3> rest_points() {
    std::vector<Vec3> places;
    for (const Vec3f& point : long_hair().points) places.push_back(point.cast<double>());
    return places;
  }
  [[nodiscard]] static const Lattice& lattice() { return (*levels())[LevelIndex::high].geometry.lattice; }
  static double rms_m(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]).squaredNorm();
    return std::sqrt(sum / static_cast<double>(a.size()));
  }
  static std::size_t count_deep(std::span<const TouchBody> bodies, const std::vector<Vec3>& points) {
    return static_cast<std::size_t>(
        std::ranges::count_if(points, [&](const Vec3& point) { return deepest_m(bodies, point) > kTooDeep_m; }));
  }

  World world_{WorldDef{}};
  CharacterId id_;
  Pose pose_;
  Deformer deformer_;
};

Pose turned_head(double yaw_rad) {
  return rigid_pose({Quat(Eigen::AngleAxisd(yaw_rad, Vec3::UnitY())), Vec3::Zero()});
}

TEST_F(TouchHair, a_palm_that_strokes_long_hair_stays_out_of_it) {
  const std::vector<Vec3> rest = rest_points();
  std::size_t deep = 0, without = 0;
  constexpr int kTicks = 90;
  for (int i = 0; i < kTicks; ++i) {
    // In the first second the hand moves from beside the ear 8 cm towards the head, into the hair; in the next two it
    // strokes 40 cm downwards.
    const double in = std::min(i / 30.0, 1.0), down = std::max(i - 30, 0) / 60.0;
    const std::vector<TouchBody> bodies = hand({0.17 - 0.08 * in, -0.02 - 0.4 * down, -0.02}, i == 0);
    tick(bodies);
    deep += count_deep(bodies, points());
    without += count_deep(bodies, rest);
  }
  // `without` counts the points that the hand would meet if hair stayed in its design.
  ASSERT_GT(without, 2000u) << "the hand strokes no hair";
  EXPECT_LT(static_cast<double>(deep), 0.15 * static_cast<double>(without));
  EXPECT_LT(static_cast<double>(deep) / kTicks, 0.001 * static_cast<double>(rest.size()));
}

TEST_F(TouchHair, a_held_lock_stays_in_the_hand_while_the_head_turns_and_falls_back_clean) {
  const TouchKey fingers{kSomeone, 0};
  const auto pinch = [&](const Vec3& place) {
    return std::vector<TouchBody>{{fingers, sphere(0.01), {Quat::Identity(), place}}};
  };
  // The hand takes the hair's point that is nearest to a place beside the left shoulder.
  const std::vector<Vec3> rest = rest_points();
  Vec3 start(0.1, -0.25, 0.02);
  start = *std::ranges::min_element(rest, {}, [&](const Vec3& point) { return (point - start).norm(); });
  tick(pinch(start));
  std::vector<std::size_t> lock;
  for (std::size_t p = 0; p < rest.size(); ++p)
    if ((rest[p] - start).norm() < 0.015) lock.push_back(p);
  ASSERT_GT(lock.size(), 3u);
  ASSERT_GT(world_.grab(id_, {fingers, Vec3::Zero(), 0.03}), 2u);
  double farthest_m = 0;
  for (int i = 1; i <= 90; ++i) {
    const double swing = std::sin(2 * std::numbers::pi * i / 45.0);
    const Vec3 place = start + Vec3(0.03 * std::min(i / 30.0, 1.0), 0, 0);
    tick(pinch(place), turned_head(0.15 * swing));
    const std::vector<Vec3> now = points();
    Vec3 mean = Vec3::Zero();
    for (const std::size_t p : lock) mean += now[p] / static_cast<double>(lock.size());
    farthest_m = std::max(farthest_m, (mean - place).norm());
  }
  EXPECT_LT(farthest_m, 0.015);
  world_.let_go(id_, fingers, Release::drop);
  for (int i = 0; i < 60; ++i) tick({});
  EXPECT_LT(rms_m(points(), rest), 0.003);
}

TEST_F(TouchHair, hair_lies_on_a_chair_back_and_comes_to_rest) {
  const std::vector<Vec3> rest = rest_points();
  // The chair back is a board behind the neck that reaches 3 cm into the place where the hair hangs.
  double back_z = 0;
  for (const Vec3& point : rest) back_z = std::min(back_z, point.y() < -0.2 ? point.z() : 0.0);
  const std::vector<TouchBody> chair{
      {{kRoomToucher, 0}, box({0.25, 0.1, 0.02}), {Quat::Identity(), {0, -0.35, back_z - 0.02 + 0.03}}}};
  const std::size_t without = count_deep(chair, rest);
  ASSERT_GT(without, 50u);
  std::size_t deep = 0;
  for (int i = 0; i < 12 * 30; ++i) {
    tick(chair, turned_head(0.3 * std::sin(2 * std::numbers::pi * i / 60.0)));
    if (i >= 60) deep += count_deep(chair, points());
  }
  // The first 60 of 360 ticks, in which the board pushes hair out, do not count.
  EXPECT_LT(static_cast<double>(deep) / 300, 0.01 * static_cast<double>(rest.size()));
  // Hair must rest 5 s after the head, and sleeps kSleepAfter_s later.
  for (int i = 0; i < (5 + kSleepAfter_s) * 30 && !world_.lattice(id_).asleep; ++i) tick(chair);
  EXPECT_TRUE(world_.lattice(id_).asleep);
  EXPECT_LT(static_cast<double>(count_deep(chair, points())), 0.01 * static_cast<double>(rest.size()));
}

}  // namespace
}  // namespace hairnet
