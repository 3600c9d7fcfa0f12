#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "core/solver/crowd_step.hpp"
#include "core/solver/reference_step.hpp"
#include "core/solver/step.hpp"
#include "tests/support/levels.hpp"

// Tests how hands and props act on hair in one step of the solver, and in many steps of one lattice.
namespace hairnet {
namespace {

using support::make_random_level;
using support::make_random_state;
using support::turned;

constexpr SolverSettings kConverged{.iterations = 400};
// The tolerance against the reference. The wall is a box whose middle is 5 m away (half_space), so a float place
// relative to this middle is rounded to half a micrometre.
constexpr float kRounding_m = 4e-6f;

// A body of each kind around the hair (sphere, capsule, box, the inside of a sphere, a wall), and some held points.
// All but the wall move; the seed shifts them.
struct Touched {
  explicit Touched(unsigned seed, std::size_t hold_count = 3) {
    const auto place = [](double angle_rad, const Vec3& position) {
      return turned(angle_rad, {0.2, 1, -0.4}, position);
    };
    const double s = 0.01 * seed;
    bodies = {
        {sphere(0.03), place(0, {0.05 + s, -0.05, 0.06}), place(0.1, {0.04 + s, -0.05, 0.05}), 0.5},
        {capsule(0.05, 0.01), place(0.3, {-0.08, -0.02 - s, 0}), place(0.5, {-0.06, -0.02 - s, 0.03}), 0.5},
        {box({0.2, 0.02, 0.2}), place(0.1, {0, -0.15, 0}), place(0.1, {0, -0.14, 0}), 0.8},
        {{.radius_m = 0.16, .is_inside_out = true}, place(0, {0, -0.04, 0}), place(0, {0.01, -0.04, 0}), 0},
    };
    const PlacedShape wall = half_space(turned(std::numbers::pi / 2, {0, 0, 1}, {0.1, 0, 0}));
    bodies.push_back({wall.shape, wall.place, wall.place, 0.3});
    for (std::size_t i = 0; i < hold_count; ++i) {
      const Vec3 from(0.1 * static_cast<double>(i) - 0.1, -0.05, 0.1);
      holds.push_back({static_cast<std::uint32_t>(3 * i + seed % 3), from, from + Vec3(0.02, 0.01, -0.03)});
    }
    touch = {bodies, holds};
  }
  Touched(const Touched&) = delete;
  std::vector<StepBody> bodies;
  std::vector<StepHold> holds;
  StepTouch touch;
};

StepInput moving_input(unsigned seed) {
  StepInput input;
  input.from = rigid_pose(turned(0.05 * seed, {0.3, 1, 0.2}));
  input.to = rigid_pose(turned(0.05 * seed + 0.08, {0.3, 1, 0.2}, {0.02, -0.01, 0.03}));
  input.step_s = 1.0 / (40 + seed);
  input.contact_release = 0.1 * (seed % 4);
  return input;
}

// Returns the bits of all numbers of a state, so that a comparison also tells 0 from -0.
std::vector<std::uint32_t> bits(const LatticeState& state) {
  std::vector<std::uint32_t> all;
  for (const std::vector<Vec3f>* nodes : {&state.displacement, &state.velocity}) {
    for (const Vec3f& node : *nodes) {
      for (int a = 0; a < 3; ++a) all.push_back(std::bit_cast<std::uint32_t>(node[a]));
    }
  }
  all.push_back(std::bit_cast<std::uint32_t>(state.elastic_energy_max_j));
  return all;
}

TEST(TouchStep, agrees_with_the_double_reference_from_the_same_state) {
  StepScratch scratch;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const Level level = make_random_level({.contact_count = 60, .seed = seed});
    const LatticeState start = make_random_state(level, 0.02f, 0.5f, seed);
    const Touched touched(seed);
    StepInput input = moving_input(seed);
    const auto expected_of = [&] {
      WorldLattice reference = to_world(level, input.from.head(), start);
      reference_step(level, input, reference, 1e-12);
      return to_head(level, input.to.head(), reference);
    };
    const LatticeState untouched = expected_of();
    input.touch = &touched.touch;
    const LatticeState expected = expected_of();
    LatticeState state = start;
    ASSERT_TRUE(step(level, input, kConverged, scratch, state));
    float farthest_m = 0;
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      EXPECT_LT((state.displacement[i] - expected.displacement[i]).norm(), kRounding_m)
          << "seed " << seed << " node " << i;
      // A velocity is a displacement over a step of at most 1/41 s; 50 leaves some room.
      EXPECT_LT((state.velocity[i] - expected.velocity[i]).norm(), 50 * kRounding_m)
          << "seed " << seed << " node " << i;
      farthest_m = std::max(farthest_m, (untouched.displacement[i] - expected.displacement[i]).norm());
    }
    // Without the bodies, the reference must end at least 1 mm elsewhere.
    EXPECT_GT(farthest_m, 1e-3f) << "the touch of seed " << seed << " does nothing";
  }
}

