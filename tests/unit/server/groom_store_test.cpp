#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/levels/build.hpp"
#include "core/levels/level_map.hpp"
#include "schema/wire/packing.hpp"
#include "server/grooms/level_bytes.hpp"
#include "tests/unit/server/groom_store_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using wire::ErrorReason;
using wire::GroomState;

TEST_F(GroomStoreTest, an_uploaded_groom_becomes_ready) {
  EXPECT_EQ(offer(kAnna, good_), ErrorReason::none);
  EXPECT_THAT(needs(kAnna), ElementsAre(0u));
  EXPECT_EQ(send_all(kAnna, good_), ErrorReason::none);
  EXPECT_FALSE(store_->ready(good_.hash));
  store_->poll(now_ns_);
  EXPECT_EQ(counters_.gauges.grooms_waiting.value(), 1);
  build();
  EXPECT_EQ(counters_.gauges.grooms_waiting.value(), 0);
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_THAT(states(kAnna), ElementsAre(GroomState::queued, GroomState::building, GroomState::ready));
  EXPECT_EQ(ready_commands(), 1u);
  EXPECT_EQ(store_->upload_bytes(), 0u);
  // Levels count, and not only the file; even the small groom's take far more than 1 kB.
  EXPECT_GT(store_->level_bytes(), 1000u);
}

// A map between two levels is needed when a character changes its level. Maps are most of a small groom's memory, so
// the bound on memory must count them.
TEST_F(GroomStoreTest, memory_of_levels_includes_the_maps_between_them) {
  const auto groom = wire::decode_groom(good_.bytes);
  LevelSet set = *build_levels(*groom);
  const std::size_t with_maps = level_bytes(set);
  std::size_t maps = 0;
  for (auto& from : set.maps) {
    for (auto& map : from) {
      if (map) maps += map->bytes();
    }
  }
  EXPECT_GT(maps, 10'000u);
  set.maps = {};
  EXPECT_EQ(with_maps, level_bytes(set) + maps);
}

// Anna uploads four grooms, and Bert one when her first is ready. His must not wait for all of hers: it is next after
// the build under way, since none of his builds has taken time yet.
TEST_F(GroomStoreTest, the_session_whose_builds_took_least_is_built_next) {
  std::vector<Upload> many;
  for (unsigned seed = 2; seed < 6; ++seed) many.emplace_back(wire::encode_groom(small_groom(seed)));
  static std::int64_t clock_ns;
  clock_ns = 0;
  // Each look at the clock takes 1 us, so every build takes some time.
  make({}, [] { return clock_ns += 1000; });
  for (const Upload& upload : many) {
    offer(kAnna, upload);
    send_all(kAnna, upload);
  }
  while (builder_->poll()) {
  }
  // The first groom is ready, and Anna is charged its time.
  store_->poll(now_ns_);
  offer(kBert, good_);
  send_all(kBert, good_);
  const auto is_ready = [&](const Upload& upload) { return store_->ready(upload.hash); };
  while (std::ranges::count_if(many, is_ready) < 3) {
    while (builder_->poll()) {
    }
    store_->poll(now_ns_);
  }
  EXPECT_TRUE(store_->ready(good_.hash)) << "it waited for what was begun only";
}

// A client with many grooms must not lock others out: the newest groom of the client with most in the queue makes room.
TEST_F(GroomStoreTest, a_full_build_queue_refuses_the_session_that_has_most_in_it) {
  std::vector<Upload> many;
  for (unsigned seed = 2; seed < 6; ++seed) many.emplace_back(wire::encode_groom(small_groom(seed)));
  GroomStoreLimits limits;
  limits.build_queue_max = 3;
  make(limits);
  // The builder has the first of the four, so the other three fill the queue.
  for (const Upload& upload : many) {
    offer(kAnna, upload);
    EXPECT_EQ(send_all(kAnna, upload), ErrorReason::none);
  }
  offer(kBert, good_);
  EXPECT_EQ(send_all(kBert, good_), ErrorReason::none);
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::groom_build_queue_full));
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_EQ(store_->groom_count(), 4u);
}

