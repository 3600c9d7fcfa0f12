#include "tests/load/fleet.hpp"

#include <gmock/gmock.h>

#include "client/assets/made/made.hpp"
#include "tests/load/fake_server.hpp"

namespace hairnet::load {
namespace {

constexpr std::int64_t kStep_ns = 1'000'000;

// Runs load clients against a fake server in simulated time. The server has 30 ticks a second and samples each pose
// 25 ms late (FakeServer::kTick_ns, kPoseDelay_ns). The clients send 72 poses a second, the default of a plan.
class FleetTest : public testing::Test {
 protected:
  void plan(const std::vector<std::string>& stages, std::uint64_t seed = 1) {
    plan_ = Plan();
    plan_.seed = seed;
    for (const std::string& text : stages)
      plan_.stages.push_back(parse_stage(text, plan_.stages.empty() ? nullptr : &plan_.stages.back()).value());
    ASSERT_EQ(settle(plan_), "");
  }

  // Runs the plan in steps of a millisecond; `each` is called at each of them, before the server.
  template <class Each>
  void run(Each each) {
    server_ = FakeServer();
    tally_.emplace(plan_, 0);
    ClientContext context;
    context.seed = plan_.seed;
    context.grooms = &grooms_;
    context.motions = &motions_;
    context.touch_share = plan_.touch_share;
    context.props_share = plan_.props_share;
    context.connector = &server_;
    context.first_host = first_host_;
    context.make_protocol_client = [this](std::uint32_t, std::uint32_t) { return server_.make_protocol_client(); };
    context.tally = &*tally_;
    Fleet fleet(plan_, context, 0);
    const std::int64_t end_ns = plan_.stage_begin_ns(plan_.stages.size());
    for (std::int64_t now_ns = 0; now_ns < end_ns; now_ns += kStep_ns) {
      each(now_ns);
      server_.pump(now_ns);
      fleet.advance(now_ns);
      tally_->advance(now_ns);
    }
    fleet.finish(end_ns);
    tally_->finish(end_ns);
  }
  void run() {
    run([](std::int64_t) {});
  }
  [[nodiscard]] const StageTally& stage(std::size_t index) const { return tally_->stage(index); }

