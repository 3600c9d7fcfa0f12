#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/session_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using wire::GoodbyeReason;
using State = Session::State;

TEST_F(SessionTest, closes_without_a_hello_in_time) {
  // The Hello must come within 5 s (SessionLimits::handshake_timeout_ns).
  session_.poll(now_ns_ + 4 * kSecond_ns);
  EXPECT_FALSE(connection_->closed);
  session_.poll(now_ns_ + 6 * kSecond_ns);
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::handshake_timeout));
  EXPECT_TRUE(connection_->closed);
}

TEST_F(SessionTest, gives_signs_of_life_where_it_has_nothing_else_to_say) {
  constexpr std::int64_t kSilent_ns = std::int64_t{wire::kSilence_ms} * 1'000'000;
  session_.poll(now_ns_ + 4 * kSecond_ns);
  EXPECT_THAT(connection_->all<wire::FrameBatch>(), IsEmpty()) << "nobody is welcome yet";
  hello();
  EXPECT_TRUE(connection_->all<wire::Welcome>()[0].signs_of_life);
  std::int64_t sent_ns = now_ns_, longest_ns = 0;
  std::size_t packets = connection_->received.size();
  for (const std::int64_t end_ns = now_ns_ + 50 * kSecond_ns; now_ns_ < end_ns; now_ns_ += kSecond_ns / 10) {
    session_.poll(now_ns_);
    if (connection_->received.size() == std::exchange(packets, connection_->received.size())) continue;
    longest_ns = std::max(longest_ns, now_ns_ - std::exchange(sent_ns, now_ns_));
  }
  // A sign of life is an empty batch of frames every 2.5 s (channel::kSignOfLife_ns), which is 20 times in 50 s. A
  // third of the silence that a client allows leaves time for a late one.
  EXPECT_LE(std::max(longest_ns, now_ns_ - sent_ns), kSilent_ns / 3);
  EXPECT_LE(connection_->all<wire::FrameBatch>().size(), 20u);
  for (const wire::FrameBatch& sign : connection_->all<wire::FrameBatch>()) EXPECT_THAT(sign.frames, IsEmpty());
}

TEST_F(SessionTest, gives_no_signs_of_life_between_other_packets) {
  hello();
  for (int i = 0; i < 30; ++i) {
    now_ns_ += kSecond_ns;
    session_.send(wire::MemberLeft{5}, now_ns_);
    session_.poll(now_ns_);
  }
  EXPECT_THAT(connection_->all<wire::FrameBatch>(), IsEmpty());
}

TEST_F(SessionTest, closes_when_nothing_is_heard_for_long) {
  hello();
  const std::int64_t heard_ns = now_ns_;
  // This client has not promised signs of life, so it may be silent for 60 s (SessionLimits::idle_timeout_ns).
  for (int s = 1; s <= 61; ++s) {
    EXPECT_FALSE(connection_->closed) << s;
    session_.poll(heard_ns + s * kSecond_ns);
  }
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::idle_timeout));
}

TEST_F(SessionTest, closes_when_a_client_that_promised_signs_of_life_gives_none) {
  wire::Hello hello{wire::kProtocolVersion, "test", "", "", wire::Role::participant, 0, {}};
  hello.signs_of_life = true;
  send(hello);
  const auto poll_for = [this](int seconds) {
    for (const std::int64_t end_ns = now_ns_ + seconds * kSecond_ns; now_ns_ < end_ns; now_ns_ += kSecond_ns / 10)
      session_.poll(now_ns_);
  };
  // A client that promises signs of life is lost after 10 s of silence (kSilence_ms).
  for (int i = 0; i < 20; ++i) {
    poll_for(9);
    send(wire::PoseBatch{});
  }
  EXPECT_FALSE(connection_->closed);
  poll_for(11);
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::idle_timeout));
}

TEST_F(SessionTest, counts_no_silence_while_the_server_itself_is_stopped) {
  wire::Hello hello{wire::kProtocolVersion, "test", "", "", wire::Role::participant, 0, {}};
  hello.signs_of_life = true;
  send(hello);
  // A server that did not run for an hour, as in a suspended machine, has heard nothing because it did not read.
  session_.poll(now_ns_ + 3600 * kSecond_ns);
  EXPECT_FALSE(connection_->closed);
}

TEST_F(SessionTest, gives_signs_of_life_when_nothing_else_is_sent) {
  hello();
  const auto batches = [this] { return connection_->all<wire::FrameBatch>().size(); };
  const std::size_t before = batches();
  std::int64_t last_ns = now_ns_, longest_ns = 0;
  for (int s = 1; s <= 30; ++s) {
    const std::int64_t at_ns = now_ns_ + s * kSecond_ns;
    const std::size_t sent = batches();
    session_.poll(at_ns);
    if (batches() == sent) continue;
    longest_ns = std::max(longest_ns, at_ns - last_ns);
    last_ns = at_ns;
  }
  EXPECT_GT(batches(), before);
  EXPECT_LT(longest_ns, std::int64_t{wire::kSilence_ms} * 1'000'000 / 2);
}

TEST_F(SessionTest, closes_a_client_that_takes_nothing) {
  hello();
  connection_->is_writable = false;
  session_.outbox().push_frames({{wire::encode_packet({1, wire::FrameBatch{}}), 1}});
  session_.flush(now_ns_);
  // A full connection may make no progress for 10 s (slow_consumer_ns), and the goodbye has 2 s more
  // (drain_timeout_ns).
  session_.poll(now_ns_ + 9 * kSecond_ns);
  EXPECT_EQ(session_.state(), State::active);
  session_.poll(now_ns_ + 11 * kSecond_ns);
  EXPECT_EQ(session_.state(), State::draining);
  EXPECT_EQ(counters_.sessions_closed_by_server_slow.value(), 1u);
  EXPECT_THAT(groom_service_.released, ElementsAre(7u));
  session_.poll(now_ns_ + 14 * kSecond_ns);
  EXPECT_TRUE(connection_->closed);
}

TEST_F(SessionTest, a_client_that_takes_something_now_and_then_is_kept) {
  hello();
  for (int i = 0; i < 10; ++i) {
    connection_->is_writable = false;
    session_.outbox().push_frames({{wire::encode_packet({1, wire::FrameBatch{}}), 1}});
    session_.flush(now_ns_);
    // Eight seconds without progress are less than slow_consumer_ns (10 s).
    now_ns_ += 8 * kSecond_ns;
    session_.poll(now_ns_);
    connection_->is_writable = true;
    session_.on_writable(now_ns_);
    send(wire::SetLevel{1, LevelIndex::low});
  }
  EXPECT_EQ(session_.state(), State::active);
}

}  // namespace
}  // namespace hairnet::server