// A build has a turn of 5 s (build_turn_ns) and then gives way to a session whose builds have taken less. It begins
// again afterwards with twice the time.
TEST_F(GroomStoreTest, a_long_build_gives_way_and_begins_again_later) {
  const Upload longest(wire::encode_groom(small_groom(2))), own(wire::encode_groom(small_groom(3)));
  std::vector<wire::GroomHash> built;
  build_levels_ = [&](const LevelBuildDef& def, const wire::GroomHash& hash, auto file, const Groom& groom,
                      const GoesOn& goes_on) {
    built.push_back(hash);
    if (built.size() > 1) return build_levels_in_process(def, hash, file, groom, goes_on);
    store_->poll(now_ns_);
    // Anna's own next groom does not end the turn, since all her builds count together; Bert's does.
    offer(kAnna, own);
    send_all(kAnna, own);
    now_ns_ += 6 * kSecond_ns;
    store_->poll(now_ns_);
    EXPECT_EQ(goes_on(), BuildError::none);
    offer(kBert, good_);
    send_all(kBert, good_);
    store_->poll(now_ns_);
    EXPECT_EQ(goes_on(), BuildError::dropped);
    return LevelBuild{nullptr, BuildError::dropped, ""};
  };
  make({});
  offer(kAnna, longest);
  send_all(kAnna, longest);
  build();
  EXPECT_EQ(built, (std::vector{longest.hash, good_.hash, longest.hash, own.hash}));
  for (const Upload* upload : std::initializer_list<const Upload*>{&longest, &own, &good_})
    EXPECT_TRUE(store_->ready(upload->hash));
  EXPECT_EQ(counters_.builds_interrupted.value(), 1u);
  EXPECT_EQ(counters_.grooms_ready.value(), 3u);
}

TEST_F(GroomStoreTest, a_build_that_nobody_waits_for_ends) {
  BuildError answer = BuildError::none;
  build_levels_ = [&](const LevelBuildDef&, const wire::GroomHash&, auto, const Groom&, const GoesOn& goes_on) {
    store_->release(kAnna, now_ns_);
    answer = goes_on();
    return LevelBuild{nullptr, answer, ""};
  };
  make({});
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  EXPECT_EQ(answer, BuildError::dropped);
  EXPECT_EQ(store_->groom_count(), 0u);
  EXPECT_EQ(store_->upload_bytes(), 0u);
  // A build that was dropped must not spoil the next one of the same groom.
  build_levels_ = nullptr;
  make({});
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

TEST_F(GroomStoreTest, a_groom_whose_build_would_take_too_much_memory_is_refused_before_it) {
  bool was_built = false;
  build_levels_ = [&](const LevelBuildDef&, const wire::GroomHash&, auto, const Groom&, const GoesOn&) {
    was_built = true;
    return LevelBuild{nullptr, BuildError::crash, ""};
  };
  GroomStoreLimits limits;
  // The estimate of even the smallest groom's build is more than 1 MiB.
  limits.build_memory_bytes_max = 1 << 20;
  make(limits);
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  EXPECT_FALSE(was_built);
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(counters_.grooms_refused_build_memory.value(), 1u);
}

// A build without memory is an error of the server, so it is tried four times (build_count_max), with waits of at most
// 4 s between. A crash would happen again, so the groom is refused at once.
TEST_F(GroomStoreTest, a_build_without_memory_or_that_crashes_ends_alone) {
  for (const bool throws : {true, false}) {
    build_levels_ = [=](const LevelBuildDef&, const wire::GroomHash&, auto, const Groom&, const GoesOn&) -> LevelBuild {
      if (throws) throw std::bad_alloc();
      return {nullptr, BuildError::crash, "it ended"};
    };
    make({});
    offer(kAnna, good_);
    send_all(kAnna, good_);
    build();
    for (int round = 0; throws && round < 10; ++round) {
      now_ns_ += 10 * kSecond_ns;
      build();
    }
    EXPECT_EQ(errors(kAnna).back(), ErrorReason::groom_build_failed) << "the file may be valid";
    EXPECT_EQ(store_->groom_count(), 0u);
    EXPECT_EQ(store_->upload_bytes(), 0u);
  }
  EXPECT_EQ(counters_.grooms_refused_server.value(), 1u);
  EXPECT_EQ(counters_.grooms_refused_build_crash.value(), 1u);
}

// The waits are 1 s (build_again_ns) after the first failure, 2 s after the second, and so on.
TEST_F(GroomStoreTest, a_build_that_fails_by_the_servers_error_is_tried_again_later_and_later) {
  int builds = 0;
  build_levels_ = [&](const LevelBuildDef& def, const wire::GroomHash& hash, auto file, const Groom& groom,
                      const GoesOn& goes_on) -> LevelBuild {
    if (++builds < 3) return {nullptr, BuildError::server, "its build ended by signal 9"};
    return build_levels_in_process(def, hash, file, groom, goes_on);
  };
  make({});
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  EXPECT_EQ(builds, 1) << "not at once";
  EXPECT_EQ(states(kAnna).back(), GroomState::queued);
  now_ns_ += kSecond_ns;
  build();
  EXPECT_EQ(builds, 2);
  now_ns_ += kSecond_ns;
  build();
  EXPECT_EQ(builds, 2) << "the second time it waits longer";
  EXPECT_EQ(offer(kBert, good_), ErrorReason::none) << "others may wait with it";
  now_ns_ += kSecond_ns;
  build();
  EXPECT_EQ(builds, 3);
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_THAT(errors(kAnna), ElementsAre());
  EXPECT_EQ(counters_.builds_failed.value(), 2u);
}

TEST_F(GroomStoreTest, a_build_that_always_fails_by_the_servers_error_is_refused_and_may_be_offered_again) {
  bool fails = true;
  build_levels_ = [&](const LevelBuildDef& def, const wire::GroomHash& hash, auto file, const Groom& groom,
                      const GoesOn& goes_on) -> LevelBuild {
    if (fails) return {nullptr, BuildError::server, "no process for its build"};
    return build_levels_in_process(def, hash, file, groom, goes_on);
  };
  make({});
  offer(kAnna, good_);
  send_all(kAnna, good_);
  // Four tries with waits of 1, 2 and 4 s take 7 s.
  for (int second = 0; second < 20; ++second) {
    build();
    now_ns_ += kSecond_ns;
  }
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::groom_build_failed));
  EXPECT_EQ(counters_.builds_failed.value(), static_cast<std::uint64_t>(GroomStoreLimits().build_count_max));
  EXPECT_EQ(counters_.grooms_refused_server.value(), 1u);
  EXPECT_EQ(store_->groom_count(), 0u);
  fails = false;
  EXPECT_EQ(offer(kAnna, good_), ErrorReason::none);
  EXPECT_EQ(send_all(kAnna, good_), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

TEST_F(GroomStoreTest, bytes_that_are_no_groom_are_refused_with_a_reason) {
  const Upload junk(std::vector<std::uint8_t>(500, 7));
  Groom bald = small_groom();
  bald.points.clear();
  bald.strands.clear();
  bald.strand_begin = {0};
  const Upload no_hair(wire::encode_groom(bald));
  for (const Upload* upload : {&junk, &no_hair}) {
    sent_.clear();
    offer(kAnna, *upload);
    send_all(kAnna, *upload);
    build();
    EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::groom_invalid));
    EXPECT_FALSE(sent<wire::Error>(kAnna)[0].detail.empty());
    EXPECT_EQ(states(kAnna).back(), GroomState::refused);
    EXPECT_EQ(store_->retain(kAnna, upload->hash, now_ns_).reason, ErrorReason::groom_unknown);
  }
  EXPECT_EQ(store_->groom_count(), 0u);
  EXPECT_EQ(store_->upload_bytes(), 0u);
  EXPECT_EQ(counters_.grooms_refused_invalid.value(), 2u);
}

