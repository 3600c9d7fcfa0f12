#include "server/room/hands_inbox.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "schema/codec/hand_code.hpp"

namespace hairnet::server {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

// Makes a hand at x metres, with shapes of a radius of 2 cm. The number of its first shape is the name of a hand.
Hand hand_at(double x, std::uint8_t first_number = 0, std::size_t shape_count = 2, bool has_jumped = false) {
  Hand hand{first_number, {Quat::Identity(), {x, 0, 0}}, has_jumped, {}};
  for (std::size_t i = 0; i < shape_count; ++i)
    hand.shapes.push_back({Vec3::Zero(), {0, 0.01 * static_cast<double>(i), 0}, 0.02});
  return hand;
}

class HandsInboxTest : public testing::Test {
 protected:
  using Put = HandsInbox::Put;
  static constexpr std::int64_t kMs = 1'000'000, kStart_ns = 5'000'000'000;

  Put put(std::uint32_t sequence, std::int64_t at_ms, std::vector<Hand> hands) {
    const std::int64_t at_ns = kStart_ns + at_ms * kMs;
    return inbox_.put({sequence, at_ns, std::move(hands)}, at_ns);
  }
  std::vector<Hand> sample(std::int64_t at_ms) { return inbox_.sample(kStart_ns + at_ms * kMs); }
  double x(std::int64_t at_ms) {
    const std::vector<Hand> hands = sample(at_ms);
    EXPECT_THAT(hands, SizeIs(1));
    return hands.empty() ? std::numeric_limits<double>::quiet_NaN() : hands[0].place.position.x();
  }

