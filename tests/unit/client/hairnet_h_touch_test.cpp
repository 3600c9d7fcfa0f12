#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "client/hairnet.h"
#include "core/world/grab.hpp"

// Tests hands and props of a world through the C interface.
namespace {

using ::testing::HasSubstr;

class HairnetHTouch : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    ASSERT_EQ(hairnet_groom_make("bob", 100, &groom, nullptr, 0), HAIRNET_OK);
    hairnet_build* build = nullptr;
    ASSERT_EQ(hairnet_build_begin(groom, &build), HAIRNET_OK);
    ASSERT_EQ(hairnet_build_finish(build, &levels), HAIRNET_OK);
    hairnet_build_free(build);
  }
  static void TearDownTestSuite() {
    hairnet_levels_free(levels);
    hairnet_groom_free(groom);
  }

  void SetUp() override {
    std::vector<double> pose(HAIRNET_POSE_NUMBERS, 0);
    for (std::size_t bone = 0; bone < 5; ++bone) pose[7 * bone + 3] = 1;
    ASSERT_EQ(hairnet_world_make(60, &world), HAIRNET_OK);
    ASSERT_EQ(hairnet_world_add(world, groom, levels, nullptr, pose.data(), &me, nullptr, 0), HAIRNET_OK);
    rest = points();
  }
  void TearDown() override { hairnet_world_free(world); }

  [[nodiscard]] std::vector<float> points() const {
    std::vector<float> all(3 * hairnet_groom_point_count(groom));
    EXPECT_EQ(hairnet_shown_points(hairnet_world_scene(world), 0, all.data(), nullptr, all.size() / 3), HAIRNET_OK);
    return all;
  }
  // Returns the tip of the strand that hangs farthest to the left of the head.
  [[nodiscard]] std::size_t left_tip() const {
    const std::uint32_t* begin = hairnet_groom_strand_begin(groom);
    std::size_t best = begin[1] - 1;
    for (std::size_t s = 0; s < hairnet_groom_strand_count(groom); ++s) {
      const std::size_t tip = begin[s + 1] - 1;
      if (rest[3 * tip] > rest[3 * best]) best = tip;
    }
    return best;
  }
  static hairnet_touch_body ball(double x, double y, double z, float radius_m) {
    hairnet_touch_body body{};
    body.toucher = 1;
    body.shape = HAIRNET_SPHERE;
    body.radius_m = radius_m;
    body.rotation[3] = 1;
    body.position[0] = x;
    body.position[1] = y;
    body.position[2] = z;
    return body;
  }
  // Advances by this number of ticks of 1/60 s.
  void advance(int pictures) {
    for (int i = 0; i < pictures; ++i) ASSERT_EQ(hairnet_world_advance(world, 1.0 / 60), HAIRNET_OK);
  }
  [[nodiscard]] float farthest_from_rest() const {
    const std::vector<float> now = points();
    float most = 0;
    for (std::size_t i = 0; i < now.size(); ++i) most = std::max(most, std::abs(now[i] - rest[i]));
    return most;
  }

  static inline hairnet_groom* groom = nullptr;
  static inline hairnet_levels* levels = nullptr;
  hairnet_world* world = nullptr;
  std::uint32_t me = 0;
  std::vector<float> rest;
};

TEST_F(HairnetHTouch, hair_follows_the_hand_that_holds_it_and_falls_back_when_let_go) {
  const std::size_t tip = left_tip();
  const auto place_of_tip = [&](const std::vector<float>& all) { return &all[3 * tip]; };
  hairnet_touch_body hand = ball(rest[3 * tip], rest[3 * tip + 1], rest[3 * tip + 2], 0.005f);
  ASSERT_EQ(hairnet_world_set_bodies(world, &hand, 1, nullptr, 0), HAIRNET_OK);
  // A hand must be in the world for a tick before it can take hold.
  advance(2);
  const std::array<double, 3> middle{};
  std::uint32_t held = 0;
  ASSERT_EQ(hairnet_world_grab(world, me, 1, 0, middle.data(), 0.04, &held), HAIRNET_OK);
  EXPECT_GT(held, 0u);
  const double start_x = hand.position[0];
  for (int i = 1; i <= 60; ++i) {
    hand.position[0] = start_x + 0.06 * i / 60;
    ASSERT_EQ(hairnet_world_set_bodies(world, &hand, 1, nullptr, 0), HAIRNET_OK);
    advance(1);
  }
  const std::vector<float> pulled = points();
  // The hand goes 6 cm within a second. Hair is held near one point, and its tip must follow for a third of the way.
  EXPECT_GT(place_of_tip(pulled)[0] - place_of_tip(rest)[0], 0.02f);

  // Pinned hair stays without the hand, but for what the hair around it pulls in two seconds.
  ASSERT_EQ(hairnet_world_let_go(world, me, 1, 0, HAIRNET_PIN), HAIRNET_OK);
  ASSERT_EQ(hairnet_world_set_bodies(world, nullptr, 0, nullptr, 0), HAIRNET_OK);
  advance(120);
  EXPECT_NEAR(place_of_tip(points())[0], place_of_tip(pulled)[0], 0.015f);
  ASSERT_EQ(hairnet_world_let_go(world, me, 1, 0, HAIRNET_UNPIN), HAIRNET_OK);
  advance(600);
  EXPECT_LT(farthest_from_rest(), 0.005f);
}

