#include "client/link/requested_wind.hpp"

#include <gtest/gtest.h>

namespace hairnet::link {
namespace {

constexpr std::uint64_t kOurs = 5, kAnother = 99;

wire::RoomWind announced(double x, std::uint64_t session) {
  return {{Vec3(x, 0, 0)}, session};
}

// RequestedWind decides whether a client sends its wind again after a reconnect: it does as long as no other client
// has set one since. The client's own session is kOurs, another client's is kAnother, and 0 stands for the server's
// own setting.
class RequestedWindTest : public testing::Test {
 protected:
  // welcome() lets a welcome arrive, and tell() a RoomWind. They return the speed of the wind that the client sends
  // in answer, m/s; 0 means that it sends none.
  double welcome(bool may_set = true) { return speed(wind_.on_welcome(may_set)); }
  double tell(double x, std::uint64_t session) { return speed(wind_.on_announced(announced(x, session), kOurs)); }
  void set(double x) { wind_.set(wire::SetWind{{Vec3(x, 0, 0)}}); }
  // Sets a wind, and lets the server confirm it.
  void settle(double x) {
    welcome();
    tell(0, 0);
    set(x);
    tell(x, kOurs);
  }
  RequestedWind wind_;

 private:
  static double speed(const wire::SetWind* wind) { return wind ? wind->wind.mean_m_per_s.x() : 0; }
};

TEST_F(RequestedWindTest, of_a_client_that_has_set_none_is_none) {
  EXPECT_EQ(welcome(), 0);
  EXPECT_EQ(tell(0, 0), 0);
  EXPECT_EQ(tell(3, kAnother), 0);
  EXPECT_EQ(welcome(), 0);
  EXPECT_EQ(tell(3, kAnother), 0);
}

TEST_F(RequestedWindTest, is_set_again_on_a_server_that_has_its_own_setting) {
  settle(9);
  EXPECT_EQ(welcome(), 0) << "the room may have another one by now";
  EXPECT_EQ(tell(0, 0), 9);
  EXPECT_EQ(tell(9, kOurs), 0) << "once";
}

TEST_F(RequestedWindTest, stays_replaced) {
  settle(9);
  tell(4, kAnother);
  welcome();
  EXPECT_EQ(tell(0, 0), 0);
}

TEST_F(RequestedWindTest, that_was_replaced_during_the_outage_stays_so) {
  for (const std::uint64_t by : {kAnother, wire::RoomWind::kOfEarlierServer}) {
    settle(9);
    EXPECT_EQ(welcome(), 0);
    EXPECT_EQ(tell(4, by), 0);
    EXPECT_EQ(welcome(), 0);
    EXPECT_EQ(tell(0, 0), 0);
  }
}

TEST_F(RequestedWindTest, that_is_set_after_anothers_is_the_newest) {
  settle(3);
  set(9);
  // The wind of another client is announced while ours is on its way, so ours is the newer one.
  tell(4, kAnother);
  tell(9, kOurs);
  welcome();
  EXPECT_EQ(tell(0, 0), 9);
}

TEST_F(RequestedWindTest, that_is_set_without_a_session_is_sent_whoever_has_set_one) {
  settle(3);
  set(9);
  EXPECT_EQ(welcome(), 9);
  EXPECT_EQ(tell(4, kAnother), 0);
  tell(9, kOurs);
  welcome();
  EXPECT_EQ(tell(0, 0), 9);
}

TEST_F(RequestedWindTest, that_may_have_been_lost_is_sent_until_the_server_tells_a_wind) {
  welcome();
  tell(0, 0);
  set(9);
  EXPECT_EQ(welcome(), 9);
  EXPECT_EQ(welcome(), 9) << "before it was told anything";
  EXPECT_EQ(tell(4, kAnother), 0);
  tell(9, kOurs);
  EXPECT_EQ(welcome(), 0);
}

TEST_F(RequestedWindTest, goes_along_to_the_next_server) {
  settle(9);
  wind_.on_sent_on();
  EXPECT_EQ(welcome(), 9);
  EXPECT_EQ(tell(4, wire::RoomWind::kOfEarlierServer), 0) << "kept before ours";
}

TEST_F(RequestedWindTest, that_was_replaced_does_not_go_along) {
  settle(9);
  tell(4, kAnother);
  wind_.on_sent_on();
  EXPECT_EQ(welcome(), 0);
}

TEST_F(RequestedWindTest, that_may_not_be_set_is_not_sent) {
  settle(9);
  EXPECT_EQ(welcome(false), 0);
  EXPECT_EQ(tell(0, 0), 0);
  set(8);
  EXPECT_EQ(welcome(false), 0);
  EXPECT_EQ(tell(0, 0), 0);
  EXPECT_EQ(welcome(), 8) << "once it may be";
}

}  // namespace
}  // namespace hairnet::link