TEST(TouchStep, a_touched_character_ends_in_the_same_bits_in_a_crowd) {
  const Level level = make_random_level({.contact_count = 60, .seed = 5});
  const std::size_t count = crowd_width();
  std::vector<LatticeState> alone, together;
  std::vector<StepInput> inputs;
  std::vector<std::unique_ptr<Touched>> touched;
  for (std::size_t c = 0; c < count; ++c) {
    const auto seed = static_cast<unsigned>(c);
    alone.push_back(make_random_state(level, 0.02f, 0.5f, seed));
    touched.push_back(std::make_unique<Touched>(seed, c % 5 == 4 ? 3 : 0));
    inputs.push_back(moving_input(seed));
    // Characters of one crowd have from no to five bodies, every fifth of them holds, and every third one no touch at
    // all.
    touched[c]->touch.bodies = touched[c]->touch.bodies.first(c % 6);
    if (c % 3 != 0) inputs[c].touch = &touched[c]->touch;
  }
  together = alone;
  StepScratch scratch;
  std::vector<CrowdMember> members;
  for (std::size_t c = 0; c < count; ++c) {
    ASSERT_TRUE(step(level, inputs[c], {}, scratch, alone[c]));
    members.push_back({std::span(&inputs[c], 1), &together[c]});
  }
  step_crowd(level, members, {}, scratch);
  for (std::size_t c = 0; c < count; ++c) {
    EXPECT_TRUE(members[c].is_finite);
    EXPECT_EQ(bits(alone[c]), bits(together[c])) << "character " << c;
  }
}

// Otherwise hair at the other end of a room would move when somebody lifts a hand, and recordings would differ.
TEST(TouchStep, a_body_that_hair_does_not_reach_changes_no_bit) {
  const Level level = make_random_level({.contact_count = 60});
  StepScratch scratch;
  LatticeState without = make_random_state(level, 0.02f, 0.5f, 1), with = without;
  StepInput input = moving_input(1);
  const StepBody far{sphere(0.1), {Quat::Identity(), {2, 0, 0}}, {Quat::Identity(), {2.1, 0, 0}}, 0.5};
  ASSERT_TRUE(step(level, input, {}, scratch, without));
  const StepTouch touch{std::span(&far, 1), {}};
  input.touch = &touch;
  ASSERT_TRUE(step(level, input, {}, scratch, with));
  EXPECT_EQ(bits(without), bits(with));
}

// Makes a level with one contact point in a cube of eight nodes. Only ether binds the nodes, so that all motion of the
// point comes from the touch and from the ether.
Level one_point_level(float ether_N_per_m) {
  Level level = make_random_level({.nodes_per_axis = 2,
                                   .spring_count = 0,
                                   .attachment_count = 0,
                                   .ether = false,
                                   .drag = false,
                                   .contacts = false});
  level.skin = std::make_shared<Skin>();
  support::add_contact(level, {0, -0.04f, 0});
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    level.mass[i] = 3e-4f;
    level.ether_stiffness[i] = ether_N_per_m / 8;
    level.ether_damping[i] = 0.1f * ether_N_per_m / 8;
  }
  return level;
}

