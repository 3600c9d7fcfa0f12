#include "core/touch/touch_shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/touch/touch_body.hpp"
#include "core/touch/touch_rule.hpp"

namespace hairnet {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  double between(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  Vec3 vec(double size) {
    const double x = between(-size, size), y = between(-size, size), z = between(-size, size);
    return {x, y, z};
  }
  bool coin() { return between(0, 1) < 0.5; }

  // Returns a sphere, a capsule, a box, or a box with a radius.
  TouchShape shape() {
    TouchShape shape;
    for (int a = 0; a < 3; ++a) shape.half_size_m[a] = coin() ? between(0.005, 0.05) : 0;
    shape.radius_m = shape.half_size_m.minCoeff() == 0 || coin() ? between(0.005, 0.04) : 0;
    return shape;
  }
  // Returns a point of the shape's surface, on a face, an edge or a corner. Where the normal has no part along an
  // axis, the coordinate in the box is free.
  Vec3 on_surface(const TouchShape& shape) {
    Vec3 normal, place;
    do {
      for (int a = 0; a < 3; ++a) {
        normal[a] = coin() ? between(-1, 1) : 0;
        place[a] =
            normal[a] == 0 ? between(-1, 1) * shape.half_size_m[a] : std::copysign(shape.half_size_m[a], normal[a]);
      }
    } while (normal.isZero(0));
    return place + shape.radius_m * normal.normalized();
  }

 private:
  std::mt19937 random_;
};

// The distance of the nearest of 20 000 random points of the surface is never less than the true one. With so many
// points it is at most 3 mm more.
TEST(TouchShape, distance_is_that_of_the_nearest_point_of_the_surface) {
  Random random(1);
  for (int trial = 0; trial < 40; ++trial) {
    const TouchShape shape = random.shape();
    std::vector<Vec3> surface;
    for (int i = 0; i < 20'000; ++i) surface.push_back(random.on_surface(shape));
    for (const Vec3& on : surface) ASSERT_NEAR(shape_distance(shape, on), 0, 1e-12);
    for (int i = 0; i < 20; ++i) {
      const Vec3 point = random.vec(0.12);
      double nearest_m = std::numeric_limits<double>::infinity();
      for (const Vec3& on : surface) nearest_m = std::min(nearest_m, (on - point).norm());
      const double distance_m = std::abs(shape_distance(shape, point));
      EXPECT_LE(distance_m, nearest_m + 1e-12);
      EXPECT_GE(distance_m, nearest_m - 0.003);
    }
  }
}

TEST(TouchShape, is_negative_inside_and_the_other_way_round_inside_out) {
  Random random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    TouchShape shape = random.shape();
    const Vec3 on = random.on_surface(shape);
    // Every shape is convex about its centre, so the way from there to a surface point is inside.
    EXPECT_LT(shape_distance(shape, 0.9 * on), 0);
    EXPECT_GT(shape_distance(shape, 1.1 * on), 0);
    const Vec3 point = random.vec(0.12);
    Vec3 normal, turned_normal;
    const double distance_m = shape_distance(shape, point, &normal);
    shape.is_inside_out = true;
    EXPECT_EQ(shape_distance(shape, point, &turned_normal), -distance_m);
    EXPECT_EQ(turned_normal, -normal);
  }
}

TEST(TouchShape, normal_is_the_gradient_of_the_distance_and_leads_to_the_surface) {
  Random random(3);
  int compared = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    TouchShape shape = random.shape();
    shape.is_inside_out = random.coin();
    const Vec3 point = random.vec(0.12);
    Vec3 normal;
    const double distance_m = shape_distance(shape, point, &normal);
    EXPECT_NEAR(normal.norm(), 1, 1e-12);
    EXPECT_NEAR(shape_distance(shape, point - distance_m * normal), 0, 1e-12);
    Vec3 gradient;
    constexpr double kStep_m = 1e-7;
    for (int a = 0; a < 3; ++a) {
      const Vec3 step = kStep_m * Vec3::Unit(a);
      gradient[a] = (shape_distance(shape, point + step) - shape_distance(shape, point - step)) / (2 * kStep_m);
    }
    // Where two faces are equally near, the difference crosses an edge of the distance field and is no gradient.
    if (std::abs(gradient.norm() - 1) > 1e-4) continue;
    EXPECT_LT((gradient - normal).norm(), 1e-4);
    ++compared;
  }
  // Such points are rare: at most 5 % of 2000 may be left out.
  EXPECT_GT(compared, 1900);
}

