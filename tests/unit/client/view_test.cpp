#include <gtest/gtest.h>

#include <limits>

#include "client/viewer/characters/character_spec.hpp"
#include "client/viewer/characters/hair_colour.hpp"
#include "client/viewer/sources/motion_timeline.hpp"
#include "client/viewer/sources/stream_statistics.hpp"
#include "schema/limits.hpp"

namespace hairnet::viewer {
namespace {

// Returns a motion of one second at 60 Hz in which the head moves along x, and leans from 0.3 to 1.3 rad.
Motion leaning(double last_x) {
  Motion motion;
  for (int i = 0; i <= 60; ++i) {
    const double s = i / 60.0;
    motion.poses.push_back(rigid_pose({Quat(Eigen::AngleAxisd(0.3 + s, Vec3::UnitX())), Vec3(s * last_x, 1.5, 0)}));
  }
  return motion;
}

double lean(const Pose& pose) {
  return pose.head().rotation.angularDistance(Quat::Identity());
}

TEST(MotionTimeline, begins_upright_where_the_clip_begins_and_eases_into_it) {
  const Motion motion = leaning(1);
  const MotionTimeline timeline(motion, 3);
  EXPECT_NEAR(lean(timeline.at(-5)), 0, 1e-9);
  EXPECT_EQ(timeline.at(-5).head().position, motion.poses[0].head().position);
  // The clip begins with a lean of 0.3 rad, half of which is reached half way through the lead-in.
  EXPECT_NEAR(lean(timeline.at(-MotionTimeline::kLeadIn_s / 2)), 0.15, 1e-9);
  EXPECT_NEAR(lean(timeline.at(0)), 0.3, 1e-9);
}

TEST(MotionTimeline, loops_while_the_duration_lasts_then_eases_upright) {
  const Motion motion = leaning(1);
  const MotionTimeline timeline(motion, 2.5);
  EXPECT_NEAR(lean(timeline.at(0.25)), lean(timeline.at(1.25)), 1e-9);
  EXPECT_NEAR(lean(timeline.at(2.49)), 0.3 + 0.49, 1e-6);
  // The duration ends half way through the third round, at a lean of 0.3 + 0.5 rad.
  EXPECT_NEAR(lean(timeline.at(2.5)), 0.8, 1e-5);
  EXPECT_NEAR(lean(timeline.at(2.5 + MotionTimeline::kEaseUpright_s)), 0, 1e-9);
  EXPECT_NEAR(timeline.at(9).head().position.x(), 0.5, 1e-5);
}

// The clip lasts 1 s, so rounds end at 1 s and 2 s. At 3 s the duration ends, and the pose eases upright.
TEST(MotionTimeline, an_end_that_does_not_meet_the_beginning_is_a_jump) {
  const Motion travels = leaning(1);
  const MotionTimeline timeline(travels, 3);
  EXPECT_FALSE(timeline.teleports(0.2, 0.9));
  EXPECT_TRUE(timeline.teleports(0.95, 1.05));
  EXPECT_FALSE(timeline.teleports(1.1, 1.2));
  EXPECT_FALSE(timeline.teleports(-0.3, -0.2));
  EXPECT_FALSE(timeline.teleports(3.1, 4.1));
}

TEST(MotionTimeline, a_clip_that_closes_loops_without_a_jump) {
  Motion closed = leaning(0);
  closed.poses.back() = closed.poses.front();
  EXPECT_FALSE(MotionTimeline(closed, 3).teleports(0.95, 1.05));
}

TEST(MotionTimeline, the_clips_own_teleports_are_jumps) {
  Motion motion = leaning(0);
  motion.teleports.assign(motion.poses.size(), false);
  // Pose 30 at 60 Hz is at 0.5 s of each round.
  motion.teleports[30] = true;
  const MotionTimeline timeline(motion, 3);
  EXPECT_TRUE(timeline.teleports(0.45, 0.55));
  EXPECT_TRUE(timeline.teleports(1.45, 1.55));
  EXPECT_FALSE(timeline.teleports(0.55, 0.6));
}

TEST(MotionTimeline, endless_clip_that_travels_stays_near_its_place_and_never_jumps) {
  const Motion travels = leaning(3);
  const MotionTimeline timeline(travels, std::numeric_limits<double>::infinity(), Loop::smooth);
  Pose last = timeline.at(0);
  for (int i = 1; i < 60 * 60; ++i) {
    const double time_s = i / 60.0;
    const Pose pose = timeline.at(time_s);
    ASSERT_TRUE(is_valid(pose));
    EXPECT_FALSE(timeline.teleports(time_s - 1 / 60.0, time_s));
    // The clip itself moves by 3 m/s, 0.05 m a step of 1/60 s, and turns by 1 rad/s. A jump to the beginning would be 3
    // m.
    EXPECT_LT((pose.head().position - last.head().position).norm(), 0.05) << time_s;
    EXPECT_LT(pose.head().rotation.angularDistance(last.head().rotation), 0.08) << time_s;
    EXPECT_LT((pose.head().position - timeline.at(0).head().position).norm(), 0.1);
    last = pose;
  }
}

TEST(MotionTimeline, endless_clip_with_teleports_keeps_them) {
  Motion motion = leaning(2);
  motion.teleports.assign(motion.poses.size(), false);
  motion.teleports[30] = true;
  const MotionTimeline timeline(motion, std::numeric_limits<double>::infinity(), Loop::smooth);
  EXPECT_TRUE(timeline.teleports(100.45, 100.55));
  EXPECT_TRUE(timeline.teleports(100.95, 101.05));
}

TEST(CharacterSpec, takes_its_keys_in_any_order) {
  const auto character =
      parse_character("level=low,motion=made:nod,groom=a.groom,strands=500,up=+z,face=-y,unit=0.01,material=wet");
  ASSERT_TRUE(character) << character.error();
  EXPECT_EQ(character->groom, "a.groom");
  EXPECT_EQ(character->motion, "made:nod");
  EXPECT_EQ(character->level, LevelIndex::low);
  EXPECT_EQ(character->hairstyle.strand_count, 500u);
  EXPECT_EQ(character->bvh.up, Axis::plus_z);
  EXPECT_EQ(character->bvh.unit_m, 0.01);
  EXPECT_EQ(character->material, *make_material("wet"));
}

TEST(CharacterSpec, looks_around_unless_a_motion_is_named) {
  const auto character = parse_character("groom=a.groom");
  ASSERT_TRUE(character) << character.error();
  EXPECT_EQ(character->motion, "made:look_around");
}

TEST(CharacterSpec, refuses_what_it_does_not_know_in_one_line) {
  for (const char* spec : {"", ",", "motion=a", "groom=a,motion=b,level=best", "groom=a,motion=b,hat=red",
                           "groom=a,motion=b,colour=#12345", "groom=a,motion=b,strands=-1", "groom=a,motion=b,unit=0",
                           "groom=a,motion=b,unit=nan", "groom=a,motion=b,material=wood", "groom=,motion=b",
                           "groom=a,motion=b,", "groom"}) {
    const auto character = parse_character(spec);
    ASSERT_FALSE(character) << spec;
    EXPECT_EQ(character.error().find('\n'), std::string::npos);
  }
}

TEST(CharacterSpec, takes_a_name_that_fits_a_tag_and_is_text) {
  const auto named = [](const std::string& name) { return parse_character("groom=a,motion=b,name=" + name); };
  EXPECT_EQ(named("Zo\xc3\xab the 2nd")->name, "Zo\xc3\xab the 2nd");
  EXPECT_EQ(named(std::string(wire::kTagBytesMax, 'x'))->name.size(), wire::kTagBytesMax);
  for (const std::string& bad :
       {std::string(wire::kTagBytesMax + 1, 'x'), std::string("a\nb"), std::string("\xff"), std::string()}) {
    const auto refused = named(bad);
    ASSERT_FALSE(refused) << bad;
    EXPECT_EQ(refused.error().rfind("name ", 0), 0u) << refused.error();
  }
}

TEST(HairColour, survives_the_way_to_other_clients) {
  for (std::size_t n = 0; n < 8; ++n) {
    const wire::Appearance sent = appearance_of(default_hair_colour(n));
    EXPECT_EQ(sent.hair_root, sent.hair_tip);
    EXPECT_LT((linear_of(sent.hair_root) - default_hair_colour(n)).norm(), 0.01f) << n;
    EXPECT_EQ(appearance_of(linear_of(sent.hair_root)), sent) << n;
  }
}

TEST(HairColour, hexadecimal_colours_are_srgb) {
  const auto colour = parse_hair_colour("#ff8000");
  ASSERT_TRUE(colour);
  EXPECT_NEAR(colour->x(), 1, 1e-6);
  // The linear value of the sRGB value 0x80, 128 of 255, is 0.2158.
  EXPECT_NEAR(colour->y(), 0.2158f, 1e-3);
  EXPECT_EQ(colour->z(), 0);
}

link::FrameBatch batch_of(std::uint64_t tick, std::vector<std::uint32_t> members) {
  link::FrameBatch batch;
  batch.tick = tick;
  for (const std::uint32_t member : members) {
    batch.frames.emplace_back();
    batch.frames.back().member = member;
  }
  return batch;
}

TEST(StreamStatistics, counts_the_ticks_each_character_missed) {
  StreamStatistics statistics;
  // Member 1 misses the ticks 12 and 13, member 2 misses 11, 12 and 13, and member 3 is new at 14.
  statistics.count_frames(batch_of(10, {1, 2}), 0);
  statistics.count_frames(batch_of(11, {1}), 0);
  statistics.count_frames(batch_of(14, {1, 2, 3}), 0);
  EXPECT_EQ(statistics.frame_count(), 6u);
  EXPECT_EQ(statistics.missed_tick_count(), 2u + 3u);
}

TEST(StreamStatistics, ticks_between_the_steps_of_a_character_are_not_missed) {
  StreamStatistics statistics;
  for (const std::uint64_t tick : {10u, 12u, 16u}) {
    link::FrameBatch batch = batch_of(tick, {1});
    batch.frames[0].step_stride = 2;
    statistics.count_frames(batch, 0);
  }
  // With a stride of 2 the character steps at 10, 12, 14 and 16, so only 14 is missed.
  EXPECT_EQ(statistics.missed_tick_count(), 1u);
}

TEST(StreamStatistics, an_endless_stream_needs_constant_memory_and_reports_the_last_batches) {
  StreamStatistics statistics;
  // Only the last kLatenciesMax, 100 000, batches are remembered, and all of these took 7 ms.
  for (int i = 0; i < 150'000; ++i) statistics.count_frames(batch_of(1, {}), i < 50'000 ? 900'000'000 : 7'000'000);
  EXPECT_EQ(statistics.latency_ms(0), 7);
  EXPECT_EQ(statistics.latency_ms(1), 7);
}

TEST(StreamStatistics, quantiles_of_latency) {
  StreamStatistics statistics;
  for (std::int64_t i = 0; i <= 100; ++i) statistics.count_frames(batch_of(1, {}), (100 - i) * 1'000'000);
  EXPECT_EQ(statistics.latency_ms(0.5), 50);
  EXPECT_EQ(statistics.latency_ms(0.95), 95);
}

}  // namespace
}  // namespace hairnet::viewer
