#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/world/world.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

// Speeds of the head in m/s. A jump from rest to more than 25 m/s in one tick is a teleport (is_teleport), so the
// speeds lie on both sides of this limit and on it.
constexpr std::array kSpeeds{0.0, 1.0, 10.0, 25.0, 30.0, 100.0, 300.0};
constexpr double kRideTick_s = 1.0 / 30;
// The radius of the circle on which heads ride.
constexpr double kRadius_m = 50;
// The ride is kilometres away from the origin of the world, where world coordinates in floats are coarse.
const Vec3 kFar(4000, 1.5, -3000);

std::shared_ptr<const LevelSet> ride_levels(bool contacts = true) {
  auto levels = std::make_shared<LevelSet>();
  for (Level& level : levels->levels)
    level = support::make_random_level(
        {.nodes_per_axis = 4, .spring_count = 60, .attachment_count = 10, .drag = true, .contacts = contacts});
  levels->learnt = std::make_shared<LearntHair>(support::random_learnt_hair(3));
  return levels;
}

WorldDef in_air(const Wind& wind) {
  WorldDef def;
  def.environment.wind = WindField(wind);
  return def;
}
Wind carried_wind() {
  Wind wind;
  wind.carried = true;
  return wind;
}
WorldDef in_carried_air() {
  return in_air(carried_wind());
}

// Steps a world with one character, whose hair starts displaced so that it moves. A tick has one substep.
struct Ride {
  explicit Ride(const std::shared_ptr<const LevelSet>& levels, const Pose& start, const Wind& wind,
                LevelIndex level = LevelIndex::low)
      : world([&] {
          WorldDef def = in_air(wind);
          def.substep_count = 1;
          return def;
        }()),
        id(world.add({levels, level, start, 0})) {
    const std::vector<Vec3f> flung(world.lattice(id).displacement.size(), Vec3f(0.05f, -0.02f, 0.03f));
    if (!flung.empty()) {
      EXPECT_TRUE(world.set_state(id, flung, {}));
    }
  }
  StepReport to(const Pose& pose, bool teleport = false) {
    world.set_pose(id, pose, teleport);
    return world.step();
  }
  [[nodiscard]] std::vector<Vec3f> displacement() const {
    const auto nodes = world.lattice(id).displacement;
    return {nodes.begin(), nodes.end()};
  }
  [[nodiscard]] std::vector<float> coefficients() const {
    const auto c = world.lattice(id).coefficients;
    return {c.begin(), c.end()};
  }

  World world;
  CharacterId id;
};

float farthest_m(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  EXPECT_EQ(a.size(), b.size());
  float most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
  return most;
}
float farthest_m(const std::vector<Vec3f>& a) {
  return farthest_m(a, std::vector<Vec3f>(a.size(), Vec3f::Zero()));
}

Pose turned_head(const Vec3& place, int tick) {
  return rigid_pose(support::turned(0.3 * std::sin(4 * tick * kRideTick_s), {0.2, 1, 0.1}, place));
}

// Carried air moves with the head, as in a vehicle. At a constant velocity hair must move exactly as that of a head
// which only turns in place; it swings when the vehicle stops, in tick 61.
TEST(RideInCarriedAir, at_any_constant_speed_hair_moves_as_at_rest_and_swings_at_the_stop) {
  const auto levels = ride_levels();
  for (const double speed : kSpeeds) {
    const auto place = [&](int tick) {
      return Vec3(kFar + std::min(tick, 60) * kRideTick_s * speed * Vec3(0.6, 0, 0.8));
    };
    Ride rides(levels, turned_head(kFar, 0), carried_wind()), rests(levels, turned_head(kFar, 0), carried_wind());
    std::uint32_t teleports = 0;
    for (int tick = 1; tick <= 60; ++tick) {
      teleports += rides.to(turned_head(place(tick), tick)).teleports;
      // Nobody knows yet in the first tick that a ride has begun.
      const bool has_jumped = tick == 1 && rides.world.lattice(rides.id).discontinuous;
      has_jumped ? rests.to(turned_head(kFar, tick), true) : rests.to(turned_head(kFar, tick));
      EXPECT_LT(farthest_m(rides.displacement(), rests.displacement()), 1e-4f) << speed << " m/s, tick " << tick;
    }
    EXPECT_EQ(teleports, speed > 25 ? 1u : 0u) << speed;
    float swing_m = 0;
    for (int tick = 61; tick <= 90; ++tick) {
      EXPECT_EQ(rides.to(turned_head(place(tick), tick)).stepped, 1u) << "a stop is no teleport";
      rests.to(turned_head(kFar, tick));
      swing_m = std::max(swing_m, farthest_m(rides.displacement(), rests.displacement()));
      ASSERT_TRUE(std::ranges::all_of(rides.displacement(), [](const Vec3f& d) { return d.allFinite(); }));
    }
    if (speed > 0) {
      EXPECT_GT(swing_m, 2e-3f) << speed;
    }
  }
}

