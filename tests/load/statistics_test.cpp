#include <gmock/gmock.h>

#include "core/random.hpp"
#include "tests/load/exposition.hpp"
#include "tests/load/frame_check.hpp"
#include "tests/load/latency_histogram.hpp"
#include "tests/load/process_sampler.hpp"
#include "tests/load/requirement.hpp"
#include "tests/load/stage_figures.hpp"
#include "tests/load/tally.hpp"

#include <unistd.h>

namespace hairnet::load {
namespace {

using testing::DoubleNear;
using testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;

TEST(LatencyHistogram, quantiles_equal_those_of_sorted_times_within_a_bin) {
  LatencyHistogram histogram;
  std::vector<double> sorted_ms;
  Random random(3);
  for (int i = 0; i < 20'000; ++i) {
    const double time_ms = std::exp(random.between(std::log(0.01), std::log(5000.0)));
    histogram.record(static_cast<std::int64_t>(time_ms * 1e6));
    sorted_ms.push_back(time_ms);
  }
  std::ranges::sort(sorted_ms);
  for (const double share : {0.001, 0.1, 0.5, 0.9, 0.99, 0.999}) {
    const double exact = sorted_ms[static_cast<std::size_t>(std::ceil(share * 20'000)) - 1];
    // The histogram has 4096 logarithmic bins between 1 us and 1000 s, so a bin is 0.51 % wide.
    EXPECT_THAT(histogram.quantile_ms(share), DoubleNear(exact, 0.0055 * exact)) << share;
  }
  EXPECT_DOUBLE_EQ(histogram.quantile_ms(1), histogram.max_ms());
  EXPECT_NEAR(histogram.max_ms(), sorted_ms.back(), 1e-5);
  EXPECT_NEAR(histogram.min_ms(), sorted_ms.front(), 1e-5);
}

TEST(LatencyHistogram, is_zero_when_empty_and_takes_any_time) {
  LatencyHistogram histogram;
  EXPECT_EQ(histogram.quantile_ms(0.5), 0);
  EXPECT_EQ(histogram.mean_ms(), 0);
  EXPECT_TRUE(histogram.tail().empty());
  for (const std::int64_t time_ns : {std::int64_t{-5}, std::int64_t{0}, std::int64_t{1} << 62})
    histogram.record(time_ns);
  EXPECT_EQ(histogram.count(), 3u);
  // The bins end at 1000 s, but the largest quantile is the exact maximum, 2^62 ns.
  EXPECT_GT(histogram.quantile_ms(1), 1e9);
}

TEST(LatencyHistogram, merged_histograms_equal_one_recorded_together) {
  LatencyHistogram a, b, both;
  for (int i = 1; i <= 100; ++i) {
    // One third of the times goes to `b`, so the two parts differ in size.
    (i % 3 ? a : b).record(i * kMs);
    both.record(i * kMs);
  }
  a.merge(b);
  EXPECT_EQ(a.count(), both.count());
  EXPECT_DOUBLE_EQ(a.mean_ms(), both.mean_ms());
  for (const double share : {0.01, 0.5, 0.99}) EXPECT_DOUBLE_EQ(a.quantile_ms(share), both.quantile_ms(share));
}

TEST(LatencyHistogram, tail_falls_to_zero) {
  LatencyHistogram histogram;
  for (int i = 1; i <= 1000; ++i) histogram.record(i * kMs);
  const auto tail = histogram.tail(50);
  ASSERT_GE(tail.size(), 10u);
  ASSERT_LE(tail.size(), 50u);
  for (std::size_t i = 1; i < tail.size(); ++i) {
    EXPECT_GT(tail[i].first, tail[i - 1].first);
    EXPECT_LE(tail[i].second, tail[i - 1].second);
  }
  EXPECT_EQ(tail.back().second, 0);
}

// The first stage lasts 10 s, whose first 2 s are a warm-up that is not measured. The second one follows for 10 s.
Plan two_stages() {
  Plan plan;
  plan.stages.push_back(parse_stage("steady:10s:warm=2s", nullptr).value());
  plan.stages.push_back(parse_stage("steady:10s", &plan.stages[0]).value());
  EXPECT_EQ(settle(plan), "");
  return plan;
}

TEST(Tally, counts_events_in_their_windows) {
  constexpr std::int64_t kBegin = 1'000'000 * kMs;
  Tally tally(two_stages(), kBegin);
  const auto at = [](double s) { return kBegin + static_cast<std::int64_t>(s * 1e9); };
  // The warm-up does not count.
  tally.count(at(1), &Counts::frames_missed, 5);
  tally.count(at(3), &Counts::frames_missed, 2);
  tally.count(at(12), &Counts::frames_missed, 3);
  // Nothing counts after the end of the last stage.
  tally.count(at(25), &Counts::frames_missed, 9);
  // Times may come out of order. An event at the edge of two parts belongs to the later part.
  tally.count(at(2), &Counts::frames_missed, 1);
  // An answer belongs to the stage in which its pose was captured, here the first one.
  tally.record_answer(at(9.9), at(12), 1);
  tally.record_unanswered(at(15), at(20), 2);
  EXPECT_EQ(tally.stage(0).counts.frames_missed, 3u);
  EXPECT_EQ(tally.stage(1).counts.frames_missed, 3u);
  EXPECT_EQ(tally.stage(0).latency.count(), 1u);
  // The answer came 12 s - 9.9 s after the capture.
  EXPECT_NEAR(tally.stage(0).latency.max_ms(), 2100, 1e-6);
  EXPECT_EQ(tally.stage(1).counts.poses_unanswered, 2u);
  // A pose without an answer counts as late as it has waited, 20 s - 15 s.
  EXPECT_NEAR(tally.stage(1).latency.max_ms(), 5000, 1e-6);
}

TEST(Tally, windows_cover_the_run_and_sum_to_it) {
  Tally tally(two_stages(), 0);
  std::uint64_t frames = 0;
  for (int ms = 0; ms < 20'000; ms += 10) {
    tally.note_population(ms * kMs, 2, 8);
    tally.record_frame(ms * kMs, LevelIndex::medium, 2, 10, false, true);
    // Each answer comes three seconds after the capture of its pose, so it arrives in a later window than that of the
    // capture.
    tally.record_answer(std::max(0, ms - 3000) * kMs, ms * kMs, 1);
    ++frames;
    tally.advance(ms * kMs);
  }
  tally.finish(20'000 * kMs);
  ASSERT_EQ(tally.windows().size(), 20u);
  std::uint64_t sum = 0;
  for (const WindowFigures& window : tally.windows()) {
    sum += window.frames;
    EXPECT_DOUBLE_EQ(window.duration_s, 1);
    EXPECT_EQ(window.frames_by_level[1], window.frames);
  }
  EXPECT_EQ(sum, frames);
  EXPECT_NEAR(tally.windows()[5].latency_p50_ms, 3000, 20);
  EXPECT_NEAR(tally.windows()[5].characters, 8, 0.1);
  EXPECT_EQ(tally.stage(1).counts.frames_by_stride[1], tally.stage(1).counts.frames);
}

// The counts are round numbers, so that each figure below can be checked by mental arithmetic: 980 + 20 frames, 10 s,
// 100 character-seconds and 50 client-seconds.
TEST(StageFigures, are_rates_of_counts) {
  StageTally tally;
  tally.counts.frames = 980;
  tally.counts.frames_missed = 20;
  tally.counts.frames_by_level[0] = 245;
  tally.counts.frames_by_level[static_cast<std::size_t>(LevelIndex::rigid)] = 735;
  tally.counts.bytes_in = 10'000;
  // These are five bytes for each of the 980 frames.
  tally.counts.content_bytes = 4'900;
  tally.counts.character_s = 100;
  tally.counts.client_s = 50;
  tally.counts.poses_intended = 1000;
  tally.counts.poses_unsent = 10;
  tally.counts.errors["reset"] = 3;
  tally.counts.errors["refused"] = 4;
  tally.latency.record(40 * kMs, 99);
  tally.latency.record(90 * kMs, 1);
  StageInputs inputs;
  inputs.tally = &tally;
  inputs.duration_s = 10;
  inputs.own = ProcessUse{2, 10, {}};
  const Figures figures = make_figures(inputs);
  EXPECT_DOUBLE_EQ(figures.at("frames_missed_share"), 0.02);
  EXPECT_DOUBLE_EQ(figures.at("level_high_share"), 0.25);
  EXPECT_DOUBLE_EQ(figures.at("level_rigid_share"), 0.75);
  EXPECT_DOUBLE_EQ(figures.at("bytes_in_per_character_s"), 100);
  EXPECT_DOUBLE_EQ(figures.at("content_bytes_per_frame"), 5);
  EXPECT_DOUBLE_EQ(figures.at("characters"), 10);
  EXPECT_DOUBLE_EQ(figures.at("clients"), 5);
  EXPECT_DOUBLE_EQ(figures.at("poses_unsent_share"), 0.01);
  EXPECT_DOUBLE_EQ(figures.at("errors"), 7);
  EXPECT_DOUBLE_EQ(figures.at("error.refused"), 4);
  EXPECT_DOUBLE_EQ(figures.at("generator_cpu_cores"), 0.2);
  EXPECT_DOUBLE_EQ(figures.at("generator_cpu_us_per_character_s"), 20'000);
  // Quantiles are exact to one bin of the histogram, 0.51 %.
  EXPECT_NEAR(figures.at("latency_p99_ms"), 40, 0.3);
  EXPECT_NEAR(figures.at("latency_p999_ms"), 90, 0.5);
  // Nobody sampled the server here, so the figure must be absent, not zero.
  EXPECT_EQ(figures.count("server_cpu_cores"), 0u);
}

TEST(StageFigures, tell_props_of_clients_with_hands) {
  StageTally tally;
  StageInputs inputs;
  inputs.tally = &tally;
  EXPECT_FALSE(make_figures(inputs).contains("props_sent"));
  // A server that permits no props must show as zero, so that a threshold on it fails.
  tally.counts.hands_sent = 10;
  EXPECT_DOUBLE_EQ(make_figures(inputs).at("props_sent"), 0);
  EXPECT_FALSE(make_figures(inputs).contains("props_latency_p50_ms"));
  tally.counts.props_sent = 3;
  tally.props_latency.record(20 * kMs, 98);
  tally.props_latency.record(60 * kMs, 2);
  const Figures figures = make_figures(inputs);
  EXPECT_DOUBLE_EQ(figures.at("props_sent"), 3);
  // Quantiles are exact to one bin of the histogram, 0.51 %.
  EXPECT_NEAR(figures.at("props_latency_p50_ms"), 20, 0.2);
  EXPECT_NEAR(figures.at("props_latency_p99_ms"), 60, 0.4);
  for (const char* name : {"props_latency_p50_ms", "props_sent"})
    EXPECT_EQ(std::ranges::count(figure_names(), name, &FigureName::name), 1) << name;
}

TEST(Requirement, reads_every_relation) {
  const auto holds_for = [](const char* text, double value) {
    const auto requirement = parse_requirement(text);
    EXPECT_TRUE(requirement) << text;
    return requirement && is_met(*requirement, value);
  };
  EXPECT_TRUE(holds_for("latency_p99_ms<40", 39.9));
  EXPECT_FALSE(holds_for("latency_p99_ms<40", 40));
  EXPECT_TRUE(holds_for("latency_p99_ms <= 40", 40));
  EXPECT_TRUE(holds_for("frames>1e3", 1001));
  EXPECT_FALSE(holds_for("frames>1e3", 1000));
  EXPECT_TRUE(holds_for("frames>=1000", 1000));
  EXPECT_TRUE(holds_for("errors==0", 0));
  EXPECT_FALSE(holds_for("errors==0", 1));
  const auto staged = parse_requirement("storm2/error.closed_reset<=3");
  ASSERT_TRUE(staged);
  EXPECT_EQ(staged->stage, "storm2");
  EXPECT_EQ(staged->figure, "error.closed_reset");
}

TEST(Requirement, refuses_invalid_requirements) {
  for (const char* text : {"", "latency", "latency=40", "<40", "latency<", "latency<x", "latency<40ms", "latency<nan",
                           "latency<inf", "/latency<4", "a b<3", "Latency<4", "latency<<4", "a/b/c<4"}) {
    const auto requirement = parse_requirement(text);
    ASSERT_FALSE(requirement) << text;
    EXPECT_THAT(requirement.error(), HasSubstr("it looks like"));
  }
}

TEST(Requirement, applies_to_all_measured_stages_or_to_one) {
  const Figures good{{"x", 1}}, bad{{"x", 9}};
  // The middle member says whether the stage is measured.
  const std::vector<NamedFigures> stages{{"ramp", false, &bad}, {"steady", true, &good}, {"storm", true, &bad}};
  const auto judged = [&](const char* text) { return judge({parse_requirement(text).value()}, stages); };
  const auto all = judged("x<5");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_TRUE(all[0].met);
  EXPECT_FALSE(all[1].met);
  EXPECT_EQ(all[1].stage, "storm");
  ASSERT_EQ(judged("ramp/x<5").size(), 1u);
  EXPECT_FALSE(judged("ramp/x<5")[0].met);
  EXPECT_FALSE(judged("nowhere/x<5")[0].met);
  EXPECT_FALSE(judged("steady/y<5")[0].met);
  EXPECT_FALSE(judged("steady/y<5")[0].value);
}

TEST(Figures, attack_is_compared_with_the_calm_stages_around_it) {
  Figures attack{{"frames_missed_share", 0.5}, {"latency_p99_ms", 70}};
  compare_with_calm(attack, {{"frames_missed_share", 0.1}, {"latency_p99_ms", 60}, {"server_resident_mib", 100}},
                    {{"frames_missed_share", 0}, {"server_resident_mib", 130}});
  EXPECT_DOUBLE_EQ(attack.at("frames_missed_share_over_calm"), 0.4);
  EXPECT_DOUBLE_EQ(attack.at("latency_p99_ms_over_calm"), 10);
  EXPECT_DOUBLE_EQ(attack.at("server_resident_after_mib_over_calm"), 30);
  EXPECT_FALSE(attack.contains("level_high_share_over_calm"));
}

TEST(Figures, server_ticks_come_from_its_metrics) {
  const StageTally tally;
  const Exposition metrics{{"hairnet_ticks_skipped_total", 3}, {"hairnet_ticks_overrun_total", 5}};
  StageInputs inputs;
  inputs.tally = &tally;
  EXPECT_FALSE(make_figures(inputs).contains("server_ticks_skipped"));
  inputs.server_metrics = &metrics;
  EXPECT_DOUBLE_EQ(make_figures(inputs).at("server_ticks_skipped"), 3);
  EXPECT_DOUBLE_EQ(make_figures(inputs).at("server_ticks_overrun"), 5);
}

TEST(Tally, gaps_count_missed_frames_by_stride) {
  Plan plan;
  plan.stages.resize(1);
  plan.stages[0].duration_s = 10;
  Tally tally(plan, 0);
  // Every second tick has a frame, so a gap of two ticks misses none.
  tally.record_gap(1, 2, 2);
  EXPECT_EQ(tally.stage(0).counts.gap_ticks_max, 1u);
  // With a stride of two, a gap of eight ticks misses the frames of ticks 2, 4 and 6.
  tally.record_gap(1, 8, 2);
  EXPECT_EQ(tally.stage(0).counts.gap_ticks_max, 7u);
  EXPECT_EQ(tally.stage(0).counts.frames_missed, 3u);
}

TEST(ProcessSampler, reads_names_with_spaces_and_parentheses) {
  const auto line =
      // The fields 14 and 15 of proc(5) are the processor time in ticks: 250 for the program, 150 for the system.
      parse_stat_line("42 (a (b) c) S 1 42 42 0 -1 4194560 100 0 0 0 250 150 0 0 20 0 4 0 1000 100000 500 184", 100);
  ASSERT_TRUE(line);
  EXPECT_EQ(line->name, "a (b) c");
  EXPECT_EQ(line->parent, 1);
  // (250 + 150) ticks are 4 s at 100 ticks a second.
  EXPECT_DOUBLE_EQ(line->cpu_s, 4);
  for (const char* bad : {"", "42", "42 (x", "42 (x) S 1 2", ")(", "42 (x)"})
    EXPECT_FALSE(parse_stat_line(bad, 100)) << bad;
}

TEST(ProcessSampler, treats_an_ended_process_as_none) {
  // A zombie (Z) and a dead process (X) still have a line, with their last figures.
  for (const char* ended : {"42 (x) Z 1 42 42 0 -1 4227084 100 0 0 0 250 150 0 0 20 0 1 0 1000 0 0 184",
                            "42 (x) X 1 42 42 0 -1 4227084 100 0 0 0 250 150 0 0 20 0 1 0 1000 0 0 184"})
    EXPECT_FALSE(parse_stat_line(ended, 100)) << ended;
}

TEST(ProcessSampler, sees_this_process_and_no_ended_one) {
  const auto before = sample_process(getpid());
  ASSERT_TRUE(before);
  EXPECT_GT(before->resident_mib, 1);
  volatile double sink = 0;
  std::optional<ProcessUse> after;
  do {
    for (int i = 0; i < 10'000'000; ++i) sink = sink + i;
    after = sample_process(getpid());
  } while (after->cpu_s - before->cpu_s < 0.05);
  const ProcessUse use = use_between(*before, *after);
  EXPECT_GE(use.cpu_s, 0.05);
  double threads_s = 0;
  for (const auto& [name, cpu_s] : use.thread_cpu_s) threads_s += cpu_s;
  // The system counts in ticks, usually of 10 ms, and the whole and its threads are read one after the other.
  EXPECT_NEAR(threads_s, use.cpu_s, 0.03);
  // No process has this number: the largest of Linux is 2^22.
  EXPECT_FALSE(sample_process(0x3fffffff));
}

TEST(Exposition, reads_samples_and_their_growth) {
  const Exposition from = parse_exposition(
      "# HELP hairnet_ticks_total ticks\n# TYPE hairnet_ticks_total counter\nhairnet_ticks_total 100\n"
      "hairnet_tick_seconds_sum 1.5\nhairnet_tick_seconds_count 100\nhairnet_rooms 3\n");
  const Exposition to = parse_exposition(
      "hairnet_ticks_total 160\r\nhairnet_tick_seconds_sum 1.8\nhairnet_tick_seconds_count 160\nhairnet_rooms 2\n"
      // The label has a brace and a number, and a time stamp follows the value: neither may be taken for the value.
      // The last two lines are no samples.
      "hairnet_refused_total{reason=\"a } b 7\",x=\"y\"} 5 1700000000000\nnonsense\nhalf \n");
  EXPECT_EQ(from.size(), 4u);
  const Exposition grown = exposition_between(from, to);
  EXPECT_DOUBLE_EQ(grown.at("hairnet_ticks_total"), 60);
  // A gauge has its later value, not its growth.
  EXPECT_DOUBLE_EQ(grown.at("hairnet_rooms"), 2);
  EXPECT_DOUBLE_EQ(grown.at("hairnet_refused_total{reason=\"a } b 7\",x=\"y\"}"), 5);
  // The mean is that of the time between: (1.8 s - 1.5 s) / (160 - 100).
  EXPECT_NEAR(grown.at("hairnet_tick_seconds_mean"), 0.005, 1e-12);
}

TEST(Exposition, accepts_only_a_valid_answer) {
  EXPECT_EQ(http_body("HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\n\r\nx 1\n"), "x 1\n");
  EXPECT_EQ(http_body("HTTP/1.1 404 Not Found\r\n\r\nx 1\n"), "");
  EXPECT_EQ(http_body("\x20\x00\x00\x00HNET"), "");
  // An empty answer is what a connection that closes at once gives.
  EXPECT_EQ(http_body(""), "");
}

TEST(FrameCheck, finds_each_kind_of_error) {
  const auto failures_of = [](auto change) {
    FrameCheck check(1, 1);
    Pose pose = rigid_pose(RigidTransform{});
    std::vector<float> hair{0.01f, 0.02f, -0.03f};
    FrameSeen frame;
    frame.character = 1;
    frame.level = LevelIndex::low;
    for (int i = 0; i < 300; ++i) {
      frame.tick = static_cast<std::uint64_t>(i) + 1;
      frame.sample_time_local_ns = i * 33 * kMs;
      frame.pose = &pose;
      frame.coefficients = hair;
      // Frame 250 has the error. Head and hair have then been at rest for 8.25 s, and `moves_at_rest` is checked
      // after 5 s.
      if (i == 250) change(frame, pose, hair);
      check.on_frame(0, frame);
    }
    std::vector<std::string> names;
    for (const auto& [name, count] : check.failures()) names.push_back(name);
    EXPECT_EQ(check.checked(), 300u);
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(failures_of([](FrameSeen&, Pose&, auto&) {}), Names{});
  EXPECT_EQ(failures_of([](FrameSeen&, Pose& pose, auto&) { pose.bones[1].rotation.coeffs() *= 1.1; }),
            Names{"pose_invalid"});
  EXPECT_EQ(failures_of([](FrameSeen& frame, Pose&, auto&) { frame.tick = 7; }), Names{"tick_went_back"});
  EXPECT_EQ(failures_of([](FrameSeen& frame, Pose& pose, auto& hair) {
              // The head moves, so hair may move too, but 11 m are above the bound of 10 m.
              pose.bones[0].position.x() += 1;
              hair[2] = 11;
              frame.coefficients = hair;
            }),
            Names{"beyond_bound"});
  // Hair at rest may move by 5 mm from frame to frame, not by 20 mm.
  EXPECT_EQ(failures_of([](FrameSeen&, Pose&, auto& hair) { hair[0] += 0.02f; }), Names{"moves_at_rest"});
}

// The server goes away after frame 249, when head and hair have been at rest for more than 5 s. Frames 250 to 254 are
// rigid, until the levels are there again. Then the hair must be where it was.
TEST(FrameCheck, expects_resting_hair_unchanged_when_the_server_is_back) {
  const auto failures_of = [](float jump_m) {
    FrameCheck check(1, 1);
    const Pose pose = rigid_pose(RigidTransform{});
    std::vector<float> hair{0.01f, 0.02f, -0.03f};
    FrameSeen frame;
    frame.character = 1;
    frame.pose = &pose;
    for (int i = 0; i < 300; ++i) {
      if (i % 250 == 0) check.on_welcome(0);
      frame.tick = static_cast<std::uint64_t>(i % 250) + 1;
      frame.sample_time_local_ns = i * 33 * kMs;
      frame.discontinuous = i % 250 == 0;
      if (i == 255) hair[1] += jump_m;
      // The character has its former level again from frame 255 on.
      const bool is_back = i < 250 || i >= 255;
      frame.level = is_back ? LevelIndex::low : LevelIndex::rigid;
      frame.coefficients = is_back ? std::span<const float>(hair) : std::span<const float>();
      check.on_frame(0, frame);
    }
    return check.failures();
  };
  // The limit is kRestMotionMax_m of frame_check.cpp, 5 mm.
  EXPECT_TRUE(failures_of(0.0045f).empty());
  EXPECT_EQ(failures_of(0.0055f).at("moves_at_rest"), 1u);
}

TEST(FrameCheck, checks_its_share_only) {
  FrameCheck check(5, 0.25);
  const Pose pose = rigid_pose(RigidTransform{});
  FrameSeen frame;
  frame.pose = &pose;
  frame.tick = 1;
  frame.character = 1;
  for (std::uint32_t client = 0; client < 4000; ++client) check.on_frame(client, frame);
  // A quarter of 4000 characters is chosen by chance: the standard deviation is 27, and 150 is more than five of
  // them.
  EXPECT_NEAR(static_cast<double>(check.checked()), 1000, 150);
}

}  // namespace
}  // namespace hairnet::load
