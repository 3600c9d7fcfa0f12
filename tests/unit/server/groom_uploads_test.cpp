#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/groom_store_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using wire::ErrorReason;
using wire::GroomState;

TEST_F(GroomStoreTest, a_second_offer_of_the_same_hash_uploads_nothing) {
  offer(kAnna, good_);
  offer(kBert, good_);
  send_all(kAnna, good_);
  build();
  EXPECT_THAT(needs(kBert), ElementsAre(good_.bytes.size()));
  EXPECT_THAT(states(kBert),
              ElementsAre(GroomState::queued, GroomState::queued, GroomState::building, GroomState::ready));
  EXPECT_EQ(chunk(kBert, good_, 0, 10), ErrorReason::unexpected_message);
  EXPECT_EQ(counters_.grooms_uploaded.value(), 1u);
}

TEST_F(GroomStoreTest, a_second_offer_in_the_middle_resumes_there) {
  offer(kAnna, good_);
  chunk(kAnna, good_, 0, 100);
  offer(kAnna, good_);
  EXPECT_THAT(needs(kAnna), ElementsAre(0u, 100u));
  EXPECT_EQ(chunk(kAnna, good_, 100, good_.bytes.size()), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

// Each session's bytes stay apart, since a session could spoil another's upload with wrong bytes. So the second one
// begins with byte 0.
TEST_F(GroomStoreTest, when_the_uploader_leaves_the_next_one_is_asked_for_all_bytes) {
  offer(kAnna, good_);
  offer(kBert, good_);
  chunk(kAnna, good_, 0, 100);
  store_->release(kAnna, now_ns_);
  EXPECT_THAT(needs(kBert), ElementsAre(good_.bytes.size(), 0u));
  EXPECT_EQ(send_all(kBert, good_), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

TEST_F(GroomStoreTest, an_unfinished_upload_goes_with_its_only_session) {
  offer(kAnna, good_);
  chunk(kAnna, good_, 0, 100);
  EXPECT_EQ(store_->upload_bytes(), 100u);
  store_->release(kAnna, now_ns_);
  EXPECT_EQ(store_->upload_bytes(), 0u);
  EXPECT_EQ(store_->groom_count(), 0u);
}

// An upload must bring something within 30 s (upload_timeout_ns).
TEST_F(GroomStoreTest, a_stalled_upload_is_dropped_or_passed_on) {
  offer(kAnna, good_);
  offer(kBert, good_);
  now_ns_ += 31 * kSecond_ns;
  store_->poll(now_ns_);
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(needs(kBert).back(), 0u);
  now_ns_ += 31 * kSecond_ns;
  store_->poll(now_ns_);
  EXPECT_EQ(store_->groom_count(), 0u);
  EXPECT_EQ(store_->upload_bytes(), 0u);
}

TEST_F(GroomStoreTest, an_upload_that_trickles_has_stalled) {
  GroomStoreLimits limits;
  // One byte every 4 s is less than 10 bytes a second over the 30 s of upload_timeout_ns.
  limits.upload_bytes_per_s_min = 10;
  make(limits);
  offer(kAnna, good_);
  for (std::size_t at = 0; at < 10; ++at) {
    now_ns_ += 4 * kSecond_ns;
    chunk(kAnna, good_, at, at + 1);
    store_->poll(now_ns_);
  }
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(store_->groom_count(), 0u);
  EXPECT_EQ(counters_.grooms_refused_stalled.value(), 1u);
}

// Anna begins to upload a groom and stops. Bert, who has the same groom, must not wait for her longer than 5 s
// (upload_patience_ns).
TEST_F(GroomStoreTest, nobody_can_hold_the_groom_of_another_session) {
  offer(kAnna, good_);
  offer(kBert, good_);
  chunk(kAnna, good_, 0, 100);
  now_ns_ += 6 * kSecond_ns;
  store_->poll(now_ns_);
  EXPECT_THAT(needs(kBert), ElementsAre(good_.bytes.size(), 0u)) << "it is asked for its own bytes";
  EXPECT_EQ(chunk(kAnna, good_, 100, 200), ErrorReason::none);
  EXPECT_EQ(send_all(kBert, good_), ErrorReason::none);
  EXPECT_EQ(chunk(kAnna, good_, 200, 300), ErrorReason::none) << "sent before it heard that the groom is there";
  build();
  EXPECT_EQ(states(kAnna).back(), GroomState::ready);
  EXPECT_EQ(states(kBert).back(), GroomState::ready);
  EXPECT_THAT(errors(kAnna), IsEmpty());
  EXPECT_EQ(counters_.grooms_uploaded.value(), 1u);
  EXPECT_EQ(store_->upload_bytes(), 0u);
}

// Nine sessions of subject 7 could each let Carl wait for 5 s, one after the other. One session of a subject is asked
// at a time, so Carl, of subject 8, is the next.
TEST_F(GroomStoreTest, nobody_waits_for_many_sessions_of_another_subject) {
  constexpr SessionId kCarl = 10;
  for (SessionId session = 1; session < kCarl; ++session) {
    store_->open(session, {7, 0}, now_ns_);
    offer(session, good_);
  }
  store_->open(kCarl, {8, 0}, now_ns_);
  offer(kCarl, good_);
  now_ns_ += 6 * kSecond_ns;
  store_->poll(now_ns_);
  EXPECT_THAT(needs(kBert), ElementsAre(good_.bytes.size())) << "Anna, of the same subject, is asked already";
  EXPECT_THAT(needs(kCarl), ElementsAre(good_.bytes.size(), 0u));
}

// All unfinished uploads have room for the large file and 100 bytes more. Bert's upload needs more, and Anna holds
// most, so her upload ends.
TEST_F(GroomStoreTest, when_bytes_are_scarce_the_session_that_holds_most_loses_an_upload) {
  const Upload large(wire::encode_groom(small_groom(2)));
  GroomStoreLimits limits;
  limits.upload_bytes_max = large.bytes.size() + 100;
  make(limits);
  offer(kAnna, large);
  EXPECT_EQ(store_->upload_bytes(), 0u) << "announced bytes hold nothing";
  chunk(kAnna, large, 0, large.bytes.size() - 1);
  offer(kBert, good_);
  EXPECT_EQ(chunk(kBert, good_, 0, 50), ErrorReason::none);
  EXPECT_EQ(chunk(kBert, good_, 50, 300), ErrorReason::none);
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_THAT(errors(kBert), IsEmpty());
  EXPECT_EQ(chunk(kBert, good_, 300, good_.bytes.size()), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

TEST_F(GroomStoreTest, a_session_alone_that_sends_too_many_bytes_is_refused) {
  GroomStoreLimits limits;
  limits.upload_bytes_max = 500;
  make(limits);
  offer(kAnna, good_);
  EXPECT_EQ(chunk(kAnna, good_, 0, 500), ErrorReason::none);
  EXPECT_THAT(errors(kAnna), IsEmpty());
  chunk(kAnna, good_, 500, 501);
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(store_->upload_bytes(), 0u);
}

// Anna has all four places, which she cannot extend; Bert takes one of hers.
TEST_F(GroomStoreTest, when_places_are_scarce_the_session_with_most_uploads_loses_one) {
  GroomStoreLimits limits;
  limits.groom_count_max = 4;
  make(limits);
  for (std::uint8_t name = 1; name <= 4; ++name)
    EXPECT_EQ(store_->offer(kAnna, {wire::GroomHash{name}, 100}, now_ns_).reason, ErrorReason::none);
  EXPECT_EQ(store_->offer(kAnna, {wire::GroomHash{5}, 100}, now_ns_).reason, ErrorReason::limit_exceeded);
  EXPECT_EQ(offer(kBert, good_), ErrorReason::none);
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(send_all(kBert, good_), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
  EXPECT_EQ(store_->groom_count(), 4u);
}

// Anna and Carl are of subject 7, so their four uploads count together. Bert, of subject 8, takes places from them
// until both subjects have two.
TEST_F(GroomStoreTest, sessions_of_one_subject_have_one_share) {
  constexpr SessionId kCarl = 3;
  GroomStoreLimits limits;
  limits.groom_count_max = 4;
  make(limits);
  store_->open(kAnna, {7, 0}, now_ns_);
  store_->open(kCarl, {7, 0}, now_ns_);
  store_->open(kBert, {8, 0}, now_ns_);
  for (std::uint8_t name = 1; name <= 2; ++name) {
    for (const SessionId session : {kAnna, kCarl}) {
      const wire::GroomHash hash{name, static_cast<std::uint8_t>(session)};
      EXPECT_EQ(store_->offer(session, {hash, 100}, now_ns_).reason, ErrorReason::none);
    }
  }
  EXPECT_EQ(store_->offer(kBert, {wire::GroomHash{9}, 100}, now_ns_).reason, ErrorReason::none);
  EXPECT_EQ(offer(kBert, good_), ErrorReason::none) << "two of its own against three of Anna and Carl";
  EXPECT_EQ(errors(kAnna).size() + errors(kCarl).size(), 2u);
  EXPECT_EQ(store_->offer(kBert, {wire::GroomHash{10}, 100}, now_ns_).reason, ErrorReason::limit_exceeded);
  EXPECT_EQ(send_all(kBert, good_), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

// A client sends one file after the other over one connection. The bytes of its first upload also count for the second:
// 100 bytes in 29 s are more than 3 a second.
TEST_F(GroomStoreTest, what_waits_for_another_upload_of_its_client_has_not_stalled) {
  GroomStoreLimits limits;
  limits.upload_bytes_per_s_min = 3;
  make(limits);
  const Upload other(wire::encode_groom(small_groom(2)));
  offer(kAnna, other);
  offer(kAnna, good_);
  for (std::size_t begin = 0; begin < 300; begin += 100) {
    now_ns_ += 29 * kSecond_ns;
    chunk(kAnna, other, begin, begin + 100);
    store_->poll(now_ns_);
  }
  EXPECT_THAT(errors(kAnna), IsEmpty());
  now_ns_ += 31 * kSecond_ns;
  store_->poll(now_ns_);
  EXPECT_EQ(errors(kAnna).size(), 2u);
}

TEST_F(GroomStoreTest, refuses_chunks_out_of_place) {
  EXPECT_EQ(chunk(kAnna, good_, 0, 10), ErrorReason::groom_unknown);
  offer(kAnna, good_);
  EXPECT_EQ(chunk(kBert, good_, 0, 10), ErrorReason::groom_unknown);
  EXPECT_EQ(chunk(kAnna, good_, 10, 20), ErrorReason::unexpected_message);
  EXPECT_EQ(chunk(kAnna, good_, 0, 0), ErrorReason::limit_exceeded);
  EXPECT_EQ(chunk(kAnna, good_, 0, 10), ErrorReason::none);
  EXPECT_EQ(chunk(kAnna, good_, 5, 15), ErrorReason::unexpected_message);
  std::vector<std::uint8_t> too_much(good_.bytes.size(), 0);
  EXPECT_EQ(store_->chunk(kAnna, {good_.hash, 10, too_much}, now_ns_).reason, ErrorReason::limit_exceeded);
  EXPECT_EQ(chunk(kAnna, good_, 10, good_.bytes.size()), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

TEST_F(GroomStoreTest, bytes_that_are_there_already_are_no_error_but_not_wanted) {
  offer(kAnna, good_);
  const wire::GroomChunk first{good_.hash, 0, {good_.bytes.begin(), good_.bytes.begin() + 100}};
  EXPECT_TRUE(store_->chunk(kAnna, first, now_ns_).was_wanted);
  // Anna's session resumes on a new connection and offers the groom again, so the server requests the rest again.
  store_->resend_states(kAnna, now_ns_);
  offer(kAnna, good_);
  EXPECT_THAT(needs(kAnna), ElementsAre(0u, 100u, 100u));
  const ChunkAnswer again = store_->chunk(kAnna, first, now_ns_);
  EXPECT_EQ(again.reason, ErrorReason::none);
  EXPECT_FALSE(again.was_wanted);
  EXPECT_EQ(chunk(kAnna, good_, 100, good_.bytes.size()), ErrorReason::none);
  EXPECT_EQ(chunk(kAnna, good_, 100, good_.bytes.size()), ErrorReason::none) << "while it waits to be built";
  build();
  EXPECT_EQ(chunk(kAnna, good_, 100, good_.bytes.size()), ErrorReason::none) << "and later";
  EXPECT_EQ(states(kAnna).back(), GroomState::ready);
}

// resend_states() is called when a session resumes. The 30 s of upload_timeout_ns begin again then: no chunk could come
// while the client was away.
TEST_F(GroomStoreTest, an_upload_does_not_stall_while_its_client_is_away_for_its_grace) {
  offer(kAnna, good_);
  now_ns_ += 29 * kSecond_ns;
  store_->resend_states(kAnna, now_ns_);
  now_ns_ += 29 * kSecond_ns;
  store_->poll(now_ns_);
  EXPECT_THAT(errors(kAnna), IsEmpty());
  now_ns_ += 2 * kSecond_ns;
  store_->poll(now_ns_);
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::limit_exceeded));
}

TEST_F(GroomStoreTest, an_offer_of_the_wrong_length_prevents_no_upload) {
  EXPECT_EQ(store_->offer(kAnna, {good_.hash, good_.bytes.size() + 1}, now_ns_).reason, ErrorReason::none);
  chunk(kAnna, good_, 0, 100);
  EXPECT_EQ(offer(kBert, good_), ErrorReason::none);
  store_->release(kAnna, now_ns_);
  EXPECT_THAT(needs(kBert), ElementsAre(good_.bytes.size(), 0u));
  EXPECT_EQ(store_->upload_bytes(), 0u);
  EXPECT_EQ(send_all(kBert, good_), ErrorReason::none);
  build();
  EXPECT_EQ(states(kBert).back(), GroomState::ready);
}

TEST_F(GroomStoreTest, bytes_of_another_hash_are_refused_and_do_not_block_the_groom_for_other_sessions) {
  offer(kAnna, good_);
  offer(kBert, good_);
  Upload wrong = good_;
  wrong.bytes[wrong.bytes.size() / 2] ^= 1;
  EXPECT_EQ(send_all(kAnna, wrong), ErrorReason::none);
  build();
  EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::groom_hash_mismatch));
  EXPECT_EQ(states(kAnna).back(), GroomState::refused);
  EXPECT_THAT(errors(kBert), IsEmpty());
  EXPECT_EQ(needs(kBert).back(), 0u);
  EXPECT_EQ(send_all(kBert, good_), ErrorReason::none);
  build();
  EXPECT_EQ(states(kBert).back(), GroomState::ready);
  EXPECT_EQ(counters_.grooms_refused_hash.value(), 1u);
}

// The bucket holds 1500 announced bytes and gains 100 a second. After the first 1000 it has 500 left; after 6 s more it
// has 1100.
TEST_F(GroomStoreTest, uploads_of_a_session_have_a_rate) {
  GroomStoreLimits limits;
  limits.upload_bytes_per_s = 100;
  limits.upload_burst_bytes = 1500;
  make(limits);
  const auto ask = [&](SessionId session, std::uint8_t name, std::uint64_t bytes) {
    return store_->offer(session, {wire::GroomHash{name}, bytes}, now_ns_).reason;
  };
  EXPECT_EQ(ask(kAnna, 1, 1000), ErrorReason::none);
  EXPECT_EQ(ask(kAnna, 1, 1000), ErrorReason::none) << "the same again is no other upload";
  EXPECT_EQ(ask(kAnna, 2, 1000), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kBert, 2, 1000), ErrorReason::none);
  EXPECT_EQ(ask(kAnna, 2, 1000), ErrorReason::none) << "another uploads it";
  EXPECT_EQ(ask(kAnna, 3, 1000), ErrorReason::limit_exceeded);
  now_ns_ += 6 * kSecond_ns;
  EXPECT_EQ(ask(kAnna, 3, 1000), ErrorReason::none);
  EXPECT_EQ(counters_.grooms_refused_rate.value(), 2u);
}

}  // namespace
}  // namespace hairnet::server
