#include <gtest/gtest.h>

#include <ostream>
#include <random>
#include <tuple>

#include "client/assets/made/made.hpp"
#include "tests/fidelity/depth_in_skin.hpp"
#include "tests/fidelity/motion_figures_measure.hpp"
#include "tests/fidelity/motion_sets.hpp"
#include "tests/support/case_name.hpp"

// These tests bound the visible errors of hair in everyday motions, such as walking. The measures are those of
// `hairnet-fidelity motion`, on fewer strands.
namespace hairnet::fidelity {
namespace {

// The bounds of each motion, for both hairstyles and both levels. Shares are of points too deep in the body, lengths of
// strands in the lattice over their design's; MotionFigures has the definitions. The numbers are somewhat above what
// was measured: they let no motion become visibly worse.
struct Bounds {
  std::string_view motion;
  double deep_share_mean, deep_share_worst;
  double length_p99, length_max;
  double jump_p999_m;
  double rest_speed_m_per_s = 0.001, rest_rms_m = 0.00002;
};
void PrintTo(const Bounds& bounds, std::ostream* out) {
  *out << bounds.motion;
}
constexpr Bounds kBounds[] = {
    // The columns are the members of Bounds, in order. Hair turned on the spot comes to rest more slowly, so it has
    // bounds of its own at rest.
    {"walk_and_stop", 0.001, 0.01, 1.19, 1.9, 0.025}, {"glide", 0.003, 0.03, 1.39, 2.9, 0.031},
    {"side_step", 0.001, 0.01, 1.31, 2.14, 0.0125},   {"turn_on_spot", 0.001, 0.005, 1.1, 1.25, 0.023, 0.0025, 0.00006},
    {"late_nod", 0.001, 0.005, 1.04, 1.21, 0.0034},
};
// The largest length of drawn strands over that of their design.
constexpr double kDrawnLength_p99 = 1.02;
// At rest no point may be too deep, and no point of the lattice inside out.
constexpr double kRestDeepShareMax = 0, kRestInvertedShareMax = 0;

// 12 s repeat the short motions, so that a figure which grows with time is noticed.
constexpr double kRate_hz = 30, kDuration_s = 12;
constexpr std::size_t kStrandCount = 800, kPointCount = 1500;

class EverydayHair : public testing::TestWithParam<std::tuple<std::string_view, Bounds>> {};

TEST_P(EverydayHair, stays_out_of_the_body_keeps_its_length_never_jumps_and_comes_home) {
  const auto& [hairstyle, bounds] = GetParam();
  const Subject subject = make_subject(make_hairstyle(hairstyle, {.strand_count = kStrandCount}).value(),
                                       {LevelIndex::medium, LevelIndex::low});
  const Clip clip = make_clip(looped(make_motion(bounds.motion).value(), kDuration_s), kRate_hz, kDuration_s);
  for (const MotionFigures& run : measure_motion_figures(subject, clip, false, {.point_count = kPointCount})) {
    SCOPED_TRACE(kLevelNames[static_cast<std::size_t>(run.level)]);
    EXPECT_LT(run.deep_share, bounds.deep_share_mean);
    EXPECT_LT(run.deep.value, bounds.deep_share_worst) << "at " << run.deep.time_s << " s";
    EXPECT_LT(run.length_p99, bounds.length_p99);
    EXPECT_LT(run.drawn_p99, kDrawnLength_p99);
    EXPECT_LT(run.length.value, bounds.length_max) << "at " << run.length.time_s << " s";
    EXPECT_LT(run.jump_p999_m, bounds.jump_p999_m) << "the largest at " << run.jump_m.time_s << " s";
    EXPECT_LT(run.rest->speed_m_per_s, bounds.rest_speed_m_per_s);
    EXPECT_LT(run.rest->rms_m, bounds.rest_rms_m);
    EXPECT_LE(run.rest->deep_share, kRestDeepShareMax);
    EXPECT_LE(run.rest->inverted_share, kRestInvertedShareMax);
  }
}

INSTANTIATE_TEST_SUITE_P(Made, EverydayHair,
                         testing::Combine(testing::Values("long_straight", "bob"), testing::ValuesIn(kBounds)),
                         support::CaseName());

TEST(LoopedMotion, continues_at_the_place_and_heading_of_its_end) {
  Motion motion = make_motion("dance").value();
  // The cut is in the middle of a turn, where a jump of the heading would show.
  motion.poses.resize(200);
  motion.teleports.resize(200);
  const double length_s = motion.duration_s();
  const Motion all = looped(motion, 12);
  EXPECT_GE(all.duration_s(), 12);
  for (std::size_t i = 1; i < all.poses.size(); ++i) {
    const RigidTransform &a = all.poses[i - 1].head(), &b = all.poses[i].head();
    // A loop that began again at the first pose's position and heading would jump there. The bounds are above any
    // speed of the dance.
    ASSERT_LT((b.position - a.position).norm() * all.rate_hz, 3) << "m/s at pose " << i;
    ASSERT_LT(a.rotation.angularDistance(b.rotation) * all.rate_hz, 15) << "rad/s at pose " << i;
  }
  const auto turned = [&](const Motion& m, double from_s, double to_s) {
    return m.sample(from_s).head().rotation.angularDistance(m.sample(to_s).head().rotation);
  };
  EXPECT_NEAR(turned(all, length_s + 1.5, length_s + 2.5), turned(motion, 1.5, 2.5), 1e-6);
}

TEST(StoppedMotion, stays_in_the_pose_it_stopped_in) {
  const Motion motion = make_motion("upside_down").value();
  const Motion all = stopped(motion, 4, 12);
  EXPECT_GE(all.duration_s(), 12);
  EXPECT_LT(all.sample(12).head().rotation.angularDistance(motion.sample(4).head().rotation), 1e-9);
}

TEST(DeepPoints, are_those_that_a_plain_look_at_every_point_finds) {
  Groom groom;
  groom.body = make_bust();
  groom.group_names = {"hair"};
  // 300 points lie around the head, in and out of the body, and move at random by up to 2 cm in each tick. The fast
  // search of DeepPoints must find exactly what a query of every point finds.
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-0.15F, 0.15F), way(-0.02F, 0.02F);
  for (int i = 0; i < 300; ++i) {
    const Vec3f point(place(random), place(random), place(random));
    groom.add_strand(std::vector<Vec3f>{point, point}, {});
  }
  std::vector<Vec3f> points = groom.points;
  BentBody body(groom);
  std::vector<double> limit_m;
  for (const Vec3f& point : points) limit_m.push_back(kTooDeep_m + (body.inside(point) ? body.distance_m(point) : 0));
  DeepPoints deep(body, points);
  std::size_t found = 0;
  const Motion dance = make_motion("dance").value();
  for (int tick = 0; tick < 15; ++tick) {
    body.bend(dance.sample(0.2 * tick));
    for (Vec3f& point : points) point += Vec3f(way(random), way(random), way(random));
    std::size_t count = 0;
    for (std::size_t p = 0; p < points.size(); ++p)
      if (body.inside(points[p]) && body.distance_m(points[p]) > limit_m[p]) ++count;
    ASSERT_NEAR(deep.share(body, points) * static_cast<double>(points.size()), static_cast<double>(count), 1e-6)
        << "at tick " << tick;
    found += count;
  }
  // Some points must have become too deep, or the comparison would be of zeros.
  EXPECT_GT(found, 0u);
  EXPECT_EQ(DeepPoints(body, {}).share(body, {}), 0);
}

}  // namespace
}  // namespace hairnet::fidelity
