#include "client/link/playout.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "tests/unit/client/small_basis.hpp"

namespace hairnet::link {
namespace {

constexpr std::int64_t kMs = 1'000'000;
// A frame is sampled every 40 ms, and arrives 25 ms later unless a test adds jitter.
constexpr std::int64_t kInterval = 40 * kMs;
constexpr std::int64_t kLateness = 25 * kMs;
// Frame x shows the head at x m, and the only coefficient of its hair at x times this step.
constexpr double kStep_m = 0.25e-3;
// Playout delays frames that come without jitter by their lateness, one interval to have a frame to interpolate to, and
// half an interval (playout.hpp).
constexpr std::int64_t kDelay = kLateness + kInterval * 3 / 2;

// Makes a basis of one mode over two nodes. A coefficient of c m moves the first node by c m along x, and the second
// one by c m against y.
std::shared_ptr<const KnownBasis> line_basis() {
  static const auto kBasis = [] {
    wire::HairBasis hair;
    hair.geometry.active_nodes = {0, 1};
    hair.basis = {2, {0.1f}, {1e-3f}, {1000, 0, 0, 0, -1000, 0}};
    return std::make_shared<const KnownBasis>(std::move(hair));
  }();
  return kBasis;
}

Frame frame_at(int x, LevelIndex level = LevelIndex::high, bool discontinuous = false) {
  Frame frame;
  frame.level = level;
  frame.discontinuous = discontinuous;
  frame.pose = rigid_pose({Quat::Identity(), Vec3(x, 0, 0)});
  if (level == LevelIndex::rigid) return frame;
  frame.coefficients = {static_cast<float>(kStep_m * x)};
  frame.basis = line_basis();
  return frame;
}

// Returns the displacement of each node of the basis, head space, m. The result is empty when there is no basis to move
// by.
std::vector<Vec3f> displacement_of(const Playout::Sample& sample) {
  std::vector<Vec3f> displacement(sample.basis ? sample.basis->hair.basis.node_count : 0);
  if (sample.basis) hairnet::displacements_of(sample.basis->hair.basis, sample.coefficients, displacement);
  return displacement;
}

class Playing : public ::testing::Test {
 protected:
  void push(std::int64_t frame_index, int x, LevelIndex level = LevelIndex::high, bool discontinuous = false,
            std::int64_t jitter_ns = 0) {
    playout_.push(frame_at(x, level, discontinuous), frame_index * kInterval,
                  frame_index * kInterval + kLateness + jitter_ns);
  }
  // Pushes frames 0 to `last`. The head moves by 10 m from frame to frame.
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
    ASSERT_EQ(displacement_of(sample).size(), 2u);
    EXPECT_NEAR(displacement_of(sample)[0].x(), kStep_m * x, 1e-8);
    EXPECT_NEAR(displacement_of(sample)[1].y(), -kStep_m * x, 1e-8);
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
    // The jitter is 0 to 30 ms, in an irregular order that is the same in each run.
    const std::int64_t jitter = (i * 7919 % 31) * kMs;
    push(i, static_cast<int>(i), LevelIndex::high, false, jitter);
    for (int s = 0; s < 3; ++s) {
      // After every fifth frame the second of three render times lies 9 ms before the first.
      render = i * kInterval + kLateness + jitter + s * 5 * kMs - (i % 5 == 0 && s == 1 ? 14 * kMs : 0);
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
    // The first half of the run, in which the delay grows, is not judged. After it, a head that is not where its time
    // says was shown without a later frame.
    if (!sample.valid || now < 200 * kInterval) continue;
    const double x = std::fmod(static_cast<double>(sample.time_ns) / static_cast<double>(kInterval), 1000);
    starved += std::abs(sample.pose.head().position.x() - x) > 1e-6;
  }
  EXPECT_EQ(starved, 0u);
  // The jitter of 60 ms is more than half an interval, so it replaces that half in the delay.
  EXPECT_EQ(playout_.delay_ns(), kLateness + kInterval + kJitter);
  EXPECT_EQ(playout_.dropped_count(), 0u);
}

TEST_F(Playing, without_frames_it_goes_on_for_a_moment_freezes_and_eases_to_rest_in_half_a_second) {
  push_line(4);
  // This is the render time at which frame 4 is shown.
  const std::int64_t newest = 4 * kInterval + kDelay;
  (void)playout_.sample(newest - kInterval);
  // The speed, in m a ms, must fall from that of the frames. It decays over kGoOn_ns, 33 ms (playout.cpp), so the head
  // stops 8.25 m after frame 4: 10 m a frame of 40 ms, for 33 ms.
  double x = 40, speed = 10.0 / 40;
  for (int ms = 4; ms < 100; ms += 4) {
    const Playout::Sample sample = playout_.sample(newest + ms * kMs);
    const double now = sample.pose.head().position.x();
    EXPECT_GT(now, x);
    EXPECT_LT(now - x, 4 * speed);
    EXPECT_NEAR(displacement_of(sample)[0].x(), now * kStep_m, 1e-8);
    speed = (now - x) / 4;
    x = now;
  }
  EXPECT_LT(x, 50);
  // Hair is frozen until kFreeze_ns, 100 ms, after frame 4, and reaches rest after kEaseToRest_ns, 500 ms, more
  // (playout.cpp).
  auto last = static_cast<float>(x * kStep_m);
  for (int ms = 160; ms < 600; ms += 20) {
    const Playout::Sample sample = playout_.sample(newest + ms * kMs);
    EXPECT_LT(displacement_of(sample)[0].x(), last);
    EXPECT_GE(displacement_of(sample)[0].x(), 0);
    EXPECT_NEAR(sample.pose.head().position.x(), x, 0.5);
    last = displacement_of(sample)[0].x();
  }
  EXPECT_EQ(displacement_of(playout_.sample(newest + 601 * kMs))[0].x(), 0);
}

TEST_F(Playing, after_a_gap_the_way_begins_at_what_was_shown) {
  push_line(4);
  (void)playout_.sample(3 * kInterval + kDelay);
  // No frame comes between frames 4 and 24, so the hair has come to rest meanwhile.
  const std::int64_t resumed = 24 * kInterval + kLateness;
  EXPECT_EQ(displacement_of(playout_.sample(resumed - kMs))[0].x(), 0);
  push(24, 1000);
  const float first = displacement_of(playout_.sample(resumed))[0].x();
  // The new frame displaces the hair by 0.25 m. At its arrival the hair may show a twentieth of it at most.
  EXPECT_LT(first, 12.5e-3f);
  const float later = displacement_of(playout_.sample(resumed + 20 * kMs))[0].x();
  EXPECT_GT(later, first);
  EXPECT_LT(later, 0.25f);
}

TEST_F(Playing, a_frame_that_comes_after_its_turn_makes_no_jump) {
  push_line(4);
  // At this time, 5 ms before frame 5 is due, the motion goes on beyond frame 4.
  const std::int64_t late = 5 * kInterval + kDelay - 5 * kMs;
  const Playout::Sample before = playout_.sample(late);
  const double x = before.pose.head().position.x();
  const float moved = displacement_of(before)[0].x();
  const Quat turned(Eigen::AngleAxisd(0.5, Vec3::UnitY()));
  Frame frame = frame_at(20);
  frame.pose = rigid_pose({turned, Vec3(20, 0, 0)});
  playout_.push(frame, 5 * kInterval, late);
  const Playout::Sample after = playout_.sample(late);
  EXPECT_NEAR(after.pose.head().position.x(), x, 1e-9);
  EXPECT_LT(after.pose.head().rotation.angularDistance(Quat::Identity()), 1e-6);
  EXPECT_NEAR(displacement_of(after)[0].x(), moved, 1e-7);
  double last = x;
  for (int ms = 2; ms <= 120; ms += 2) {
    const double now = playout_.sample(late + ms * kMs).pose.head().position.x();
    // Frame 5 lies some 20 m behind what was shown. The correction spreads this over 40 ms, so 2 ms take less than 3 m.
    EXPECT_LT(std::abs(now - last), 3);
    last = now;
  }
}

TEST_F(Playing, a_frame_older_than_what_is_shown_still_corrects_it) {
  push_line(4);
  playout_.sample(5 * kInterval + kDelay + 10 * kMs);
  push(5, 50);
  EXPECT_EQ(playout_.dropped_count(), 0u);
  const Playout::Sample later = playout_.sample(5 * kInterval + kDelay + 90 * kMs);
  // Without frame 5 the head would have stopped before 50 m, since its speed decays after frame 4.
  EXPECT_GT(later.pose.head().position.x(), 55);
}

TEST_F(Playing, a_sleeping_frame_that_comes_again_with_its_basis_shows_its_hair) {
  push_line(1);
  Frame asleep = frame_at(20);
  asleep.asleep = true;
  // `asleep` is the frame as it is decoded before its basis has arrived; `whole` is the same frame with its hair.
  const Frame whole = std::exchange(asleep, [&] {
    Frame lacking = asleep;
    lacking.coefficients.clear();
    lacking.basis = nullptr;
    return lacking;
  }());
  playout_.push(asleep, 2 * kInterval, 2 * kInterval + kLateness);
  std::int64_t now = 2 * kInterval + kDelay + 2'000 * kMs;
  EXPECT_TRUE(displacement_of(playout_.sample(now)).empty());
  const std::int64_t delay = playout_.delay_ns();
  Frame again = whole;
  again.repeated = true;
  playout_.push(again, 2 * kInterval, now);
  EXPECT_EQ(playout_.dropped_count(), 0u);
  EXPECT_NEAR(displacement_of(playout_.sample(now))[0].x(), 0, 1e-7);
  EXPECT_NEAR(displacement_of(playout_.sample(now += 1'000 * kMs))[0].x(), 20 * kStep_m, 1e-7);
  EXPECT_NEAR(displacement_of(playout_.sample(now += 60'000 * kMs))[0].x(), 20 * kStep_m, 1e-7);
  // The repeated frame is two seconds old, but says nothing about the lateness of the connection.
  EXPECT_EQ(playout_.delay_ns(), delay);
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

TEST_F(Playing, hair_goes_on_across_a_change_of_level) {
  push_line(3);
  push(4, 40, LevelIndex::low);
  const Playout::Sample between = playout_.sample(3 * kInterval + kInterval / 2 + kDelay);
  ASSERT_EQ(displacement_of(between).size(), 2u);
  EXPECT_NEAR(displacement_of(between)[0].x(), kStep_m * 35, 1e-7);
  EXPECT_EQ(playout_.sample(4 * kInterval + kDelay).level, LevelIndex::low);
}

TEST_F(Playing, hair_without_coefficients_is_at_rest_and_eases_there) {
  push_line(3);
  push(4, 40, LevelIndex::rigid);
  // Frame 3 displaces the hair by 30 steps. Half way to the rigid frame 4 the hair must be on its way to rest.
  const Playout::Sample between = playout_.sample(3 * kInterval + kInterval / 2 + kDelay);
  ASSERT_EQ(displacement_of(between).size(), 2u);
  EXPECT_GT(displacement_of(between)[0].x(), kStep_m * 10);
  EXPECT_LT(displacement_of(between)[0].x(), kStep_m * 25);
  const Playout::Sample rigid = playout_.sample(4 * kInterval + kDelay);
  EXPECT_EQ(rigid.level, LevelIndex::rigid);
  EXPECT_TRUE(displacement_of(rigid).empty());
  EXPECT_FALSE(rigid.geometry());
}

TEST_F(Playing, coefficients_of_another_basis_are_not_mixed) {
  push_line(3);
  Frame other = frame_at(4);
  other.basis = std::make_shared<const KnownBasis>(small_basis(1));
  playout_.push(other, 4 * kInterval, 4 * kInterval + kLateness);
  EXPECT_NEAR(displacement_of(playout_.sample(4 * kInterval - 1 + kDelay))[0].x(), kStep_m * 30, 1e-7);
  // The basis of the other frames has 2 nodes.
  EXPECT_EQ(displacement_of(playout_.sample(4 * kInterval + kDelay)).size(), kSmallBasisNodes);
}

TEST_F(Playing, an_even_acceleration_is_played_exactly) {
  // Between frames the curve has the slopes of parabolas through them (playout.hpp), so a parabola is shown as it is.
  for (std::int64_t i = 0; i <= 9; ++i) push(i, static_cast<int>(3 * i * i));
  for (std::int64_t time = kInterval; time < 9 * kInterval; time += 7 * kMs) {
    const Playout::Sample sample = playout_.sample(time + kDelay);
    const double at = static_cast<double>(sample.time_ns) / static_cast<double>(kInterval);
    if (at < 1) continue;
    EXPECT_NEAR(displacement_of(sample)[0].x(), kStep_m * 3 * at * at, 1e-7);
  }
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
    ASSERT_EQ(displacement_of(sample).size(), 2u);
    EXPECT_NEAR(displacement_of(sample)[0].x(), kStep_m * 90, 1e-7);
  }
}

TEST_F(Playing, easing_hair_freezes_where_it_is_and_continues_from_there) {
  push_line(9);
  std::int64_t now = 0;
  for (; now < 9 * kInterval + kDelay + 350 * kMs; now += 10 * kMs) playout_.sample(now);
  // Hair freezes for 100 ms after the last frame, then eases to rest in 500 ms: after 350 ms it is halfway.
  const float x = displacement_of(playout_.sample(now))[0].x();
  EXPECT_LT(x, 0.9 * kStep_m * 90);
  EXPECT_GT(x, 0.1 * kStep_m * 90);
  playout_.freeze();
  for (int i = 0; i < 100; ++i) EXPECT_FLOAT_EQ(displacement_of(playout_.sample(now += 10 * kMs))[0].x(), x);
  float last = x;
  for (std::int64_t i = now / kInterval + 1; i < now / kInterval + 60; ++i) {
    push(i, 90);
    for (std::int64_t render = i * kInterval + kLateness; render < (i + 1) * kInterval + kLateness; render += 5 * kMs) {
      const float shown = displacement_of(playout_.sample(render))[0].x();
      // A step of 5 ms that moves hair by half of its displacement would be a jump.
      EXPECT_LT(std::abs(shown - last), 0.5 * kStep_m * 90);
      last = shown;
    }
  }
  EXPECT_NEAR(last, kStep_m * 90, 1e-7);
}

TEST_F(Playing, a_clock_that_is_corrected_between_two_frames_flings_nothing) {
  std::int64_t shift = 0;
  double last = 0;
  for (std::int64_t i = 0; i < 60; ++i) {
    // Here the estimate of the server's clock changes by almost an interval: the frame seems to be sampled 0.1 ms after
    // the last one. Taken at its word, the head would move 400 times as fast.
    if (i % 15 == 10) shift += kInterval - kMs / 10;
    Frame frame = frame_at(static_cast<int>(10 * i));
    frame.step_s = 0.04f;
    const std::int64_t time = i * kInterval - shift;
    playout_.push(frame, time, time + kLateness);
    for (std::int64_t part = 0; part < 4; ++part) {
      const Playout::Sample sample = playout_.sample(time + kLateness + part * kInterval / 4);
      const double x = sample.pose.head().position.x(),
                   shown = sample.coefficients.empty() ? 0 : double{sample.coefficients[0]};
      // The head may be between the frames that have arrived, or one frame (10 m) and rounding ahead of the newest.
      EXPECT_LE(x, 10.0 * static_cast<double>(i) + 11) << i;
      EXPECT_GE(x, last - 11) << i;
      EXPECT_NEAR(shown, kStep_m * x, 12 * kStep_m) << i;
      last = x;
    }
  }
}

// Plays hair whose modes swing at 0.5 to 3.3 Hz at once, 30 frames a second.
class Swinging : public ::testing::Test {
 protected:
  static constexpr std::int64_t kFrame = 33'333'333;
  static constexpr std::size_t kModes = 8;
  static std::vector<float> coefficients_at(double t) {
    std::vector<float> c;
    for (std::size_t k = 0; k < kModes; ++k) {
      const double hz = 0.5 + 0.4 * static_cast<double>(k);
      c.push_back(static_cast<float>(0.05 / hz * std::sin(2 * std::numbers::pi * hz * t + static_cast<double>(k))));
    }
    return c;
  }
  // Returns the RMS, over nodes and times, of the difference between the shown displacement and the true one at the
  // shown time, as a share of the motion. `comes` says whether frame i arrives; only every `stride`-th frame is sent.
  static double error(const std::function<bool(std::int64_t)>& comes, int stride = 1) {
    const auto basis = std::make_shared<const KnownBasis>(small_basis(kModes));
    Playout playout;
    double squares = 0, motion = 0;
    for (std::int64_t i = 0; i < 600; ++i) {
      const std::int64_t now = i * kFrame, jitter = (i * 7919 % 13) * kMs;
      if (i % stride == 0 && comes(i)) {
        Frame frame;
        frame.level = LevelIndex::low;
        frame.coefficients = coefficients_at(1e-9 * static_cast<double>(now));
        frame.basis = basis;
        playout.push(frame, now, now + jitter);
      }
      for (std::int64_t part = 0; part < 4; ++part) {
        const Playout::Sample sample = playout.sample(now + part * kFrame / 4);
        // The first 100 frames, in which the delay adapts to a jitter of up to 12 ms, are not judged.
        if (i < 100) continue;
        std::vector<Vec3f> wanted(kSmallBasisNodes);
        hairnet::displacements_of(basis->hair.basis, coefficients_at(1e-9 * static_cast<double>(sample.time_ns)),
                                  wanted);
        const std::vector<Vec3f> shown = displacement_of(sample);
        for (std::size_t node = 0; node < kSmallBasisNodes; ++node) {
          squares += double{(shown[node] - wanted[node]).squaredNorm()};
          motion += double{wanted[node].squaredNorm()};
        }
      }
    }
    return std::sqrt(squares / motion);
  }
};

TEST_F(Swinging, hair_is_shown_where_it_was) {
  const auto all = [](std::int64_t) { return true; };
  // The three cases have 30, 15 and 7.5 frames a second. The last one has only 2.3 frames for each swing of the fastest
  // mode, so hair is shown less exactly.
  EXPECT_LT(error(all), 0.002);
  EXPECT_LT(error(all, 2), 0.02);
  EXPECT_LT(error(all, 4), 0.12);
}

TEST_F(Swinging, a_fifth_of_the_frames_lost_at_random_leaves_it_smooth) {
  std::mt19937 random(3);
  std::vector<bool> lost;
  for (int i = 0; i < 600; ++i) lost.push_back(random() % 5 == 0);
  EXPECT_LT(error([&](std::int64_t i) { return !lost[static_cast<std::size_t>(i)]; }), 0.025);
}

TEST_F(Playing, memory_is_bounded_without_sampling) {
  for (std::int64_t i = 0; i < 10'000; ++i) push(i, 0);
  // Playout buffers at most kFramesMax, 256, frames (playout.cpp).
  EXPECT_EQ(playout_.dropped_count(), 10'000u - 256u);
}

}  // namespace
}  // namespace hairnet::link
