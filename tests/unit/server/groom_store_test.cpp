#include "server/tick/groom_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "schema/wire/groom_file.hpp"
#include "small_groom.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using wire::ErrorReason;
using wire::GroomState;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr SessionId kAnna = 1, kBert = 2;

struct Upload {
  explicit Upload(std::vector<std::uint8_t> b) : bytes(std::move(b)), hash(wire::hash_groom(bytes)) {}
  std::vector<std::uint8_t> bytes;
  wire::GroomHash hash;
};

class GroomStoreTest : public testing::Test {
 protected:
  GroomStoreTest() { make({}); }
  void make(GroomStoreLimits limits) {
    builder_ = std::make_unique<GroomBuilder>(limits.groom, limits.build_queue_max, false);
    store_ = std::make_unique<GroomStore>(limits, *builder_, commands_, counters_,
                                          [this](SessionId session, const wire::Message& message, std::int64_t) {
                                            told_.emplace_back(session, message);
                                          });
  }
  ErrorReason offer(SessionId session, const Upload& upload) {
    return store_->offer(session, {upload.hash, upload.bytes.size()}, now_ns_).reason;
  }
  ErrorReason chunk(SessionId session, const Upload& upload, std::size_t from, std::size_t to) {
    return store_
        ->chunk(session, {upload.hash, from, {upload.bytes.begin() + from, upload.bytes.begin() + to}}, now_ns_)
        .reason;
  }
  ErrorReason send_all(SessionId session, const Upload& upload) {
    return chunk(session, upload, 0, upload.bytes.size());
  }
  void build() {
    while (builder_->poll()) {
    }
    store_->poll(now_ns_);
  }
  template <class T>
  [[nodiscard]] std::vector<T> told(SessionId session) const {
    std::vector<T> found;
    for (const auto& [to, message] : told_) {
      if (to != session) continue;
      if (const T* m = std::get_if<T>(&message)) found.push_back(*m);
    }
    return found;
  }
  [[nodiscard]] std::vector<GroomState> states(SessionId session) const {
    std::vector<GroomState> found;
    for (const auto& status : told<wire::GroomStatus>(session)) found.push_back(status.state);
    return found;
  }
  [[nodiscard]] std::vector<std::uint64_t> needs(SessionId session) const {
    std::vector<std::uint64_t> found;
    for (const auto& need : told<wire::GroomNeed>(session)) found.push_back(need.offset);
    return found;
  }
  [[nodiscard]] std::vector<ErrorReason> errors(SessionId session) const {
    std::vector<ErrorReason> found;
    for (const auto& error : told<wire::Error>(session)) found.push_back(error.reason);
    return found;
  }
  std::size_t ready_commands() {
    std::vector<Command> taken;
    commands_.take_all(taken);
    return static_cast<std::size_t>(std::count_if(
        taken.begin(), taken.end(), [](const Command& c) { return std::holds_alternative<GroomReady>(c); }));
  }

  Upload good_{wire::encode_groom(small_groom())};
  CommandQueue commands_{1000};
  GroomCounters counters_;
  std::vector<std::pair<SessionId, wire::Message>> told_;
  std::unique_ptr<GroomBuilder> builder_;
  std::unique_ptr<GroomStore> store_;
  std::int64_t now_ns_ = 0;
};

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
  EXPECT_GT(store_->level_bytes(), 1000u);
}

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

