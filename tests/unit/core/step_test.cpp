#include "core/solver/step.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/solver/energy.hpp"
#include "core/solver/head_motion.hpp"
#include "core/solver/reference_step.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

using support::make_random_level;
using support::make_random_state;
using support::turned;

// A step ends earlier when it has converged to the rounding of floats, so this number is only an upper limit.
constexpr SolverSettings kConverged{.iterations = 400};

float largest(std::span<const Vec3f> nodes) {
  float most = 0;
  for (const Vec3f& node : nodes) most = std::max(most, node.norm());
  return most;
}

Pose moved(double yaw_rad, const Vec3& position, double shoulder_rad = 0) {
  Pose pose = rigid_pose(turned(yaw_rad, {0.3, 1, 0.2}, position));
  pose[Bone::left_shoulder] = turned(shoulder_rad, {0, 0, 1}, position + Vec3(0.01, 0.005, 0));
  return pose;
}

// Momentum sum m P' and angular momentum about the origin sum P x m P' of the change from `before` to `after`.
struct Momentum {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};
Momentum momentum_change(const Level& level, const WorldLattice& before, const WorldLattice& after) {
  Momentum change;
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const Vec3 impulse = double{level.mass[i]} * (after.P_dot[i] - before.P_dot[i]);
    change.linear += impulse;
    change.angular += before.P[i].cross(impulse);
  }
  return change;
}

// One converged step in floats must equal the reference in doubles but for rounding: half a micrometre, and a velocity
// error some 30 times as large, since a step lasts 1/30 s. The heads are near the origin: the reference works in world
// coordinates, where the sums of float weights are off 1 or 0 by rounding, and the error grows with the distance.
TEST(Step, agrees_with_the_double_reference_from_the_same_state) {
  StepScratch scratch;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const Level level = make_random_level({.seed = seed});
    LatticeState state = make_random_state(level, 0.02f, 0.5f, seed);
    StepInput input;
    input.from = moved(0.1 * seed, {0, 0, 0});
    input.to = moved(0.1 * seed + 0.08, {0.02, -0.01, 0.03}, 0.2);
    const Environment windy{.wind = WindField({.mean_m_per_s = {1, 0.2, -0.5}})};
    input.environment = &windy;
    // Contact is switched off by 0, 20, 40 or 60 %.
    input.contact_release = 0.2 * (seed % 4);
    WorldLattice reference = to_world(level, input.from.head(), state);
    reference_step(level, input, reference, 1e-12);
    const LatticeState expected = to_head(level, input.to.head(), reference);
    ASSERT_TRUE(step(level, input, kConverged, scratch, state));
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      EXPECT_LT((state.displacement[i] - expected.displacement[i]).norm(), 5e-7f) << "seed " << seed << " node " << i;
      EXPECT_LT((state.velocity[i] - expected.velocity[i]).norm(), 2e-5f) << "seed " << seed << " node " << i;
    }
  }
}

// The step works in the axes of the head, so a character two kilometres away must move like one at the origin. Floats
// in world coordinates would have steps of 0.1 mm there.
TEST(Step, is_the_same_far_from_the_origin) {
  const Level level = make_random_level({});
  const auto stepped = [&](const Vec3& place) {
    LatticeState state = make_random_state(level, 0.02f, 0.5f, 1);
    StepInput input;
    input.from = moved(0.1, place);
    input.to = moved(0.18, place + Vec3(0.02, -0.01, 0.03), 0.2);
    StepScratch scratch;
    EXPECT_TRUE(step(level, input, kConverged, scratch, state));
    return state;
  };
  const LatticeState near = stepped(Vec3::Zero()), far = stepped({500, 1.5, -2000});
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    EXPECT_LT((far.displacement[i] - near.displacement[i]).norm(), 5e-7f) << "node " << i;
    EXPECT_LT((far.velocity[i] - near.velocity[i]).norm(), 2e-5f) << "node " << i;
  }
}

