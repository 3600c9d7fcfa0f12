#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "client/assets/made/made.hpp"
#include "client/viewer/drawing/framing.hpp"
#include "client/viewer/drawing/mouse_controller.hpp"
#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/sources/head_grab.hpp"
#include "client/viewer/window/adaptive_quality.hpp"

namespace hairnet::viewer {
namespace {

constexpr int kWidth = 800, kHeight = 600;

TEST(OrbitCamera, a_ray_through_the_middle_meets_the_target) {
  OrbitCamera camera;
  camera.frame(Vec3(1, 2, 3), 0.5);
  const Ray ray = camera.ray(kWidth / 2.0, kHeight / 2.0, kWidth, kHeight);
  const Vec3 to = Vec3(1, 2, 3) - ray.origin;
  EXPECT_LT(to.cross(ray.direction).norm(), 1e-9);
  EXPECT_GT(to.dot(ray.direction), 0);
}

TEST(OrbitCamera, what_it_frames_stays_in_view_however_it_is_turned) {
  OrbitCamera camera;
  camera.frame(Vec3(0, 1.5, 0), 0.4);
  for (int i = 0; i < 50; ++i) {
    // The numbers are pixels that the mouse has moved to the right and down.
    camera.orbit(37, 11, kHeight);
    EXPECT_TRUE(camera.in_view(Vec3(0, 1.5, 0), 0.1, 1.0));
    EXPECT_NEAR((camera.camera().eye - Vec3(0, 1.5, 0)).norm(), camera.distance_m(), 1e-9);
    EXPECT_GT(camera.up().y(), 0) << "never upside down";
    EXPECT_NEAR(camera.up().dot(camera.right()), 0, 1e-9);
  }
  EXPECT_FALSE(camera.in_view(2 * camera.camera().eye - Vec3(0, 1.5, 0), 0.1, 1.0)) << "behind the eye";
}

TEST(OrbitCamera, a_pan_keeps_what_is_at_the_target_under_the_mouse) {
  OrbitCamera camera;
  camera.frame(Vec3(0, 1, 0), 0.5);
  const Vec3 grasped = camera.camera().target;
  camera.pan(120, -80, kHeight);
  const Ray ray = camera.ray(kWidth / 2.0 + 120, kHeight / 2.0 - 80, kWidth, kHeight);
  EXPECT_LT((grasped - ray.origin).cross(ray.direction).norm(), 1e-9);
}

TEST(OrbitCamera, the_wheel_never_goes_through_the_target_or_out_of_sight) {
  OrbitCamera camera;
  // OrbitCamera keeps its distance between kDistanceMin_m and kDistanceMax_m, 0.12 and 500 m (orbit_camera.cpp).
  camera.zoom(1000);
  EXPECT_DOUBLE_EQ(camera.distance_m(), 0.12);
  camera.zoom(-5000);
  EXPECT_DOUBLE_EQ(camera.distance_m(), 500);
}

TEST(OrbitCamera, follows_smoothly_and_keeps_its_bearing) {
  OrbitCamera camera;
  const Vec3 before = camera.camera().eye - camera.camera().target;
  const Vec3 start = camera.camera().target;
  camera.follow(Vec3(0, 1, 0), 0.016);
  EXPECT_EQ(camera.camera().target, start) << "following begins where the camera is";
  double last = 0;
  for (int i = 0; i < 200; ++i) {
    camera.follow(Vec3(1, 1, 0), 0.016);
    const double gone = camera.camera().target.x() - start.x();
    EXPECT_GE(gone, last);
    // The target jumps by 1 m. The camera needs about 0.2 s for it (kFollow_s in orbit_camera.cpp), so a step of 16 ms
    // moves it by less than 0.1 m.
    EXPECT_LT(gone - last, 0.1);
    last = gone;
  }
  EXPECT_NEAR(last, 1, 1e-3);
  EXPECT_LT((camera.camera().eye - camera.camera().target - before).norm(), 1e-9);
}

TEST(OrbitCamera, measures_the_height_of_a_head_on_the_picture) {
  OrbitCamera camera;
  camera.frame(Vec3::Zero(), 0.5);
  const double near = camera.height_share(Vec3::Zero(), 0.24);
  camera.zoom(-5);
  EXPECT_LT(camera.height_share(Vec3::Zero(), 0.24), near);
  EXPECT_EQ(camera.height_share(2 * camera.camera().eye, 0.24), 0) << "behind the eye";
}

TEST(HitSphere, meets_the_near_side_and_only_what_is_before_it) {
  const Ray ray{Vec3::Zero(), Vec3::UnitZ()};
  EXPECT_NEAR(*hit_sphere(ray, Vec3(0, 0, 5), 1), 4, 1e-12);
  EXPECT_FALSE(hit_sphere(ray, Vec3(0, 0, -5), 1));
  EXPECT_FALSE(hit_sphere(ray, Vec3(0, 1.01, 5), 1));
  EXPECT_EQ(*hit_sphere(ray, Vec3::Zero(), 1), 0);
}

Body bust_body() {
  return make_bust();
}

TEST(HeadGrab, goes_after_the_hand_and_springs_back_without_swinging) {
  const Body body = bust_body();
  const Pose rest = rigid_pose({Quat::Identity(), Vec3(0, 1.5, 0)});
  HeadGrab grab;
  grab.take();
  grab.turn(Vec3::UnitY(), 1.0);
  for (int i = 0; i < 20; ++i) grab.advance(0.016);
  const auto turned = [&] {
    const Eigen::AngleAxisd turn(grab.apply(rest, body).head().rotation);
    return turn.angle() * turn.axis().y();
  };
  // A grabbed head makes half of a step in about 40 ms (head_grab.cpp), so after 0.32 s it is there.
  EXPECT_NEAR(turned(), 1.0, 0.02);
  grab.release();
  double last = turned();
  for (int i = 0; i < 200; ++i) {
    grab.advance(0.016);
    EXPECT_LE(turned(), last + 1e-9);
    EXPECT_GE(turned(), -1e-9) << "past where it belongs";
    last = turned();
  }
  EXPECT_TRUE(grab.at_rest());
  EXPECT_EQ(grab.apply(rest, body).head().position, rest.head().position);
}

TEST(HeadGrab, no_jerk_of_the_mouse_is_a_teleport) {
  const Body body = bust_body();
  const Pose rest = rigid_pose({Quat::Identity(), Vec3(0, 1.5, 0)});
  HeadGrab grab;
  grab.take();
  Pose last = grab.apply(rest, body);
  for (int i = 0; i < 300; ++i) {
    // Every 40 steps the mouse jerks by 3 rad and 2 m. A head that followed at once would move too fast for
    // is_teleport(), and its hair would not swing.
    if (i % 40 == 0) {
      grab.turn(i % 80 == 0 ? Vec3::UnitX() : Vec3::UnitY(), i % 3 == 0 ? 3.0 : -3.0);
      grab.move(Vec3(i % 80 == 0 ? 2 : -2, 0.5, 0));
    }
    grab.advance(1.0 / 60);
    const Pose pose = grab.apply(rest, body);
    ASSERT_TRUE(is_valid(pose));
    EXPECT_FALSE(is_teleport(last, pose, 1.0 / 60, Vec3::Zero())) << i;
    last = pose;
  }
}

// A window may stand still for half a minute (30 s), or draw ten thousand images a second (1e-4 s).
TEST(HeadGrab, is_bounded_and_stable_for_any_time_step) {
  const Body body = bust_body();
  HeadGrab grab;
  grab.take();
  for (int i = 0; i < 100; ++i) {
    grab.turn(Vec3::UnitX(), 0.5);
    grab.move(Vec3(1, 0, 0));
    grab.advance(i % 7 == 0 ? 30.0 : 1e-4);
  }
  const Pose pose = grab.apply(rigid_pose({}), body);
  EXPECT_LE(Eigen::AngleAxisd(pose.head().rotation).angle(), HeadGrab::kTurnMax_rad + 1e-6);
  EXPECT_LE(pose[Bone::upper_trunk].position.norm(), HeadGrab::kShiftMax_m + 1e-6);
  grab.advance(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(is_valid(grab.apply(rigid_pose({}), body)));
}

TEST(HeadGrab, the_neck_goes_along_and_the_trunk_stays) {
  const Body body = bust_body();
  HeadGrab grab;
  grab.take();
  grab.turn(Vec3::UnitX(), 0.8);
  for (int i = 0; i < 100; ++i) grab.advance(0.016);
  const Pose pose = grab.apply(rigid_pose({}), body);
  // The neck takes half of the turn of the head (complete_pose.cpp).
  EXPECT_NEAR(Eigen::AngleAxisd(pose[Bone::neck].rotation).angle(), 0.4, 0.02);
  EXPECT_NEAR(Eigen::AngleAxisd(pose[Bone::upper_trunk].rotation).angle(), 0, 1e-9);
  const Vec3 foot = body.joints[static_cast<std::size_t>(Bone::neck)].cast<double>();
  EXPECT_LT((pose.head().point(foot) - foot).norm(), 1e-9) << "the foot of the neck stays on the trunk";
}

// Two characters side by side; the second belongs to another client.
class TwoHeads : public HairSource {
 public:
  TwoHeads() {
    HairstyleOptions options;
    options.strand_count = 10;
    const auto groom = std::make_shared<const Groom>(*make_hairstyle("short", options));
    for (std::uint64_t id : {1u, 2u}) {
      ViewedCharacter& character = viewed_.emplace_back();
      character.id = id;
      character.groom = groom;
      character.own = id == 1;
      character.pose = rigid_pose({Quat::Identity(), Vec3(id == 1 ? -0.4 : 0.4, 1.5, 0)});
    }
  }
  Result<void> advance(std::int64_t) override { return {}; }
  [[nodiscard]] std::span<const ViewedCharacter> viewed_characters() const override { return viewed_; }
  HeadGrab* grab(std::uint64_t id) override { return id == 1 ? &grab_ : nullptr; }
  void set_material(std::uint64_t, const MaterialScale&) override {}
  void set_level(std::uint64_t, LevelIndex) override {}
  void teleport(std::uint64_t) override {}
  [[nodiscard]] const Wind& wind() const override { return wind_; }
  void set_wind(const Wind&) override {}
  [[nodiscard]] bool paused() const override { return false; }
  void set_paused(bool) override {}
  HeadGrab grab_;

 private:
  std::vector<ViewedCharacter> viewed_;
  Wind wind_;
};

class MouseControllerTest : public ::testing::Test {
 protected:
  MouseControllerTest() {
    camera_.look_from(Vec3::UnitZ());
    camera_.frame(Vec3(0, 1.5, 0), 0.8);
  }
  // Puts the mouse over the head.
  MouseInput over(std::uint64_t id) {
    const Vec3 at = head_middle(show_.viewed_characters()[id - 1].pose) - camera_.camera().target;
    const double pixel_m = camera_.pixel_m(kHeight);
    MouseInput mouse;
    mouse.x_px = 0.5 * kWidth + at.dot(camera_.right()) / pixel_m;
    mouse.y_px = 0.5 * kHeight - at.dot(camera_.up()) / pixel_m;
    mouse.left = true;
    return mouse;
  }
  void apply(const MouseInput& mouse) { mouse_controller_.apply(mouse, show_, camera_, kWidth, kHeight); }

  TwoHeads show_;
  OrbitCamera camera_;
  MouseController mouse_controller_;
};

TEST_F(MouseControllerTest, a_drag_on_an_own_head_turns_it_and_not_the_camera) {
  const Vec3 eye = camera_.camera().eye;
  MouseInput mouse = over(1);
  apply(mouse);
  EXPECT_EQ(mouse_controller_.grabbed(), 1u);
  EXPECT_EQ(mouse_controller_.take_chosen(), 1u);
  mouse.right_px = 100;
  apply(mouse);
  EXPECT_TRUE(show_.grab_.grabbed());
  for (int i = 0; i < 50; ++i) show_.grab_.advance(0.016);
  const Pose pose = show_.grab_.apply(show_.viewed_characters()[0].pose, show_.viewed_characters()[0].groom->body);
  EXPECT_GT(pose.head().vector(Vec3::UnitZ()).x(), 0.3) << "the face goes where the mouse goes";
  EXPECT_EQ(camera_.camera().eye, eye);
  mouse.left = false;
  apply(mouse);
  EXPECT_FALSE(mouse_controller_.grabbed());
  EXPECT_FALSE(show_.grab_.grabbed());
}

TEST_F(MouseControllerTest, with_shift_the_head_goes_with_the_mouse) {
  MouseInput mouse = over(1);
  mouse.shift = true;
  apply(mouse);
  mouse.right_px = 50;
  mouse.down_px = 20;
  apply(mouse);
  for (int i = 0; i < 100; ++i) show_.grab_.advance(0.016);
  const Pose& from = show_.viewed_characters()[0].pose;
  const Vec3 moved =
      show_.grab_.apply(from, show_.viewed_characters()[0].groom->body).head().position - from.head().position;
  const double pixel_m = camera_.pixel_m(kHeight);
  // The head follows the mouse within a tenth of its way on each axis.
  EXPECT_NEAR(moved.x(), 50 * pixel_m, 0.1 * 50 * pixel_m);
  EXPECT_NEAR(moved.y(), -20 * pixel_m, 0.1 * 20 * pixel_m);
}

TEST_F(MouseControllerTest, another_clients_head_is_chosen_and_the_camera_turns) {
  const Vec3 eye = camera_.camera().eye;
  MouseInput mouse = over(2);
  mouse.right_px = 30;
  apply(mouse);
  EXPECT_EQ(mouse_controller_.take_chosen(), 2u);
  EXPECT_FALSE(mouse_controller_.grabbed());
  EXPECT_FALSE(show_.grab_.grabbed());
  EXPECT_GT((camera_.camera().eye - eye).norm(), 0.01);
}

// A drag of a slider must not turn a head when the mouse leaves the controls.
TEST_F(MouseControllerTest, what_began_over_the_controls_moves_nothing) {
  const Vec3 eye = camera_.camera().eye;
  MouseInput mouse = over(1);
  mouse.elsewhere = true;
  mouse.wheel = 3;
  apply(mouse);
  mouse.elsewhere = false;
  mouse.wheel = 0;
  mouse.right_px = 200;
  apply(mouse);
  EXPECT_EQ(camera_.camera().eye, eye);
  EXPECT_FALSE(show_.grab_.grabbed());
}

TEST_F(MouseControllerTest, a_drag_that_began_beside_keeps_to_the_camera_over_a_head) {
  MouseInput mouse;
  mouse.left = true;
  apply(mouse);
  mouse = over(1);
  mouse.right_px = 10;
  apply(mouse);
  EXPECT_FALSE(show_.grab_.grabbed());
}

TEST(Framing, all_heads_are_in_view_from_every_side) {
  TwoHeads source;
  for (const View view : {View::front, View::side, View::back, View::three_quarter}) {
    OrbitCamera camera;
    frame_all(source.viewed_characters(), view, kWidth, kHeight, camera);
    for (const ViewedCharacter& character : source.viewed_characters()) {
      const Ray ray{camera.camera().eye, (camera.camera().target - camera.camera().eye).normalized()};
      const Vec3 to = head_middle(character.pose) - ray.origin;
      const double depth = to.dot(ray.direction);
      // A head that is within 10 cm of the image's edge counts as cut off.
      const double tangent = std::tan(OrbitCamera::kFov_deg / 2 * 3.14159265 / 180);
      EXPECT_LT(std::abs(to.dot(camera.up())) + 0.1, depth * tangent);
      EXPECT_LT(std::abs(to.dot(camera.right())) + 0.1, depth * tangent * kWidth / kHeight);
    }
  }
}

TEST(AdaptiveQuality, falls_with_slow_pictures_and_recovers) {
  AdaptiveQuality adaptive_quality;
  // Images of 2 s are far slower than kSlow_ms, 40 ms, and images of 5 ms faster than kFast_ms, 20 ms.
  for (int i = 0; i < 100; ++i) adaptive_quality.take(2000);
  EXPECT_EQ(adaptive_quality.share(), AdaptiveQuality::kMin);
  double last = adaptive_quality.share();
  // From kMin, 2 %, it takes about 130 images of 3 % more to reach 1.
  for (int i = 0; i < 500; ++i) {
    const double share = adaptive_quality.take(5);
    EXPECT_GE(share, last);
    // A fast image raises the share by 3 %. A larger step would be seen.
    EXPECT_LT(share, 1.05 * last);
    last = share;
  }
  EXPECT_EQ(last, 1);
}

}  // namespace
}  // namespace hairnet::viewer