// A small packed file could unpack to more memory than a groom may have, so the bound on bytes holds for the unpacked
// bytes, too.
TEST_F(GroomStoreTest, refuses_groom_that_unpacks_to_more_than_its_bound) {
  const std::size_t unpacked_bytes = wire::unpacked_bytes(good_.bytes, wire::kPackedGroom);
  ASSERT_GT(unpacked_bytes, good_.bytes.size());
  GroomStoreLimits limits;
  for (const bool fits : {false, true}) {
    limits.groom_bytes_max = fits ? unpacked_bytes : unpacked_bytes - 1;
    make(limits);
    sent_.clear();
    ASSERT_EQ(offer(kAnna, good_), ErrorReason::none) << "the file itself is small enough";
    ASSERT_EQ(send_all(kAnna, good_), ErrorReason::none);
    build();
    EXPECT_EQ(states(kAnna).back(), fits ? GroomState::ready : GroomState::refused);
    if (fits) continue;
    ASSERT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
    EXPECT_NE(sent<wire::Error>(kAnna)[0].detail.find("when unpacked"), std::string::npos);
  }
}

TEST_F(GroomStoreTest, refuses_offers_beyond_its_bounds) {
  GroomStoreLimits limits;
  limits.groom_bytes_max = 1000;
  limits.grooms_per_session_max = 2;
  make(limits);
  const auto ask = [&](SessionId session, std::uint8_t name, std::uint64_t bytes) {
    return store_->offer(session, {wire::GroomHash{name}, bytes}, now_ns_).reason;
  };
  EXPECT_EQ(ask(kAnna, 1, 0), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kAnna, 1, 1001), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kAnna, 1, ~std::uint64_t{0}), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kAnna, 1, 1000), ErrorReason::none);
  EXPECT_EQ(ask(kAnna, 2, 400), ErrorReason::none);
  EXPECT_EQ(ask(kAnna, 3, 1), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kAnna, 1, 999), ErrorReason::groom_hash_mismatch);
}