TEST(Step, springs_alone_conserve_momentum_and_angular_momentum) {
  const Level level = make_random_level({.attachment_count = 0, .ether = false, .drag = false, .contacts = false});
  LatticeState state = make_random_state(level, 0.02f, 0.5f, 3);
  const StepInput input;
  const WorldLattice before = to_world(level, input.from.head(), state);
  WorldLattice after = before;
  reference_step(level, input, after, 1e-13);
  const Momentum change = momentum_change(level, before, after);
  // Impulses are of the order of 1e-2 N s; weights in float sum to zero within 1e-8.
  EXPECT_LT(change.linear.norm(), 1e-9);
  EXPECT_LT(change.angular.norm(), 1e-9);

  StepScratch scratch;
  ASSERT_TRUE(step(level, input, kConverged, scratch, state));
  const Momentum of_step = momentum_change(level, before, to_world(level, input.to.head(), state));
  // The step computes in floats, so its rounding may be a hundred times as large.
  EXPECT_LT(of_step.linear.norm(), 1e-7);
  EXPECT_LT(of_step.angular.norm(), 1e-7);
}

TEST(Step, the_upright_design_is_the_equilibrium_exactly) {
  const Level level = make_random_level();
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  input.from = input.to = rigid_pose({Quat::Identity(), {3, 1.5, -2}});
  for (int tick = 0; tick < 200; ++tick) ASSERT_TRUE(step(level, input, {}, scratch, state));
  EXPECT_EQ(largest(state.displacement), 0.0f);
  EXPECT_EQ(largest(state.velocity), 0.0f);
}

// Gravity is turned into the axes of the head, which rounds, so hair moves by less than a nanometre and not by exactly
// zero.
TEST(Step, facing_another_way_changes_nothing) {
  const Level level = make_random_level();
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  input.from = input.to = rigid_pose(turned(2.1, {0, 1, 0}));
  for (int tick = 0; tick < 200; ++tick) ASSERT_TRUE(step(level, input, {}, scratch, state));
  EXPECT_LT(largest(state.displacement), 1e-9f);
}

// Without drag a constant velocity has no effect on hair, after any number of iterations, even a hundred metres from
// the origin. An absolute position in floats would lose micrometres in every step.
TEST(Step, a_head_at_constant_translation_leaves_the_lattice_rigid_exactly) {
  const Level level = make_random_level({.drag = false});
  const Vec3 velocity(2.5, 0.25, -1.5);
  for (const int iterations : {1, 4, 16, 200}) {
    LatticeState state;
    reset_to_rest(level, state);
    for (Vec3f& v : state.velocity) v = velocity.cast<float>();
    StepScratch scratch;
    StepInput input;
    input.to = rigid_pose({Quat::Identity(), {100, 1.5, 50}});
    for (int tick = 0; tick < 300; ++tick) {
      input.from = input.to;
      for (RigidTransform& bone : input.to.bones) bone.position += input.step_s * velocity;
      ASSERT_TRUE(step(level, input, {.iterations = iterations}, scratch, state));
    }
    EXPECT_LT(largest(state.displacement), 1e-6f) << iterations << " iterations";
  }
}

// A rigid turn with the head is not an exact solution of a step of backward Euler. The error must be of the second
// order of the angle a step: half the angle leaves a quarter of the deviation.
TEST(Step, a_turning_head_deviates_by_the_square_of_the_angle_a_step) {
  const Level level = make_random_level({.drag = false});
  StepScratch scratch;
  const auto deviation = [&](double angle_rad) {
    LatticeState state;
    reset_to_rest(level, state);
    StepInput before, input;
    before.from = rigid_pose(turned(-angle_rad, {0, 1, 0}));
    before.to = input.from = rigid_pose(turned(0, {0, 1, 0}));
    input.to = rigid_pose(turned(angle_rad, {0, 1, 0}));
    const HeadMotion rest_motion(before);
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      state.velocity[i] = rest_motion.rigid_velocity(level.rest[i].cast<double>()).cast<float>();
    }
    EXPECT_TRUE(step(level, input, kConverged, scratch, state));
    return largest(state.displacement);
  };
  const float coarse = deviation(0.2), fine = deviation(0.1), finer = deviation(0.05);
  EXPECT_NEAR(coarse / fine, 4, 0.4);
  EXPECT_NEAR(fine / finer, 4, 0.2);
  // The deviation is of the size of theta^2 times the distance of a node from the axis, which is less than 0.25 m.
  EXPECT_LT(finer, 0.05f * 0.05f * 0.25f);
}

