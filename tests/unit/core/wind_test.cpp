#include "core/solver/wind.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/random.hpp"

namespace hairnet {
namespace {

using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Wind make_storm(std::uint64_t seed = 7) {
  Wind wind;
  wind.mean_m_per_s = {6, 0.5, -2};
  wind.gust_ratio = 0.6;
  wind.gust_period_s = 3;
  wind.turbulence_rms_m_per_s = 1.5;
  wind.turbulence_scale_m = 0.8;
  wind.seed = seed;
  return wind;
}

// A point within 20 m of the origin and a time within an hour.
struct Somewhere {
  explicit Somewhere(Random& random)
      : point(20 * random.symmetric(), 20 * random.symmetric(), 20 * random.symmetric()),
        time_s(3600 * random.unit()) {}
  Vec3 point;
  double time_s;
};

TEST(Wind, still_air_is_exactly_zero) {
  Wind gusts_of_nothing;
  gusts_of_nothing.gust_ratio = 1;
  for (const WindField& field : {WindField(), WindField(Wind{}), WindField(gusts_of_nothing)}) {
    EXPECT_TRUE(field.is_still());
    EXPECT_EQ(field.velocity({1, 2, 3}, 4), Vec3::Zero());
    for (const Vec3f& corner : wind_on(field, {Vec3f::Zero(), Vec3f::Ones(), {3, 3, 3}}, {}, 1).corners)
      EXPECT_EQ(corner, Vec3f::Zero());
  }
}

TEST(Wind, a_steady_wind_is_its_mean_everywhere_and_always) {
  Wind wind;
  wind.mean_m_per_s = {3, -1, 2};
  const WindField field(wind);
  EXPECT_FALSE(field.is_still());
  EXPECT_FALSE(field.is_turbulent());
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Somewhere at(random);
    EXPECT_EQ(field.velocity(at.point, at.time_s), wind.mean_m_per_s);
  }
}

// People set the wind in m/s, and the sum of random waves must keep to these numbers within 2 %.
TEST(Wind, over_space_and_time_it_has_the_mean_and_the_turbulence_asked_for) {
  Wind wind = make_storm();
  wind.gust_ratio = 0;
  const WindField field(wind);
  Random random(2);
  constexpr int kSamples = 200'000;
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const Somewhere at(random);
    const Vec3 beyond = field.velocity(at.point, at.time_s) - wind.mean_m_per_s;
    sum += beyond;
    squares += beyond.cwiseAbs2();
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(sum[axis] / kSamples, 0, 0.02 * wind.turbulence_rms_m_per_s);
    EXPECT_NEAR(std::sqrt(squares[axis] / kSamples), wind.turbulence_rms_m_per_s, 0.02 * wind.turbulence_rms_m_per_s);
  }
}

// Air that flows together at a point would press hair to it. The divergence is the sum of three central differences,
// whose own error allows 1e-6 per second.
TEST(Wind, has_no_divergence) {
  const WindField field(make_storm());
  const double step = 1e-4;
  Random random(3);
  double gradient_max = 0;
  for (int i = 0; i < 500; ++i) {
    const Somewhere at(random);
    double divergence = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 ahead = step * Vec3::Unit(axis);
      const Vec3 slope =
          (field.velocity(at.point + ahead, at.time_s) - field.velocity(at.point - ahead, at.time_s)) / (2 * step);
      divergence += slope[axis];
      gradient_max = std::max(gradient_max, slope.cwiseAbs().maxCoeff());
    }
    EXPECT_NEAR(divergence, 0, 1e-6);
  }
  // The field must have gradients at all, or a divergence of zero says nothing.
  EXPECT_GT(gradient_max, 0.1);
}