TEST_F(GroomStoreTest, a_full_build_queue_refuses_and_can_be_asked_again) {
  GroomStoreLimits limits;
  limits.build_queue_max = 1;
  make(limits);
  const Upload second(wire::encode_groom(small_groom(3))), other(wire::encode_groom(small_groom(2)));
  // The builder has the first, so the second alone fills the queue of one.
  for (const Upload* upload : std::initializer_list<const Upload*>{&good_, &second}) {
    offer(kAnna, *upload);
    EXPECT_EQ(send_all(kAnna, *upload), ErrorReason::none);
  }
  offer(kAnna, other);
  EXPECT_EQ(send_all(kAnna, other), ErrorReason::groom_build_queue_full);
  build();
  EXPECT_EQ(offer(kAnna, other), ErrorReason::none);
  EXPECT_EQ(send_all(kAnna, other), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(other.hash));
}

// There is memory for one and a half grooms. While Anna uses the first one, Bert's is refused; when she has left, the
// first goes as soon as its memory is needed, and not before.
TEST_F(GroomStoreTest, unused_levels_are_evicted_and_retained_ones_stay) {
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  GroomStoreLimits limits;
  limits.level_bytes_max = store_->level_bytes() * 3 / 2;
  make(limits);
  const Upload other(wire::encode_groom(small_groom(2)));
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  offer(kBert, other);
  send_all(kBert, other);
  build();
  EXPECT_EQ(errors(kBert), std::vector{ErrorReason::limit_exceeded});
  EXPECT_TRUE(store_->ready(good_.hash));
  store_->release(kAnna, now_ns_);
  // The memory is not needed yet.
  EXPECT_TRUE(store_->ready(good_.hash));
  offer(kBert, other);
  send_all(kBert, other);
  build();
  EXPECT_TRUE(store_->ready(other.hash));
  EXPECT_FALSE(store_->ready(good_.hash));
  EXPECT_EQ(counters_.grooms_evicted.value(), 1u);
  EXPECT_LE(store_->level_bytes(), limits.level_bytes_max);
}

TEST_F(GroomStoreTest, building_is_announced_only_for_bytes_with_the_hash) {
  Upload wrong = good_;
  wrong.bytes.back() ^= 1;
  offer(kAnna, good_);
  send_all(kAnna, wrong);
  build();
  EXPECT_THAT(states(kAnna), ElementsAre(GroomState::refused));
}

TEST_F(GroomStoreTest, the_least_recently_used_groom_goes_first_and_its_file_counts_with_its_levels) {
  std::vector<Upload> uploads;
  for (unsigned seed = 1; seed <= 4; ++seed) uploads.emplace_back(wire::encode_groom(small_groom(seed)));
  const auto bring = [&](const Upload& upload) {
    offer(kAnna, upload);
    send_all(kAnna, upload);
    build();
    store_->release(kAnna, now_ns_);
    return store_->ready(upload.hash);
  };
  ASSERT_TRUE(bring(uploads[0]));
  const std::size_t one = store_->level_bytes();
  EXPECT_GT(one, uploads[0].bytes.size());
  GroomStoreLimits limits;
  // Three grooms fit, and not four.
  limits.level_bytes_max = one * 7 / 2;
  make(limits);
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(bring(uploads[i]));
  EXPECT_EQ(counters_.grooms_evicted.value(), 0u);
  // A download is a use of the first groom, so the second is now the least recently used.
  EXPECT_TRUE(store_->bytes(uploads[0].hash));
  ASSERT_TRUE(bring(uploads[3]));
  EXPECT_TRUE(store_->ready(uploads[0].hash));
  EXPECT_FALSE(store_->ready(uploads[1].hash));
  EXPECT_TRUE(store_->ready(uploads[2].hash));
  EXPECT_LE(store_->level_bytes(), limits.level_bytes_max);
}