// A step makes a fixed number of iterations. Each must bring the hair closer to the solution that has converged.
TEST(Step, more_iterations_come_closer_to_the_converged_solution) {
  const Level level = make_random_level({.nodes_per_axis = 6, .spring_count = 300, .attachment_count = 40});
  const LatticeState start = make_random_state(level, 0.02f, 0.5f, 5);
  StepInput input;
  input.from = moved(0, {0, 1.5, 0});
  input.to = moved(0.1, {0.02, 1.5, 0});
  WorldLattice lattice = to_world(level, input.from.head(), start);
  reference_step(level, input, lattice, 1e-12);
  const LatticeState converged = to_head(level, input.to.head(), lattice);
  StepScratch scratch;
  double last = 1e9;
  for (const int iterations : {2, 4, 8, 16, 32}) {
    LatticeState state = start;
    ASSERT_TRUE(step(level, input, {.iterations = iterations}, scratch, state));
    double error = 0;
    for (std::size_t i = 0; i < level.rest.size(); ++i) {
      error += static_cast<double>((state.displacement[i] - converged.displacement[i]).squaredNorm());
    }
    EXPECT_LT(error, last) << iterations << " iterations";
    last = error;
  }
}

// Each tick turns and moves the head at random, by up to half a radian and 20 cm an axis. A solver that stops after one
// iteration must be inaccurate, but not unstable.
TEST(Step, stiff_springs_and_few_iterations_stay_bounded_under_wild_poses) {
  for (const int iterations : {1, 2, 4, 16}) {
    const Level level = make_random_level({.spring_stiffness = 30, .seed = 7});
    LatticeState state;
    reset_to_rest(level, state);
    StepScratch scratch;
    std::mt19937 random(11);
    StepInput input;
    for (int tick = 0; tick < 3000; ++tick) {
      input.from = input.to;
      const RigidTransform jolt =
          turned(0.5 * static_cast<double>(support::random_vec(random, 1).x()),
                 support::random_vec(random, 1).cast<double>(), support::random_vec(random, 0.2f).cast<double>());
      input.to = rigid_pose(input.from.head() * jolt);
      ASSERT_TRUE(step(level, input, {.iterations = iterations}, scratch, state));
      // The level itself would allow 10 m (Level::displacement_max_m), so it is the solver that must keep hair within 3
      // m.
      ASSERT_LT(largest(state.displacement), 3.0f) << "tick " << tick << ", " << iterations << " iterations";
    }
  }
}

