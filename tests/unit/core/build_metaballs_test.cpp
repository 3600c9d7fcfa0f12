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

TEST(PlaceBalls, a_body_with_shoulders_has_six_to_ten_on_all_its_bones) {
  const BodyShape shape = place_balls(make_groom_with_body());
  EXPECT_GE(shape.balls.size(), 6u);
  EXPECT_LE(shape.balls.size(), kBallCountMost);
  EXPECT_EQ(balls_by_bone(shape).size(), kBoneCount);
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

TEST(PlaceBalls, a_skull_alone_has_one_or_two) {
  Groom groom = support::make_head_of_hair(50);
  support::add_ellipsoid(groom.body, {0, 0.05f, 0}, {0.08f, 0.1f, 0.09f}, Bone::head);
  const std::size_t count = place_balls(groom).balls.size();
  EXPECT_GE(count, 1u);
  EXPECT_LE(count, 2u);
}

TEST(PlaceBalls, a_round_head_has_one_in_its_middle) {
  Groom groom = support::make_head_of_hair(50);
  support::add_ellipsoid(groom.body, {0, 0.01f, 0}, {0.09f, 0.09f, 0.09f}, Bone::head);
  const BodyShape shape = place_balls(groom);
  ASSERT_EQ(shape.balls.size(), 1u);
  EXPECT_NEAR((shape.balls[0].centre - Vec3(0, 0.01, 0)).norm(), 0, 0.01);
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
  ASSERT_GE(level->metaballs.size(), 6u);
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

TEST_P(Contact, a_node_inside_goes_no_further_in) {
  const Groom groom = make_groom_with_body();
  const auto level = build_level(groom, kLevelSpecs[GetParam()]);
  const MeshQuery skin(groom.body.mesh);
  std::size_t inside = 0;
  for (const Metaball& ball : level->metaballs) {
    for (std::size_t i = 0; i < level->rest.size(); ++i) {
      if (ball.radius[i] == 0 || !skin.inside(level->rest[i].cast<double>())) continue;
      ++inside;
      EXPECT_NEAR(ball.radius[i], (level->rest[i] - ball.centre).norm(), 1e-6f);
    }
  }
  EXPECT_GT(inside, 0u);
}

TEST_P(Contact, hair_stays_outside_when_all_nodes_go_in_as_far_as_they_may) {
  const Groom groom = make_groom_with_body();
  const auto level = build_level(groom, kLevelSpecs[GetParam()]);
  const BodyShape shape = place_balls(groom);
  const HairStencils stencils = make_stencils(level->geometry, shape.hair);
  ASSERT_EQ(level->metaballs.size(), shape.balls.size());
  std::size_t tight = 0;
  for (std::size_t b = 0; b < shape.balls.size(); ++b) {
    const Metaball& ball = level->metaballs[b];
    for (std::size_t p = 0; p < shape.hair.points.size(); ++p) {
      double moved = 0;
      for (std::uint32_t e = stencils.begin[p]; e < stencils.begin[p + 1]; ++e) {
        const std::uint32_t i = stencils.nodes[e];
        if (ball.radius[i] == 0) continue;
        moved += stencils.weights[e] * static_cast<double>((level->rest[i] - ball.centre).norm() - ball.radius[i]);
      }
      const Vec3 r = shape.hair.points[p].cast<double>() - shape.balls[b].centre;
      const double clearance = std::max(0.0, r.norm() - shape.balls[b].profile.distance(r));
      EXPECT_LE(moved, clearance + 1e-3);
      if (clearance < 0.01) ++tight;
    }
  }
  EXPECT_GT(tight, 0u);
}

INSTANTIATE_TEST_SUITE_P(Levels, Contact, testing::Values(0, 1, 2, 3));

// One ball in the middle of an ellipsoid, and no hair but the nodes.
std::vector<float> radii_around(const Vec3f& ellipsoid, double radius, const std::vector<Vec3f>& nodes) {
  Body body;
  support::add_ellipsoid(body, {0, 0, 0}, ellipsoid, Bone::head);
  BodyShape shape{MeshQuery(body.mesh), {}, {}};
  shape.balls.emplace_back(shape.skin, Bone::head, Vec3::Zero(), radius);
  const std::vector<double> mass(nodes.size(), 1e-3);
  return fit_metaballs(shape, {}, nodes, mass, {})[0].radius;
}

TEST(Contact, around_a_sphere_the_limit_is_the_skin_plus_the_thickness) {
  const std::vector<float> radius =
      radii_around({0.1f, 0.1f, 0.1f}, 0.1,
                   {{0, 0.2f, 0}, {0.15f, 0, 0.1f}, {0, 0.103f, 0}, {0.08f, 0, 0}, {0, 0.02f, 0}, {0, 0, 0}});
  EXPECT_NEAR(radius[0], 0.106, 1e-3);  // far outside: skin plus thickness
  EXPECT_NEAR(radius[1], 0.106, 1e-3);
  EXPECT_NEAR(radius[2], 0.103, 1e-5);  // just outside: where it lies
  EXPECT_NEAR(radius[3], 0.08, 1e-5);   // inside: where it lies
  EXPECT_EQ(radius[4], 0);              // too deep: off
  EXPECT_EQ(radius[5], 0);              // at the centre: off
}

TEST(Contact, around_a_long_head_the_limit_follows_the_skin_or_what_rises_beside_it) {
  const std::vector<float> radius =
      radii_around({0.08f, 0.1f, 0.11f}, 0.095, {{0.3f, 0, 0}, {0, 0.3f, 0}, {0, 0, 0.3f}});
  EXPECT_GT(radius[0], 0.0855f);
  EXPECT_LT(radius[0], 0.0915f);
  EXPECT_GT(radius[1], 0.1055f);
  EXPECT_LT(radius[1], 0.109f);
  EXPECT_NEAR(radius[2], 0.116, 1e-3);
}

// One point that two nodes move, and another that the second moves alone.
HairStencils two_points() {
  HairStencils stencils;
  stencils.begin = {0, 2, 3};
  stencils.nodes = {0, 1, 1};
  stencils.weights = {0.75, 0.25, 1};
  return stencils;
}

TEST(LimitTravel, keeps_what_no_point_forbids) {
  std::vector<double> travel{0.02, 0.04};
  limit_travel(two_points(), std::vector<double>{0.03, 0.04}, travel);
  EXPECT_EQ(travel, (std::vector<double>{0.02, 0.04}));
}

TEST(LimitTravel, lowers_the_nodes_of_a_point_too_near_by_their_weights) {
  std::vector<double> travel{0.02, 0.04};
  limit_travel(two_points(), std::vector<double>{0.01, 0.04}, travel);
  EXPECT_NEAR(0.75 * travel[0] + 0.25 * travel[1], 0.01, 1e-9);
  EXPECT_NEAR((0.02 - travel[0]) / (0.04 - travel[1]), 3, 1e-6);
}

TEST(LimitTravel, lets_nothing_in_where_hair_lies_on_the_skin) {
  std::vector<double> travel{0.5, 0.4};
  limit_travel(two_points(), std::vector<double>{0, 0}, travel);
  EXPECT_NEAR(travel[0], 0, 1e-6);
  EXPECT_NEAR(travel[1], 0, 1e-6);
}

TEST(SampleHair, takes_points_from_all_along_the_strands) {
  const HairSample sample = sample_hair(support::make_head_of_hair(4000));
  EXPECT_GT(sample.points.size(), 3500u);
  EXPECT_LT(sample.points.size(), 4500u);
  const auto is_low = [](const Vec3f& point) { return point.y() < -0.1f; };
  EXPECT_GT(std::ranges::count_if(sample.points, is_low), 500);
  EXPECT_GT(std::ranges::count(sample.blend, 0.0f), 100);
}

}  // namespace
}  // namespace hairnet
