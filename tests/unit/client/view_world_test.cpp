#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "client/assets/made/made.hpp"
#include "client/viewer/characters/place.hpp"
#include "client/viewer/sources/level_builder.hpp"
#include "client/viewer/sources/local_world.hpp"
#include "client/viewer/sources/scene_list.hpp"
#include "core/levels/build.hpp"

namespace hairnet::viewer {
namespace {

// Builds a small head of hair with its levels low and ether, once for the suite. Worlds have 30 ticks a second
// unless a test says more, and clips of 100 s, longer than any test here.
class LocalWorldTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    HairstyleOptions options;
    options.strand_count = 120;
    groom_ = std::make_shared<const Groom>(*make_hairstyle("bob", options));
    auto levels = std::make_shared<LevelSet>();
    for (const LevelIndex level : {LevelIndex::low, LevelIndex::ether}) {
      const auto index = static_cast<std::size_t>(level);
      levels->levels[index] = *build_level(*groom_, kLevelSpecs[index]);
    }
    levels_ = levels;
  }
  static void TearDownTestSuite() {
    groom_.reset();
    levels_.reset();
  }
  static LocalCharacter character(const char* motion) {
    LocalCharacter c;
    c.name = "one";
    c.groom = groom_;
    c.motion = std::make_shared<const Motion>(*make_motion(motion));
    c.level = LevelIndex::low;
    return c;
  }
  static LocalWorld world(const char* motion, double rate_hz = 30) {
    // The arguments are the tick rate, the length of clips in s, how clips repeat, no wind, and no clock.
    LocalWorld w({rate_hz, 100, Loop::smooth, {}, nullptr});
    w.add(character(motion));
    w.give_levels(*groom_, levels_);
    return w;
  }
  // Returns how far the hair's nodes are from rest at most, m. Hair that is at rest or rigid gives 0.
  static float furthest(const LocalWorld& w) {
    float most = 0;
    for (const Vec3f& d : w.viewed_characters()[0].displacement) most = std::max(most, d.norm());
    return most;
  }
  static inline std::shared_ptr<const Groom> groom_;
  static inline std::shared_ptr<const LevelSet> levels_;
};

TEST_F(LocalWorldTest, hair_without_levels_is_rigid_and_lives_once_it_has_them) {
  LocalWorld w({30, 100, Loop::smooth, {}, nullptr});
  w.add(character("shake"));
  w.advance_to(1);
  EXPECT_EQ(w.viewed_characters()[0].lattice.geometry, nullptr);
  ASSERT_EQ(w.grooms_without_levels().size(), 1u);
  w.give_levels(*groom_, levels_);
  EXPECT_TRUE(w.grooms_without_levels().empty());
  w.advance_to(2);
  EXPECT_NE(w.viewed_characters()[0].lattice.geometry, nullptr);
  // A shaken head moves its hair by centimetres, so 2 mm are plain motion.
  EXPECT_GT(furthest(w), 0.002f);
}

// A window asks for times as its screen refreshes, and a video for others. Both must show the same hair.
TEST_F(LocalWorldTest, the_same_times_show_the_same_bits_with_any_times_between) {
  LocalWorld steadily = world("dance"), at_once = world("dance");
  for (int i = 0; i <= 200; ++i) steadily.advance_to(0.01 * i);
  at_once.advance_to(2);
  ASSERT_EQ(steadily.world().hash(), at_once.world().hash());
  const auto a = steadily.viewed_characters()[0].displacement, b = at_once.viewed_characters()[0].displacement;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i], b[i]);
}

// Screens refresh faster than the 30 ticks a second. Without interpolation hair would move in steps.
TEST_F(LocalWorldTest, hair_shown_between_two_ticks_lies_between_them) {
  LocalWorld w = world("shake");
  w.advance_to(1.0);
  const std::vector<Vec3f> from(w.viewed_characters()[0].displacement.begin(),
                                w.viewed_characters()[0].displacement.end());
  w.advance_to(1.0 + 0.5 / 30);
  const std::vector<Vec3f> middle(w.viewed_characters()[0].displacement.begin(),
                                  w.viewed_characters()[0].displacement.end());
  w.advance_to(1.0 + 1.0 / 30);
  const auto to = w.viewed_characters()[0].displacement;
  for (std::size_t i = 0; i < to.size(); ++i) EXPECT_LT((middle[i] - 0.5f * (from[i] + to[i])).norm(), 1e-6f);
}

TEST_F(LocalWorldTest, pause_stops_everything_and_a_step_is_one_tick) {
  LocalWorld w = world("shake");
  w.advance_to(1);
  w.set_paused(true);
  const std::uint64_t hash = w.world().hash();
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(w.advance(i * 16'000'000));
  EXPECT_EQ(w.world().hash(), hash);
  w.step_once();
  EXPECT_EQ(w.ticks().size(), 1u);
  EXPECT_NEAR(w.time_s(), 1 + 1.0 / 30, 1e-9);
}