TEST(Wind, turbulence_changes_over_no_less_than_its_scale) {
  // A field of wave numbers up to K = 1 / scale has a mean square slope, along any line, of at most K^2 times its own;
  // and along a fixed line one of exactly a third of the mean of k^2 if isotropic: well above zero.
  for (const double scale : {0.3, 1.0, 5.0}) {
    Wind wind;
    wind.turbulence_rms_m_per_s = 2;
    wind.turbulence_scale_m = scale;
    const WindField field(wind);
    const double step = 1e-3 * scale;
    Random random(4);
    double slope_squares = 0, bend_squares = 0;
    constexpr int kSamples = 20'000;
    for (int i = 0; i < kSamples; ++i) {
      const Somewhere at(random);
      const Vec3 ahead(step, 0, 0);
      const Vec3 here = field.velocity(at.point, at.time_s);
      const Vec3 next = field.velocity(at.point + ahead, at.time_s), last = field.velocity(at.point - ahead, at.time_s);
      slope_squares += (next - last).squaredNorm() / (4 * step * step);
      bend_squares += (next - 2 * here + last).squaredNorm() / (step * step * step * step);
    }
    // The RMS of the whole vector is sqrt(3) times that of one component.
    const double own = std::sqrt(3.0) * wind.turbulence_rms_m_per_s;
    // The 2 % allow for the error of sampling.
    EXPECT_LT(std::sqrt(slope_squares / kSamples), 1.02 * own / scale);
    EXPECT_GT(std::sqrt(slope_squares / kSamples), 0.1 * own / scale);
    EXPECT_LT(std::sqrt(bend_squares / kSamples), 1.02 * own / (scale * scale));
  }
}

// A point that travels with the mean wind for 0.1 s meets almost the same eddy; a point that stays meets another part
// of it. After 30 s the eddies themselves have changed.
TEST(Wind, carries_its_turbulence_along_and_changes_it_on_the_way) {
  Wind wind = make_storm();
  wind.gust_ratio = 0;
  const WindField field(wind);
  Random random(5);
  double followed = 0, stayed = 0, followed_long = 0;
  for (int i = 0; i < 2000; ++i) {
    const Somewhere at(random);
    const Vec3 here = field.velocity(at.point, at.time_s);
    const auto later = [&](double s, bool follow) {
      return field.velocity(at.point + (follow ? s : 0) * wind.mean_m_per_s, at.time_s + s);
    };
    followed += (later(0.1, true) - here).squaredNorm();
    stayed += (later(0.1, false) - here).squaredNorm();
    followed_long += (later(30, true) - here).squaredNorm();
  }
  EXPECT_LT(followed, 0.1 * stayed);
  EXPECT_GT(followed_long, stayed);
}

TEST(Wind, gusts_stay_within_their_ratio_never_turn_the_wind_and_keep_its_mean) {
  Wind wind = make_storm();
  wind.turbulence_rms_m_per_s = 0;
  const Vec3 along = wind.mean_m_per_s.normalized();
  const double mean = wind.mean_m_per_s.norm();
  for (const double ratio : {0.3, 1.0}) {
    wind.gust_ratio = ratio;
    const WindField field(wind);
    double least = 1e9, most = -1e9, sum = 0, before = field.velocity({0, 0, 0}, 0).norm();
    constexpr int kSteps = 40'000;
    for (int i = 1; i <= kSteps; ++i) {
      const Vec3 velocity = field.velocity({0, 0, 0}, i / 50.0);
      const double speed = velocity.dot(along);
      EXPECT_LT(velocity.cross(along).norm(), 1e-9);
      // A gust is a sum of cosines, of which the quickest is 4.6 times as quick as the slowest, whose period is
      // gust_period_s. 6.3 is 2 pi, and a step lasts 1/50 s.
      EXPECT_LE(std::abs(speed - before), ratio * mean * 4.6 * 6.3 / wind.gust_period_s / 50);
      least = std::min(least, speed);
      most = std::max(most, speed);
      sum += before = speed;
    }
    EXPECT_GE(least, (1 - ratio) * mean - 1e-9);
    EXPECT_LE(most, (1 + ratio) * mean + 1e-9);
    EXPECT_LT(least, (1 - 0.8 * ratio) * mean);
    EXPECT_GT(most, (1 + 0.8 * ratio) * mean);
    EXPECT_NEAR(sum / kSteps, mean, 0.01 * mean);
  }
}