TEST(TouchShape, has_a_definite_normal_at_its_centre) {
  for (const TouchShape& shape : {sphere(0.03), capsule(0.05, 0.01), box({0.1, 0.1, 0.1}), box({0.1, 0.02, 0.1})}) {
    Vec3 normal;
    EXPECT_LT(shape_distance(shape, Vec3::Zero(), &normal), 0);
    EXPECT_EQ(normal.norm(), 1);
    // The point is so near to the centre that the squares of its coordinates are zero.
    EXPECT_LT(shape_distance(shape, Vec3(1e-200, 0, 1e-200), &normal), 0);
    EXPECT_NEAR(normal.norm(), 1, 1e-12);
  }
  Vec3 normal;
  shape_distance(sphere(0.03), Vec3::Zero(), &normal);
  EXPECT_EQ(normal, Vec3::UnitY());
}

TEST(TouchShape, lies_within_its_bounding_radius) {
  Random random(4);
  for (int trial = 0; trial < 1000; ++trial) {
    const TouchShape shape = random.shape();
    EXPECT_LE(random.on_surface(shape).norm(), bounding_radius(shape) + 1e-12);
  }
}

TEST(TouchShape, a_half_space_is_all_below_its_plane) {
  Random random(5);
  const RigidTransform plane{Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized())), {3, 1, -2}};
  const PlacedShape below = half_space(plane);
  EXPECT_EQ(validate(below.shape), "");
  for (int trial = 0; trial < 1000; ++trial) {
    const Vec3 point = plane.position + random.vec(2);
    const double height_m = plane.inverse().point(point).y();
    Vec3 normal;
    EXPECT_NEAR(shape_distance(below.shape, below.place.inverse().point(point), &normal), height_m, 1e-9);
    EXPECT_LT((normal - Vec3::UnitY()).norm(), 1e-12);
  }
}

TEST(TouchShape, a_half_space_stays_at_its_plane_where_the_rotation_is_a_little_off_unit_length) {
  const RigidTransform plane{Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized())), {3, 1, -2}};
  // A rotation may be off unit length by kTouchRotationTolerance = 1e-3.
  const RigidTransform off{Quat(1.0009 * plane.rotation.coeffs()), plane.position};
  EXPECT_LT((half_space(off).place.position - half_space(plane).place.position).norm(), 1e-12);
}

TEST(TouchShape, without_size_or_of_a_size_that_is_no_number_is_refused) {
  EXPECT_EQ(validate(sphere(0.02)), "");
  EXPECT_EQ(validate(box({0.1, 0, 0})), "");
  // The largest size is kTouchSizeMax_m = 100.
  for (const TouchShape& shape : {TouchShape{}, sphere(-0.01), sphere(kNaN), sphere(101), capsule(kNaN, 0.01),
                                  box({1, std::numeric_limits<double>::infinity(), 1}), box({-1, 1, 1})}) {
    EXPECT_NE(validate(shape), "");
  }
}

TEST(TouchBody, at_no_place_is_refused) {
  const TouchBody good{{3, 1}, sphere(0.02), {Quat::Identity(), {1, 2, 3}}};
  EXPECT_EQ(validate(good), "");
  const auto is_refused = [&](auto&& change) {
    TouchBody body = good;
    change(body);
    return !validate(body).empty();
  };
  EXPECT_TRUE(is_refused([](TouchBody& b) { b.shape = {}; }));
  EXPECT_TRUE(is_refused([](TouchBody& b) { b.place.position.y() = kNaN; }));
  // A place may be at most 20 km away.
  EXPECT_TRUE(is_refused([](TouchBody& b) { b.place.position.y() = 30'000; }));
  EXPECT_TRUE(is_refused([](TouchBody& b) { b.place.rotation.w() = 1.1; }));
  EXPECT_TRUE(is_refused([](TouchBody& b) { b.place.rotation.x() = kNaN; }));
}

// Props of the room (kRoomToucher) touch everyone. The owner may always touch, unless nobody may.
TEST(TouchRule, names_who_may_touch) {
  constexpr ToucherId kOwner = 5, kFriend = 7, kStranger = 9;
  const auto allowed = [](const TouchRule& rule) {
    std::vector<ToucherId> who;
    for (const ToucherId toucher : {kRoomToucher, kOwner, kFriend, kStranger}) {
      if (may_touch(rule, kOwner, toucher)) who.push_back(toucher);
    }
    return who;
  };
  using Who = std::vector<ToucherId>;
  EXPECT_EQ(allowed({}), (Who{kRoomToucher, kOwner}));
  EXPECT_EQ(allowed({TouchAudience::nobody, {kOwner, kFriend}}), Who{kRoomToucher});
  EXPECT_EQ(allowed({TouchAudience::oneself, {kFriend}}), (Who{kRoomToucher, kOwner}));
  EXPECT_EQ(allowed({TouchAudience::chosen, {2, kFriend, 8}}), (Who{kRoomToucher, kOwner, kFriend}));
  EXPECT_EQ(allowed({TouchAudience::everyone}), (Who{kRoomToucher, kOwner, kFriend, kStranger}));
}

}  // namespace
}  // namespace hairnet