TEST_F(GroomStoreTest, when_the_uploader_leaves_the_next_goes_on_from_there) {
  offer(kAnna, good_);
  offer(kBert, good_);
  chunk(kAnna, good_, 0, 100);
  store_->release(kAnna, now_ns_);
  EXPECT_THAT(needs(kBert), ElementsAre(good_.bytes.size(), 100u));
  EXPECT_EQ(chunk(kBert, good_, 100, good_.bytes.size()), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

TEST_F(GroomStoreTest, an_unfinished_upload_goes_with_its_only_session) {
  offer(kAnna, good_);
  chunk(kAnna, good_, 0, 100);
  EXPECT_EQ(store_->upload_bytes(), good_.bytes.size());
  store_->release(kAnna, now_ns_);
  EXPECT_EQ(store_->upload_bytes(), 0u);
  EXPECT_EQ(store_->groom_count(), 0u);
}

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

TEST_F(GroomStoreTest, refuses_chunks_out_of_place) {
  EXPECT_EQ(chunk(kAnna, good_, 0, 10), ErrorReason::groom_unknown);
  offer(kAnna, good_);
  EXPECT_EQ(chunk(kBert, good_, 0, 10), ErrorReason::groom_unknown);
  EXPECT_EQ(chunk(kAnna, good_, 10, 20), ErrorReason::unexpected_message);
  EXPECT_EQ(chunk(kAnna, good_, 0, 0), ErrorReason::limit_exceeded);
  EXPECT_EQ(chunk(kAnna, good_, 0, 10), ErrorReason::none);
  EXPECT_EQ(chunk(kAnna, good_, 0, 10), ErrorReason::unexpected_message);
  std::vector<std::uint8_t> too_much(good_.bytes.size(), 0);
  EXPECT_EQ(store_->chunk(kAnna, {good_.hash, 10, too_much}, now_ns_).reason, ErrorReason::limit_exceeded);
  EXPECT_EQ(chunk(kAnna, good_, 10, good_.bytes.size()), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(good_.hash));
}

TEST_F(GroomStoreTest, bytes_of_another_hash_are_refused_and_do_not_spoil_the_groom_for_others) {
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

TEST_F(GroomStoreTest, bytes_that_are_no_groom_are_refused_with_a_reason) {
  const Upload junk(std::vector<std::uint8_t>(500, 7));
  Groom bald = small_groom();
  bald.points.clear();
  bald.strands.clear();
  bald.strand_begin = {0};
  const Upload no_hair(wire::encode_groom(bald));
  for (const Upload* upload : {&junk, &no_hair}) {
    told_.clear();
    offer(kAnna, *upload);
    send_all(kAnna, *upload);
    build();
    EXPECT_THAT(errors(kAnna), ElementsAre(ErrorReason::groom_invalid));
    EXPECT_FALSE(told<wire::Error>(kAnna)[0].detail.empty());
    EXPECT_EQ(states(kAnna).back(), GroomState::refused);
    EXPECT_EQ(store_->hold(kAnna, upload->hash).reason, ErrorReason::groom_unknown);
  }
  EXPECT_EQ(store_->groom_count(), 0u);
  EXPECT_EQ(store_->upload_bytes(), 0u);
  EXPECT_EQ(counters_.grooms_refused_invalid.value(), 2u);
}

TEST_F(GroomStoreTest, refuses_offers_beyond_its_bounds) {
  GroomStoreLimits limits;
  limits.groom_bytes_max = 1000;
  limits.upload_bytes_max = 1500;
  limits.grooms_per_session_max = 2;
  make(limits);
  const auto ask = [&](SessionId session, std::uint8_t name, std::uint64_t bytes) {
    return store_->offer(session, {wire::GroomHash{name}, bytes}, now_ns_).reason;
  };
  EXPECT_EQ(ask(kAnna, 1, 0), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kAnna, 1, 1001), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kAnna, 1, ~std::uint64_t{0}), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kAnna, 1, 1000), ErrorReason::none);
  EXPECT_EQ(ask(kAnna, 2, 501), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kAnna, 2, 400), ErrorReason::none);
  EXPECT_EQ(ask(kAnna, 3, 1), ErrorReason::limit_exceeded);
  EXPECT_EQ(ask(kBert, 1, 999), ErrorReason::groom_hash_mismatch);
}

TEST_F(GroomStoreTest, a_full_build_queue_refuses_and_can_be_asked_again) {
  GroomStoreLimits limits;
  limits.build_queue_max = 1;
  make(limits);
  const Upload other(wire::encode_groom(small_groom(2)));
  offer(kAnna, good_);
  send_all(kAnna, good_);
  offer(kAnna, other);
  EXPECT_EQ(send_all(kAnna, other), ErrorReason::groom_build_queue_full);
  build();
  EXPECT_EQ(offer(kAnna, other), ErrorReason::none);
  EXPECT_EQ(send_all(kAnna, other), ErrorReason::none);
  build();
  EXPECT_TRUE(store_->ready(other.hash));
}

TEST_F(GroomStoreTest, levels_nobody_holds_make_room_for_others_and_held_ones_stay) {
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
  EXPECT_TRUE(store_->ready(good_.hash));  // kept, as there is room
  offer(kBert, other);
  send_all(kBert, other);
  build();
  EXPECT_TRUE(store_->ready(other.hash));
  EXPECT_FALSE(store_->ready(good_.hash));
  EXPECT_EQ(counters_.grooms_evicted.value(), 1u);
  EXPECT_LE(store_->level_bytes(), limits.level_bytes_max);
}

}  // namespace
}  // namespace hairnet::server