  Plan plan_;
  FakeServer server_;
  std::uint32_t first_host_ = 0;
  std::vector<EncodedGroom> grooms_{{"groom", {}, nullptr}};
  MotionBank motions_ = MotionBank::of({make_motion("dance").value(), make_motion("still").value()}, 72);
  std::optional<Tally> tally_;
};

TEST_F(FleetTest, counts_poses_and_frames_of_a_prompt_server) {
  plan({"ramp:2s:clients=4,characters=3", "steady:10s"});
  run();
  const Counts& counts = stage(1).counts;
  // Four clients with three characters each are there for 10 s.
  EXPECT_NEAR(counts.character_s, 120, 0.1);
  // A character may have two poses or frames more or fewer at the edges of the stage.
  EXPECT_NEAR(static_cast<double>(counts.poses_intended), 12 * 72 * 10, 24);
  EXPECT_NEAR(static_cast<double>(counts.frames), 12 * 30 * 10, 24);
  EXPECT_EQ(counts.frames_missed, 0u);
  EXPECT_EQ(counts.gap_ticks_max, 1u);
  EXPECT_THAT(server_.hosts, testing::Each(0u));
  EXPECT_EQ(counts.poses_unanswered, 0u);
  EXPECT_EQ(counts.poses_unsent, 0u);
  EXPECT_TRUE(counts.errors.empty());
  // The frames of the fake server have the level `low`, which has the index 2.
  EXPECT_EQ(counts.frames_by_level[2], counts.frames);
  // Each frame of the fake server has 600 bytes.
  EXPECT_EQ(counts.content_bytes, counts.frames * 600);
  // A pose waits for the sampling delay and for the next tick: between 25 ms and 25 ms and a tick, and one step.
  EXPECT_GE(stage(1).latency.min_ms(), 24.9);
  EXPECT_LE(stage(1).latency.max_ms(), 25 + 33.4 + 1.1);
  EXPECT_NEAR(stage(1).latency.mean_ms(), 25 + 33.3 / 2, 2);
  // A frame is 25 ms old at its tick, and arrives up to one step of 1 ms later. The step is also all jitter there is.
  EXPECT_NEAR(stage(1).frame_age.mean_ms(), 25.5, 1);
  EXPECT_LE(stage(1).jitter.max_ms(), 1.1);
  // All twelve characters joined during the ramp.
  EXPECT_EQ(stage(0).counts.joins, 12u);
}

TEST_F(FleetTest, a_share_of_the_clients_has_hands_which_hold_hair_and_are_timed_at_the_others) {
  plan({"steady:12s:clients=4,characters=1"});
  run();
  EXPECT_THAT(server_.with_hands, testing::IsEmpty());
  EXPECT_EQ(stage(0).hands_latency.count(), 0u);

  plan_.touch_share = 0.5;
  run();
  EXPECT_EQ(server_.with_hands.size(), 2u);
  const Counts& counts = stage(0).counts;
  // Two clients with hands send 72 samples a second for 12 s. They come within the first second.
  EXPECT_NEAR(static_cast<double>(counts.hands_sent), 2 * 72 * 12, 2 * 72 + 4);
  // The hands of one are seen by the three others.
  EXPECT_NEAR(static_cast<double>(stage(0).hands_latency.count()), 3.0 * static_cast<double>(counts.hands_sent),
              3 * 72);
  // The times are those of poses in the test before.
  EXPECT_GE(stage(0).hands_latency.min_ms(), 24.9);
  EXPECT_LE(stage(0).hands_latency.max_ms(), 25 + 33.4 + 1.1);
  EXPECT_NEAR(stage(0).hands_latency.mean_ms(), 25 + 33.3 / 2, 2);
  // Each holds hair once in five seconds, and pins it each second time.
  EXPECT_GE(counts.holds, 4u);
  // Each hold catches 20 points at the fake server.
  EXPECT_EQ(counts.held_points, 20 * counts.holds);
  for (const char* kind : {"take", "pin", "unpin", "drop"})
    EXPECT_GE(std::ranges::count(server_.holds, kind), 1) << kind;
}

TEST_F(FleetTest, a_share_of_the_clients_with_hands_sets_props_which_are_timed_at_the_others) {
  plan({"steady:12s:clients=4,characters=1"});
  plan_.touch_share = 0.5;
  run();
  EXPECT_THAT(server_.props_set, testing::IsEmpty());
  EXPECT_EQ(stage(0).props_latency.count(), 0u);

  plan_.props_share = 0.5;
  run();
  // One of the two clients with hands sets a prop. It is the last of the four, whose number is 3.
  std::size_t removed = 0;
  for (const wire::SetProps& set : server_.props_set) {
    removed += set.removed.size();
    for (const wire::Prop& prop : set.props) {
      EXPECT_EQ(prop.number, 3);
      EXPECT_EQ(wire::validate(prop), "");
    }
  }
  EXPECT_GE(removed, 1u);
  const Counts& counts = stage(0).counts;
  EXPECT_EQ(counts.props_sent, server_.props_set.size());
  // The prop moves for 2 s of 6 s, at each of 72 poses a second. A pose may be more or less at each edge.
  EXPECT_NEAR(static_cast<double>(counts.props_sent - removed), 12. / 6 * 2 * 72, 4);
  // The three others see each change, although a tick announces the newest one alone.
  EXPECT_EQ(stage(0).props_latency.count(), 3 * counts.props_sent);
  // A change waits for the next tick at most, and a step of 1 ms before it and after it.
  EXPECT_GT(stage(0).props_latency.min_ms(), 0);
  EXPECT_LE(stage(0).props_latency.max_ms(), 33.4 + 2.1);
  // Five poses come in the time of two ticks, so their places within a tick, 6.7 ms apart, shift the mean by 3.4 ms at
  // most.
  EXPECT_NEAR(stage(0).props_latency.mean_ms(), 33.3 / 2 + 1, 3.4 + 1);
}

TEST_F(FleetTest, clients_set_no_props_where_the_server_does_not_permit_it) {
  plan({"steady:8s:clients=4,characters=1"});
  plan_.touch_share = plan_.props_share = 1;
  run([this](std::int64_t) { server_.may_set_props = false; });
  EXPECT_EQ(server_.with_hands.size(), 4u);
  EXPECT_THAT(server_.props_set, testing::IsEmpty());
  EXPECT_EQ(stage(0).counts.props_sent, 0u);
}

// Changes that wait during a stall must not get lost in the figure.
TEST_F(FleetTest, stall_of_the_server_counts_as_latency_of_props) {
  // At the end, after 11 s, no prop is moved, so no change waits for a tick any more.
  plan({"steady:11s:clients=2,characters=1"});
  plan_.touch_share = plan_.props_share = 1;
  // The first client moves its prop from 6 s to 8 s.
  run([this](std::int64_t now_ns) { server_.stalled = now_ns >= 6'500'000'000 && now_ns < 7'500'000'000; });
  EXPECT_EQ(stage(0).props_latency.count(), stage(0).counts.props_sent);
  // The stall is 1 s, and a tick and steps come on top.
  EXPECT_NEAR(stage(0).props_latency.max_ms(), 1000, 40);
}

// A generator that waits for a stalled server would send fewer poses during the stall and so measure hardly any of it
// (coordinated omission).
TEST_F(FleetTest, stalled_server_delays_no_pose_and_its_stall_counts_as_latency) {
  plan({"steady:10s:clients=5,characters=2"});
  run();
  const std::vector<std::pair<std::int64_t, std::int64_t>> prompt = server_.poses;
  const std::uint64_t intended = stage(0).counts.poses_intended;

  run([this](std::int64_t now_ns) { server_.stalled = now_ns >= 4'000'000'000 && now_ns < 5'000'000'000; });
  // The clients capture and send at the same times as before: the stall slows no client down.
  EXPECT_EQ(server_.poses, prompt);
  EXPECT_EQ(stage(0).counts.poses_intended, intended);
  // The longest wait is the stall of 1 s. The sampling delay and a tick, 58 ms, come on top.
  EXPECT_NEAR(stage(0).latency.max_ms(), 1000, 80);
  // A tenth of all poses was captured during the stall of 1 s, and waited for 500 ms on average. If they were left out,
  // the quantile would be that of a prompt server.
  EXPECT_NEAR(stage(0).latency.quantile_ms(0.95), 500, 100);
  EXPECT_EQ(stage(0).latency.count(), stage(0).counts.poses_answered + stage(0).counts.poses_unanswered);
  // Poses without an answer count only after 250 ms (kAnswerWait_ns), so some of the last half second may be missing
  // here.
  EXPECT_GE(stage(0).latency.count() + 10 * 72 / 2, intended);
  // Each of the ten characters misses the 30 frames of the second.
  EXPECT_NEAR(static_cast<double>(stage(0).counts.frames_missed), 10 * 30, 20);
  EXPECT_NEAR(static_cast<double>(stage(0).counts.gap_ticks_max), 30, 1);
}

TEST_F(FleetTest, poses_without_an_answer_count_with_their_waiting_time) {
  plan({"steady:6s:clients=2,characters=1"});
  run([this](std::int64_t now_ns) { server_.stalled = now_ns >= 3'000'000'000; });
  // The server stalls for the last 3 s. Poses of the last 250 ms (kAnswerWait_ns) may still be answered, and do not
  // count.
  EXPECT_NEAR(static_cast<double>(stage(0).counts.poses_unanswered), 2 * 72 * (3 - 0.25), 10);
  EXPECT_NEAR(stage(0).latency.max_ms(), 3000, 80);
}

TEST_F(FleetTest, server_that_welcomes_no_client_has_unanswered_joins) {
  plan({"steady:3s:clients=4,characters=2"});
  run([this](std::int64_t) { server_.stalled = true; });
  EXPECT_EQ(stage(0).counts.joins, 0u);
  // Each of the eight characters waits for its join.
  EXPECT_EQ(stage(0).counts.joins_unanswered, 8u);
  // Clients of a steady stage come within its first second, so some wait for more than 2 of the 3 s.
  EXPECT_GT(stage(0).join.max_ms(), 2000);
}

TEST_F(FleetTest, lost_connections_are_errors_and_clients_return) {
  plan({"ramp:1s:clients=3,characters=1", "steady:8s"});
  run([this](std::int64_t now_ns) {
    if (now_ns == 3'000'000'000) server_.drop_all(now_ns);
  });
  EXPECT_EQ(stage(1).counts.errors.at("closed_reset"), 3u);
  // Each of the three clients connects twice.
  EXPECT_EQ(server_.connect_count, 6u);
  // A fake client connects again 600 ms after its loss: poses of more than half a second and less than a second are
  // not sent.
  EXPECT_GT(stage(1).counts.poses_unsent, 3u * 72 / 2 - 10);
  EXPECT_LT(stage(1).counts.poses_unsent, 3u * 72);
  EXPECT_EQ(stage(1).counts.joins, 3u);
  EXPECT_EQ(stage(1).counts.poses_intended, stage(1).counts.poses_sent + stage(1).counts.poses_unsent);
}

TEST_F(FleetTest, reconnect_storm_reconnects_its_share_without_errors) {
  plan({"ramp:1s:clients=8,characters=1", "steady:6s:storm=50%"});
  run();
  // Half of the eight clients lose their connections, and connect a second time.
  EXPECT_EQ(server_.connect_count, 12u);
  EXPECT_TRUE(stage(1).counts.errors.empty());
  EXPECT_EQ(stage(1).counts.joins, 4u);
  // A client is away for 600 ms, and is welcomed at the next tick.
  EXPECT_GT(stage(1).join.min_ms(), 600);
  EXPECT_LT(stage(1).join.max_ms(), 750);
  EXPECT_EQ(stage(1).counts.resumes, 4u);
}

TEST_F(FleetTest, generator_that_sleeps_reports_it) {
  plan({"steady:5s:clients=3,characters=1"});
  server_ = FakeServer();
  tally_.emplace(plan_, 0);
  ClientContext context;
  context.grooms = &grooms_;
  context.motions = &motions_;
  context.connector = &server_;
  context.make_protocol_client = [this](std::uint32_t, std::uint32_t) { return server_.make_protocol_client(); };
  context.tally = &*tally_;
  Fleet fleet(plan_, context, 0);
  // The generator stands still once, from 2 s to 2.4 s.
  for (std::int64_t now_ns = 0; now_ns < 5'000'000'000; now_ns += now_ns == 2'000'000'000 ? 400 * kStep_ns : kStep_ns) {
    server_.pump(now_ns);
    fleet.advance(now_ns);
  }
  // The first pose of the gap is late by nearly 400 ms. All other poses are late by a step of 1 ms at most.
  EXPECT_GT(tally_->lag().max_ms(), 350);
  EXPECT_LT(tally_->lag().quantile_ms(0.5), 1.1);
  // Poses that are sent late still have the times at which they were meant to be captured.
  std::int64_t last_ns = 0;
  std::size_t late = 0;
  for (const auto& [captured_ns, pushed_ns] : server_.poses) {
    EXPECT_LE(captured_ns, pushed_ns);
    late += pushed_ns - captured_ns > 100'000'000 ? 1 : 0;
    last_ns = std::max(last_ns, captured_ns);
  }
  // The poses of the first 300 ms of the 400 ms are sent more than 100 ms late.
  EXPECT_NEAR(static_cast<double>(late), 3 * 72 * 0.3, 6);
}

TEST_F(FleetTest, clients_come_from_hosts_of_their_own_where_the_run_wants_it) {
  plan({"steady:2s:clients=3,silent=1"});
  first_host_ = 0x010001;
  run();
  EXPECT_THAT(server_.hosts, testing::UnorderedElementsAre(0x010001u, 0x010002u, 0x010003u, 0x010004u));
}

TEST_F(FleetTest, the_same_seed_sends_the_same_poses) {
  plan({"ramp:2s:clients=6,characters=2", "steady:5s:churn=2"});
  run();
  const auto first = server_.poses;
  run();
  EXPECT_EQ(server_.poses, first);
  plan({"ramp:2s:clients=6,characters=2", "steady:5s:churn=2"}, 2);
  run();
  EXPECT_NE(server_.poses, first);
}

}  // namespace
}  // namespace hairnet::load