TEST(Wind, the_same_seed_blows_the_same_and_another_does_not) {
  const WindField field(make_storm(7)), again(make_storm(7)), other(make_storm(8));
  const WindField copy = field;
  Random random(6);
  for (int i = 0; i < 100; ++i) {
    const Somewhere at(random);
    EXPECT_EQ(field.velocity(at.point, at.time_s), again.velocity(at.point, at.time_s));
    EXPECT_EQ(field.velocity(at.point, at.time_s), copy.velocity(at.point, at.time_s));
    EXPECT_NE(field.velocity(at.point, at.time_s), other.velocity(at.point, at.time_s));
  }
}

// Every machine must compute the same wind, so that a recording repeats its run anywhere. The expected numbers are what
// this field has given before.
TEST(Wind, blows_the_same_bits_from_every_compiler) {
  const WindField field(make_storm());
  const Vec3 expected{0x1.1b6ae36d71667p+2, 0x1.c39d290c0b68cp-2, -0x1.565b24a6f4ab2p+1};
  const Vec3 expected_later{0x1.621fb98d9731bp+1, 0x1.06b3598688b92p-1, -0x1.4912dac1ec755p+1};
  EXPECT_EQ(field.velocity({0.25, 1.5, -3}, 100), expected);
  EXPECT_EQ(field.velocity({-7.5, 0.125, 40}, 86400.5), expected_later);
}

TEST(Wind, blows_as_smoothly_after_a_month_and_far_from_the_origin) {
  const WindField field(make_storm());
  const double month_s = 30 * 86'400.0;
  const Vec3 far(5e3, -100, 8e3);
  Vec3 before = field.velocity(far, month_s);
  for (int i = 1; i < 1000; ++i) {
    const Vec3 next = field.velocity(far, month_s + 1e-4 * i);
    // In 0.1 ms the wind of this storm hardly changes. A phase in floats would have lost its precision after a month,
    // and jump.
    EXPECT_LT((next - before).norm(), 0.02);
    before = next;
  }
}

TEST(WindDeathTest, a_field_of_values_that_validate_refuses_stops_the_program) {
  Wind wind = make_storm();
  wind.gust_period_s = 0;
  EXPECT_DEATH(WindField{wind}, "assertion failed: validate\\(wind\\).empty\\(\\)");
}

TEST(LatticeWind, corners_are_the_field_in_the_axes_of_the_head) {
  const WindField field(make_storm());
  const Lattice lattice{{-0.1f, -0.3f, -0.2f}, {0.05f, 0.1f, 0.04f}, {5, 6, 7}};
  const RigidTransform head{Quat(Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized())), {4, 1.7, -3}};
  const LatticeWind wind = wind_on(field, lattice, head, 12.5);
  for (const auto& [i, j, k] : {std::array{0, 0, 0}, {4, 0, 0}, {0, 5, 0}, {0, 0, 6}, {4, 5, 0}, {4, 5, 6}}) {
    const Vec3 node = lattice.node(lattice.index(i, j, k)).cast<double>();
    const Vec3f expected = (head.rotation.conjugate() * field.velocity(head.point(node), 12.5)).cast<float>();
    const Vec3f fraction(static_cast<float>(i) / 4, static_cast<float>(j) / 5, static_cast<float>(k) / 6);
    EXPECT_LT((wind.at(fraction) - expected).norm(), 1e-4f);
  }
}

