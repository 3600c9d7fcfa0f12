#include "server/room/frame_throttle.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hairnet::server {
namespace {

constexpr double kThrottledTick_s = 1.0 / 30;

// Simulates a connection at 30 ticks a second. A frame has 25 bytes of pose and 80 of hair; each doubling of the error
// (an octave) leaves 0.65 of the bytes of hair. So a frame has 105 bytes as wanted, and 47 at the coarsest rung of
// three octaves.
class ThrottledRoom {
 public:
  explicit ThrottledRoom(int characters) : characters_(characters) {}

  void run(double duration_s, double client_bytes_per_s, double network_bytes_per_s = 0) {
    sent_ = 0;
    changes_ = 0;
    const auto ticks = static_cast<int>(std::lround(duration_s / kThrottledTick_s));
    for (int t = 0; t < ticks; ++t, ++tick_) {
      const int octaves = throttle_.coarser_octaves(), stride = throttle_.stride();
      const double bytes = tick_ % stride == 0 ? characters_ * (25 + 80 * std::pow(0.65, octaves)) : 0;
      sent_ += bytes;
      throttle_.end_tick(static_cast<std::size_t>(bytes), kThrottledTick_s, client_bytes_per_s, network_bytes_per_s);
      if (octaves != throttle_.coarser_octaves() || stride != throttle_.stride()) ++changes_;
    }
    rate_ = sent_ / duration_s;
  }
  // The bytes a second of the last run.
  [[nodiscard]] double rate() const { return rate_; }
  // The number of changes of the rung in the last run.
  [[nodiscard]] int changes() const { return changes_; }
  [[nodiscard]] FrameThrottle& throttle() { return throttle_; }

 private:
  FrameThrottle throttle_;
  int characters_, tick_ = 0, changes_ = 0;
  double sent_ = 0, rate_ = 0;
};

TEST(FrameThrottle, leaves_frames_as_wanted_without_a_bound) {
  ThrottledRoom room(100);
  room.run(10, 0);
  EXPECT_EQ(room.changes(), 0);
  EXPECT_EQ(room.throttle().coarser_octaves(), 0);
  EXPECT_EQ(room.throttle().stride(), 1);
}

TEST(FrameThrottle, keeps_a_bound_that_it_can_keep_and_stays_there) {
  // The coarsest rung also sends at every fourth tick only (kRungs in frame_throttle.cpp).
  const double wanted = 10 * 105 / kThrottledTick_s, least = 10 * 47 / kThrottledTick_s / 4;
  for (const double share : {0.9, 0.75, 0.6, 0.5, 0.4, 0.3, 0.2}) {
    const double bound = share * wanted;
    ASSERT_GT(bound, least);
    ThrottledRoom room(10);
    // The throttle has 4 s, ten of its windows, to find its rung; then the rate of 20 s counts.
    room.run(4, bound);
    room.run(20, bound);
    EXPECT_LE(room.rate(), bound) << share;
    // Rungs are up to a factor of 2 apart, and a finer one must fit with a reserve of 10 % (kReserve), so a part of the
    // bound stays unused.
    EXPECT_GT(room.rate(), 0.4 * bound) << share;
    EXPECT_EQ(room.changes(), 0) << share;
  }
}

TEST(FrameThrottle, leaves_a_part_of_what_the_network_carries_to_others) {
  const double wanted = 10 * 105 / kThrottledTick_s;
  for (const double share : {1.2, 0.9, 0.6, 0.4}) {
    ThrottledRoom room(10);
    room.run(4, 0, share * wanted);
    room.run(20, 0, share * wanted);
    // Frames may take 0.8 of what the network carries (kNetworkShare).
    EXPECT_LE(room.rate(), 0.81 * share * wanted) << share;
    EXPECT_GT(room.rate(), 0.3 * share * wanted) << share;
    EXPECT_EQ(room.changes(), 0) << share;
  }
}

TEST(FrameThrottle, keeps_to_the_lesser_of_what_the_client_asks_for_and_the_network_carries) {
  const double wanted = 10 * 105 / kThrottledTick_s;
  for (const bool is_client_less : {false, true}) {
    ThrottledRoom room(10);
    room.run(4, is_client_less ? 0.4 * wanted : wanted, is_client_less ? 2 * wanted : 0.5 * wanted);
    room.run(10, is_client_less ? 0.4 * wanted : wanted, is_client_less ? 2 * wanted : 0.5 * wanted);
    // Either the client asks for 0.4, or the network carries 0.5, of which frames may take 0.8: both bounds are 0.4 of
    // what is wanted.
    EXPECT_LE(room.rate(), 0.41 * wanted);
  }
}

TEST(FrameThrottle, follows_a_network_that_changes) {
  const double wanted = 10 * 105 / kThrottledTick_s;
  ThrottledRoom room(10);
  room.run(4, 0, 3 * wanted);
  EXPECT_EQ(room.throttle().coarser_octaves(), 0);
  room.run(4, 0, 0.3 * wanted);
  EXPECT_LE(room.rate(), 0.5 * wanted);
  room.run(4, 0, 3 * wanted);
  EXPECT_EQ(room.throttle().coarser_octaves(), 0);
  EXPECT_EQ(room.throttle().stride(), 1);
}

TEST(FrameThrottle, comes_as_near_as_it_can_to_a_bound_that_is_too_small) {
  ThrottledRoom room(10);
  room.run(10, 1);
  EXPECT_EQ(room.throttle().coarser_octaves(), 3);
  EXPECT_EQ(room.throttle().stride(), 4);
}

TEST(FrameThrottle, makes_hair_coarser_before_it_leaves_out_ticks) {
  ThrottledRoom room(10);
  for (const double share : {0.9, 0.75, 0.6, 0.5}) {
    room.run(4, share * 10 * 105 / kThrottledTick_s);
    EXPECT_EQ(room.throttle().stride(), 1) << share;
    EXPECT_GT(room.throttle().coarser_octaves(), 0) << share;
  }
}

TEST(FrameThrottle, sends_as_wanted_again_when_the_bound_is_gone) {
  ThrottledRoom room(10);
  room.run(10, 1);
  room.run(4, 0);
  EXPECT_EQ(room.throttle().coarser_octaves(), 0);
  EXPECT_EQ(room.throttle().stride(), 1);
}

// After a loss the connection is taken to carry 0.7 of what was sent (kLostShare). The estimate grows by 5 % in each
// window of 0.4 s, so after 20 s frames are as wanted again.
TEST(FrameThrottle, sends_less_than_what_a_connection_lost_and_then_tries_more_again) {
  ThrottledRoom room(10);
  room.run(2, 0);
  const double lost = room.rate();
  room.throttle().on_lost_frames();
  room.run(1.5, 0);
  room.run(1, 0);
  EXPECT_LT(room.rate(), 0.85 * lost);
  room.run(20, 0);
  EXPECT_EQ(room.throttle().coarser_octaves(), 0);
  EXPECT_EQ(room.throttle().stride(), 1);
}

// Each loss makes frames coarser by a rung; six losses reach the last of six rungs.
TEST(FrameThrottle, sends_least_while_a_connection_loses_frames_again_and_again) {
  ThrottledRoom room(10);
  for (int loss = 0; loss < 6; ++loss) {
    room.throttle().on_lost_frames();
    room.run(0.2, 0);
  }
  EXPECT_EQ(room.throttle().stride(), 4);
  EXPECT_LT(room.rate(), 10 * 105 / kThrottledTick_s / 4);
}

}  // namespace
}  // namespace hairnet::server
