#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/groom_store_fixture.hpp"

namespace hairnet::server {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using wire::ErrorReason;
using wire::GroomState;

TEST_F(GroomStoreTest, a_groom_that_is_kept_on_disk_is_not_uploaded) {
  make_with_cache({&good_});
  EXPECT_EQ(offer(kAnna, good_), ErrorReason::none);
  EXPECT_EQ(store_->upload_bytes(), 0u);
  build();
  EXPECT_THAT(needs(kAnna), ElementsAre(good_.bytes.size()));
  EXPECT_THAT(states(kAnna), ElementsAre(GroomState::queued, GroomState::building, GroomState::ready));
  EXPECT_THAT(errors(kAnna), IsEmpty());
  EXPECT_EQ(counters_.grooms_uploaded.value(), 0u);
  EXPECT_EQ(cache_counters_.groom_cache_hits.value(), 1u);
  EXPECT_EQ(ready_commands(), 1u);
  EXPECT_EQ(store_->upload_bytes(), 0u);
}

TEST_F(GroomStoreTest, a_character_may_have_a_groom_on_disk_that_no_session_has_offered) {
  make_with_cache({&good_});
  EXPECT_EQ(store_->retain(kAnna, good_.hash, now_ns_).reason, ErrorReason::none);
  EXPECT_EQ(store_->retain(kBert, wire::GroomHash{9}, now_ns_).reason, ErrorReason::groom_unknown);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_THAT(needs(kAnna), IsEmpty());
  EXPECT_EQ(states(kAnna).back(), GroomState::ready);
}

TEST_F(GroomStoreTest, a_prepared_groom_is_ready_before_anybody_asks_for_it) {
  make_with_cache({&good_});
  // The draining server names a groom whose file nobody has, and another one twice.
  const std::array expected{wire::GroomHash{9}, good_.hash, good_.hash};
  store_->prepare(expected, now_ns_);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_EQ(store_->groom_count(), 1u) << "nobody has the other one's file";
  EXPECT_EQ(store_->user_count(), 0u);
  EXPECT_EQ(store_->retain(kAnna, good_.hash, now_ns_).reason, ErrorReason::none);
  build();
  EXPECT_EQ(counters_.grooms_ready.value(), 1u);
  EXPECT_EQ(ready_commands(), 1u);
}

TEST_F(GroomStoreTest, a_groom_that_another_server_has_just_put_into_the_folder_is_prepared) {
  make_with_cache({});
  GroomCache(folder_, std::uint64_t{1} << 30, cache_counters_).put(good_.hash, good_.bytes);
  ASSERT_FALSE(store_->is_cached(good_.hash));
  store_->prepare({&good_.hash, 1}, now_ns_);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

// The builder has begun the first prepared groom when Anna asks for another one. Hers must come before the second
// prepared one.
TEST_F(GroomStoreTest, grooms_that_sessions_wait_for_come_before_prepared_ones) {
  const Upload other(wire::encode_groom(small_groom(2))), last(wire::encode_groom(small_groom(3)));
  make_with_cache({&good_, &other, &last});
  store_->prepare(std::array{good_.hash, other.hash}, now_ns_);
  EXPECT_EQ(store_->retain(kAnna, last.hash, now_ns_).reason, ErrorReason::none);
  while (!store_->ready(good_.hash)) {
    builder_->poll();
    store_->poll(now_ns_);
  }
  EXPECT_FALSE(store_->ready(last.hash));
  while (!store_->ready(last.hash)) {
    builder_->poll();
    store_->poll(now_ns_);
  }
  EXPECT_FALSE(store_->ready(other.hash));
  build();
  EXPECT_TRUE(store_->ready(other.hash));
}

TEST_F(GroomStoreTest, an_uploaded_groom_is_kept_for_the_next_server) {
  make_with_cache({});
  offer(kAnna, good_);
  send_all(kAnna, good_);
  build();
  EXPECT_EQ(cache_counters_.groom_cache_written.value(), 1u);
  make({});
  EXPECT_EQ(store_->retain(kAnna, good_.hash, now_ns_).reason, ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_EQ(counters_.grooms_uploaded.value(), 1u);
}

// A client could otherwise fill the folder of all servers with junk.
TEST_F(GroomStoreTest, a_groom_that_cannot_be_built_is_not_kept) {
  make_with_cache({});
  const Upload junk(std::vector<std::uint8_t>(500, 7));
  offer(kAnna, junk);
  send_all(kAnna, junk);
  build();
  EXPECT_EQ(cache_counters_.groom_cache_written.value(), 0u);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(GroomStoreTest, a_bad_file_is_removed_and_the_upload_asked_for_without_an_error) {
  make_with_cache({&good_});
  corrupt_kept();
  offer(kAnna, good_);
  offer(kBert, good_);
  build();
  EXPECT_THAT(needs(kAnna), ElementsAre(good_.bytes.size(), 0u));
  EXPECT_THAT(needs(kBert), ElementsAre(good_.bytes.size()));
  EXPECT_THAT(errors(kAnna), IsEmpty());
  EXPECT_EQ(cache_counters_.groom_cache_rejected_damaged.value(), 1u);
  EXPECT_TRUE(fs::is_empty(folder_));
  EXPECT_EQ(store_->upload_bytes(), 0u);
  send_all(kAnna, good_);
  build();
  EXPECT_EQ(states(kAnna),
            (std::vector{GroomState::queued, GroomState::queued, GroomState::building, GroomState::ready}));
  EXPECT_EQ(states(kBert).back(), GroomState::ready);
  EXPECT_THAT(errors(kBert), IsEmpty());
  EXPECT_EQ(cache_counters_.groom_cache_written.value(), 2u) << "and good bytes take its place";
}

TEST_F(GroomStoreTest, a_bad_file_that_no_session_can_upload_is_refused_as_unknown) {
  make_with_cache({&good_});
  corrupt_kept();
  EXPECT_EQ(store_->retain(kAnna, good_.hash, now_ns_).reason, ErrorReason::none);
  build();
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::groom_unknown));
  EXPECT_EQ(counters_.grooms_refused_absent.value(), 1u);
  EXPECT_EQ(store_->groom_count(), 0u);
  EXPECT_EQ(offer(kAnna, good_), ErrorReason::none);
  EXPECT_THAT(needs(kAnna), ElementsAre(0u));
}

TEST_F(GroomStoreTest, an_offer_of_the_wrong_length_does_not_corrupt_a_kept_groom) {
  make_with_cache({&good_});
  EXPECT_EQ(store_->offer(kAnna, {good_.hash, good_.bytes.size() + 1}, now_ns_).reason, ErrorReason::none);
  EXPECT_EQ(store_->retain(kBert, good_.hash, now_ns_).reason, ErrorReason::none);
  build();
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::groom_hash_mismatch));
  EXPECT_EQ(states(kBert).back(), GroomState::ready);
}

