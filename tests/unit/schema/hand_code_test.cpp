#include "schema/codec/hand_code.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "schema/limits.hpp"
#include "tests/support/random_messages.hpp"

namespace hairnet::codec {
namespace {

// Makes a hand of six capsules: a palm of two, and four fingers.
Hand open_hand(const Vec3& at) {
  Hand hand{.place = {Quat(Eigen::AngleAxisd(2, Vec3(1, 2, 3).normalized())), at}};
  for (const double x : {-0.02, 0.02}) hand.shapes.push_back({{x, 0, 0}, {x, 0.08, 0}, 0.018});
  for (const double x : {-0.035, -0.012, 0.012, 0.035}) hand.shapes.push_back({{x, 0.09, 0}, {x, 0.16, 0.01}, 0.009});
  return hand;
}

// Two such hands at 30 Hz are 3.6 kB a second, in the order of a head's frames.
TEST(HandCode, a_hand_of_six_capsules_takes_at_most_60_bytes) {
  EXPECT_LE(encode_hands(std::vector{open_hand({12.3, 1.4, -25})}).size(), 60u);
}

TEST(HandCode, errs_by_half_a_millimetre_anywhere) {
  wire::RandomMessages random(7);
  for (int i = 0; i < 500; ++i) {
    const Vec3 at(random.real(-9999, 9999), random.real(-9999, 9999), random.real(-9999, 9999));
    Hand hand = open_hand(at);
    hand.place.rotation = Quat(Eigen::AngleAxisd(random.real(0, 3.1), Vec3(at.y(), at.x(), at.z()).normalized()));
    for (HandShape& shape : hand.shapes) shape.to.x() += random.real(-0.05, 0.05);
    const Hand coded = rounded_to_wire(std::vector{hand}).front();
    EXPECT_LE((coded.place.position - at).cwiseAbs().maxCoeff(), kHandStep_m / 2 + 1e-9);
    // The code of rotations promises 0.25 mrad (pose_code.hpp).
    EXPECT_LE(coded.place.rotation.angularDistance(hand.place.rotation), 0.25e-3);
    ASSERT_EQ(coded.shapes.size(), hand.shapes.size());
    for (std::size_t s = 0; s < hand.shapes.size(); ++s) {
      EXPECT_LE((coded.shapes[s].from - hand.shapes[s].from).cwiseAbs().maxCoeff(), kHandStep_m / 2 + 1e-9);
      EXPECT_LE((coded.shapes[s].to - hand.shapes[s].to).cwiseAbs().maxCoeff(), kHandStep_m / 2 + 1e-9);
      EXPECT_LE(std::abs(coded.shapes[s].radius_m - hand.shapes[s].radius_m), kHandStep_m / 2 + 1e-9);
    }
  }
}

TEST(HandCode, what_arrives_is_coded_as_the_same_bytes) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const std::vector<Hand> hands = wire::RandomMessages(seed).hands();
    const std::vector<std::uint8_t> bytes = encode_hands(hands);
    // A server passes hands on, so hands that are encoded a second time must not drift.
    EXPECT_EQ(encode_hands(rounded_to_wire(hands)), bytes);
  }
}

TEST(HandCode, the_largest_and_farthest_shapes_fit_and_stay_valid) {
  Hand hand{.place = {Quat::Identity(), {kHandPlaceMax_m, -kHandPlaceMax_m, kHandPlaceMax_m}}};
  const Vec3 far = Vec3::Constant(kHandSizeMax_m);
  hand.shapes.assign(kHandShapesMax, {far, -far, kHandSizeMax_m, true});
  ASSERT_EQ(validate(std::vector{hand}), "");
  const std::vector<Hand> coded = rounded_to_wire(std::vector{hand});
  EXPECT_EQ(validate(coded), "");
  EXPECT_EQ(coded.front().shapes, hand.shapes);
  EXPECT_EQ(coded.front().place.position, hand.place.position);
}

TEST(HandCode, any_end_up_to_the_limit_stays_valid) {
  wire::RandomMessages random(11);
  const auto coordinate = [&] {
    const double some = random.real(-kHandSizeMax_m, kHandSizeMax_m);
    // A coordinate is at either limit, anywhere, or a whole number of steps, where rounding errors would show.
    const double values[] = {-kHandSizeMax_m, kHandSizeMax_m, some, std::nearbyint(some / kHandStep_m) * kHandStep_m};
    return std::clamp(values[random.integer(0, 3)], -kHandSizeMax_m, kHandSizeMax_m);
  };
  const auto end = [&] { return Vec3(coordinate(), coordinate(), coordinate()); };
  for (int i = 0; i < 2000; ++i) {
    Hand hand{.place = {Quat::Identity(), kHandPlaceMax_m / kHandSizeMax_m * end()}};
    for (std::size_t s = 0; s < kHandShapesMax; ++s)
      hand.shapes.push_back({end(), end(), std::max(std::abs(coordinate()), 1e-9), false});
    ASSERT_EQ(validate({hand}), "");
    std::vector<Hand> coded;
    ASSERT_EQ(decode_hands(encode_hands(std::vector{hand}), coded), "") << i;
    EXPECT_EQ(encode_hands(coded), encode_hands(std::vector{hand}));
  }
}