TEST(LatticeWind, is_off_by_no_more_than_the_stated_bound) {
  const float side = 0.4f;
  const Lattice lattice{{-0.2f, -0.2f, -0.2f}, Vec3f::Constant(side / 3), {4, 4, 4}};
  for (const double scale : {0.3, 0.6, 2.0}) {
    Wind storm;
    storm.turbulence_rms_m_per_s = 2;
    storm.turbulence_scale_m = scale;
    double error_squares = 0;
    int count = 0;
    Random random(8);
    for (int seed = 1; seed <= 400; ++seed) {
      storm.seed = static_cast<std::uint64_t>(seed);
      const WindField field(storm);
      const Somewhere at(random);
      const RigidTransform head{Quat::Identity(), at.point};
      const LatticeWind wind = wind_on(field, lattice, head, at.time_s);
      for (std::uint32_t node = 0; node < lattice.node_count(); ++node) {
        const Vec3f rest = lattice.node(node);
        const Vec3f fraction = (rest - lattice.origin) / side;
        const Vec3 exact = field.velocity(head.point(rest.cast<double>()), at.time_s);
        error_squares += (wind.at(fraction).cast<double>() - exact).squaredNorm();
        ++count;
      }
    }
    const double own = std::sqrt(3.0) * storm.turbulence_rms_m_per_s;
    const double error = std::sqrt(error_squares / count);
    RecordProperty("error_over_rms_at_" + std::to_string(scale), std::to_string(error / own));
    // The bound (L / scale)^2 / 8 is that of LatticeWind in wind.hpp; L is the side of the box.
    EXPECT_LT(error, double{side * side} / (8 * scale * scale) * own);
    EXPECT_GT(error, 0);
  }
}

TEST(Wind, refuses_values_out_of_range_and_names_them) {
  const auto error = [](auto change) {
    Wind wind = make_storm();
    change(wind);
    return validate(wind);
  };
  EXPECT_EQ(validate(Wind{}), "");
  EXPECT_EQ(validate(make_storm()), "");
  EXPECT_EQ(error([](Wind& w) { w.mean_m_per_s = {5, 5 * std::cos(std::numbers::pi / 2), 0}; }), "") << "3e-16 along y";
  EXPECT_NE(error([](Wind& w) { w.mean_m_per_s = {5, -1e-42, 0}; }), "");
  for (const double tiny : {5e-324, 1e-42, 1e-13}) {
    EXPECT_NE(error([tiny](Wind& w) { w.mean_m_per_s = Vec3(0, tiny, 0); }), "");
    EXPECT_NE(error([tiny](Wind& w) { w.gust_ratio = tiny; }), "");
    EXPECT_NE(error([tiny](Wind& w) { w.turbulence_rms_m_per_s = tiny; }), "");
  }
  EXPECT_THAT(error([](Wind& w) { w.mean_m_per_s.y() = kNan; }), HasSubstr("speed"));
  // Each component is in its range, but the speed of 70.7 m/s is above the limit of 60 m/s (wind.cpp).
  EXPECT_THAT(error([](Wind& w) { w.mean_m_per_s = {50, 50, 0}; }), HasSubstr("speed"));
  EXPECT_THAT(error([](Wind& w) { w.gust_ratio = 1.01; }), HasSubstr("gust ratio"));
  EXPECT_THAT(error([](Wind& w) { w.gust_ratio = kNan; }), HasSubstr("gust ratio"));
  EXPECT_THAT(error([](Wind& w) { w.gust_period_s = 0; }), HasSubstr("gust period"));
  EXPECT_THAT(error([](Wind& w) { w.turbulence_rms_m_per_s = -1; }), HasSubstr("turbulence (m/s)"));
  EXPECT_THAT(error([](Wind& w) { w.turbulence_scale_m = 0.29; }), HasSubstr("turbulence scale"));
  EXPECT_THAT(error([](Wind& w) { w.turbulence_scale_m = std::numeric_limits<double>::infinity(); }),
              HasSubstr("turbulence scale"));
}

}  // namespace
}  // namespace hairnet
