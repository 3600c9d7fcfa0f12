#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "server/app/metric_name.hpp"
#include "server/app/metrics.hpp"

namespace hairnet::server {
namespace {

std::string content_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Every name that /metrics may show.
std::set<std::string> metric_names() {
  const Metrics metrics;
  std::set<std::string> names{"hairnet_build_info"};
  for (const CounterSet* set : metrics.counter_sets()) {
    for (const Counter* counter : set->counters())
      names.insert(metric_name(counter->name(), MetricKind::counter).family);
  }
  for (const GaugeSet* set : metrics.gauge_sets()) {
    for (const Gauge* gauge : set->gauges()) names.insert(metric_name(gauge->name(), MetricKind::gauge).family);
  }
  for (const HistogramSet* set : metrics.histogram_sets()) {
    for (const Histogram* histogram : set->histograms()) {
      const std::string name = metric_name(histogram->name(), MetricKind::histogram).family;
      for (const char* part : {"_bucket", "_sum", "_count"}) names.insert(name + part);
    }
  }
  return names;
}

std::set<std::string> named_in(const std::string& text) {
  static const std::regex name("\\bhairnet_[a-z0-9_]+");
  std::set<std::string> names;
  for (std::sregex_iterator match(text.begin(), text.end(), name), end; match != end; ++match)
    names.insert(match->str());
  return names;
}

TEST(Dashboard, every_metric_it_asks_for_exists) {
  const nlohmann::json dashboard = nlohmann::json::parse(content_of(HAIRNET_DEPLOY_DIR "/dashboard.json"));
  const std::set<std::string> known = metric_names();
  std::size_t expressions = 0;
  for (const auto& panel : dashboard.at("panels")) {
    if (panel.at("type") == "row") continue;
    for (const auto& target : panel.at("targets")) {
      const std::set<std::string> asked = named_in(target.at("expr"));
      EXPECT_FALSE(asked.empty()) << target.at("expr");
      EXPECT_TRUE(std::includes(known.begin(), known.end(), asked.begin(), asked.end())) << target.at("expr");
      ++expressions;
    }
  }
  EXPECT_GT(expressions, 20u);
}

TEST(Alerts, every_metric_they_ask_for_exists_and_the_runbook_has_each) {
  const std::string alerts = content_of(HAIRNET_DEPLOY_DIR "/alerts.yml");
  const std::string runbook = content_of(HAIRNET_DEPLOY_DIR "/README.md");
  const std::set<std::string> known = metric_names(), asked = named_in(alerts);
  EXPECT_GT(asked.size(), 5u);
  for (const std::string& name : asked) EXPECT_TRUE(known.contains(name)) << name;
  static const std::regex alert("alert: (\\w+)");
  for (std::sregex_iterator match(alerts.begin(), alerts.end(), alert), end; match != end; ++match)
    EXPECT_THAT(runbook, testing::HasSubstr("`" + (*match)[1].str() + "`"));
}

TEST(Runbook, every_metric_it_names_exists) {
  const std::set<std::string> known = metric_names();
  for (const std::string& name : named_in(content_of(HAIRNET_DEPLOY_DIR "/README.md")))
    EXPECT_TRUE(known.contains(name) || known.contains(name + "_bucket")) << name;
}

}  // namespace
}  // namespace hairnet::server