TEST(HandCode, no_prefix_and_no_longer_bytes_are_hands) {
  const std::vector<Hand> hands{open_hand({1, 2, 3})};
  std::vector<std::uint8_t> bytes = encode_hands(hands);
  std::vector<Hand> out;
  for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_NE(decode_hands(std::span(bytes).first(n), out), "") << n;
  bytes.push_back(0);
  EXPECT_NE(decode_hands(bytes, out), "");
}

TEST(HandCode, any_bytes_give_valid_hands_or_a_reason) {
  wire::RandomMessages random(3);
  std::vector<std::uint8_t> bytes;
  int valid = 0;
  for (int i = 0; i < 20'000; ++i) {
    bytes = encode_hands(random.hands());
    for (std::uint64_t n = random.integer(0, 3); n > 0; --n)
      bytes[random.integer(0, bytes.size() - 1)] ^= static_cast<std::uint8_t>(1 << random.integer(0, 7));
    std::vector<Hand> out;
    if (!decode_hands(bytes, out).empty()) continue;
    ++valid;
    EXPECT_EQ(validate(out), "");
  }
  // Of 20 000 damaged codes some must still decode, or the values behind the first byte were not tested.
  EXPECT_GT(valid, 1000);
}

TEST(Hands, that_are_not_valid_have_a_reason_each) {
  const auto error = [](auto corrupt) {
    std::vector<Hand> hands{open_hand({1, 2, 3})};
    corrupt(hands);
    return validate(hands);
  };
  const double nan = std::nan("");
  EXPECT_EQ(error([](auto&) {}), "");
  EXPECT_NE(error([](auto& h) { h[0].shapes.clear(); }), "");
  EXPECT_NE(error([](auto& h) { h[0].shapes.resize(kHandShapesMax + 1, h[0].shapes[0]); }), "");
  // The hand has six shapes, so its last ones would have numbers beyond the limit.
  EXPECT_NE(error([](auto& h) { h[0].first_number = kHandShapesMax - 2; }), "");
  EXPECT_NE(error([](auto& h) { h.push_back(h[0]); }), "") << "both begin at 0";
  EXPECT_NE(error([&](auto& h) { h[0].place.position.y() = nan; }), "");
  // The limits are kHandPlaceMax_m = 10 000 for places and kHandSizeMax_m = 10 for ends and radii.
  EXPECT_NE(error([](auto& h) { h[0].place.position.y() = 10'001; }), "");
  EXPECT_NE(error([](auto& h) { h[0].place.rotation.w() += 1; }), "");
  EXPECT_NE(error([&](auto& h) { h[0].place.rotation.w() = nan; }), "");
  EXPECT_NE(error([&](auto& h) { h[0].shapes[1].to.z() = nan; }), "");
  EXPECT_NE(error([](auto& h) { h[0].shapes[1].from.z() = -11; }), "");
  EXPECT_NE(error([](auto& h) { h[0].shapes[2].radius_m = 0; }), "");
  EXPECT_NE(error([](auto& h) { h[0].shapes[2].radius_m = 11; }), "");
}

TEST(Hands, become_bodies_whose_axis_is_the_capsules) {
  const Hand hand = open_hand({1, 2, 3});
  std::vector<TouchBody> bodies;
  append_bodies(hand, 9, bodies);
  ASSERT_EQ(bodies.size(), hand.shapes.size());
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    const TouchBody& body = bodies[s];
    EXPECT_EQ(body.key, (TouchKey{9, static_cast<std::uint8_t>(s)}));
    EXPECT_EQ(validate(body), "");
    const double half_m = body.shape.half_size_m.y();
    EXPECT_LT((body.place.point({0, half_m, 0}) - hand.place.point(hand.shapes[s].to)).norm(), 1e-9);
    EXPECT_LT((body.place.point({0, -half_m, 0}) - hand.place.point(hand.shapes[s].from)).norm(), 1e-9);
  }
  std::vector<TouchBody> ball;
  append_bodies({0, {}, false, {{Vec3::UnitX(), Vec3::UnitX(), 0.1}}}, 9, ball);
  EXPECT_EQ(ball[0].shape, sphere(0.1));
}

}  // namespace
}  // namespace hairnet::codec