// Grooms on disk hold no memory while they wait, so build_queue_max bounds uploaded ones only. Bert's upload must not
// be refused because of the six grooms that Anna has on disk.
TEST_F(GroomStoreTest, many_kept_grooms_at_once_leave_the_build_queue_to_uploads) {
  std::vector<Upload> kept;
  for (unsigned seed = 2; seed < 8; ++seed) kept.emplace_back(wire::encode_groom(small_groom(seed)));
  GroomStoreLimits limits;
  limits.build_queue_max = 3;
  make_with_cache({&kept[0], &kept[1], &kept[2], &kept[3], &kept[4], &kept[5]}, limits);
  for (const Upload& upload : kept) EXPECT_EQ(store_->retain(kAnna, upload.hash, now_ns_).reason, ErrorReason::none);
  offer(kBert, good_);
  EXPECT_EQ(send_all(kBert, good_), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
  for (const Upload& upload : kept) EXPECT_TRUE(store_->ready(upload.hash));
}

TEST_F(GroomStoreTest, grooms_on_disk_are_not_read_for_sessions_that_have_left) {
  std::vector<Upload> kept;
  for (unsigned seed = 1; seed < 6; ++seed) kept.emplace_back(wire::encode_groom(small_groom(seed)));
  make_with_cache({&kept[0], &kept[1], &kept[2], &kept[3], &kept[4]});
  for (const Upload& upload : kept) store_->retain(kAnna, upload.hash, now_ns_);
  store_->release(kAnna, now_ns_);
  build();
  EXPECT_LE(cache_counters_.groom_cache_hits.value(), 1u) << "that which the builder had been given";
  EXPECT_EQ(store_->groom_count(), 0u);
}

TEST_F(GroomStoreTest, a_file_on_disk_is_read_once_for_all_requests) {
  make_with_cache({&good_});
  EXPECT_FALSE(store_->bytes(good_.hash));
  EXPECT_TRUE(store_->is_cached(good_.hash));
  EXPECT_TRUE(store_->fetch(kAnna, good_.hash));
  EXPECT_TRUE(store_->fetch(kBert, good_.hash));
  EXPECT_FALSE(store_->fetch(kBert, wire::GroomHash{9}));
  build();
  ASSERT_EQ(delivered_.size(), 2u);
  ASSERT_TRUE(delivered_[0].bytes);
  EXPECT_EQ(*delivered_[0].bytes, good_.bytes);
  EXPECT_EQ(delivered_[0].bytes, delivered_[1].bytes);
  EXPECT_EQ(store_->bytes(good_.hash), delivered_[0].bytes) << "a session that asks while it is being sent shares it";
  EXPECT_EQ(cache_counters_.groom_cache_hits.value(), 1u);
  EXPECT_EQ(store_->groom_count(), 0u) << "nothing is built of it";
  delivered_.clear();
  EXPECT_FALSE(store_->bytes(good_.hash));
}

TEST_F(GroomStoreTest, a_request_for_a_bad_file_gets_the_answer_that_it_is_absent) {
  make_with_cache({&good_});
  corrupt_kept();
  EXPECT_TRUE(store_->fetch(kAnna, good_.hash));
  build();
  ASSERT_EQ(delivered_.size(), 1u);
  EXPECT_FALSE(delivered_[0].bytes);
  EXPECT_FALSE(store_->is_cached(good_.hash));
}

TEST_F(GroomStoreTest, what_another_server_has_kept_is_found_after_a_while) {
  make_with_cache({});
  GroomCacheCounters others;
  GroomCache other(folder_, std::uint64_t{1} << 30, others);
  build();
  other.put(good_.hash, good_.bytes);
  build();
  EXPECT_FALSE(store_->is_cached(good_.hash));
  // The folder is listed every 10 s (kRefreshInterval_ns in groom_store.cpp).
  now_ns_ += 11 * kSecond_ns;
  build();
  EXPECT_TRUE(store_->is_cached(good_.hash));
}

TEST_F(GroomStoreTest, a_kept_groom_larger_than_is_taken_is_refused) {
  GroomStoreLimits limits;
  limits.groom_bytes_max = good_.bytes.size() - 1;
  make_with_cache({&good_}, limits);
  EXPECT_EQ(offer(kAnna, good_), ErrorReason::limit_exceeded);
  EXPECT_EQ(store_->retain(kAnna, good_.hash, now_ns_).reason, ErrorReason::none);
  build();
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_FALSE(fs::is_empty(folder_)) << "others who share the folder may take it";
}

}  // namespace
}  // namespace hairnet::server
