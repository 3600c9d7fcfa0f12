#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/session/message_price.hpp"
#include "tests/unit/server/session_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using wire::ErrorReason;
using wire::GoodbyeReason;
using State = Session::State;

// In these tests a client may send 10 messages in a second and 40 at once (small_limits() in session_fixture.hpp).
TEST_F(SessionTest, closes_a_client_above_the_message_rate) {
  hello();
  for (int i = 0; i < 100; ++i) send(wire::SetLevel{1, LevelIndex::low});
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::over_rate));
  EXPECT_TRUE(connection_->closed);
  EXPECT_EQ(counters_.messages_refused_over_rate.value(), 1u);
}

TEST_F(SessionTest, groom_bytes_that_were_not_requested_count_as_messages) {
  hello();
  for (int i = 0; i < 100; ++i) send(wire::GroomChunk{groom_service_.known, 0, std::vector<std::uint8_t>(5000)});
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::over_rate));
  EXPECT_LE(errors().size(), 40u);
}

TEST_F(SessionTest, keeps_a_client_at_the_message_rate) {
  hello();
  for (int i = 0; i < 100; ++i) {
    now_ns_ += kSecond_ns / 10;
    send(wire::SetLevel{1, LevelIndex::low});
  }
  EXPECT_THAT(goodbyes(), IsEmpty());
}

TEST_F(SessionTest, more_work_than_a_client_may_ask_for_is_refused_and_plain_messages_still_pass) {
  hello();
  const auto ask = [&] {
    // Each wind costs as much as 4 plain messages (message_price.hpp).
    for (int i = 0; i < 8; ++i) send(wire::SetWind{});
  };
  ask();
  const std::size_t passed = requests<wire::SetWind>().size();
  // A quarter of the 40 is left for plain messages (kPlainReserve in session_messages.cpp), so at most 7 winds pass.
  EXPECT_GE(passed, 4u);
  EXPECT_LE(passed, 7u);
  EXPECT_THAT(errors(), testing::AllOf(testing::SizeIs(8 - passed), testing::Each(ErrorReason::limit_exceeded)));
  EXPECT_EQ(counters_.messages_refused_work.value(), 8 - passed);
  for (int i = 0; i < 10; ++i) send(wire::PoseBatch{});
  EXPECT_EQ(session_.state(), State::active);
  now_ns_ += 2 * kSecond_ns;
  send(wire::SetWind{});
  EXPECT_EQ(requests<wire::SetWind>().size(), 1u) << "later there is time for it";
}

TEST_F(SessionTest, appearances_count_against_the_rate_of_messages) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  for (int i = 0; i < 1000 && session_.state() == State::active; ++i) send(wire::SetAppearance{1, "Ann", {}});
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::over_rate));
}

TEST_F(SessionTest, an_appearance_costs_more_in_a_room_of_many) {
  CountsByName rooms;
  const auto price = [&] { return price_of(wire::SetAppearance{}, rooms, "hall"); };
  const double alone = price();
  for (int i = 0; i < 256; ++i) rooms.enter("hall");
  // 64 sessions that hear of a change cost as much as a plain message.
  EXPECT_GE(price(), alone + 4);
}

TEST_F(SessionTest, a_new_tag_is_refused_while_memory_is_full) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  context_.is_memory_full = [] { return true; };
  send(wire::SetAppearance{1, "Ann", {}});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(counters_.messages_refused_memory.value(), 1u);
  EXPECT_THAT(requests<wire::SetAppearance>(), IsEmpty());
  send(wire::SetAppearance{1, "", wire::Appearance{}});
  EXPECT_EQ(requests<wire::SetAppearance>().size(), 1u) << "it frees memory";
}

TEST_F(SessionTest, no_message_costs_more_than_a_client_can_save_up) {
  hello();
  const std::string room = connection_->all<wire::Welcome>().at(0).room;
  // Each of 6400 sessions hears of a new character, which would cost 100 plain messages. A client can save up 40.
  for (int i = 0; i < 6400; ++i) context_.rooms.enter(room);
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  EXPECT_THAT(errors(), IsEmpty());
  EXPECT_EQ(requests<wire::AddCharacter>().size(), 1u);
}

}  // namespace
}  // namespace hairnet::server
