#include "core/build/metaballs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "core/build/body_balls.hpp"
#include "core/build/build.hpp"
#include "tests/unit/core/build_grooms.hpp"

namespace hairnet {
namespace {

// Model section 5, in float as the solver has it.
Vec3f force(const Vec3f& centre, float radius, float potential, const Vec3f& point) {
  const Vec3f r = point - centre;
  const float u = r.squaredNorm() / (radius * radius);
  return u >= 1 ? Vec3f(Vec3f::Zero()) : Vec3f(6 * potential / (radius * radius) * (1 - u) * (1 - u) * r);
}

Groom make_groom_with_body() {
  Groom groom = support::make_head_of_hair(300);
  groom.body = support::make_plain_body();
  return groom;
}

std::map<Bone, int> balls_by_bone(const BodyShape& shape) {
  std::map<Bone, int> counts;
  for (const BodyBall& ball : shape.balls) ++counts[ball.bone];
  return counts;
}

TEST(PlaceBalls, gives_every_part_of_the_body_its_balls) {
  const BodyShape shape = place_balls(make_groom_with_body());
  EXPECT_EQ(balls_by_bone(shape), (std::map<Bone, int>{{Bone::head, 2},
                                                       {Bone::neck, 1},
                                                       {Bone::left_shoulder, 1},
                                                       {Bone::right_shoulder, 1},
                                                       {Bone::upper_trunk, 2}}));
}

TEST(PlaceBalls, centres_are_inside_the_body) {
  const BodyShape shape = place_balls(make_groom_with_body());
  for (const BodyBall& ball : shape.balls) {
    EXPECT_TRUE(shape.skin.inside(ball.centre)) << ball.centre.transpose();
    EXPECT_GT(ball.radius, 0.02);
    EXPECT_LT(ball.radius, 0.3);
  }
}

TEST(PlaceBalls, balls_lie_in_their_own_part) {
  const Groom groom = make_groom_with_body();
  for (const BodyBall& ball : place_balls(groom).balls) {
    if (ball.bone == Bone::left_shoulder) {
      EXPECT_GT(ball.centre.x(), 0.05);
    }
    if (ball.bone == Bone::right_shoulder) {
      EXPECT_LT(ball.centre.x(), -0.05);
    }
    if (ball.bone == Bone::head) {
      EXPECT_GT(ball.centre.y(), -0.05);
    }
    if (ball.bone == Bone::upper_trunk) {
      EXPECT_LT(ball.centre.y(), -0.2);
    }
  }
}

TEST(PlaceBalls, a_skull_alone_has_two) {
  Groom groom = support::make_head_of_hair(50);
  support::add_ellipsoid(groom.body, {0, 0.05f, 0}, {0.08f, 0.1f, 0.09f}, Bone::head);
  EXPECT_EQ(balls_by_bone(place_balls(groom)), (std::map<Bone, int>{{Bone::head, 2}}));
}

TEST(PlaceBalls, legs_get_none) {
  Groom groom = make_groom_with_body();
  support::add_ellipsoid(groom.body, {0.1f, -1.2f, 0}, {0.08f, 0.4f, 0.08f}, Bone::upper_trunk);
  for (const BodyBall& ball : place_balls(groom).balls) EXPECT_GT(ball.centre.y(), -0.56);
}

TEST(PlaceBalls, no_mesh_has_no_balls) {
  EXPECT_TRUE(place_balls(support::make_head_of_hair(5)).balls.empty());
  const auto level = build_level(support::make_head_of_hair(5), kLevelSpecs[2]);
  EXPECT_TRUE(level->metaballs.empty());
}

class Contact : public testing::TestWithParam<std::size_t> {};

TEST_P(Contact, does_nothing_in_the_design) {
  const auto level = build_level(make_groom_with_body(), kLevelSpecs[GetParam()]);
  ASSERT_EQ(level->metaballs.size(), 7u);
  for (const Metaball& ball : level->metaballs) {
    ASSERT_EQ(ball.radius.size(), level->rest.size());
    ASSERT_EQ(ball.potential.size(), level->rest.size());
    for (std::size_t i = 0; i < level->rest.size(); ++i) {
      if (ball.radius[i] == 0) continue;
      EXPECT_EQ(force(ball.centre, ball.radius[i], ball.potential[i], level->rest[i]), Vec3f(Vec3f::Zero()));
      EXPECT_LE(ball.radius[i], (level->rest[i] - ball.centre).norm());
    }
  }
}

TEST_P(Contact, carries_five_times_the_weight_within_five_millimetres) {
  Groom groom = make_groom_with_body();
  groom.materials.base.metaball_potential_j = 0;  // as much as the load needs and no more
  const auto level = build_level(groom, kLevelSpecs[GetParam()]);
  std::size_t on = 0;
  for (const Metaball& ball : level->metaballs) {
    for (std::size_t i = 0; i < level->rest.size(); ++i) {
      if (ball.radius[i] == 0) {
        EXPECT_EQ(ball.potential[i], 0);
        continue;
      }
      ++on;
      const float load = 5 * 9.81f * level->mass[i];
      const auto at = [&](float depth) {
        return force(ball.centre, ball.radius[i], ball.potential[i], ball.centre + Vec3f(0, ball.radius[i] - depth, 0))
            .norm();
      };
      EXPECT_NEAR(at(0.005f), load, 0.01f * load);
      EXPECT_LT(at(0.004f), load);
    }
  }
  EXPECT_GT(on, level->rest.size());
}

TEST_P(Contact, a_node_outside_is_held_off_the_skin_and_a_node_inside_goes_no_further_in) {
  const Groom groom = make_groom_with_body();
  const auto level = build_level(groom, kLevelSpecs[GetParam()]);
  const MeshQuery skin(groom.body.mesh);
  for (const Metaball& ball : level->metaballs) {
    for (std::size_t i = 0; i < level->rest.size(); ++i) {
      if (ball.radius[i] == 0) continue;
      const Vec3 node = level->rest[i].cast<double>(), centre = ball.centre.cast<double>();
      if (skin.inside(node)) continue;
      // No farther out than the skin along the ray, plus the hair's thickness, unless the ball is at its least size.
      const double distance = (node - centre).norm();
      const auto last = skin.first_hit(node, (centre - node) / distance, distance);
      const double to_skin = last ? distance - last->distance : 0;
      EXPECT_LE(static_cast<double>(ball.radius[i]), std::max(to_skin, 0.14) + 0.0061);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Levels, Contact, testing::Values(0, 1, 2, 3));

TEST(Contact, around_a_sphere_the_limit_is_the_skin_plus_the_thickness) {
  Body body;
  support::add_ellipsoid(body, {0, 0, 0}, {0.1f, 0.1f, 0.1f}, Bone::head);
  const BodyShape shape{MeshQuery(body.mesh), {{Bone::head, Vec3::Zero(), 0.1}}};
  const std::vector<Vec3f> nodes{{0, 0.2f, 0},  {0.15f, 0, 0.1f}, {0, 0.103f, 0},
                                 {0.08f, 0, 0}, {0, 0.02f, 0},    {0, 0, 0}};
  const std::vector<double> mass(nodes.size(), 1e-3);
  const std::vector<Metaball> balls = fit_metaballs(shape, nodes, mass, {});
  ASSERT_EQ(balls.size(), 1u);
  EXPECT_NEAR(balls[0].radius[0], 0.106, 1e-3);  // far outside: skin plus thickness
  EXPECT_NEAR(balls[0].radius[1], 0.106, 1e-3);
  EXPECT_NEAR(balls[0].radius[2], 0.103, 1e-5);  // just outside: where it lies
  EXPECT_NEAR(balls[0].radius[3], 0.08, 1e-5);   // inside: where it lies
  EXPECT_EQ(balls[0].radius[4], 0);              // too deep: off
  EXPECT_EQ(balls[0].radius[5], 0);              // at the centre: off
}

TEST(Contact, a_ball_reaches_the_skin_on_both_sides_of_a_long_head) {
  Body body;
  support::add_ellipsoid(body, {0, 0, 0}, {0.08f, 0.1f, 0.11f}, Bone::head);
  const BodyShape shape{MeshQuery(body.mesh), {{Bone::head, Vec3::Zero(), 0.095}}};
  const std::vector<Vec3f> nodes{{0.3f, 0, 0}, {0, 0.3f, 0}, {0, 0, 0.3f}};
  const std::vector<double> mass(nodes.size(), 1e-3);
  const Metaball ball = fit_metaballs(shape, nodes, mass, {})[0];
  EXPECT_NEAR(ball.radius[0], 0.086, 1e-3);
  EXPECT_NEAR(ball.radius[1], 0.106, 1e-3);
  EXPECT_NEAR(ball.radius[2], 0.116, 1e-3);
}

}  // namespace
}  // namespace hairnet