Vec3 place_of_point(const Level& level, const LatticeState& state) {
  Vec3 place = level.contacts.rest[0].cast<double>();
  for (std::uint32_t e = level.contacts.begin[0]; e < level.contacts.begin[1]; ++e) {
    place += double{level.contacts.weights[e]} * state.displacement[level.contacts.nodes[e]].cast<double>();
  }
  return place;
}

// Moves one body from place to place, one step of 1/50 s each, and returns where the point ends.
Vec3 stroked(const Level& level, const TouchShape& shape, double friction, std::span<const Vec3> places,
             LatticeState& state) {
  StepScratch scratch;
  for (std::size_t tick = 0; tick + 1 < places.size(); ++tick) {
    const StepBody body{shape, {Quat::Identity(), places[tick]}, {Quat::Identity(), places[tick + 1]}, friction};
    const StepTouch touch{std::span(&body, 1), {}};
    StepInput input;
    input.step_s = 1.0 / 50;
    input.touch = &touch;
    EXPECT_TRUE(step(level, input, {}, scratch, state));
  }
  return place_of_point(level, state);
}

TEST(TouchStep, a_finger_that_would_cross_hair_within_a_step_takes_it_along) {
  const Level level = one_point_level(0.05f);
  LatticeState state;
  reset_to_rest(level, state);
  // The finger has a radius of 8 mm and moves at 1.25 m/s: 2.5 cm in a step, more than its thickness of 16 mm. It
  // begins just before the point. A contact that looked only at the end of the step would let the point through.
  std::vector<Vec3> places;
  for (int tick = 0; tick < 8; ++tick) places.emplace_back(-0.015 + 0.025 * tick, -0.04, 0);
  const Vec3 end = stroked(level, capsule(0.04, 0.008), 0, places, state);
  EXPECT_GT(end.x(), places.back().x()) << "the finger has passed";
}

TEST(TouchStep, friction_carries_hair_along_a_palm_as_coulomb_says) {
  const Level level = one_point_level(1);
  // A plate of 4 cm thickness lifts the point by 1 cm and then slides 12 cm to the side. The returned shift is where
  // friction and the ether balance, so by Coulomb's law it doubles with the coefficient. A coefficient of 20 holds the
  // point on the plate.
  const auto shift = [&](double friction) {
    LatticeState state;
    reset_to_rest(level, state);
    std::vector<Vec3> places;
    for (int tick = 0; tick <= 20; ++tick) places.emplace_back(0, -0.07 + 0.00075 * tick, 0);
    for (int tick = 1; tick <= 120; ++tick) places.emplace_back(0.001 * tick, -0.055, 0);
    return stroked(level, box({0.3, 0.02, 0.3}), friction, places, state).x();
  };
  const double half = shift(0.5), whole = shift(1);
  EXPECT_NEAR(shift(0), 0, 1e-4);
  EXPECT_GT(half, 0.002);
  EXPECT_NEAR(whole / half, 2, 0.2);
  EXPECT_GT(shift(20), 0.1) << "what sticks moves with the plate";
}

// The point begins 4 cm deep in a ball of 5 cm that does not move. Without a limit of speed, contact would throw it
// out.
TEST(TouchStep, hair_within_a_body_leaves_it_no_faster_than_the_recovery) {
  const Level level = one_point_level(0.01f);
  LatticeState state;
  reset_to_rest(level, state);
  const std::vector<Vec3> places(26, Vec3(0.01, -0.04, 0));
  double deepest_m = 0.05;
  StepScratch scratch;
  for (std::size_t tick = 0; tick + 1 < places.size(); ++tick) {
    const Vec3 before = place_of_point(level, state);
    const Vec3 after = stroked(level, sphere(0.05), 0, std::span(places).subspan(tick, 2), state);
    // Contact pushes out at 0.4 m/s at most (kContactRecovery_m_per_s in contact.hpp); a step lasts 1/50 s, and the
    // half more is for the ether.
    EXPECT_LT((after - before).norm(), 1.5 * 0.4 / 50) << "tick " << tick;
    deepest_m = 0.05 - (after - places[0]).norm();
  }
  EXPECT_LT(deepest_m, 0.003) << "it is still within";
}