  HandsInbox inbox_;
};

TEST_F(HandsInboxTest, has_no_hands_before_the_first_sample_came_and_those_of_the_first_at_times_before_it) {
  EXPECT_THAT(sample(0), IsEmpty());
  put(1, 0, {hand_at(3)});
  EXPECT_EQ(x(-25), 3);
}

TEST_F(HandsInboxTest, hands_move_straight_and_evenly_between_two_samples) {
  put(1, 0, {hand_at(0), hand_at(5, 8)});
  put(2, 20, {hand_at(0.2), hand_at(4, 8)});
  for (const std::int64_t at_ms : {0, 5, 10, 19, 20}) {
    const std::vector<Hand> hands = sample(at_ms);
    ASSERT_THAT(hands, SizeIs(2));
    EXPECT_NEAR(hands[0].place.position.x(), 0.01 * static_cast<double>(at_ms), 1e-12);
    EXPECT_NEAR(hands[1].place.position.x(), 5 - 0.05 * static_cast<double>(at_ms), 1e-12);
    EXPECT_FALSE(hands[0].has_jumped);
  }
}

TEST_F(HandsInboxTest, hands_turn_the_shortest_way_also_from_quaternions_of_the_other_sign) {
  Hand from = hand_at(0), to = hand_at(0);
  to.place.rotation = Quat(Eigen::AngleAxisd(0.4, Vec3::UnitY()));
  to.place.rotation.coeffs() *= -1;
  put(1, 0, {from});
  put(2, 20, {to});
  EXPECT_NEAR(sample(5)[0].place.rotation.angularDistance(Quat::Identity()), 0.1, 1e-9);
  EXPECT_NEAR(sample(15)[0].place.rotation.angularDistance(Quat::Identity()), 0.3, 1e-9);
}

TEST_F(HandsInboxTest, a_fist_opens_as_the_later_sample_says) {
  put(1, 0, {hand_at(0)});
  Hand open = hand_at(0);
  open.shapes[1].to = {0, 0, 0.09};
  put(2, 20, {open});
  EXPECT_EQ(sample(1)[0].shapes, open.shapes);
}

TEST_F(HandsInboxTest, a_mixture_of_far_and_near_hands_can_be_sent) {
  // Makes hands of one shape each, of which one half is as far away and as large as allowed. Between two samples with
  // different halves, a hand has the place of one sample and the shape of the other, so the hands take more bytes than
  // in each sample. A message must still hold them.
  const auto half_far = [](std::size_t which) {
    std::vector<Hand> hands;
    for (std::size_t i = 0; i < kHandShapesMax; ++i) {
      Hand& hand = hands.emplace_back(hand_at(0, static_cast<std::uint8_t>(i), 1));
      if (i / (kHandShapesMax / 2) != which) continue;
      hand.place.position.setConstant(-kHandPlaceMax_m);
      hand.shapes = {{Vec3::Constant(kHandSizeMax_m), Vec3::Constant(-kHandSizeMax_m), kHandSizeMax_m}};
    }
    return hands;
  };
  for (std::uint32_t i = 0; i < 3; ++i) put(i, 20 * i, half_far(i % 2));
  for (const std::int64_t at_ms : {10, 30}) {
    const std::vector<Hand> hands = sample(at_ms);
    EXPECT_GT(codec::encode_hands(hands).size(), codec::encode_hands(half_far(0)).size());
    const std::vector<std::uint8_t> packet = wire::encode_packet({0, wire::RoomHands{1, 0, {{9, hands}}}});
    const wire::DecodedPacket decoded = wire::decode_packet(packet);
    ASSERT_EQ(decoded.error, wire::DecodeError::none) << decoded.detail;
    EXPECT_THAT(std::get<wire::RoomHands>(decoded.envelope.message).people.at(0).hands, SizeIs(kHandShapesMax));
  }
}

TEST_F(HandsInboxTest, hands_stay_after_the_newest_sample_and_are_gone_half_a_second_later) {
  put(1, 0, {hand_at(0)});
  put(2, 20, {hand_at(0.2)});
  EXPECT_EQ(x(50), 0.2) << "they are not extrapolated";
  // Hands stay for 500 ms (kGone_ns) after the newest sample, at 20 ms.
  EXPECT_EQ(x(520), 0.2);
  EXPECT_THAT(sample(521), IsEmpty());
  put(3, 1000, {hand_at(9)});
  EXPECT_THAT(sample(999), IsEmpty()) << "they do not come back between";
  EXPECT_EQ(x(1000), 9);
}

TEST_F(HandsInboxTest, a_hand_comes_and_goes_at_the_time_of_the_sample_that_says_so) {
  put(1, 0, {hand_at(1)});
  put(2, 20, {hand_at(1), hand_at(2, 8)});
  put(3, 40, {hand_at(2, 8)});
  put(4, 60, {});
  EXPECT_THAT(sample(19), SizeIs(1));
  EXPECT_THAT(sample(20), SizeIs(2));
  EXPECT_THAT(sample(39), SizeIs(2));
  EXPECT_THAT(sample(40), SizeIs(1));
  EXPECT_THAT(sample(60), IsEmpty());
}

// A hand whose shapes cannot be paired with those of the sample before must not move: it stays, and jumps.
TEST_F(HandsInboxTest, a_hand_with_another_count_of_shapes_is_another_hand) {
  put(1, 0, {hand_at(0)});
  put(2, 20, {hand_at(1, 0, 5)});
  EXPECT_EQ(x(10), 0);
  EXPECT_THAT(sample(10)[0].shapes, SizeIs(2));
  EXPECT_TRUE(sample(20)[0].has_jumped);
  EXPECT_THAT(sample(20)[0].shapes, SizeIs(5));
}

TEST_F(HandsInboxTest, a_jump_happens_at_its_time_and_is_reported_once_to_the_hand_that_made_it) {
  put(1, 0, {hand_at(0), hand_at(5, 8)});
  put(2, 20, {hand_at(10, 0, 2, true), hand_at(5, 8)});
  put(3, 40, {hand_at(10), hand_at(5, 8)});
  EXPECT_EQ(sample(19)[0].place.position.x(), 0);
  EXPECT_FALSE(sample(19)[0].has_jumped);
  const std::vector<Hand> after = sample(21);
  EXPECT_EQ(after[0].place.position.x(), 10);
  EXPECT_TRUE(after[0].has_jumped);
  EXPECT_FALSE(after[1].has_jumped);
  EXPECT_FALSE(sample(22)[0].has_jumped);
  EXPECT_FALSE(sample(41)[0].has_jumped);
}

TEST_F(HandsInboxTest, no_jump_is_missed_between_two_ticks) {
  put(1, 0, {hand_at(0)});
  EXPECT_FALSE(sample(0)[0].has_jumped);
  put(2, 10, {hand_at(5, 0, 2, true)});
  put(3, 20, {hand_at(5)});
  put(4, 30, {});
  put(5, 40, {hand_at(5)});
  EXPECT_TRUE(sample(25)[0].has_jumped);
  EXPECT_FALSE(sample(25)[0].has_jumped);
  EXPECT_TRUE(sample(45)[0].has_jumped) << "it was away";
  EXPECT_FALSE(sample(45)[0].has_jumped);
}

TEST_F(HandsInboxTest, jumps_survive_a_full_inbox_and_samples_that_come_too_late) {
  put(1, 0, {hand_at(0)});
  EXPECT_FALSE(sample(0)[0].has_jumped);
  put(2, 1, {hand_at(5, 0, 2, true)});
  // An inbox holds 32 samples (kSamplesMax), so the one with the jump is dropped before it is sampled.
  for (std::uint32_t i = 3; i < 60; ++i) put(i, i, {hand_at(5)});
  EXPECT_TRUE(sample(100)[0].has_jumped);
  // Sample 65 tells of a jump and arrives after sample 70. Without its jump, the hand would move through all hair
  // between 5 m and 9 m.
  put(70, 200, {hand_at(5)});
  EXPECT_FALSE(sample(200)[0].has_jumped);
  EXPECT_EQ(put(65, 190, {hand_at(9, 0, 2, true)}), Put::out_of_order);
  put(71, 210, {hand_at(9)});
  EXPECT_TRUE(sample(210)[0].has_jumped);
}

// The tick samples at a time in the past. At 120 Hz, 25 samples cover 200 ms, which the inbox must still have.
TEST_F(HandsInboxTest, hands_of_120_hz_are_there_200_ms_later) {
  const auto x_at = [](std::uint32_t i) { return 0.01 * i * i; };
  for (std::uint32_t i = 0; i <= 60; ++i) {
    put(i, 8 * i, {hand_at(x_at(i))});
    if (i >= 25) {
      EXPECT_EQ(x(8 * (i - 25)), x_at(i - 25));
    }
  }
}

TEST_F(HandsInboxTest, ended_hands_are_gone_at_once_and_older_samples_do_not_bring_them_back) {
  put(5, 0, {hand_at(0)});
  put(6, 20, {hand_at(1)});
  inbox_.end();
  for (const std::int64_t at_ms : {-1, 10, 20, 100}) EXPECT_THAT(sample(at_ms), IsEmpty());
  EXPECT_EQ(put(6, 30, {hand_at(0)}), Put::out_of_order);
  EXPECT_EQ(put(7, 40, {hand_at(0)}), Put::accepted);
  EXPECT_THAT(sample(40), SizeIs(1));
}

TEST_F(HandsInboxTest, rejects_samples_that_are_not_newer_and_takes_sequences_that_wrap) {
  EXPECT_EQ(put(0xffffffff, 100, {}), Put::accepted);
  EXPECT_EQ(put(0xffffffff, 110, {}), Put::out_of_order);
  EXPECT_EQ(put(0xfffffffe, 120, {}), Put::out_of_order);
  EXPECT_EQ(put(0, 100, {}), Put::out_of_order);
  EXPECT_EQ(put(0, 101, {}), Put::accepted);
}

// The limits are those of poses: kAgeMax_ns and kLeadMax_ns of pose_inbox.hpp.
TEST_F(HandsInboxTest, rejects_samples_from_more_than_a_second_away) {
  const std::int64_t now_ns = kStart_ns + 10'000 * kMs;
  const auto at = [&](std::int64_t at_ms) { return wire::HandsSample{1, kStart_ns + at_ms * kMs, {}}; };
  EXPECT_EQ(inbox_.put(at(8'999), now_ns), Put::stale);
  EXPECT_EQ(inbox_.put(at(11'001), now_ns), Put::future);
  EXPECT_EQ(inbox_.put(at(9'001), now_ns), Put::accepted);
}

TEST_F(HandsInboxTest, any_valid_samples_give_valid_hands_at_any_times) {
  std::mt19937 random(5);
  const auto chance = [&](unsigned percent) { return random() % 100 < percent; };
  std::uniform_real_distribution<double> any(-1, 1);
  std::int64_t sampled_ms = 0;
  std::size_t hand_count = 0;
  for (std::uint32_t i = 1; i < 3000; ++i) {
    std::vector<Hand> hands;
    for (std::size_t next = random() % 9; next < kHandShapesMax && !chance(25);) {
      const std::size_t shape_count = 1 + random() % std::min<std::size_t>(4, kHandShapesMax - next);
      Hand& hand = hands.emplace_back(hand_at(0, static_cast<std::uint8_t>(next), shape_count, chance(10)));
      hand.place.position = kHandPlaceMax_m * Vec3(any(random), any(random), any(random));
      const Vec3 axis(any(random), any(random), any(random) + 2);
      hand.place.rotation = Quat(Eigen::AngleAxisd(4 * any(random), axis.normalized()));
      // A rotation may be off unit length by 1e-3 (hand.hpp).
      hand.place.rotation.coeffs() *= 1 + 9e-4 * any(random);
      next += shape_count + random() % 3;
    }
    ASSERT_EQ(validate(hands), "");
    const std::int64_t at_ms = 11 * i + static_cast<std::int64_t>(random() % 10) + (chance(1) ? 400 : 0);
    put(i, at_ms, hands);
    for (; sampled_ms < at_ms - 25; sampled_ms += 33) {
      const std::vector<Hand> sampled = sample(sampled_ms);
      ASSERT_EQ(validate(sampled), "");
      hand_count += sampled.size();
    }
  }
  // With few hands in the samples, the test would check nothing.
  EXPECT_GT(hand_count, 500u);
}

}  // namespace
}  // namespace hairnet::server