// A head on a circle accelerates towards the middle. Hair there must move as at rest under a gravity that has this
// acceleration taken off.
TEST(RideInCarriedAir, on_a_circle_hair_moves_as_at_rest_under_the_circles_own_force) {
  // Contact and the limit of elastic energy look at velocities, so that they tell inertia from gravity.
  const auto levels = ride_levels(false);
  for (const double speed : kSpeeds) {
    const auto place = [&](int tick) {
      const double turn = speed / kRadius_m * kRideTick_s * tick;
      return Vec3(kFar + kRadius_m * Vec3(std::cos(turn), 0, std::sin(turn)));
    };
    Ride rides(levels, rigid_pose({Quat::Identity(), place(0)}), carried_wind());
    Ride rests(levels, rigid_pose({Quat::Identity(), kFar}), carried_wind());
    std::uint32_t teleports = 0;
    float pulled_m = 0;
    for (int tick = 1; tick <= 90; ++tick) {
      teleports += rides.to(rigid_pose({Quat::Identity(), place(tick)})).teleports;
      if (rides.world.lattice(rides.id).discontinuous) {
        rests.to(rigid_pose({Quat::Identity(), kFar}), true);
        continue;
      }
      Environment environment = in_carried_air().environment;
      const Vec3 acceleration = (place(tick) - 2 * place(tick - 1) + place(tick - 2)) / (kRideTick_s * kRideTick_s);
      const bool has_begun = tick > (speed > 25 ? 2 : 1);
      if (has_begun) environment.gravity -= acceleration;
      rests.world.set_environment(environment);
      rests.to(rigid_pose({Quat::Identity(), kFar}));
      const float size_m = farthest_m(rests.displacement());
      // At more than 20 g the limit of elastic energy soon acts on the crumpled springs.
      if (speed <= 30 || tick <= 5) {
        EXPECT_LT(farthest_m(rides.displacement(), rests.displacement()), 1e-4f + 0.02f * size_m)
            << speed << " " << tick;
      }
      if (speed >= 10 && tick > 30) {
        Vec3f mean = Vec3f::Zero();
        for (const Vec3f& d : rides.displacement()) mean += d;
        EXPECT_GT(mean.dot((place(tick) - kFar).cast<float>()), 0) << "outwards, at " << speed << " m/s, tick " << tick;
      }
      pulled_m = std::max(pulled_m, size_m);
    }
    EXPECT_EQ(teleports, speed > 25 ? 1u : 0u) << speed;
    EXPECT_GT(pulled_m, 0.0f);
  }
}

// In a vehicle whose air is carried along, hair moves as in a room.
TEST(RideInCarriedAir, learnt_hair_moves_as_at_rest_and_is_covered) {
  const auto levels = ride_levels();
  for (const double speed : kSpeeds) {
    const auto place = [&](int tick) { return Vec3(kFar + tick * kRideTick_s * speed * Vec3(0.6, 0, 0.8)); };
    Ride rides(levels, turned_head(kFar, 0), carried_wind(), LevelIndex::learnt);
    Ride rests(levels, turned_head(kFar, 0), carried_wind(), LevelIndex::learnt);
    std::uint32_t teleports = 0;
    for (int tick = 1; tick <= 150; ++tick) {
      teleports += rides.to(turned_head(place(tick), tick)).teleports;
      rests.to(turned_head(kFar, tick));
      if (tick < 90) continue;
      EXPECT_TRUE(rides.world.lattice(rides.id).is_covered) << speed;
      for (std::size_t k = 0; k < rests.coefficients().size(); ++k)
        EXPECT_NEAR(rides.coefficients()[k], rests.coefficients()[k], 1e-4f) << speed << ", tick " << tick;
    }
    EXPECT_EQ(teleports, speed > 25 ? 1u : 0u) << speed;
  }
}