// The head is still and no outside force acts: the lattice may only lose energy.
TEST(Step, no_stiffness_and_no_number_of_iterations_adds_energy) {
  const HeadMotion still{StepInput{}};
  for (const float stiffness : {0.02f, 5.0f, 500.0f, 50'000.0f}) {
    for (const int iterations : {1, 2, 3, 5, 9, 16}) {
      for (const double step_s : {1.0 / 90, 1.0 / 25, 1.0 / 5}) {
        const Level level = make_random_level({.spring_stiffness = stiffness, .drag = false, .contacts = false});
        // Nodes start up to 15 cm off on each axis, at up to 5 m/s.
        LatticeState state = make_random_state(level, 0.15f, 5, 3);
        StepScratch scratch;
        StepInput input;
        input.step_s = step_s;
        double before_j = std::numeric_limits<double>::infinity();
        for (int tick = 0; tick < 60; ++tick) {
          ASSERT_TRUE(step(level, input, {.iterations = iterations}, scratch, state));
          // The next step first removes the energy above the limit.
          const LatticeEnergy now = energy(level, {}, still, state);
          const double now_j = now.kinetic_j + std::min(now.elastic_j, double{state.elastic_energy_max_j});
          // The step itself ignores an excess of 0.1 %, which may be rounding (limit_elastic_energy in step_inl.hpp).
          ASSERT_LE(now_j, before_j * 1.002 + 1e-9)
              << "k " << stiffness << ", " << iterations << " iterations of " << step_s << " s, tick " << tick;
          before_j = now_j;
        }
      }
    }
  }
}

// A linearised step does not see that a spring turns. Springs of 500 N/m and nodes of up to 40 m/s an axis turn so far
// in a step that their true energy rises, which limit_elastic_energy (step_inl.hpp) must take away again.
TEST(Step, lattices_that_gain_energy_by_turning_springs_are_scaled_down_and_return_to_rest) {
  const HeadMotion still{StepInput{}};
  StepInput input;
  input.step_s = 1.0 / 25;
  int drawn_in = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Level level = make_random_level({.spring_stiffness = 500, .drag = false, .contacts = false, .seed = seed});
    LatticeState state = make_random_state(level, 0.15f, 40, seed);
    StepScratch scratch;
    for (int tick = 0; tick < 30; ++tick) {
      ASSERT_TRUE(step(level, input, {.iterations = 9}, scratch, state));
      drawn_in += energy(level, {}, still, state).elastic_j > 1.01 * double{state.elastic_energy_max_j};
    }
    // Hair has 30 s, 750 steps of 1/25 s, to come to rest.
    for (int tick = 0; tick < 30 * 25; ++tick) ASSERT_TRUE(step(level, input, {.iterations = 9}, scratch, state));
    EXPECT_LT(largest(state.displacement), 1e-2f) << "seed " << seed;
  }
  EXPECT_GT(drawn_in, 0) << "nothing to draw in: the case tests nothing";
}

// The head goes back and forth by 0.8 m in every tick, and the ether and soft springs let hair stay behind.
// Displacements must reach near the bound, and never pass it but for rounding.
TEST(Step, a_lattice_goes_no_further_than_its_level_allows) {
  Level level = make_random_level({.spring_stiffness = 0.001f, .contacts = false});
  level.displacement_max_m = 0.4f;
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  float farthest = 0;
  for (int tick = 0; tick < 200; ++tick) {
    input.from = input.to;
    input.to = rigid_pose({Quat::Identity(), {tick % 2 ? 0.8 : 0.0, 0, 0.02 * tick}});
    ASSERT_TRUE(step(level, input, {}, scratch, state));
    farthest = std::max(farthest, largest(state.displacement));
  }
  EXPECT_GT(farthest, 0.3f);
  EXPECT_LE(farthest, 0.4f * 1.0001f);
}

TEST(Step, returns_to_the_design_from_any_crumpled_state) {
  const Level level = make_random_level({.spring_stiffness = 0.5f});
  StepScratch scratch;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    LatticeState state = make_random_state(level, 0.1f, 5, seed);
    // A minute passes.
    for (int tick = 0; tick < 30 * 60; ++tick) ASSERT_TRUE(step(level, {}, {}, scratch, state));
    EXPECT_LT(largest(state.displacement), 1e-4f) << "seed " << seed;
  }
}

TEST(Step, steady_wind_ends_where_drag_and_ether_balance) {
  const Level level = make_random_level({.spring_count = 0, .attachment_count = 0, .contacts = false});
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  const Environment windy{.wind = WindField({.mean_m_per_s = {4, 0, 1}})};
  input.environment = &windy;
  // The 100 s of the loop are ample for hair to come to rest.
  for (int tick = 0; tick < 3000; ++tick) ASSERT_TRUE(step(level, input, {}, scratch, state));
  const Vec3f wind(4, 0, 1);
  for (std::size_t i = 0; i < level.rest.size(); ++i) {
    const auto& q = level.drag[i];
    const Vec3f drag(q[0] * wind.x() + q[2] * wind.z(), q[1] * wind.x() + q[4] * wind.z(),
                     q[2] * wind.x() + q[5] * wind.z());
    // At rest, the drag Q w of the wind equals the pull k d of the ether.
    EXPECT_LT((state.displacement[i] - drag / level.ether_stiffness[i]).norm(), 1e-5f);
  }
}

