#include "schema/wire/recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "schema/limits.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/unit/schema/equal.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Makes a recording of a header and 20 random ticks, with grooms and learnt hair between them. The entries 1 and 2
// are a groom and learnt hair.
std::vector<RecordEntry> some_recording(std::uint64_t seed) {
  RandomMessages random(seed);
  std::vector<RecordEntry> entries{random.recording_header()};
  for (int n = 0; n < 20; ++n) {
    if (n % 5 == 0) entries.emplace_back(RecordedGroom{Bytes(random.integer(0, 300), 7)});
    if (n % 10 == 0)
      entries.emplace_back(RecordedLearnt{{7}, std::make_shared<LearntHair>(support::random_learnt_hair(seed))});
    entries.emplace_back(random.recorded_tick());
  }
  return entries;
}

Bytes encode_all(const std::vector<RecordEntry>& entries) {
  Bytes bytes;
  for (const RecordEntry& entry : entries) {
    const Bytes one = encode_record_entry(entry);
    bytes.insert(bytes.end(), one.begin(), one.end());
  }
  return bytes;
}

Result<RecordEntry> decode_one(const RecordEntry& entry) {
  const Bytes bytes = encode_record_entry(entry);
  std::span<const std::uint8_t> rest = bytes;
  return take_record_entry(rest);
}

TEST(Recording, gives_back_every_entry_in_order) {
  const std::vector<RecordEntry> entries = some_recording(1);
  const Bytes bytes = encode_all(entries);
  std::span<const std::uint8_t> rest = bytes;
  for (const RecordEntry& entry : entries) {
    const Result<RecordEntry> got = take_record_entry(rest);
    ASSERT_TRUE(got) << got.error();
    EXPECT_TRUE(equal(*got, entry));
  }
  EXPECT_TRUE(rest.empty());
}

TEST(Recording, says_that_its_last_entry_is_incomplete_and_keeps_the_rest) {
  // Two kinds of entries are enough: the header and the learnt hair.
  const std::vector<RecordEntry> entries{some_recording(2)[0], some_recording(2)[2]};
  const Bytes bytes = encode_all(entries);
  const std::size_t first_bytes = encode_record_entry(entries[0]).size();
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    std::span<const std::uint8_t> rest = std::span(bytes).first(n);
    if (n >= first_bytes) {
      ASSERT_TRUE(take_record_entry(rest));
    }
    const std::size_t left = rest.size();
    const Result<RecordEntry> got = take_record_entry(rest);
    ASSERT_FALSE(got);
    EXPECT_NE(got.error().find("incomplete"), std::string::npos) << got.error();
    // The bytes stay, so that a reader of a file that is still written can try again later.
    EXPECT_EQ(rest.size(), left);
  }
}

// Whether a replay may step a World with a header, or evaluate learnt hair. All other entries count as valid.
bool may_be_replayed(const RecordEntry& entry) {
  if (const auto* header = std::get_if<RecordingHeader>(&entry)) {
    const auto is_finite = [](double x) { return std::isfinite(x); };
    return header->tick_rate_hz >= 1 && header->tick_rate_hz <= kTickRateMax_hz && header->substep_count >= 1 &&
           header->iterations >= 0 && std::ranges::all_of(header->gravity, is_finite) && validate(header->wind).empty();
  }
  const auto* learnt = std::get_if<RecordedLearnt>(&entry);
  return learnt == nullptr || (learnt->hair != nullptr && validate(*learnt->hair).empty());
}

TEST(Recording, gives_valid_entries_or_none_for_every_flipped_bit) {
  Bytes bytes = encode_all({some_recording(3)[0], some_recording(3)[2]});
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const auto mask = static_cast<std::uint8_t>(1u << bit % 8);
    bytes[bit / 8] ^= mask;
    std::span<const std::uint8_t> rest = bytes;
    while (!rest.empty()) {
      const std::size_t left = rest.size();
      const Result<RecordEntry> got = take_record_entry(rest);
      if (!got) break;
      ASSERT_TRUE(may_be_replayed(*got)) << bit;
      ASSERT_LT(rest.size(), left) << "an entry that takes no bytes";
    }
    bytes[bit / 8] ^= mask;
  }
}

TEST(Recording, refuses_other_files) {
  const Bytes packet = encode_packet({1, RemoveCharacter{1}});
  std::span<const std::uint8_t> rest = packet;
  EXPECT_FALSE(take_record_entry(rest));
}

