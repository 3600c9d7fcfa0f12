#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "client/assets/made/made.hpp"
#include "client/viewer/drawing/framing.hpp"
#include "client/viewer/drawing/mouse_hand.hpp"
#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/offline/scripted_touch.hpp"
#include "client/viewer/sources/local_world.hpp"
#include "core/levels/build.hpp"

namespace hairnet::viewer {
namespace {

constexpr int kWindowWidth = 800, kWindowHeight = 600;
// A ray finds hair that is up to this far beside it, for each metre from the eye: 3 mm at 1 m. Up to 8 mm it finds
// hair in any case (pick_hair()).
constexpr double kReach_per_m = 0.003;

std::shared_ptr<const Groom> make_groom(const char* style) {
  HairstyleOptions options;
  options.strand_count = 120;
  return std::make_shared<const Groom>(*make_hairstyle(style, options));
}

// Shows a still head of long hair at level low. The camera looks at it from the front, and the mouse is over a lock of
// hair.
class ViewTouchTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    groom_ = make_groom("long_straight");
    auto levels = std::make_shared<LevelSet>();
    const auto low = static_cast<std::size_t>(LevelIndex::low);
    levels->levels[low] = *build_level(*groom_, kLevelSpecs[low]);
    levels_ = levels;
  }
  static void TearDownTestSuite() {
    groom_.reset();
    levels_.reset();
  }
  static void fill(LocalWorld& world) {
    LocalCharacter character;
    character.groom = groom_;
    character.motion = std::make_shared<const Motion>(*make_motion("still"));
    character.level = LevelIndex::low;
    world.add(character);
    world.give_levels(*groom_, levels_);
  }
  static CharacterSetup setup() { return {groom_, *make_motion("still"), LevelIndex::low, Vec3f::Zero(), {}}; }

  ViewTouchTest() {
    fill(world_);
    world_.touch_by([this](double from_s, double to_s) {
      bodies_ = hand_.tick(to_s - from_s, world_);
      return bodies_;
    });
    world_.advance_to(0);
    // The view is a little from the head's left side and from above, since the lock hangs there.
    look_from(Vec3(0.3, 0.1, 1));
    mouse_ = over(lock());
  }
  void look_from(const Vec3& direction) {
    camera_.look_from(direction.normalized());
    camera_.frame(head_middle(character().pose) - Vec3(0, 0.15, 0), 0.4);
  }
  [[nodiscard]] const ViewedCharacter& character() const { return world_.viewed_characters().front(); }
  [[nodiscard]] Vec3 in_world(const Vec3& head) const { return character().pose.head().point(head); }
  [[nodiscard]] Vec3 lock() const { return in_world(HairToTouch(*groom_).lock); }
  [[nodiscard]] Vec3 forward() const { return (camera_.camera().target - camera_.camera().eye).normalized(); }
  // Puts the mouse over a place in the world.
  [[nodiscard]] MouseInput over(const Vec3& place) const {
    const Vec3 to = place - camera_.camera().eye;
    const double px = camera_.distance_m() / camera_.pixel_m(kWindowHeight) / to.dot(forward());
    MouseInput mouse;
    mouse.x_px = 0.5 * kWindowWidth + px * to.dot(camera_.right());
    mouse.y_px = 0.5 * kWindowHeight - px * to.dot(camera_.up());
    return mouse;
  }
  bool apply() { return hand_.apply(mouse_, world_, camera_, kWindowWidth, kWindowHeight); }
  bool press() {
    mouse_.left = true;
    return apply();
  }
  void release() {
    mouse_.left = false;
    EXPECT_FALSE(apply());
  }
  // Lets this time pass in images of 1/60 s each.
  void pass(double time_s) {
    for (const double end_s = world_.time_s() + time_s; world_.time_s() < end_s;) {
      apply();
      world_.advance_to(world_.time_s() + 1.0 / 60);
    }
  }
  // Moves the mouse evenly, so that the hand goes that way.
  void drag(const Vec3& way, double time_s) {
    const int pictures = static_cast<int>(60 * time_s);
    const Vec3 from = hand_.place();
    for (int i = 1; i <= pictures; ++i) {
      const MouseInput there = over(from + way * i / pictures);
      mouse_.x_px = there.x_px;
      mouse_.y_px = there.y_px;
      pass(1.0 / 60);
    }
  }
  // Returns the contact points as they are shown, world.
  [[nodiscard]] std::vector<Vec3> contact_points() const {
    const ContactPoints& contacts = character().model->contacts;
    std::vector<Vec3> points;
    for (std::size_t p = 0; p < contacts.count(); ++p) {
      Vec3f at = contacts.rest[p];
      for (std::uint32_t e = contacts.begin[p]; e < contacts.begin[p + 1]; ++e)
        at += contacts.weights[e] * character().displacement[contacts.nodes[e]];
      points.push_back(in_world(at.cast<double>()));
    }
    return points;
  }
  // Returns the contact point that is nearest to the lock. A hold takes contact points, so the test watches this
  // one.
  [[nodiscard]] std::size_t point_at_lock() const {
    const std::vector<Vec3> points = contact_points();
    const auto distance = [&](const Vec3& p) { return (p - lock()).squaredNorm(); };
    return static_cast<std::size_t>(std::ranges::min_element(points, {}, distance) - points.begin());
  }

