#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "server/app/metrics.hpp"
#include "tests/unit/server/exposition.hpp"

namespace hairnet::server {
namespace {

std::string content_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Writes one series as queries name it: NAME{LABEL="VALUE"}.
std::string series(const std::string& name, const std::string& label, const std::string& value) {
  return name + "{" + label + "=\"" + value + "\"}";
}

// Returns every metric and series that a server can show on /metrics. Gauges appear there only once they are set, so
// they are listed by their names.
std::set<std::string> all_series() {
  const Metrics metrics;
  Exposition shown;
  std::string error;
  EXPECT_TRUE(parse_exposition(prometheus_text(metrics), shown, error)) << error;
  std::set<std::string> all;
  for (const auto& [family_name, family] : shown.families) {
    for (const Exposition::Sample& sample : family.samples) {
      all.insert(sample.name);
      for (const auto& [label, value] : sample.labels) all.insert(series(sample.name, label, value));
    }
  }
  for (const GaugeSet* set : metrics.gauge_sets()) {
    for (const Gauge* gauge : set->gauges()) {
      const MetricName& name = gauge->name();
      const std::string family = "hairnet_" + std::string(name.family);
      all.insert({family, series(family, std::string(name.label), std::string(name.value))});
    }
  }
  return all;
}

// Returns the metrics and series that a text of queries or a page names.
std::set<std::string> asked_by(const std::string& text) {
  static const std::regex name("\\b(hairnet_[a-z0-9_]+)(\\{[^}]*\\})?"), selector("(\\w+)=\"([^\"]*)\"");
  std::set<std::string> asked;
  for (std::sregex_iterator match(text.begin(), text.end(), name), end; match != end; ++match) {
    const std::string selectors = (*match)[2];
    asked.insert((*match)[1]);
    for (std::sregex_iterator one(selectors.begin(), selectors.end(), selector); one != end; ++one)
      asked.insert(series((*match)[1], (*one)[1], (*one)[2]));
  }
  return asked;
}

// A metric that was renamed would leave its panel empty.
TEST(Dashboard, every_metric_it_asks_for_exists) {
  const nlohmann::json dashboard = nlohmann::json::parse(content_of(HAIRNET_DEPLOY_DIR "/dashboard.json"));
  const std::set<std::string> known = all_series();
  std::size_t expressions = 0;
  for (const auto& panel : dashboard.at("panels")) {
    if (panel.at("type") == "row") continue;
    for (const auto& target : panel.at("targets")) {
      const std::set<std::string> asked = asked_by(target.at("expr"));
      EXPECT_FALSE(asked.empty()) << target.at("expr");
      EXPECT_TRUE(std::includes(known.begin(), known.end(), asked.begin(), asked.end())) << target.at("expr");
      ++expressions;
    }
  }
  // A dashboard that was read wrongly would have no expressions to check.
  EXPECT_GT(expressions, 20u);
}

// An alert that asks for a metric which does not exist never fires.
TEST(Alerts, every_metric_they_ask_for_exists_and_the_runbook_has_each) {
  const std::string alerts = content_of(HAIRNET_DEPLOY_DIR "/alerts.yml");
  const std::string runbook = content_of(HAIRNET_DEPLOY_DIR "/README.md");
  const std::set<std::string> known = all_series(), asked = asked_by(alerts);
  EXPECT_GT(asked.size(), 5u);
  for (const std::string& name : asked) EXPECT_TRUE(known.contains(name)) << name;
  static const std::regex alert("alert: (\\w+)");
  for (std::sregex_iterator match(alerts.begin(), alerts.end(), alert), end; match != end; ++match)
    EXPECT_THAT(runbook, testing::HasSubstr("`" + (*match)[1].str() + "`"));
}

TEST(Runbook, every_metric_it_names_exists) {
  const std::set<std::string> known = all_series();
  for (const std::string& name : asked_by(content_of(HAIRNET_DEPLOY_DIR "/README.md")))
    EXPECT_TRUE(known.contains(name) || known.contains(name + "_bucket")) << name;
}

}  // namespace
}  // namespace hairnet::server
