#include "core/ffd/skin_push.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "client/assets/made/made.hpp"
#include "core/ffd/deform.hpp"
#include "core/ffd/reference_skin_push.hpp"
#include "core/levels/make_skin.hpp"
#include "tests/support/levels.hpp"

// Tests that drawn hair keeps out of the skin, and that points which need no push keep their bits.
namespace hairnet {
namespace {

// Points are kept this far from the skin, unless they are nearer in the design.
constexpr float kThickness_m = 0.006f;

Pose turned(Bone bone, double angle, const Vec3& shift) {
  Pose pose = rigid_pose({Quat(Eigen::AngleAxisd(0.4, Vec3(1, 2, -1).normalized())), Vec3(3, 1.5, -2)});
  const RigidTransform by{Quat(Eigen::AngleAxisd(angle, Vec3(1, 0.3, 0.2).normalized())), shift};
  pose[bone] = pose[bone] * by;
  return pose;
}

// Returns where a point of head space is in the bone's rest space.
Vec3 in_bone(const Pose& pose, Bone bone, const Vec3f& point) {
  return (pose[bone].inverse() * pose.head()).point(point.cast<double>());
}

struct Points {
  std::vector<Vec3f> rest, moved;
  std::vector<float> blend;
};

// Makes 3000 points within `size_m` of the centre, moved by up to `moved_m`. Every fourth is a root, with a blend of 0.
Points around(const Vec3f& centre, float size_m, float moved_m, unsigned seed) {
  std::mt19937 random(seed);
  Points points;
  for (int i = 0; i < 3000; ++i) {
    points.rest.push_back(centre + support::random_vec(random, size_m));
    points.moved.push_back(points.rest.back() + support::random_vec(random, moved_m));
    points.blend.push_back(i % 4 == 0 ? 0.0f : static_cast<float>(i % 100) / 99);
  }
  return points;
}

// Makes a head of 9 cm radius and a left shoulder of 6 cm.
Skin ball_skin() {
  return {support::make_round_skin(Bone::head, Vec3f(0, 0.02f, 0.01f), 0.09f),
          support::make_round_skin(Bone::left_shoulder, Vec3f(0.15f, -0.2f, 0), 0.06f)};
}

std::vector<Vec3f> pushed(const SkinPush& skin, const Pose& pose, const Points& points) {
  std::vector<Vec3f> out = points.moved;
  skin.push(pose, points.rest, points.blend, out);
  return out;
}

TEST(SkinPush, leaves_hair_at_rest_and_far_hair_as_they_are) {
  const SkinPush skin(ball_skin(), kThickness_m);
  Points points = around({0.05f, -0.1f, 0}, 0.25f, 0, 1);
  const Pose still = rigid_pose({Quat(Eigen::AngleAxisd(2, Vec3(0, 1, 1).normalized())), Vec3(500, 1, -900)});
  EXPECT_EQ(pushed(skin, still, points), points.rest);
  points = around({0, 0.6f, 0}, 0.2f, 0.1f, 2);
  EXPECT_EQ(pushed(skin, turned(Bone::left_shoulder, 0.5, {0, 0.1, 0}), points), points.moved);
  EXPECT_EQ(pushed(SkinPush({}, kThickness_m), still, points), points.moved);
}

TEST(SkinPush, is_that_of_the_reference) {
  const SkinPush skin(ball_skin(), kThickness_m);
  const Points points = around({0.08f, -0.1f, 0}, 0.15f, 0.05f, 3);
  const Pose pose = turned(Bone::left_shoulder, 0.5, {0.01, 0.05, 0});
  const std::vector<Vec3f> got = pushed(skin, pose, points);
  int moved = 0;
  for (std::size_t p = 0; p < got.size(); ++p) {
    const Vec3 wanted = reference_skin_push(skin, pose, points.rest[p].cast<double>(),
                                            static_cast<double>(points.blend[p]), points.moved[p].cast<double>());
    ASSERT_LT((got[p].cast<double>() - wanted).norm(), 1e-6) << p;
    moved += got[p] != points.moved[p];
  }
  // The push must act on enough of the 3000 points, or the comparison says nothing.
  EXPECT_GT(moved, 200);
}

TEST(SkinPush, leaves_no_point_nearer_than_its_limit) {
  const Skin balls = ball_skin();
  const SkinPush skin(balls, kThickness_m);
  const Pose pose = turned(Bone::left_shoulder, 0.5, {0.01, 0.05, 0});
  for (const SkinDistanceField& field : balls) {
    // make_round_skin() makes cubes of 30 cm, so this is the middle of the ball.
    const Vec3f centre = field.origin + Vec3f::Constant(0.15f);
    Points points = around(centre, 0.12f, 0.03f, 4);
    // Without blends every point counts as far from its root, so that the push of each bone is complete.
    points.blend.clear();
    const std::vector<Vec3f> got = pushed(skin, pose, points);
    int deep = 0;
    for (std::size_t p = 0; p < got.size(); ++p) {
      const double before_m = skin_distance(field, in_bone(pose, field.bone, points.moved[p]));
      // The push fades out near the deepest distance that a byte holds.
      if (before_m < -0.03) continue;
      const double design_m = skin_distance(field, points.rest[p].cast<double>());
      const double limit_m = std::min(static_cast<double>(kThickness_m), design_m);
      // Distances are stored in steps of 0.35 mm (kSkinStep_m), so half a millimetre may be missing.
      ASSERT_GT(skin_distance(field, in_bone(pose, field.bone, got[p])), limit_m - 5e-4) << "from " << before_m;
      deep += before_m < limit_m;
    }
    EXPECT_GT(deep, 100);
  }
}

TEST(SkinPush, keeps_roots_where_they_are) {
  const SkinPush skin(ball_skin(), kThickness_m);
  Points points = around({0.15f, -0.2f, 0}, 0.08f, 0, 5);
  std::ranges::fill(points.blend, 0.0f);
  EXPECT_EQ(pushed(skin, turned(Bone::left_shoulder, 0.8, {0, 0.05, 0}), points), points.rest);
}

TEST(SkinPush, goes_on_without_jumps_when_points_and_bones_move) {
  const SkinPush skin(ball_skin(), kThickness_m);
  const Points points = around({0.05f, -0.1f, 0}, 0.2f, 0.08f, 6);
  // The step of central differences: m for shifts, rad for turns.
  constexpr double kStep = 1e-4;
  Points next = points;
  for (Vec3f& point : next.moved) point += Vec3f(0.6f, -0.6f, 0.5f) * static_cast<float>(kStep);
  const auto pose = [](double by) { return turned(Bone::left_shoulder, 0.5 + by, {0.01, 0.05, by}); };
  const std::vector<Vec3f> at = pushed(skin, pose(0), points), after_point = pushed(skin, pose(0), next),
                           after_bone = pushed(skin, pose(kStep), points);
  for (std::size_t p = 0; p < at.size(); ++p) {
    // A change by one step may move a pushed point by at most 20 steps; a jump would be millimetres.
    ASSERT_LT((after_point[p] - at[p]).norm(), 20 * kStep) << p;
    ASSERT_LT((after_bone[p] - at[p]).norm(), 20 * kStep) << p;
  }
}

TEST(SkinPush, is_symmetric_for_a_symmetric_body) {
  Skin skin{support::make_round_skin(Bone::head, Vec3f(0, 0.02f, 0.01f), 0.09f),
            support::make_round_skin(Bone::left_shoulder, Vec3f(0.15f, -0.2f, 0), 0.06f),
            support::make_round_skin(Bone::right_shoulder, Vec3f(-0.15f, -0.2f, 0), 0.06f)};
  const SkinPush push(skin, kThickness_m);
  const Points points = around({0.05f, -0.1f, 0}, 0.2f, 0.05f, 7);
  const auto mirrored = [](std::vector<Vec3f> list) {
    for (Vec3f& point : list) point.x() = -point.x();
    return list;
  };
  const Points other{mirrored(points.rest), mirrored(points.moved), points.blend};
  Pose left, right;
  left[Bone::left_shoulder].position = Vec3(0.02, 0.06, 0.01);
  right[Bone::right_shoulder].position = Vec3(-0.02, 0.06, 0.01);
  // The mirrored points in the mirrored pose must be pushed to the mirror image.
  const std::vector<Vec3f> got = pushed(push, left, points), mirror = mirrored(pushed(push, right, other));
  // Distances and ways are rounded to bytes, which need not be symmetric to the last step. The limit is less than one
  // step of a distance, 0.35 mm (kSkinStep_m).
  for (std::size_t p = 0; p < got.size(); ++p) ASSERT_LT((got[p] - mirror[p]).norm(), 3e-4f) << p;
}

// All hair of a made head is moved 3 cm forwards, into the head and shoulders. Of the points that are then more than 2
// mm too near to the skin, the push may leave at most one in fifty.
TEST(SkinPush, keeps_a_hairstyle_out_of_its_bust) {
  const Groom groom = *make_hairstyle("long_straight", {.strand_count = 200});
  const std::shared_ptr<const Skin> skin = make_skin(groom);
  const SkinPush push(*skin, groom.materials.base.thickness_m);
  Points points{groom.points, groom.points, root_blend(groom)};
  EXPECT_EQ(pushed(push, rigid_pose({Quat::Identity(), Vec3(1, 2, 3)}), points), points.rest);
  for (std::size_t p = 0; p < points.rest.size(); ++p) points.moved[p].z() += 0.03f * points.blend[p];
  const std::vector<Vec3f> got = pushed(push, Pose{}, points);
  std::size_t before = 0, after = 0;
  for (std::size_t p = 0; p < got.size(); ++p) {
    for (const SkinDistanceField& field : *skin) {
      const double design_m = skin_distance(field, points.rest[p].cast<double>());
      const double limit_m = std::min(static_cast<double>(push.thickness_m()), design_m) - 0.002;
      before += skin_distance(field, points.moved[p].cast<double>()) < limit_m;
      after += skin_distance(field, got[p].cast<double>()) < limit_m;
    }
  }
  EXPECT_GT(before, 500u);
  EXPECT_LT(after, before / 50);
}

}  // namespace
}  // namespace hairnet