TEST(Ride, through_the_rooms_still_air_has_a_headwind) {
  const auto levels = ride_levels();
  for (const double speed : {5.0, 30.0}) {
    const Vec3 velocity = speed * Vec3(0.6, 0, 0.8);
    Ride rides(levels, rigid_pose({Quat::Identity(), kFar}), {});
    Wind headwind;
    headwind.mean_m_per_s = -velocity;
    Ride in_wind(levels, rigid_pose({Quat::Identity(), kFar}), headwind);
    rides.to(rigid_pose({Quat::Identity(), kFar + kRideTick_s * velocity}), true);
    in_wind.to(rigid_pose({Quat::Identity(), kFar}), true);
    // Only the second tick at more than 25 m/s shows that the first was the start of a ride and no jump.
    if (speed > 25) {
      rides.to(rigid_pose({Quat::Identity(), kFar + 2 * kRideTick_s * velocity}));
      in_wind.to(rigid_pose({Quat::Identity(), kFar}), true);
    }
    const int first = speed > 25 ? 3 : 2;
    for (int tick = first; tick <= 60; ++tick) {
      EXPECT_EQ(rides.to(rigid_pose({Quat::Identity(), kFar + tick * kRideTick_s * velocity})).stepped, 1u);
      in_wind.to(rigid_pose({Quat::Identity(), kFar}));
      EXPECT_LT(farthest_m(rides.displacement(), in_wind.displacement()), 1e-4f) << speed << ", tick " << tick;
    }
    EXPECT_GT(farthest_m(rides.displacement()), 1e-3f);
  }
}

// A head that rides for ten ticks jumps 500 m to the side, then goes on or stands still. Whether the client marks the
// jump or not, it must be one teleport, and the velocity after it must not count as an acceleration of the hair.
TEST(RideInCarriedAir, a_jump_is_a_teleport_at_any_speed_and_kicks_no_hair) {
  const auto levels = ride_levels();
  for (const bool is_marked : {false, true}) {
    for (const double speed : kSpeeds) {
      for (const double speed_after : {0.0, speed}) {
        const Vec3 velocity(0, 0, speed);
        World world(in_carried_air());
        const CharacterId id = world.add({levels, LevelIndex::low, rigid_pose({Quat::Identity(), kFar}), 0});
        const auto at = [&](const Vec3& place) { return rigid_pose({Quat::Identity(), place}); };
        ASSERT_TRUE(world.set_state(id, std::vector<Vec3f>(world.lattice(id).displacement.size(), Vec3f::Zero()), {}));
        Vec3 place = kFar;
        for (int tick = 0; tick < 10; ++tick) {
          world.set_pose(id, at(place += kRideTick_s * velocity));
          world.step();
        }
        EXPECT_FALSE(world.lattice(id).discontinuous);
        world.set_pose(id, at(place += Vec3(500, 0, 0)), is_marked);
        EXPECT_EQ(world.step().teleports, 1u);
        EXPECT_TRUE(world.lattice(id).discontinuous);
        for (int tick = 0; tick < 10; ++tick) {
          world.set_pose(id, at(place += kRideTick_s * speed_after * Vec3::UnitZ()));
          EXPECT_EQ(world.step().teleports, 0u) << speed << ", " << tick;
          for (const Vec3f& d : world.lattice(id).displacement) EXPECT_LT(d.norm(), 1e-4f) << speed << " " << tick;
        }
      }
    }
  }
}

TEST(RideInCarriedAir, is_the_same_after_a_change_of_level_a_suspension_and_with_strides) {
  const auto levels = ride_levels();
  World world(in_carried_air());
  const CharacterId id = world.add({levels, LevelIndex::low, rigid_pose({Quat::Identity(), kFar}), 0});
  Vec3 place = kFar;
  for (int tick = 0; tick < 200; ++tick) {
    world.set_pose(id, rigid_pose({Quat::Identity(), place += Vec3(100 * kRideTick_s, 0, 0)}));
    // The ride is at 100 m/s. Its first tick is a jump, and so is the end of the suspension in tick 130; nothing else
    // may be, and no change may displace the hair by a millimetre.
    if (tick == 20) world.set_level(id, LevelIndex::rigid);
    if (tick == 40) world.set_level(id, LevelIndex::medium);
    if (tick == 60) world.set_stride(id, 4);
    if (tick == 90) world.set_stride(id, 1);
    if (tick == 100) world.set_suspended(id, true);
    if (tick == 130) world.set_suspended(id, false);
    if (tick == 150) world.set_level(id, LevelIndex::learnt);
    if (tick == 170) world.set_level(id, LevelIndex::high);
    const std::uint32_t teleports = world.step().teleports;
    EXPECT_EQ(teleports, tick == 0 || tick == 130 ? 1u : 0u) << tick;
    for (const Vec3f& d : world.lattice(id).displacement) EXPECT_LT(d.norm(), 1e-3f) << tick;
  }
}

}  // namespace
}  // namespace hairnet