// A download holds the file by a shared pointer: evicting the groom meanwhile must not take the bytes from under it.
TEST_F(GroomStoreTest, a_file_that_is_being_sent_outlives_its_groom) {
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  GroomStoreLimits limits;
  limits.level_bytes_max = store_->level_bytes() * 3 / 2;
  make(limits);
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  const GroomStore::Bytes sent = store_->bytes(good_.hash);
  store_->release(kAnna, now_ns_);
  const Upload other(wire::encode_groom(small_groom(2)));
  offer(kBert, other);
  send_all(kBert, other);
  build();
  EXPECT_FALSE(store_->bytes(good_.hash));
  ASSERT_TRUE(sent);
  EXPECT_EQ(*sent, good_.bytes);
}

// The number of strands is known only once the file has been read, so the third offer is accepted and refused later.
TEST_F(GroomStoreTest, the_strands_of_all_grooms_of_a_session_are_bounded) {
  const std::size_t strands = small_groom().strand_count();
  GroomStoreLimits limits;
  limits.strands_per_session_max = 2 * strands;
  make(limits);
  const Upload second(wire::encode_groom(small_groom(2))), third(wire::encode_groom(small_groom(3)));
  for (const Upload* upload : std::initializer_list<const Upload*>{&good_, &second, &third}) {
    EXPECT_EQ(offer(kAnna, *upload), ErrorReason::none);
    send_all(kAnna, *upload);
    build();
  }
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(sent<wire::Error>(kAnna)[0].groom, third.hash);
  EXPECT_THAT(lost_, ElementsAre(kAnna));
  EXPECT_EQ(states(kAnna).back(), GroomState::refused);
  EXPECT_EQ(counters_.grooms_refused_strands.value(), 1u);
  EXPECT_EQ(offer(kAnna, third), ErrorReason::limit_exceeded) << "known by now, and refused at once";
  EXPECT_EQ(store_->retain(kAnna, third.hash, now_ns_).reason, ErrorReason::limit_exceeded);
  EXPECT_EQ(offer(kBert, third), ErrorReason::none);
}

TEST_F(GroomStoreTest, a_session_may_be_allowed_fewer_strands_than_the_server_allows) {
  const std::size_t strands = small_groom().strand_count();
  // Tokens give two holders, 1 and 2, a number of strands each.
  store_->open(kAnna, {0, 1, strands - 1}, now_ns_);
  store_->open(kBert, {0, 2, strands}, now_ns_);
  offer(kAnna, good_);
  offer(kBert, good_);
  send_all(kAnna, good_);
  build();
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_THAT(errors(kBert), IsEmpty());
  EXPECT_EQ(states(kBert).back(), GroomState::ready);
  EXPECT_THAT(lost_, ElementsAre(kAnna));
}

// Without this rule, a token for one groom's strands could be used in any number of sessions at once.
TEST_F(GroomStoreTest, sessions_of_one_token_holder_share_its_strands) {
  const std::size_t strands = small_groom().strand_count();
  const Upload second(wire::encode_groom(small_groom(2)));
  for (const SessionId session : {kAnna, kBert}) store_->open(session, {0, 1, strands}, now_ns_);
  EXPECT_EQ(offer(kAnna, good_), ErrorReason::none);
  send_all(kAnna, good_);
  build();
  EXPECT_EQ(offer(kBert, good_), ErrorReason::none) << "one groom counts once";
  EXPECT_EQ(offer(kBert, second), ErrorReason::none) << "its strands are not known yet";
  send_all(kBert, second);
  build();
  EXPECT_THAT(errors(kBert), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_THAT(lost_, ElementsAre(kBert));
  store_->open(kBert, {0, 1, 2 * strands}, now_ns_);
  EXPECT_EQ(offer(kBert, second), ErrorReason::none) << "another token, another quota";
}

TEST_F(GroomStoreTest, a_build_that_takes_too_long_is_refused) {
  GroomStoreLimits limits;
  limits.build_ns_max = 5 * kSecond_ns;
  static std::int64_t clock_ns;
  clock_ns = 0;
  // The builder looks at the clock again and again, and each look takes a second; the limit is 5 s.
  make(limits, [] { return clock_ns += kSecond_ns; });
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_THAT(states(kAnna), ElementsAre(GroomState::queued, GroomState::building, GroomState::refused));
  EXPECT_EQ(counters_.grooms_refused_build_time.value(), 1u);
  EXPECT_EQ(store_->groom_count(), 0u);
  EXPECT_EQ(store_->upload_bytes(), 0u);
  make(limits, [] { return clock_ns; });
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

}  // namespace
}  // namespace hairnet::server