  static inline std::shared_ptr<const Groom> groom_;
  static inline std::shared_ptr<const LevelSet> levels_;
  LocalWorld world_{{30, 100, Loop::smooth, {}, nullptr}};
  OrbitCamera camera_;
  MouseInput mouse_;
  MouseHand hand_;
  std::vector<TouchBody> bodies_;
};

TEST_F(ViewTouchTest, a_ray_finds_the_hair_on_its_way_that_is_nearest_to_the_eye) {
  const Ray ray = camera_.ray(mouse_.x_px, mouse_.y_px, kWindowWidth, kWindowHeight);
  const auto picked = pick_hair(ray, kReach_per_m, world_.viewed_characters());
  ASSERT_TRUE(picked);
  EXPECT_EQ(picked->id, character().id);
  const Vec3 to = picked->place - ray.origin;
  // Hair may be up to kPickReach_m, 8 mm, beside the ray (mouse_hand.cpp).
  EXPECT_LT(to.cross(ray.direction).norm(), 0.009);
  EXPECT_LT(to.dot(ray.direction), (lock() - ray.origin).dot(ray.direction) + 0.02);
  EXPECT_FALSE(pick_hair({ray.origin, -ray.direction}, kReach_per_m, world_.viewed_characters())) << "behind the eye";
  EXPECT_FALSE(pick_hair({ray.origin, Vec3::UnitY()}, kReach_per_m, world_.viewed_characters())) << "beside";
}

TEST_F(ViewTouchTest, a_ray_finds_no_hair_behind_the_face) {
  // A ray from the front meets the face before the hair at the back of the head. A ray from the back meets that hair.
  const Vec3 nose = in_world(Vec3(0, 0.03, 0.12));
  const auto along_z = [&](double side) { return Ray{nose + Vec3(0, 0, 2 * side), Vec3(0, 0, -side)}; };
  constexpr double kWide_per_m = 0.01;
  EXPECT_TRUE(pick_hair(along_z(-1), kWide_per_m, world_.viewed_characters())) << "hair is there, at the back";
  EXPECT_FALSE(pick_hair(along_z(1), kWide_per_m, world_.viewed_characters()));
}

TEST_F(ViewTouchTest, only_own_hair_on_a_lattice_is_found) {
  const Ray ray = camera_.ray(mouse_.x_px, mouse_.y_px, kWindowWidth, kWindowHeight);
  std::vector<ViewedCharacter> viewed{character()};
  EXPECT_TRUE(pick_hair(ray, kReach_per_m, viewed));
  viewed[0].own = false;
  EXPECT_FALSE(pick_hair(ray, kReach_per_m, viewed));
  viewed[0].own = true;
  viewed[0].lattice = {};
  EXPECT_FALSE(pick_hair(ray, kReach_per_m, viewed));
}

TEST_F(ViewTouchTest, what_is_not_a_left_press_on_hair_is_left_to_heads_and_camera) {
  const MouseInput on_hair = mouse_;
  const auto presses = [&](MouseInput mouse) {
    mouse_ = mouse;
    const bool takes = apply();
    mouse_ = on_hair;
    apply();
    return takes;
  };
  MouseInput mouse = on_hair;
  mouse.left = true;
  EXPECT_TRUE(presses(mouse));
  mouse.shift = true;
  EXPECT_FALSE(presses(mouse)) << "moves the head";
  mouse.shift = false;
  mouse.elsewhere = true;
  EXPECT_FALSE(presses(mouse));
  mouse.elsewhere = false;
  mouse.right = true;
  EXPECT_FALSE(presses(mouse));
  MouseInput beside;
  beside.left = true;
  EXPECT_FALSE(presses(beside));
  // A drag that begins beside hair does not take hold where it comes over hair.
  mouse_ = beside;
  apply();
  mouse_ = on_hair;
  mouse_.left = true;
  EXPECT_FALSE(apply());
  EXPECT_EQ(hand_.action(), MouseHand::Action::none);
}

