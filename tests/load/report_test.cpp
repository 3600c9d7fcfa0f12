#include "tests/load/report.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/random.hpp"
#include "tests/load/bad_client.hpp"
#include "tests/load/live_view.hpp"
#include "tests/load/options.hpp"
#include "tests/load/svg_chart.hpp"

namespace hairnet::load {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Empty when every element is closed in order and no attribute or text has a stray < or &; else the error.
std::string markup_error(std::string_view html) {
  std::vector<std::string> open;
  for (std::size_t at = 0; at < html.size(); ++at) {
    if (html[at] == '&' && !(html.substr(at).starts_with("&amp;") || html.substr(at).starts_with("&lt;") ||
                             html.substr(at).starts_with("&gt;") || html.substr(at).starts_with("&quot;") ||
                             html.substr(at).starts_with("&#39;")))
      return "stray & at " + std::to_string(at);
    if (html[at] != '<') continue;
    if (html.substr(at).starts_with("<!DOCTYPE html>")) continue;
    const std::size_t end = html.find('>', at);
    if (end == std::string_view::npos) return "a tag does not end";
    const std::string_view tag = html.substr(at + 1, end - at - 1);
    if (tag.find('<') != std::string_view::npos) return "a < within a tag: " + std::string(tag);
    if (std::ranges::count(tag, '"') % 2 != 0) return "quotes do not pair: " + std::string(tag);
    const bool closes = tag.starts_with('/');
    const std::string name(tag.substr(closes ? 1 : 0, tag.find_first_of(" /", closes ? 1 : 0) - (closes ? 1 : 0)));
    if (closes) {
      if (open.empty() || open.back() != name) return "closes " + name + " that is not open";
      open.pop_back();
    } else if (!tag.ends_with('/') && name != "meta") {
      open.push_back(name);
    }
    at = end;
  }
  return open.empty() ? "" : "left open: " + open.back();
}

// Makes a report with every part that the page and the JSON show. Its numbers need not agree with each other.
Report sample_report() {
  Report report;
  // These are the characters that HTML must escape.
  report.command = "hairnet-load --stage <b>&\"'";
  report.machine = "a machine";
  report.outcome_text = "all <2> thresholds met";
  RunResult run;
  run.plan = preset_plan("rooms32").value();
  run.tick_rate_hz = 30;
  for (const Stage& stage : run.plan.stages) {
    StageResult staged;
    staged.stage = stage;
    staged.duration_s = stage.duration_s;
    staged.figures = {{"latency_p99_ms", 41.25}, {"errors", 0}};
    for (int i = 1; i < 1000; ++i) staged.tally.latency.record(i * 100'000);
    staged.tally.counts.errors["closed_<reset>"] = 2;
    staged.tally.counts.bad_client_ends["slow: goodbye_slow_consumer"] = 1;
    staged.server_metrics = {{"hairnet_refused_total{reason=\"a&b\"}", 3}};
    staged.server.thread_cpu_s = {{"tick", 1.5}};
    run.stages.push_back(std::move(staged));
  }
  for (int i = 0; i < 30; ++i) {
    WindowFigures window;
    window.begin_s = i;
    window.duration_s = 1;
    // A window without an answered pose has no latency. The page must leave the gap out, and never print "nan".
    window.latency_p99_ms = i % 7 == 0 ? std::nan("") : 30 + i;
    window.frames = 100;
    window.frames_by_level = {10, 20, 30, 40, 0};
    run.windows.push_back(window);
    // The members are the time in s, cores and MiB of the generator, and cores and MiB of the server.
    run.processes.push_back({i + 0.5, 0.1, 20, 0.9, 300});
  }
  report.verdicts = {{"latency_p99_ms<50", "steady", 41.25, true}, {"<x>", "", std::nullopt, false}};
  report.runs.push_back(std::move(run));
  // The capacity is 64 characters, found by one probe that confirmed them and passed.
  report.capacity = CapacityReport{64, false, false, {{{64, true, true}, {{"latency_p99_ms", 40}}}}};
  return report;
}

TEST(Page, is_well_formed_and_self_contained) {
  const std::string page = to_page(sample_report());
  EXPECT_EQ(markup_error(page), "");
  // The page is opened as a file, often without a network. So it must not refer to anything outside.
  for (const char* outside : {"http:", "https:", "//", "<script", "<link", "<img", "@import", "url("})
    EXPECT_THAT(page, Not(HasSubstr(outside)));
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;&amp;&quot;&#39;"));
  for (const char* number : {">nan<", "nan ", "nan\"", "inf ", ">inf<"}) EXPECT_THAT(page, Not(HasSubstr(number)));
  for (const char* part : {"Latency", "Levels of detail", "Bytes", "Processor", "Memory", "Thresholds", "Capacity",
                           "Errors and refusals", "Server, by thread", "slow: goodbye_slow_consumer"})
    EXPECT_THAT(page, HasSubstr(part));
}

// Makes a report of a run with two measured stages, of 8 and of 64 characters, and these verdicts.
Report judged_report(std::vector<Verdict> verdicts, Outcome outcome) {
  Report report;
  RunResult run;
  for (const double characters : {8.0, 64.0}) {
    StageResult& stage = run.stages.emplace_back();
    stage.stage.measured = true;
    stage.figures = {{"characters", characters}, {"clients", 8}, {"frames_per_character_s", 29.97}};
  }
  report.runs.push_back(std::move(run));
  report.verdicts = std::move(verdicts);
  report.outcome = outcome;
  report.outcome_text = "the server died";
  return report;
}

// The sentence names the figure that uses the largest share of its threshold: 0.9 / 0.95 in the first case, against
// 43.5 / 100. A share above 1 means that the threshold is not met.
TEST(Sentence, says_what_held_and_which_figure_is_nearest_to_its_threshold) {
  EXPECT_EQ(to_sentence(judged_report({{"latency_p99_ms<100", "steady", 43.5, true},
                                       {"level_high_share>=0.9", "steady", 0.95, true},
                                       {"errors==0", "steady", 0, true}},
                                      Outcome::ok)),
            "The server held 64 characters of 8 clients, 30.0 frames a second for each; nearest to its threshold is "
            "0.95 in stage steady, of level_high_share>=0.9.");
  EXPECT_THAT(to_sentence(judged_report({{"latency_p99_ms<100", "steady", 250, false}, {"errors==0", "soak", 1, false}},
                                        Outcome::threshold)),
              AllOf(HasSubstr("did not hold 64 characters"), HasSubstr("1 in stage soak, of errors==0.")));
  EXPECT_THAT(to_sentence(judged_report({{"no_such<1", "", std::nullopt, false}}, Outcome::threshold)),
              HasSubstr("no_such<1 could not be judged"));
  EXPECT_THAT(to_sentence(judged_report({}, Outcome::ok)), HasSubstr("No threshold was given; the server carried 64"));
  EXPECT_EQ(to_sentence(judged_report({}, Outcome::failed)),
            "This run says nothing about the server: the server died.");
  Report capacity = judged_report({}, Outcome::ok);
  capacity.capacity = CapacityReport{48, false, false, {}};
  EXPECT_THAT(to_page(capacity), HasSubstr("<strong>Capacity: 48 characters. "));
}

TEST(Page, is_well_formed_without_data) {
  Report report;
  EXPECT_EQ(markup_error(to_page(report)), "");
  report.runs.emplace_back();
  EXPECT_EQ(markup_error(to_page(report)), "");
  EXPECT_THAT(to_page(report), HasSubstr("nothing to show"));
}

TEST(Page, page_checker_finds_errors) {
  EXPECT_NE(markup_error("<p><b></p></b>"), "");
  EXPECT_NE(markup_error("<p>a & b</p>"), "");
  EXPECT_NE(markup_error("<p class=\"x>y</p>"), "");
  EXPECT_NE(markup_error("<p>"), "");
  EXPECT_EQ(markup_error("<p class=\"x\">a &amp; b</p>"), "");
}

TEST(JsonReport, contains_figures_and_a_plan_that_can_be_run_again) {
  const Report report = sample_report();
  const std::string text = to_json_text(report);
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["exit_code"], 0);
  EXPECT_EQ(json["run"]["stages"][1]["name"], "steady");
  EXPECT_DOUBLE_EQ(json["run"]["stages"][1]["figures"]["latency_p99_ms"].get<double>(), 41.25);
  EXPECT_EQ(json["capacity"]["characters"], 64);
  EXPECT_TRUE(json["verdicts"][1]["value"].is_null());
  const auto plan = parse_plan(text);
  ASSERT_TRUE(plan) << plan.error();
  EXPECT_EQ(to_json_text(*plan), to_json_text(report.runs[0].plan));
}

TEST(Summary, says_of_each_attack_whether_it_passed) {
  Report report;
  RunResult& run = report.runs.emplace_back();
  run.plan = preset_plan("hostile").value();
  for (const Stage& stage : run.plan.stages) run.stages.emplace_back().stage = stage;
  report.verdicts = {{"gap_ticks_max<=2", "wind", 1, true}, {"gap_ticks_max<=2", "poses", 5, false}};
  const std::string summary = to_summary(report);
  EXPECT_THAT(summary, HasSubstr("attack wind: passed\n"));
  EXPECT_THAT(summary, HasSubstr("attack poses: FAILED; gap_ticks_max<=2: 5\n"));
}

TEST(Chart, ticks_are_round_and_span_the_values) {
  EXPECT_EQ(ticks(0, 10, 5, false), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(ticks(-1, 1, 4, false), (std::vector<double>{-1, -0.5, 0, 0.5, 1}));
  EXPECT_EQ(ticks(1, 1000, 5, true), (std::vector<double>{1, 10, 100, 1000}));
  EXPECT_TRUE(ticks(1, 1, 5, false).empty());
  EXPECT_TRUE(ticks(0, std::nan(""), 5, false).empty());
}

TEST(LiveView, draws_a_screen_of_fixed_height_and_a_line_of_one) {
  RunProgress progress;
  progress.duration_s = 10;
  const auto height = std::ranges::count(to_screen(progress), '\n');
  // This time is past the end, which a late run may reach.
  progress.time_s = 25;
  progress.characters = 100'000;
  progress.latest.frames = 5;
  progress.latest.frames_by_level = {1, 1, 1, 1, 1};
  EXPECT_EQ(std::ranges::count(to_screen(progress), '\n'), height);
  EXPECT_EQ(std::ranges::count(to_line(progress), '\n'), 1);
}

TEST(BadClient, packets_repeat_with_the_seed_and_most_are_refused) {
  Random a(4), b(4);
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    const auto packet = make_bad_packet(a, 1'000'000'000 + i);
    EXPECT_EQ(packet, make_bad_packet(b, 1'000'000'000 + i));
    refused += wire::decode_packet(packet).error != wire::DecodeError::none ? 1 : 0;
  }
  // At least half of the packets must fail to decode. The others decode, and the server itself must refuse them.
  EXPECT_GT(refused, 150);
}

int exit_code_of(std::vector<const char*> words) {
  words.insert(words.begin(), "hairnet-load");
  const auto parsed = parse_options(static_cast<int>(words.size()), words.data());
  return std::holds_alternative<int>(parsed) ? std::get<int>(parsed) : -1;
}

TEST(Options, usage_error_is_status_two_and_help_is_zero) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  EXPECT_EQ(exit_code_of({"--help"}), 0);
  EXPECT_EQ(exit_code_of({"--list"}), 0);
  for (const auto& words :
       std::vector<std::vector<const char*>>{{},
                                             {"--stage", "steady"},
                                             {"--preset", "none"},
                                             {"--preset", "smoke", "--plan", "x.json"},
                                             {"--plan", "/nowhere/plan.json"},
                                             {"--preset", "smoke", "--require", "latency"},
                                             {"--preset", "smoke", "--server", "localhost"},
                                             {"--preset", "smoke", "--server", "localhost:0"},
                                             {"--preset", "smoke", "--pose-hz", "nan"},
                                             {"--preset", "smoke", "--check", "2"},
                                             {"--preset", "smoke", "--", "--workers", "1"},
                                             {"--preset", "smoke", "--find-capacity", "--require", "steady/errors==0"}})
    EXPECT_EQ(exit_code_of(words), 2) << (words.empty() ? "" : words.back());
  testing::internal::GetCapturedStdout();
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("hairnet-load: "));
}

TEST(Options, command_line_goes_before_the_plan) {
  std::vector<const char*> words{
      "hairnet-load",        "--preset", "smoke",  "--stage", "steady:5s:clients=3", "--seed", "9", "--groom",
      "made:bob,made:short", "--spawn",  "server", "--",      "--workers",           "2"};
  const auto parsed = parse_options(static_cast<int>(words.size()), words.data());
  ASSERT_TRUE(std::holds_alternative<Options>(parsed));
  const Options& options = std::get<Options>(parsed);
  EXPECT_EQ(options.plan.seed, 9u);
  ASSERT_EQ(options.plan.stages.size(), 1u);
  EXPECT_EQ(options.plan.stages[0].clients, 3u);
  EXPECT_EQ(options.plan.grooms, (std::vector<std::string>{"made:bob", "made:short"}));
  EXPECT_EQ(options.server_arguments, (std::vector<std::string>{"--workers", "2"}));
}

}  // namespace
}  // namespace hairnet::load
