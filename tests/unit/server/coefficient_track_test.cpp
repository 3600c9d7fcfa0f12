#include "server/room/coefficient_track.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hairnet::server {
namespace {

constexpr double kTickLength_s = 1.0 / 30;

// Plays hair on two levels whose solutions differ: the coarse level's coefficients are half of the fine one's. A change
// of the level fades within 0.4 s (kFade_s in coefficient_track.cpp), 12 ticks.
class CoefficientTrackTest : public testing::Test {
 protected:
  static ModeMap scaled(float factor) {
    ModeMap::Matrix matrix = ModeMap::Matrix::Zero(3, 6);
    for (Eigen::Index k = 0; k < 3; ++k) matrix(k, k) = factor;
    return ModeMap(matrix);
  }
  static std::vector<Vec3f> hair(std::uint64_t tick) {
    const float swing = 0.1f * std::sin(0.3f * static_cast<float>(tick));
    return {Vec3f(swing, 0.5f * swing, 0.02f), Vec3f::Zero()};
  }
  std::vector<float> at(std::uint64_t tick, const ModeMap* map, bool discontinuous = false) {
    std::vector<float> own(map ? 3 : 0);
    if (map) map->coefficients_of(hair(tick), own);
    return padded(track_.at(tick, kTickLength_s, {map, own}, 3, discontinuous));
  }
  static std::vector<float> padded(std::span<const float> first) {
    std::vector<float> all(first.begin(), first.end());
    all.resize(3);
    return all;
  }
  const ModeMap fine_ = scaled(1), coarse_ = scaled(0.5f);
  CoefficientTrack track_;
};

TEST_F(CoefficientTrackTest, are_those_of_the_level_while_it_stays) {
  for (std::uint64_t tick = 5; tick < 20; ++tick) {
    const std::vector<float> c = at(tick, &fine_);
    EXPECT_FLOAT_EQ(c[0], hair(tick)[0].x());
    EXPECT_FLOAT_EQ(c[1], hair(tick)[0].y());
  }
}

TEST_F(CoefficientTrackTest, go_on_smoothly_when_the_level_changes_and_end_as_those_of_the_new_one) {
  float last = 0, fastest = 0;
  for (std::uint64_t tick = 1; tick <= 15; ++tick) {
    const float now = at(tick, &fine_)[0];
    if (tick > 1) fastest = std::max(fastest, std::abs(now - last));
    last = now;
  }
  for (std::uint64_t tick = 16; tick <= 30; ++tick) {
    const float now = at(tick, &coarse_)[0];
    // Without the fade, the first coefficient would jump by half of its value, which reaches 0.1 m. It may move a
    // little faster than the hair itself does.
    EXPECT_LT(std::abs(now - last), 1.5f * fastest) << tick;
    last = now;
  }
  EXPECT_FLOAT_EQ(at(31, &coarse_)[0], 0.5f * hair(31)[0].x());
}

TEST_F(CoefficientTrackTest, jump_where_the_hair_does) {
  at(4, &fine_);
  at(5, &fine_);
  EXPECT_FLOAT_EQ(at(6, &coarse_, true)[0], 0.5f * hair(6)[0].x());
}

TEST_F(CoefficientTrackTest, do_not_go_on_from_before_a_jump_when_the_level_changes_after_it) {
  const std::vector<float> far{-0.5f, 0, 0}, near{0.1f, 0, 0};
  static_cast<void>(track_.at(4, kTickLength_s, {&fine_, far}, 3, false));
  static_cast<void>(track_.at(5, kTickLength_s, {&fine_, near}, 3, true));
  EXPECT_LT(track_.at(6, kTickLength_s, {&coarse_, near}, 3, false)[0], 0.11f);
}

TEST_F(CoefficientTrackTest, begin_again_with_a_basis_of_another_size) {
  at(4, &fine_);
  at(5, &fine_);
  const std::vector<float> two{0.2f, 0.1f};
  const std::span<const float> shown = track_.at(6, kTickLength_s, {&coarse_, two}, 2, false);
  EXPECT_EQ(std::vector<float>(shown.begin(), shown.end()), two);
  EXPECT_FALSE(track_.is_fading());
  EXPECT_LT(track_.at(7, kTickLength_s, {&fine_, two}, 2, false)[0], 0.21f) << "not on from another basis";
}

TEST_F(CoefficientTrackTest, that_nobody_has_seen_for_a_while_do_not_fade) {
  at(4, &fine_);
  at(5, &fine_);
  // A gap of more than 8 ticks (kGapMax_ticks) ends a motion.
  EXPECT_FLOAT_EQ(at(50, &coarse_)[0], 0.5f * hair(50)[0].x());
}

TEST_F(CoefficientTrackTest, fade_to_rest_when_the_lattice_goes) {
  at(4, &fine_);
  const float before = at(5, &fine_)[0];
  const float first = at(6, nullptr)[0];
  EXPECT_GT(std::abs(first), 0.5f * std::abs(before));
  for (std::uint64_t tick = 7; tick <= 20; ++tick) at(tick, nullptr);
  EXPECT_EQ(at(21, nullptr), std::vector<float>(3, 0.0f));
  EXPECT_TRUE(track_.shown().empty());
}

TEST_F(CoefficientTrackTest, fade_to_those_of_a_network_and_back) {
  // The network drives two of the three coefficients.
  const std::vector<float> learnt{0.03f, -0.02f};
  const auto at_learnt = [&](std::uint64_t tick) {
    return padded(track_.at(tick, kTickLength_s, {nullptr, learnt}, 3, false));
  };
  at(4, &fine_);
  const float before = at(5, &fine_)[0];
  EXPECT_LT(std::abs(at_learnt(6)[0] - before), 0.04f);
  EXPECT_EQ(track_.shown().size(), 3u) << "the third fades";
  for (std::uint64_t tick = 7; tick <= 20; ++tick) at_learnt(tick);
  EXPECT_EQ(at_learnt(21), (std::vector<float>{0.03f, -0.02f, 0}));
  EXPECT_EQ(track_.shown().size(), 2u);
  EXPECT_LT(std::abs(at(22, &fine_)[0] - 0.03f), 0.01f);
}

TEST_F(CoefficientTrackTest, can_be_asked_for_again_at_the_same_tick) {
  at(4, &fine_);
  const std::vector<float> once = at(5, &fine_);
  EXPECT_EQ(at(5, &fine_), once);
  EXPECT_LT(std::abs(at(6, &coarse_)[0] - once[0]), 0.05f);
}

}  // namespace
}  // namespace hairnet::server