TEST_F(ViewTouchTest, the_hand_is_under_the_mouse_in_a_plane_parallel_to_the_screen) {
  ASSERT_TRUE(press());
  const double depth_m = (hand_.place() - camera_.camera().eye).dot(forward());
  drag(0.1 * camera_.right() + 0.07 * camera_.up(), 0.5);
  pass(0.2);
  EXPECT_NEAR((hand_.place() - camera_.camera().eye).dot(forward()), depth_m, 1e-9);
  const MouseInput at = over(hand_.place());
  EXPECT_NEAR(at.x_px, mouse_.x_px, 1e-6);
  EXPECT_NEAR(at.y_px, mouse_.y_px, 1e-6);
}

TEST_F(ViewTouchTest, no_jump_of_the_mouse_is_one_of_the_hand) {
  constexpr double kOutside = -std::numeric_limits<float>::max();
  ASSERT_TRUE(press());
  pass(0.1);
  ASSERT_EQ(bodies_.size(), 1u);
  // The mouse jumps across the window, leaves it, and reports places that no window has.
  for (const double px : {0.0, 700.0, kOutside, 1e9, 300.0}) {
    mouse_.x_px = mouse_.y_px = px;
    for (int tick = 0; tick < 10; ++tick) {
      const Vec3 before = bodies_[0].place.position;
      apply();
      world_.step_once();
      ASSERT_EQ(validate(bodies_[0]), "");
      EXPECT_LE((bodies_[0].place.position - before).norm(), MouseHand::kSpeedMax_m_per_s / 30 + 1e-9);
      EXPECT_LT((bodies_[0].place.position - lock()).norm(), 2) << "it stays in the picture";
    }
  }
}

TEST_F(ViewTouchTest, held_hair_goes_with_the_mouse_and_falls_back_when_let_go) {
  const std::size_t point = point_at_lock();
  const Vec3 before = contact_points()[point];
  ASSERT_TRUE(press());
  pass(0.2);
  ASSERT_TRUE(hand_.has_hold());
  const Vec3 way = 0.08 * camera_.right();
  drag(way, 1);
  pass(1);
  const auto moved_m = [&] { return (contact_points()[point] - before).dot(way.normalized()); };
  const double held_m = moved_m();
  // The hand moves 0.08 m. Hair is held near one point, and the lock must follow for a good part of the way.
  EXPECT_GT(held_m, 0.03);
  release();
  EXPECT_EQ(hand_.action(), MouseHand::Action::none);
  pass(3);
  EXPECT_TRUE(bodies_.empty());
  // In 3 s hair that is let go falls back by more than half of its way.
  EXPECT_LT(moved_m(), held_m / 2);
}

TEST_F(ViewTouchTest, hair_let_go_with_shift_stays_until_all_pins_go) {
  ASSERT_TRUE(press());
  pass(0.2);
  ASSERT_TRUE(hand_.has_hold());
  const std::size_t point = point_at_lock();
  const Vec3 before = contact_points()[point];
  drag(0.08 * camera_.right(), 1);
  pass(1);
  const Vec3 pinned = contact_points()[point];
  const double pulled_m = (pinned - before).norm();
  ASSERT_GT(pulled_m, 0.03);
  mouse_.shift = true;
  release();
  pass(3);
  // Pinned hair stays where it was let go, but for what the hair below it pulls.
  EXPECT_LT((contact_points()[point] - pinned).norm(), pulled_m / 3);
  unpin_hair(world_);
  pass(3);
  EXPECT_GT((contact_points()[point] - pinned).norm(), pulled_m / 2);
}

TEST_F(ViewTouchTest, with_ctrl_the_mouse_is_a_ball_that_pushes_hair_and_holds_none) {
  mouse_.ctrl = true;
  ASSERT_TRUE(press());
  pass(0.1);
  EXPECT_EQ(hand_.action(), MouseHand::Action::stroke);
  EXPECT_FALSE(hand_.has_hold());
  const std::vector<Vec3> before = contact_points();
  // The ball goes to the other side of the head, through the hair.
  drag(-0.15 * camera_.right(), 1);
  ASSERT_EQ(bodies_.size(), 1u);
  EXPECT_EQ(bodies_[0].shape, sphere(MouseHand::kBallRadius_m));
  double farthest_m = 0;
  const std::vector<Vec3> after = contact_points();
  for (std::size_t p = 0; p < before.size(); ++p) farthest_m = std::max(farthest_m, (after[p] - before[p]).norm());
  // The ball has a radius of 4 cm (kBallRadius_m) and goes through the hair, so some hair must move by more than 1
  // cm.
  EXPECT_GT(farthest_m, 0.01);
}