TEST_F(HairnetHTouch, a_prop_in_the_hair_pushes_it_away) {
  const std::size_t tip = left_tip();
  const hairnet_touch_body prop = ball(rest[3 * tip], rest[3 * tip + 1], rest[3 * tip + 2], 0.03f);
  ASSERT_EQ(hairnet_world_set_bodies(world, &prop, 1, nullptr, 0), HAIRNET_OK);
  advance(180);
  EXPECT_GT(farthest_from_rest(), 0.015f);
  ASSERT_EQ(hairnet_world_set_bodies(world, nullptr, 0, nullptr, 0), HAIRNET_OK);
  advance(600);
  EXPECT_LT(farthest_from_rest(), 0.005f);
}

TEST_F(HairnetHTouch, what_is_no_body_or_no_hold_is_refused_and_changes_nothing) {
  char error[128] = "";
  const auto refusal = [&](const std::vector<hairnet_touch_body>& bodies) {
    EXPECT_EQ(hairnet_world_set_bodies(world, bodies.data(), bodies.size(), error, sizeof error), HAIRNET_INVALID);
    return std::string(error);
  };
  hairnet_touch_body bad = ball(0, 0, 0, 0);
  EXPECT_THAT(refusal({bad}), HasSubstr("body 0: "));
  bad = ball(std::numeric_limits<double>::quiet_NaN(), 0, 0, 0.1f);
  EXPECT_THAT(refusal({ball(0, 0, 0, 0.1f), bad}), HasSubstr("body 1: "));
  EXPECT_THAT(refusal({ball(0, 0, 0, 0.1f), ball(1, 0, 0, 0.1f)}), HasSubstr("another one"));
  bad = ball(0, 0, 0, 0.1f);
  // Numbers of bodies have 8 bits, and a world takes at most kBodiesMax bodies (client/c/worlds.cpp).
  constexpr unsigned kNumberMax = std::numeric_limits<std::uint8_t>::max();
  constexpr std::size_t kBodiesMax = 1024;
  bad.number = kNumberMax + 1;
  EXPECT_THAT(refusal({bad}), HasSubstr(std::to_string(kNumberMax)));
  bad = ball(0, 0, 0, 0.1f);
  bad.shape = 9;
  EXPECT_THAT(refusal({bad}), HasSubstr("shape 9"));
  EXPECT_THAT(refusal(std::vector<hairnet_touch_body>(kBodiesMax + 1, bad)), HasSubstr(std::to_string(kBodiesMax)));

  const std::array<double, 3> middle{};
  std::uint32_t held = 7;
  EXPECT_EQ(hairnet_world_grab(world, me, 1, 0, middle.data(), 0.04, &held), HAIRNET_NOT_THERE);
  const hairnet_touch_body far = ball(5, 0, 0, 0.05f);
  ASSERT_EQ(hairnet_world_set_bodies(world, &far, 1, nullptr, 0), HAIRNET_OK);
  advance(1);
  EXPECT_EQ(hairnet_world_grab(world, me + 1, 1, 0, middle.data(), 0.04, &held), HAIRNET_NOT_THERE);
  EXPECT_EQ(hairnet_world_grab(world, me, 1, 0, middle.data(), hairnet::kGrabRadiusMax_m + 0.01, &held),
            HAIRNET_INVALID);
  EXPECT_EQ(held, 7u);
  EXPECT_EQ(hairnet_world_grab(world, me, 1, 0, middle.data(), 0.04, &held), HAIRNET_OK);
  EXPECT_EQ(held, 0u) << "it is too far away";
  EXPECT_EQ(hairnet_world_let_go(world, me, 1, 0, static_cast<hairnet_release>(3)), HAIRNET_INVALID);
  EXPECT_EQ(hairnet_world_let_go(world, me + 1, 1, 0, HAIRNET_DROP), HAIRNET_NOT_THERE);
  advance(30);
  EXPECT_EQ(farthest_from_rest(), 0);
}

}  // namespace