// The hand moves 10 cm to the side within a second. The point must stay within 4 mm of it; after the hold ends, the
// point returns to its start within 2 mm, slower than 5 m/s.
TEST(TouchStep, a_held_point_follows_the_hand_and_the_force_ends_with_the_hold) {
  const Level level = one_point_level(0.05f);
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  Vec3 hand = place_of_point(level, state);
  const Vec3 start = hand;
  for (int tick = 0; tick < 50; ++tick) {
    // An angle of 0.063 rad a step is half a turn in 50 steps, so the hand starts and stops gently.
    const Vec3 next = start + Vec3(0.1 * (1 - std::cos(0.063 * (tick + 1))) / 2, 0, 0);
    const StepHold hold{0, hand, next};
    const StepTouch touch{{}, std::span(&hold, 1)};
    StepInput input;
    input.step_s = 1.0 / 50;
    input.touch = &touch;
    ASSERT_TRUE(step(level, input, {}, scratch, state));
    hand = next;
    EXPECT_LT((place_of_point(level, state) - hand).norm(), 0.004) << "tick " << tick;
  }
  double fastest_m_per_s = 0;
  Vec3 before = place_of_point(level, state);
  for (int tick = 0; tick < 300; ++tick) {
    StepInput input;
    input.step_s = 1.0 / 50;
    ASSERT_TRUE(step(level, input, {}, scratch, state));
    const Vec3 now = place_of_point(level, state);
    fastest_m_per_s = std::max(fastest_m_per_s, (now - before).norm() * 50);
    before = now;
  }
  EXPECT_LT(fastest_m_per_s, 5);
  EXPECT_LT((before - start).norm(), 0.002);
}

// A step meets the most bodies that it takes (kStepBodiesMax) and 20 held points, all at new random places in each
// tick. In every hundredth tick the bodies are up to 10 km away, and some bodies are inside out.
TEST(TouchStep, mad_hands_leave_every_state_finite_and_bounded) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto place = [&](double size) {
    return RigidTransform{Quat(unit(random) + 1.1, unit(random), unit(random), unit(random)).normalized(),
                          size * Vec3(unit(random), unit(random), unit(random))};
  };
  const Level level = make_random_level({.contact_count = 60});
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  std::vector<RigidTransform> at(kStepBodiesMax);
  std::vector<Vec3> held(20, Vec3::Zero());
  for (int tick = 0; tick < 2000; ++tick) {
    std::vector<StepBody> bodies;
    for (std::size_t b = 0; b < at.size(); ++b) {
      const RigidTransform before = std::exchange(at[b], place(tick % 100 == 0 ? 1e4 : 0.3));
      bodies.push_back({{.half_size_m = b % 3 ? Vec3(0, 0.05, 0) : Vec3(0.02, 0, 0.1),
                         .radius_m = b % 4 ? 0.02 : 0,
                         .is_inside_out = b % 11 == 10},
                        before,
                        at[b],
                        0.5});
    }
    std::vector<StepHold> holds;
    for (std::uint32_t p = 0; p < held.size(); ++p) {
      const Vec3 before = std::exchange(held[p], place(tick % 50 == 0 ? 100 : 0.2).position);
      holds.push_back({p, before, held[p]});
    }
    const StepTouch touch{bodies, holds};
    StepInput input = moving_input(static_cast<unsigned>(tick % 20));
    input.touch = &touch;
    ASSERT_TRUE(step(level, input, {}, scratch, state)) << "tick " << tick;
    for (const Vec3f& d : state.displacement) ASSERT_LE(d.norm(), 1.001f * level.displacement_max_m);
  }
}

}  // namespace
}  // namespace hairnet