TEST_F(ViewTouchTest, a_hand_whose_character_has_gone_holds_nothing) {
  ASSERT_TRUE(press());
  world_.remove_all();
  fill(world_);
  pass(0.3);
  EXPECT_FALSE(hand_.has_hold());
  EXPECT_FALSE(bodies_.empty()) << "the new hair meets the hand";
  release();
}

constexpr TouchScript kScripts[] = {TouchScript::stroke, TouchScript::hold, TouchScript::pin, TouchScript::prop};

TEST(ScriptedTouch, its_bodies_are_valid_and_none_is_faster_than_three_metres_a_second) {
  // The limit of 3 m/s is that of scripted_bodies(): a body that moves much faster counts as one that has jumped. A
  // point on a turning body moves too, so the turn counts with the radius of the body.
  // Steps of 1/240 s are shorter than any tick, so that no fast part of a way falls between two of them.
  constexpr double kStep_s = 1.0 / 240;
  for (const char* style : {"long_straight", "bob", "short", "ponytail"}) {
    const HairToTouch hair(*make_groom(style));
    ASSERT_TRUE(hair.lock.allFinite());
    for (const TouchScript script : kScripts) {
      std::vector<TouchBody> before = scripted_bodies(script, hair, -1);
      ASSERT_FALSE(before.empty());
      double way_m = 0;
      for (double time_s = -1 + kStep_s; time_s < 8; time_s += kStep_s) {
        std::vector<TouchBody> bodies = scripted_bodies(script, hair, time_s);
        ASSERT_EQ(bodies.size(), before.size());
        for (std::size_t b = 0; b < bodies.size(); ++b) {
          ASSERT_EQ(validate(bodies[b]), "");
          ASSERT_EQ(bodies[b].key, before[b].key);
          ASSERT_EQ(bodies[b].shape, before[b].shape);
          if (b > 0) {
            ASSERT_LT(bodies[b - 1].key, bodies[b].key);
          }
          const RigidTransform &from = before[b].place, &to = bodies[b].place;
          const double step_m = (to.position - from.position).norm() +
                                bounding_radius(bodies[b].shape) * to.rotation.angularDistance(from.rotation);
          ASSERT_LE(step_m, 3 * kStep_s) << style << " " << static_cast<int>(script) << " at " << time_s;
          way_m += step_m;
        }
        before = std::move(bodies);
      }
      EXPECT_GT(way_m, 0.1) << "it comes to the hair";
    }
  }
}

TEST_F(ViewTouchTest, each_script_moves_hair_and_the_same_times_give_the_same_bits) {
  // One world steps to 2.5 s in one call, and the other in calls that begin before 0 s. Both must give the same bits.
  const CharacterSetup touched = setup();
  LocalWorld alone({30, 6, Loop::plain, {}, nullptr});
  fill(alone);
  alone.advance_to(2.5);
  for (const TouchScript script : kScripts) {
    LocalWorld at_once({30, 6, Loop::plain, {}, nullptr}), steadily({30, 6, Loop::plain, {}, nullptr});
    fill(at_once);
    fill(steadily);
    ::testing::internal::CaptureStderr();
    touch_by_script(script, touched, 6, at_once);
    touch_by_script(script, touched, 6, steadily);
    at_once.advance_to(2.5);
    for (int i = -50; i <= 250; ++i) steadily.advance_to(0.01 * i);
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << "the hand finds its hair";
    EXPECT_EQ(at_once.world().hash(), steadily.world().hash());
    const auto hair = at_once.viewed_characters().front().displacement;
    const auto untouched = alone.viewed_characters().front().displacement;
    ASSERT_EQ(hair.size(), untouched.size());
    float farthest_m = 0;
    for (std::size_t i = 0; i < hair.size(); ++i) {
      ASSERT_TRUE(hair[i].allFinite());
      farthest_m = std::max(farthest_m, (hair[i] - untouched[i]).norm());
    }
    EXPECT_GT(farthest_m, 0.005f) << static_cast<int>(script);
  }
}

TEST_F(ViewTouchTest, a_script_that_finds_no_hair_that_moves_says_so) {
  LocalWorld rigid({30, 6, Loop::plain, {}, nullptr});
  fill(rigid);
  rigid.set_level(rigid.viewed_characters().front().id, LevelIndex::rigid);
  const CharacterSetup touched = setup();
  ::testing::internal::CaptureStderr();
  touch_by_script(TouchScript::hold, touched, 6, rigid);
  rigid.advance_to(1);
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("no hair"), std::string::npos);
  EXPECT_EQ(std::ranges::count(said, '\n'), 1);
}

}  // namespace
}  // namespace hairnet::viewer