TEST_F(LocalWorldTest, every_tick_is_reported_once) {
  LocalWorld w = world("shake");
  std::vector<std::uint64_t> numbers;
  w.on_tick([&] {
    numbers.push_back(w.ticks().back().number);
    EXPECT_EQ(w.lattice(1)->displacement.size(),
              levels_->levels[static_cast<std::size_t>(LevelIndex::low)].rest.size());
  });
  w.advance_to(1);
  // This time lies within a tick that was reported already.
  w.advance_to(1.001);
  w.step_once();
  w.set_tick_rate(120);
  w.advance_to(1.5);
  ASSERT_GT(numbers.size(), 100u);
  for (std::size_t i = 0; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], i + 1);
}

TEST_F(LocalWorldTest, a_machine_that_is_too_slow_shows_slow_motion) {
  LocalWorld w = world("shake");
  ASSERT_TRUE(w.advance(0));
  const double before_s = w.time_s();
  ASSERT_TRUE(w.advance(5'000'000'000));
  // A call catches up with at most kCatchUpMax_s, 0.1 s (local_world.cpp), of the 5 s that have passed.
  EXPECT_NEAR(w.time_s() - before_s, 0.1, 1e-9);
}

TEST_F(LocalWorldTest, another_tick_rate_keeps_hair_as_it_is) {
  LocalWorld w = world("shake");
  w.advance_to(1);
  const std::vector<Vec3f> before(w.viewed_characters()[0].displacement.begin(),
                                  w.viewed_characters()[0].displacement.end());
  w.set_tick_rate(90);
  w.advance_to(1 + 1.0 / 90);
  const auto after = w.viewed_characters()[0].displacement;
  ASSERT_EQ(before.size(), after.size());
  float most = 0;
  for (std::size_t i = 0; i < after.size(); ++i) most = std::max(most, (after[i] - before[i]).norm());
  // Hair that began again at rest would jump by more than 3 cm, since it is more than 5 cm away from rest.
  EXPECT_LT(most, 0.03f);
  EXPECT_GT(furthest(w), 0.05f);
  w.advance_to(2);
  EXPECT_NEAR(static_cast<double>(w.ticks().size()), 89, 1);
}

TEST_F(LocalWorldTest, levels_that_were_not_built_are_passed_over) {
  LocalWorld w = world("still");
  w.advance_to(0);
  w.set_level(1, LevelIndex::high);
  w.advance_to(0.5);
  EXPECT_EQ(w.viewed_characters()[0].level, LevelIndex::low);
  w.set_level(1, LevelIndex::ether);
  w.advance_to(0.6);
  EXPECT_EQ(w.viewed_characters()[0].level, LevelIndex::ether);
}

TEST_F(LocalWorldTest, a_teleport_moves_the_head_and_not_the_hair_against_it) {
  LocalWorld w = world("still");
  w.advance_to(1);
  const Vec3 before = w.viewed_characters()[0].pose.head().position;
  w.teleport(1);
  w.advance_to(1.2);
  // A teleport puts a character 0.8 m aside, and the next one back.
  EXPECT_GT((w.viewed_characters()[0].pose.head().position - before).norm(), 0.5);
  EXPECT_LT(furthest(w), 1e-4f);
  w.teleport(1);
  w.advance_to(1.4);
  EXPECT_LT((w.viewed_characters()[0].pose.head().position - before).norm(), 1e-9);
}

TEST_F(LocalWorldTest, a_head_that_is_turned_swings_its_hair_and_comes_home) {
  LocalWorld w = world("still");
  w.advance_to(1);
  ASSERT_LT(furthest(w), 1e-4f);
  HeadGrab* grab = w.grab(1);
  ASSERT_NE(grab, nullptr);
  grab->take();
  grab->turn(Vec3::UnitY(), 1.0);
  std::int64_t now_ns = 0;
  // The images are 16 ms apart, as at 60 Hz. In the first 0.2 s a grabbed head makes nearly all of its turn of 1
  // rad; in the 3.8 s after that a released head comes back (head_grab.cpp).
  for (int i = 0; i < 12; ++i) ASSERT_TRUE(w.advance(now_ns += 16'000'000));
  EXPECT_GT(w.viewed_characters()[0].pose.head().rotation.angularDistance(Quat::Identity()), 0.8);
  EXPECT_GT(furthest(w), 0.005f);
  grab->release();
  for (int i = 0; i < 240; ++i) ASSERT_TRUE(w.advance(now_ns += 16'000'000));
  EXPECT_LT(w.viewed_characters()[0].pose.head().rotation.angularDistance(Quat::Identity()), 1e-6);
}

TEST_F(LocalWorldTest, what_is_out_of_range_changes_nothing) {
  LocalWorld w = world("still");
  MaterialScale scale;
  scale.stiffness = std::numeric_limits<float>::quiet_NaN();
  w.set_material(1, scale);
  EXPECT_EQ(w.viewed_characters()[0].material, MaterialScale{});
  Wind wind;
  // A gust ratio is at most 1 (validate(Wind)).
  wind.gust_ratio = 7;
  w.set_wind(wind);
  EXPECT_EQ(w.wind().gust_ratio, 0);
  EXPECT_EQ(w.grab(99), nullptr);
}

// Waits for the levels of a groom, and returns null after ten seconds.
std::shared_ptr<const LevelSet> built(LevelBuilder& builder, const std::shared_ptr<const Groom>& groom) {
  for (int i = 0; i < 10'000; ++i) {
    if (auto levels = builder.levels_of(groom)) return levels;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return nullptr;
}

TEST(LevelBuilder, builds_each_of_any_number_of_grooms_once) {
  LevelBuilder builder;
  std::vector<std::shared_ptr<const Groom>> grooms;
  std::vector<std::shared_ptr<const LevelSet>> levels;
  for (int i = 0; i < 40; ++i) {
    // The groom has no hair, so its levels are soon built.
    grooms.push_back(std::make_shared<const Groom>());
    levels.push_back(built(builder, grooms.back()));
    ASSERT_TRUE(levels.back());
  }
  for (std::size_t i = 0; i < grooms.size(); ++i) EXPECT_EQ(builder.levels_of(grooms[i]), levels[i]);
}

TEST(LevelBuilder, levels_go_with_their_groom_and_not_while_they_are_drawn) {
  LevelBuilder builder;
  auto groom = std::make_shared<const Groom>();
  const std::shared_ptr<const LevelSet> drawn = built(builder, groom);
  const std::weak_ptr<const Groom> kept = groom;
  groom.reset();
  ASSERT_TRUE(built(builder, std::make_shared<const Groom>()));
  EXPECT_TRUE(kept.expired());
  // The builder has let go of the levels as well, and this test is their last owner.
  EXPECT_EQ(drawn.use_count(), 1);
}

TEST(SceneList, makes_every_kind_of_scene_from_few_grooms_and_motions) {
  SceneList scenes({});
  SceneList::Choice choice;
  choice.count = 20;
  const auto crowd = scenes.make(choice);
  ASSERT_TRUE(crowd) << crowd.error();
  ASSERT_EQ(crowd->size(), 20u);
  for (const LocalCharacter& one : *crowd) EXPECT_EQ(one.groom, crowd->front().groom);
  for (std::size_t i = 0; i < 20; ++i) {
    for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE((*crowd)[i].place == (*crowd)[j].place);
  }
  // The scene has one character for each level, so that the levels can be compared side by side.
  choice.level = SceneList::kEveryLevel;
  const auto levels = scenes.make(choice);
  ASSERT_TRUE(levels);
  ASSERT_EQ(levels->size(), kLevelCount - 1) << "all but the learnt one, which needs a server";
  for (std::size_t i = 0; i < levels->size(); ++i) {
    EXPECT_EQ((*levels)[i].level, i < 4 ? static_cast<LevelIndex>(i) : LevelIndex::rigid);
    EXPECT_EQ((*levels)[i].motion, levels->front().motion) << "they are to be compared";
  }
  choice.hair = 1000;
  EXPECT_FALSE(scenes.make(choice));
}

TEST(Place, is_read_and_refused_in_one_line) {
  const auto place = parse_place("0.6:-1:20");
  ASSERT_TRUE(place);
  EXPECT_EQ(*place, (Place{0.6, -1, 20}));
  EXPECT_EQ(*parse_place("1:2"), (Place{1, 2, 0}));
  // A place within 1000 m (kFar_m in place.cpp) stays far from the protocol's limit for poses.
  for (const char* text : {"", "1", ":", "1:", "1:2:3:4", "1:nan", "1:2:x", "1e9:0", "1::2"})
    EXPECT_FALSE(parse_place(text)) << text;
}

TEST(Place, turns_about_its_own_place) {
  const Pose pose = rigid_pose({Quat::Identity(), Vec3(0, 1.5, 0)});
  const Pose there = placed({2, -1, 90}, pose);
  EXPECT_LT((there.head().position - Vec3(2, 1.5, -1)).norm(), 1e-12);
  // A turn of 90 degrees about the vertical axis turns the face from +z to +x.
  EXPECT_LT((there.head().vector(Vec3::UnitZ()) - Vec3::UnitX()).norm(), 1e-12);
}

TEST(Place, a_single_one_stands_at_the_origin_and_many_stand_apart) {
  EXPECT_EQ(side_by_side(0, 1), Place{});
  for (std::size_t count : {2u, 7u, 8u, 9u, 100u}) {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const Place a = side_by_side(i, count), b = side_by_side(j, count);
        // Neighbours in a row stand 0.7 m apart and rows 0.9 m (kApart_m and kRowsApart_m in place.cpp), so that
        // shoulders do not meet.
        EXPECT_GT(std::hypot(a.x_m - b.x_m, a.z_m - b.z_m), 0.6);
      }
    }
  }
}

}  // namespace
}  // namespace hairnet::viewer