TEST(Recording, refuses_settings_that_no_world_takes) {
  const auto is_taken = [](auto&& change) {
    RecordingHeader header;
    change(header);
    return decode_one(header).has_value();
  };
  EXPECT_TRUE(is_taken([](RecordingHeader&) {}));
  // A replay steps a World with these settings. Each of them would stop it by an assertion.
  EXPECT_FALSE(is_taken([](RecordingHeader& h) { h.tick_rate_hz = 0; }));
  EXPECT_FALSE(is_taken([](RecordingHeader& h) { h.substep_count = 0; }));
  EXPECT_FALSE(is_taken([](RecordingHeader& h) { h.iterations = -1; }));
  EXPECT_FALSE(is_taken([](RecordingHeader& h) { h.gravity[1] = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_FALSE(is_taken([](RecordingHeader& h) { h.wind.mean_m_per_s[0] = std::numeric_limits<double>::infinity(); }));
  EXPECT_FALSE(is_taken([](RecordingHeader& h) { h.wind.gust_ratio = 2; }));
}

TEST(Recording, refuses_poses_and_levels_that_no_world_takes) {
  RecordedTick tick;
  tick.poses.resize(1);
  EXPECT_TRUE(decode_one(tick));
  tick.poses[0].pose[Bone::head].rotation.w() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(decode_one(tick));
  tick.poses.clear();
  tick.levels.push_back({1, static_cast<LevelIndex>(kLevelCount)});
  EXPECT_FALSE(decode_one(tick));
  tick.levels.clear();
  tick.added.resize(1);
  // A coordinate is at most kPositionMax_m, 10 km (schema/limits.hpp).
  tick.added[0].pose[Bone::neck].position.x() = 1e6;
  EXPECT_FALSE(decode_one(tick));
  tick.added.clear();
  tick.materials.resize(1);
  tick.winds.resize(1);
  EXPECT_TRUE(decode_one(tick));
  tick.materials[0].scale.stiffness = 0;
  EXPECT_FALSE(decode_one(tick));
  tick.materials.clear();
  // A turbulence has a scale of at least 0.3 m (kTurbulenceScaleMin_m).
  tick.winds[0].wind.turbulence_scale_m = 0.1;
  EXPECT_FALSE(decode_one(tick));
  tick.winds.clear();
  tick.strides.resize(1);
  EXPECT_TRUE(decode_one(tick));
  // Strides are 1, 2 or 4 ticks.
  tick.strides[0].stride = 3;
  EXPECT_FALSE(decode_one(tick));
  tick.strides.clear();
  tick.states = {{1, {Vec3f::Zero()}, {Vec3f::Zero()}}};
  EXPECT_TRUE(decode_one(tick));
  tick.states[0].velocities[0].x() = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(decode_one(tick));
}

TEST(Recording, refuses_touch_that_no_world_takes) {
  RecordedTick good;
  good.added.resize(2);
  good.added[1].owner = 7;
  good.touch_rules = {{1, {TouchAudience::chosen, {3, 5}}}, {2, {TouchAudience::nobody}}};
  good.bodies = {{3, {{{0, 1}, sphere(0.1), {}}, {{7, 0}, sphere(0.1), {}}}}, {4, {}}};
  good.releases = {{1, {7, 0}, Release::unpin}};
  good.grabs = {{1, {{7, 0}, {0.1, 0, 0}, 0.05}}};
  const Result<RecordEntry> got = decode_one(good);
  ASSERT_TRUE(got) << got.error();
  EXPECT_TRUE(equal(*got, RecordEntry(good)));
  const auto is_taken = [&](auto&& change) {
    RecordedTick tick = good;
    change(tick);
    return decode_one(tick).has_value();
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  // Each line breaks one rule: a known audience, sessions in order, an existing room, bodies in the order of their
  // keys, a valid shape and place, a known release, and a grab within kGrabRadiusMax_m.
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.touch_rules[0].rule.audience = static_cast<TouchAudience>(4); }));
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.touch_rules[0].rule.chosen = {5, 3}; }));
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.bodies[0].room = kRecordedRoomCountMax; }));
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.bodies[0].bodies[1].key = {0, 1}; }));
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.bodies[0].bodies[1].shape = {}; }));
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.bodies[0].bodies[0].place.position.z() = kNaN; }));
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.releases[0].release = static_cast<Release>(3); }));
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.grabs[0].grab.place.x() = kNaN; }));
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.grabs[0].grab.radius_m = kNaN; }));
  EXPECT_FALSE(is_taken([](RecordedTick& t) { t.grabs[0].grab.radius_m = 2 * kGrabRadiusMax_m; }));
}

TEST(Recording, refuses_rooms_that_no_world_has) {
  RecordedTick tick;
  tick.added.resize(1);
  // Rooms are numbered from 0. A larger number would index beyond the environments of the World.
  tick.added[0].room = kRecordedRoomCountMax - 1;
  EXPECT_TRUE(decode_one(tick));
  tick.added[0].room = kRecordedRoomCountMax;
  EXPECT_FALSE(decode_one(tick));
  tick.added.clear();
  tick.winds.resize(1);
  tick.winds[0].room = kRecordedRoomCountMax - 1;
  EXPECT_TRUE(decode_one(tick));
  tick.winds[0].room = ~0u;
  EXPECT_FALSE(decode_one(tick));
}

}  // namespace
}  // namespace hairnet::wire
