#include "client/link/playout.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

namespace hairnet::link {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kInterval = 40 * kMs;
constexpr std::int64_t kLateness = 25 * kMs;
constexpr double kStep_m = 0.25e-3;
constexpr std::int64_t kDelay = kLateness + kInterval * 3 / 2;

// Displacements are whole multiples of a step, so what goes in comes out exactly.
Frame frame_at(int x, LevelIndex level = LevelIndex::high, bool discontinuous = false) {
  Frame frame;
  frame.level = level;
  frame.discontinuous = discontinuous;
  frame.pose = rigid_pose({Quat::Identity(), Vec3(x, 0, 0)});
  frame.error_class = codec::ErrorClass::quarter_mm;
  if (level != LevelIndex::rigid)
    frame.displacements = {static_cast<std::int16_t>(x), 0, 0, 0, static_cast<std::int16_t>(-x), 0};
  return frame;
}

class Playing : public ::testing::Test {
 protected:
  void push(std::int64_t frame_index, int x, LevelIndex level = LevelIndex::high, bool discontinuous = false,
            std::int64_t jitter_ns = 0) {
    playout_.push(frame_at(x, level, discontinuous), frame_index * kInterval,
                  frame_index * kInterval + kLateness + jitter_ns);
  }
  // Frames 0 … last, of x = 10 a frame, and a first sample so that playing has begun.
  void push_line(std::int64_t last) {
    for (std::int64_t i = 0; i <= last; ++i) push(i, static_cast<int>(10 * i));
  }
  Playout playout_;
};

TEST_F(Playing, is_not_valid_before_the_first_frame) {
  EXPECT_FALSE(playout_.sample(0).valid);
}

TEST_F(Playing, lags_by_the_lateness_and_one_and_a_half_intervals) {
  push_line(9);
  const Playout::Sample sample = playout_.sample(8 * kInterval);
  ASSERT_TRUE(sample.valid);
  EXPECT_EQ(sample.time_ns, 8 * kInterval - kDelay);
}

TEST_F(Playing, linear_motion_is_played_exactly) {
  push_line(9);
  for (std::int64_t render = kDelay; render < kDelay + 9 * kInterval; render += 7 * kMs) {
    const Playout::Sample sample = playout_.sample(render);
    const double x = 10.0 * static_cast<double>(sample.time_ns) / static_cast<double>(kInterval);
    EXPECT_NEAR(sample.pose.head().position.x(), x, 1e-9);
    ASSERT_EQ(sample.displacement.size(), 2u);
    EXPECT_NEAR(sample.displacement[0].x(), kStep_m * x, 1e-8);
    EXPECT_NEAR(sample.displacement[1].y(), -kStep_m * x, 1e-8);
  }
}

TEST_F(Playing, rotation_is_slerped) {
  const Quat turned(Eigen::AngleAxisd(1.0, Vec3::UnitY()));
  Frame from = frame_at(0), to = frame_at(0);
  to.pose = rigid_pose({turned, Vec3::Zero()});
  playout_.push(from, 0, kLateness);
  playout_.push(to, kInterval, kInterval + kLateness);
  const Playout::Sample sample = playout_.sample(kDelay + kInterval / 2);
  EXPECT_NEAR(sample.pose.head().rotation.angularDistance(Quat::Identity()), 0.5, 1e-9);
}

TEST_F(Playing, time_never_goes_back_under_jitter_and_earlier_render_times) {
  std::int64_t last = std::numeric_limits<std::int64_t>::min(), render = 0;
  for (std::int64_t i = 0; i < 200; ++i) {
    const std::int64_t jitter = (i * 7919 % 31) * kMs;  // 0 … 30 ms, irregular
    push(i, static_cast<int>(i), LevelIndex::high, false, jitter);
    for (int s = 0; s < 3; ++s) {
      render = i * kInterval + kLateness + jitter + s * 5 * kMs - (i % 5 == 0 ? 9 * kMs : 0);
      const Playout::Sample sample = playout_.sample(render);
      EXPECT_GE(sample.time_ns, last);
      last = sample.time_ns;
    }
  }
}

TEST_F(Playing, the_delay_grows_with_jitter_so_that_every_time_has_a_frame_after_it) {
  constexpr std::int64_t kJitter = 60 * kMs;
  std::size_t starved = 0;
  for (std::int64_t now = 0; now < 400 * kInterval; now += 4 * kMs) {
    // Every fifth frame comes 60 ms late; those after it wait behind it, as on TCP.
    for (std::int64_t i = 0; i <= now / kInterval; ++i) {
      std::int64_t arrival = i * kInterval + kLateness + (i % 5 == 0 ? kJitter : 0);
      if (i % 5 == 1) arrival = std::max(arrival, (i - 1) * kInterval + kLateness + kJitter);
      if (arrival <= now && arrival > now - 4 * kMs)
        playout_.push(frame_at(static_cast<int>(i % 1000)), i * kInterval, arrival);
    }
    const Playout::Sample sample = playout_.sample(now);
    if (!sample.valid || now < 200 * kInterval) continue;
    const double x = std::fmod(static_cast<double>(sample.time_ns) / static_cast<double>(kInterval), 1000);
    starved += std::abs(sample.pose.head().position.x() - x) > 1e-6;
  }
  EXPECT_EQ(starved, 0u);
  EXPECT_EQ(playout_.delay_ns(), kLateness + kInterval + kJitter);
  EXPECT_EQ(playout_.dropped_count(), 0u);
}

TEST_F(Playing, freezes_for_100_ms_without_frames_then_eases_to_rest_in_half_a_second) {
  push_line(4);
  const std::int64_t newest = 4 * kInterval + kDelay;  // when frame 4 is shown
  (void)playout_.sample(newest - kInterval);
  EXPECT_NEAR(playout_.sample(newest + 99 * kMs).displacement[0].x(), 40 * kStep_m, 1e-8);
  float last = static_cast<float>(40 * kStep_m);
  for (int ms = 120; ms < 600; ms += 20) {
    const Playout::Sample sample = playout_.sample(newest + ms * kMs);
    EXPECT_LT(sample.displacement[0].x(), last);
    EXPECT_GE(sample.displacement[0].x(), 0);
    EXPECT_EQ(sample.pose.head().position.x(), 40);
    last = sample.displacement[0].x();
  }
  EXPECT_EQ(playout_.sample(newest + 601 * kMs).displacement[0].x(), 0);
}

TEST_F(Playing, after_a_gap_the_way_begins_at_what_was_shown) {
  push_line(4);
  (void)playout_.sample(3 * kInterval + kDelay);
  const std::int64_t resumed = 24 * kInterval + kLateness;
  EXPECT_EQ(playout_.sample(resumed - kMs).displacement[0].x(), 0);
  push(24, 1000);
  const float first = playout_.sample(resumed).displacement[0].x();
  EXPECT_LT(first, 12.5e-3f);
  const float later = playout_.sample(resumed + 20 * kMs).displacement[0].x();
  EXPECT_GT(later, first);
  EXPECT_LT(later, 0.25f);
}

TEST_F(Playing, does_not_interpolate_into_a_discontinuous_frame) {
  push_line(3);
  push(4, 500, LevelIndex::high, true);
  push(5, 510);
  const auto shown_x = [&](std::int64_t time) { return playout_.sample(time + kDelay).pose.head().position.x(); };
  EXPECT_NEAR(shown_x(3 * kInterval), 30, 1e-9);
  EXPECT_NEAR(shown_x(4 * kInterval - 1), 30, 1e-9);
  EXPECT_NEAR(shown_x(4 * kInterval), 500, 1e-9);
  EXPECT_NEAR(shown_x(4 * kInterval + kInterval / 2), 505, 1e-9);
}

TEST_F(Playing, a_level_change_is_shown_at_its_frame_and_not_before) {
  push_line(3);
  push(4, 40, LevelIndex::low);
  push(5, 50, LevelIndex::rigid);
  EXPECT_EQ(playout_.sample(4 * kInterval - 1 + kDelay).level, LevelIndex::high);
  EXPECT_EQ(playout_.sample(4 * kInterval + kDelay).level, LevelIndex::low);
  EXPECT_EQ(playout_.sample(5 * kInterval - 1 + kDelay).displacement.size(), 2u);
  const Playout::Sample rigid = playout_.sample(5 * kInterval + kDelay);
  EXPECT_EQ(rigid.level, LevelIndex::rigid);
  EXPECT_TRUE(rigid.displacement.empty());
}

TEST_F(Playing, drops_duplicates_and_what_was_already_played) {
  push_line(5);
  push(5, 77);
  EXPECT_EQ(playout_.dropped_count(), 1u);
  (void)playout_.sample(4 * kInterval + kDelay);
  push(2, 99);
  EXPECT_EQ(playout_.dropped_count(), 2u);
  EXPECT_NEAR(playout_.sample(5 * kInterval + kDelay).pose.head().position.x(), 50, 1e-9);
}

TEST_F(Playing, frames_out_of_order_are_played_in_order) {
  for (const std::int64_t i : {0, 2, 1, 3}) push(i, static_cast<int>(10 * i));
  for (std::int64_t time = 0; time <= 3 * kInterval; time += 5 * kMs) {
    const Playout::Sample sample = playout_.sample(time + kLateness + 3 * kInterval);
    EXPECT_NEAR(sample.pose.head().position.x(), 10.0 * static_cast<double>(sample.time_ns) / kInterval, 1e-9);
  }
}

TEST_F(Playing, hair_that_is_frozen_on_purpose_stays_for_any_time) {
  push_line(9);
  playout_.sample(8 * kInterval);
  playout_.freeze();
  const std::int64_t last_shown = 9 * kInterval + kDelay;
  for (std::int64_t waited = 0; waited < 60'000 * kMs; waited += 1'000 * kMs) {
    const Playout::Sample sample = playout_.sample(last_shown + waited);
    ASSERT_EQ(sample.displacement.size(), 2u);
    EXPECT_NEAR(sample.displacement[0].x(), kStep_m * 90, 1e-7);
  }
}

TEST_F(Playing, easing_hair_freezes_where_it_is_and_continues_from_there) {
  push_line(9);
  std::int64_t now = 0;
  for (; now < 9 * kInterval + kDelay + 350 * kMs; now += 10 * kMs) playout_.sample(now);
  const float x = playout_.sample(now).displacement[0].x();
  EXPECT_LT(x, 0.9 * kStep_m * 90);
  EXPECT_GT(x, 0.1 * kStep_m * 90);
  playout_.freeze();
  for (int i = 0; i < 100; ++i) EXPECT_FLOAT_EQ(playout_.sample(now += 10 * kMs).displacement[0].x(), x);
  float last = x;
  for (std::int64_t i = now / kInterval + 1; i < now / kInterval + 60; ++i) {
    push(i, 90);
    for (std::int64_t render = i * kInterval + kLateness; render < (i + 1) * kInterval + kLateness; render += 5 * kMs) {
      const float shown = playout_.sample(render).displacement[0].x();
      EXPECT_LT(std::abs(shown - last), 0.5 * kStep_m * 90);
      last = shown;
    }
  }
  EXPECT_NEAR(last, kStep_m * 90, 1e-7);
}

// A lattice that swings in the world while its head moves on and turns, as frames of a server give it: velocities are
// means over the step that ended.
class Swinging : public ::testing::Test {
 protected:
  static constexpr double kStep_s = 0.04;
  Swinging() {
    auto grid = std::make_shared<LevelGeometry>();
    grid->lattice = {Vec3f(-0.1f, -0.3f, -0.1f), Vec3f::Constant(0.1f), {3, 3, 3}};
    for (std::uint32_t node = 0; node < 27; ++node) grid->active_nodes.push_back(node);
    grid->trimmed_begin = {0};
    geometry_ = grid;
  }
  static RigidTransform head_at(double t) {
    return {Quat(Eigen::AngleAxisd(1.5 * t, Vec3::UnitY())), Vec3(0.8 * t, 0, 0.3 * t)};
  }
  [[nodiscard]] Vec3 rest(std::size_t node) const {
    return geometry_->lattice.node(geometry_->active_nodes[node]).cast<double>();
  }
  static Vec3 displacement_at(double t, std::size_t node) {
    const double phase = 9 * t + static_cast<double>(node);
    return 0.03 * Vec3(std::sin(phase), 0.3 * std::cos(phase), std::sin(phase + 1));
  }
  [[nodiscard]] Vec3 world_at(double t, std::size_t node) const {
    return head_at(t).point(rest(node) + displacement_at(t, node));
  }
  [[nodiscard]] Frame frame_at(double t, bool velocities) const {
    Frame frame;
    frame.level = LevelIndex::low;
    frame.error_class = codec::ErrorClass::quarter_mm;
    frame.step_s = static_cast<float>(kStep_s);
    frame.pose = rigid_pose(head_at(t));
    frame.geometry = geometry_;
    std::vector<Vec3f> displacement, velocity;
    for (std::size_t node = 0; node < 27; ++node) {
      displacement.push_back(displacement_at(t, node).cast<float>());
      const Vec3 moved = (world_at(t, node) - world_at(t - kStep_s, node)) / kStep_s;
      velocity.push_back((head_at(t).rotation.conjugate() * moved).cast<float>());
    }
    EXPECT_TRUE(codec::quantise_nodes(displacement, frame.error_class, frame.displacements));
    if (velocities) codec::quantise_velocities(velocity, frame.error_class, frame.velocities);
    return frame;
  }
  // RMS over nodes and times of the difference between shown and true state, m. Frames come every `stride` steps.
  double error_m(int stride, bool velocities) {
    Playout playout;
    const auto interval = static_cast<std::int64_t>(stride * kStep_s * 1e9);
    double sum = 0, count = 0;
    for (std::int64_t i = 0; i < 100; ++i) {
      const std::int64_t now = i * interval;
      playout.push(frame_at(1e-9 * static_cast<double>(now), velocities), now, now);
      for (std::int64_t part = 0; part < 8; ++part) {
        const Playout::Sample sample = playout.sample(now + part * interval / 8);
        if (i < 20) continue;
        const double t = 1e-9 * static_cast<double>(sample.time_ns);
        for (std::size_t node = 0; node < 27; ++node) {
          sum += (sample.displacement[node].cast<double>() - displacement_at(t, node)).squaredNorm();
          ++count;
        }
      }
    }
    return std::sqrt(sum / count);
  }
  std::shared_ptr<const LevelGeometry> geometry_;
};

TEST_F(Swinging, velocities_bring_the_hair_several_times_nearer_to_where_it_was) {
  // Rounding to the class's step is off by step / sqrt(12) in each of three coordinates, however it is played.
  const double rounding_m = double{codec::kStep_m[static_cast<std::size_t>(codec::ErrorClass::quarter_mm)]} / 2;
  for (const int stride : {1, 2, 4}) {
    const double cubic_m = error_m(stride, true), straight_m = error_m(stride, false);
    EXPECT_LT(cubic_m - rounding_m, straight_m / 4) << "stride " << stride;
    EXPECT_GT(straight_m, 2 * rounding_m) << "stride " << stride;
  }
}

TEST_F(Swinging, frames_with_and_without_velocities_are_played_as_they_can) {
  Playout playout;
  const auto interval = static_cast<std::int64_t>(kStep_s * 1e9);
  for (std::int64_t i = 0; i < 40; ++i) {
    const std::int64_t now = i * interval;
    playout.push(frame_at(1e-9 * static_cast<double>(now), i % 3 != 0), now, now);
    const Playout::Sample sample = playout.sample(now);
    ASSERT_EQ(sample.displacement.size(), 27u);
    if (i < 10) continue;
    for (std::size_t node = 0; node < 27; ++node) {
      const Vec3 wanted = displacement_at(1e-9 * static_cast<double>(sample.time_ns), node);
      EXPECT_LT((sample.displacement[node].cast<double>() - wanted).norm(), 2e-3);
    }
  }
}

// A level may have no active nodes: its frames then have a geometry and no displacements.
TEST_F(Playing, a_level_that_loses_its_nodes_keeps_displacements_and_geometry_together) {
  const auto geometry_of = [](std::uint32_t node_count) {
    auto geometry = std::make_shared<LevelGeometry>();
    for (std::uint32_t node = 0; node < node_count; ++node) geometry->active_nodes.push_back(node);
    return geometry;
  };
  Frame from = frame_at(10), to = frame_at(20);
  from.geometry = geometry_of(2);
  to.displacements.clear();
  to.geometry = geometry_of(0);
  playout_.push(from, 0, kLateness);
  playout_.push(to, kInterval, kInterval + kLateness);
  const Playout::Sample sample = playout_.sample(kDelay + kInterval / 2);
  ASSERT_TRUE(sample.geometry);
  EXPECT_EQ(sample.displacement.size(), 2u);
  EXPECT_EQ(sample.geometry->active_nodes.size(), sample.displacement.size());
}

TEST_F(Playing, memory_is_bounded_without_sampling) {
  for (std::int64_t i = 0; i < 10'000; ++i) push(i, 0);
  EXPECT_EQ(playout_.dropped_count(), 10'000u - 256u);
}

}  // namespace
}  // namespace hairnet::link
