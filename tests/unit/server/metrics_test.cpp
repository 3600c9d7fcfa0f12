#include "server/app/metrics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <thread>

#include "server/app/process_gauges.hpp"
#include "server/telemetry/log_text.hpp"
#include "tests/unit/server/exposition.hpp"

namespace hairnet::server {
namespace {

Exposition exposition_of(const Metrics& metrics) {
  Exposition exposition;
  std::string error;
  EXPECT_TRUE(parse_exposition(prometheus_text(metrics), exposition, error)) << error;
  return exposition;
}

TEST(Metrics, a_fresh_server_shows_every_counter_at_zero_and_no_unset_gauge) {
  const Metrics metrics;
  const Exposition exposition = exposition_of(metrics);
  EXPECT_EQ(exposition.value("hairnet_ticks_run_total"), 0);
  EXPECT_EQ(exposition.value("hairnet_poses_rejected_total", "reason", "stale"), 0);
  EXPECT_FALSE(exposition.families.contains("hairnet_clients"));
  EXPECT_EQ(exposition.families.at("hairnet_build_info").samples.at(0).value, 1);
}

TEST(Metrics, every_counter_gauge_and_histogram_is_a_series_of_its_own) {
  Metrics metrics;
  metrics.session.gauges.clients.set(3);
  metrics.tick.gauges.characters[LevelIndex::low].set(7);
  metrics.tick.gauges.characters_by_state_asleep.set(2.5);
  metrics.tick.gauges.step_cost_seconds[LevelIndex::high].set(1e-5);
  metrics.room.poses_rejected_out_of_order.add(5);
  metrics.session.poses_rejected_not_unit.add(6);
  metrics.session.sessions_closed_by_server_idle.add(2);
  metrics.session.sessions_closed.add(9);
  metrics.level_cache.level_cache_rejected_damaged.add(4);
  metrics.tick.step_ns_total.add(2'500'000'000);
  // Doubles are exact up to 2^53; the text must not round this number.
  metrics.transport.bytes_read.add(std::uint64_t{1} << 52);
  const Exposition exposition = exposition_of(metrics);
  EXPECT_EQ(exposition.value("hairnet_clients"), 3);
  EXPECT_EQ(exposition.value("hairnet_characters", "level", "low"), 7);
  EXPECT_EQ(exposition.value("hairnet_characters_by_state", "state", "asleep"), 2.5);
  EXPECT_EQ(exposition.value("hairnet_step_cost_seconds", "level", "high"), 1e-5);
  EXPECT_EQ(exposition.value("hairnet_poses_rejected_total", "reason", "out_of_order"), 5);
  EXPECT_EQ(exposition.value("hairnet_poses_rejected_total", "reason", "not_unit"), 6);
  EXPECT_EQ(exposition.value("hairnet_sessions_closed_by_server_total", "reason", "idle"), 2);
  EXPECT_EQ(exposition.value("hairnet_sessions_closed_total"), 9);
  EXPECT_EQ(exposition.value("hairnet_level_cache_rejected_total", "reason", "damaged"), 4);
  EXPECT_DOUBLE_EQ(exposition.value("hairnet_duty_seconds_total", "duty", "step"), 2.5);
  EXPECT_EQ(exposition.value("hairnet_bytes_read_total"), 4503599627370496.0);
}

TEST(Metrics, a_histogram_counts_each_value_in_the_first_bucket_that_contains_it) {
  Metrics metrics;
  Histogram& seconds = metrics.tick.histograms.tick_seconds;
  seconds.observe(0);
  // This value equals the bound of a bucket, and belongs to this bucket.
  seconds.observe(0.001);
  seconds.observe(0.0011);
  seconds.observe(1000);
  const Exposition exposition = exposition_of(metrics);
  EXPECT_EQ(exposition.value("hairnet_tick_seconds_bucket", "le", "0.0005"), 1);
  EXPECT_EQ(exposition.value("hairnet_tick_seconds_bucket", "le", "0.001"), 2);
  EXPECT_EQ(exposition.value("hairnet_tick_seconds_bucket", "le", "0.002"), 3);
  EXPECT_EQ(exposition.value("hairnet_tick_seconds_bucket", "le", "1"), 3);
  EXPECT_EQ(exposition.value("hairnet_tick_seconds_bucket", "le", "+Inf"), 4);
  EXPECT_EQ(exposition.value("hairnet_tick_seconds_count"), 4);
  EXPECT_NEAR(exposition.value("hairnet_tick_seconds_sum"), 1000.0021, 1e-3);
}

TEST(Metrics, a_histogram_leaves_out_what_is_not_finite) {
  HistogramSet set;
  Histogram histogram(set, "seconds", "Seconds.", {1});
  histogram.observe(std::nan(""));
  histogram.observe(std::numeric_limits<double>::infinity());
  {
    Histogram::Tally tally(histogram);
    tally.observe(std::nan(""));
    tally.observe(2);
  }
  EXPECT_EQ(histogram.sum(), 2);
  EXPECT_EQ(histogram.count(0), 0u);
  EXPECT_EQ(histogram.count(1), 1u);
}

TEST(Metrics, tallies_of_several_threads_add_up) {
  HistogramSet set;
  Histogram histogram(set, "seconds", "Seconds.", {1, 2});
  const auto work = [&histogram] {
    for (int round = 0; round < 100; ++round) {
      Histogram::Tally tally(histogram);
      for (int i = 0; i < 10; ++i) tally.observe(i % 4);
      histogram.observe(2);
    }
  };
  std::thread other(work);
  work();
  other.join();
  // Each round of each thread tallies 0 1 2 3 0 1 2 3 0 1: six values within 1, two within 2, and two above. The sum is
  // 13, and one more value of 2 is observed without a tally.
  EXPECT_EQ(histogram.count(0), 200u * 6);
  EXPECT_EQ(histogram.count(1), 200u * 2 + 200);
  EXPECT_EQ(histogram.count(2), 200u * 2);
  EXPECT_EQ(histogram.sum(), 200 * 13 + 200 * 2);
}

TEST(Metrics, names_contain_thing_refusal_and_reason) {
  Metrics metrics;
  metrics.groom.grooms_refused_queue_full.add(2);
  metrics.session.frames_sent.add(3);
  metrics.transport.sent_bytes_websocket.add(4);
  metrics.tick.encode_ns_total.add(2'500'000'000);
  metrics.tick.tick_ns_max.raise_to(250'000'000);
  const Exposition exposition = exposition_of(metrics);
  EXPECT_EQ(exposition.value("hairnet_grooms_refused_total", "reason", "queue_full"), 2);
  EXPECT_EQ(exposition.value("hairnet_frames_sent_total"), 3);
  EXPECT_EQ(exposition.value("hairnet_sent_bytes_total", "transport", "websocket"), 4);
  EXPECT_TRUE(exposition.families.contains("hairnet_tick_seconds"));
  EXPECT_FALSE(exposition.families.contains("hairnet_tick_seconds_max_total")) << "only the log has it";
  EXPECT_EQ(to_text(metrics, '=', ' '),
            "sent_bytes_websocket=4 frames_sent=3 duty_seconds_encode=2.5 grooms_refused_queue_full=2 "
            "tick_seconds_max=0.25 ");
}

TEST(Metrics, every_family_has_one_sentence_of_help) {
  const Metrics metrics;
  std::map<std::string, std::vector<std::string>> helps;
  const auto note = [&helps](const MetricName& name) {
    std::vector<std::string>& of_family = helps[std::string(name.family)];
    if (!name.help.empty()) of_family.emplace_back(name.help);
  };
  for (const CounterSet* set : metrics.counter_sets())
    for (const Counter* counter : set->counters()) note(counter->name());
  for (const GaugeSet* set : metrics.gauge_sets())
    for (const Gauge* gauge : set->gauges()) note(gauge->name());
  for (const HistogramSet* set : metrics.histogram_sets())
    for (const Histogram* histogram : set->histograms()) note(histogram->name());
  // The server has more families than that. A walk that finds none would pass the loop below.
  EXPECT_GT(helps.size(), 150u);
  for (const auto& [family, of_family] : helps) {
    ASSERT_EQ(of_family.size(), 1u) << family;
    EXPECT_TRUE(of_family[0].ends_with('.') && of_family[0].find('\n') == std::string::npos) << of_family[0];
    const bool has_unit = !family.ends_with("_seconds") || of_family[0].find("seconds") != std::string::npos;
    EXPECT_TRUE(has_unit) << family << ": " << of_family[0];
  }
}

TEST(Metrics, every_family_is_shown_with_its_help) {
  Metrics metrics;
  // The help of a family stands at its first member, which is not set here.
  metrics.tick.gauges.characters[LevelIndex::low].set(7);
  const Exposition exposition = exposition_of(metrics);
  EXPECT_TRUE(exposition.families.contains("hairnet_characters"));
  for (const auto& [family, shown] : exposition.families) EXPECT_TRUE(exposition.helps.contains(family)) << family;
}

TEST(Metrics, names_in_the_log_are_as_many_as_counters) {
  const Metrics metrics;
  std::size_t count = 0;
  std::set<std::string> names;
  for (const CounterSet* set : metrics.counter_sets()) {
    count += set->counters().size();
    for (const Counter* counter : set->counters()) names.insert(counter->name().flat());
  }
  EXPECT_EQ(names.size(), count);
}

TEST(LogText, text_from_outside_stays_in_its_quotes_and_on_its_line) {
  EXPECT_EQ(log_text("plain \u65e5"), "\"plain \u65e5\"");
  EXPECT_EQ(log_text("a\" level=error \n\\"), "\"a\\\" level=error \\u000a\\\\\"");
  // A field has at most 200 bytes of the text (kTextBytesMax in log_text.cpp) between two quotes. A quote becomes two
  // characters, and a byte that is no UTF-8 becomes four.
  EXPECT_EQ(log_text(std::string(1000, '"')).size(), 402u);
  EXPECT_EQ(log_text(std::string(300, '\xff')).size(), 2 + 4 * 200u);
}

TEST(Metrics, the_process_is_measured) {
  ProgramGauges gauges;
  read_process(gauges);
  // Any process has more than 1 MiB, and at least its three standard files are open.
  EXPECT_GT(gauges.resident_memory_bytes.value(), 1 << 20);
  EXPECT_GE(gauges.open_files.value(), 3);
  EXPECT_GE(gauges.cpu_seconds.value(), 0);
}

TEST(Exposition, the_parser_refuses_what_is_not_the_format) {
  const auto refused = [](const std::string& text) {
    Exposition exposition;
    std::string error;
    return !parse_exposition(text, exposition, error);
  };
  EXPECT_FALSE(refused("# TYPE a counter\na 1\n"));
  EXPECT_FALSE(refused("# TYPE a counter\na{b=\"c\\\\\\\"\\n\"} 1\n"));
  EXPECT_TRUE(refused("# TYPE a counter\na 1"));
  EXPECT_TRUE(refused("a 1\n"));
  EXPECT_TRUE(refused("# TYPE a count\na 1\n"));
  EXPECT_TRUE(refused("# TYPE a counter\na -1\n"));
  EXPECT_TRUE(refused("# TYPE a counter\na 1x\n"));
  EXPECT_TRUE(refused("# TYPE a counter\na 1\na 1\n"));
  EXPECT_TRUE(refused("# TYPE a counter\na 1\na{b=\"c\"} 1\n"));
  EXPECT_TRUE(refused("# TYPE a counter\na{b=\"c\\x\"} 1\n"));
  EXPECT_TRUE(refused("# TYPE a counter\na{b-=\"c\"} 1\n"));
  EXPECT_TRUE(refused("# TYPE a counter\na{b=\"c\" 1\n"));
  EXPECT_TRUE(refused("# TYPE a counter\na 1\n# TYPE a counter\n"));
  const std::string histogram = "# TYPE h histogram\nh_count 2\nh_sum 1\nh_bucket{le=\"1\"} 1\n";
  EXPECT_FALSE(refused(histogram + "h_bucket{le=\"+Inf\"} 2\n"));
  EXPECT_TRUE(refused(histogram));
  EXPECT_TRUE(refused(histogram + "h_bucket{le=\"+Inf\"} 3\n"));
  EXPECT_TRUE(refused(histogram + "h_bucket{le=\"2\"} 0\nh_bucket{le=\"+Inf\"} 2\n"));
  EXPECT_TRUE(refused(histogram + "h_bucket{le=\"0.5\"} 1\nh_bucket{le=\"+Inf\"} 2\n"));
}

}  // namespace
}  // namespace hairnet::server