// The left shoulder rises by 5 cm. Points of the hair that it would come at least 1 cm too near must be pushed away;
// contact is elastic, so the ether may press them up to 6 mm within their limit.
TEST(Step, skin_that_moves_into_the_hair_pushes_it_out) {
  const Level level = make_random_level({.spring_count = 0, .attachment_count = 0, .drag = false});
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  for (int tick = 0; tick < 120; ++tick) {
    input.from = input.to;
    input.to[Bone::left_shoulder].position.y() = 0.05 * std::min(1.0, tick / 20.0);
    ASSERT_TRUE(step(level, input, {}, scratch, state));
  }
  const ContactPoints& contacts = level.contacts;
  const SkinDistanceField& shoulder = level.skin->back();
  int pushed = 0;
  for (std::size_t p = 0; p < contacts.count(); ++p) {
    const double limit = double{contacts.limit[contacts.count() + p]};
    const Vec3 raised(0, 0.05, 0);
    if (skin_distance(shoulder, contacts.rest[p].cast<double>() - raised) >= limit - 0.01) continue;
    ++pushed;
    Vec3f at = contacts.rest[p];
    for (std::uint32_t e = contacts.begin[p]; e < contacts.begin[p + 1]; ++e)
      at += contacts.weights[e] * state.displacement[contacts.nodes[e]];
    EXPECT_GT(skin_distance(shoulder, at.cast<double>() - raised), limit - 0.006) << "point " << p;
  }
  EXPECT_GT(pushed, 0) << "no point in the way: the case tests nothing";
}

TEST(StepDeathTest, a_state_of_another_level_stops_the_program) {
  const Level level = make_random_level({.nodes_per_axis = 4}), other = make_random_level({.nodes_per_axis = 5});
  LatticeState state;
  reset_to_rest(other, state);
  StepScratch scratch;
  EXPECT_DEATH((void)step(level, {}, {}, scratch, state), "assertion failed: state.displacement.size\\(\\)");
}

TEST(StepDeathTest, a_step_without_length_stops_the_program) {
  const Level level = make_random_level();
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  StepInput input;
  input.step_s = 0;
  EXPECT_DEATH((void)step(level, input, {}, scratch, state), "assertion failed: input.step_s > 0");
}

#ifdef HAIRNET_VALIDATE_ON
TEST(StepDeathTest, a_node_that_the_level_lacks_stops_the_program) {
  Level level = make_random_level();
  level.springs.nodes.front() = static_cast<std::uint16_t>(level.rest.size());
  LatticeState state;
  reset_to_rest(level, state);
  StepScratch scratch;
  EXPECT_DEATH((void)step(level, {}, {}, scratch, state), "assertion failed: are_runs_of_nodes");
}
#endif

// A point of hair 4 cm in front of a ball of 4 cm radius is thrown at it. At 9 m/s the point goes 18 cm in a step, so
// it would be behind the ball if contact looked only at the place where the step ends.
TEST(Step, hair_does_not_pass_through_the_skull_however_fast) {
  Level level =
      make_random_level({.spring_count = 0, .attachment_count = 0, .ether = false, .drag = false, .contacts = false});
  level.skin = std::make_shared<Skin>(Skin{support::make_round_skin(Bone::head, Vec3f(0, -0.04f, 0), 0.04f)});
  // The point has a contact potential of 1 J, as the build gives a point of this mass.
  support::add_contact(level, Vec3f(0, -0.04f, 0.079f), 1);
  support::set_limits(level);
  for (const float speed : {0.5f, 2.0f, 5.0f, 9.0f}) {
    LatticeState state;
    reset_to_rest(level, state);
    for (Vec3f& v : state.velocity) v = Vec3f(0, 0, -speed);
    StepScratch scratch;
    StepInput input;
    input.step_s = 1.0 / 50;
    for (int tick = 0; tick < 25; ++tick) {
      ASSERT_TRUE(step(level, input, {}, scratch, state));
      Vec3f at = level.contacts.rest[0];
      for (std::size_t e = 0; e < level.contacts.nodes.size(); ++e)
        at += level.contacts.weights[e] * state.displacement[level.contacts.nodes[e]];
      ASSERT_GT(skin_distance(level.skin->front(), at.cast<double>()), 0) << speed << " m/s, tick " << tick;
    }
  }
}

}  // namespace
}  // namespace hairnet
