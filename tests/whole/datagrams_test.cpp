#include <boost/system/system_error.hpp>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/whole/lossy_relay.hpp"
#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using Json = nlohmann::json;

struct Addresses {
  const char* name;
  const char *clients, *server;
};
// In the order of the lines' directions.
struct Case {
  Addresses addresses{"ipv4", "127.0.0.2", "127.0.0.1"};
  std::array<Line, 2> lines{};
};

// Clients that reach the server through a relay, by WebTransport.
class Datagrams : public WholeTest {
 protected:
  void begin(const Case& the) {
    server_ = start_server({"--webtransport", "on", "--bind", the.addresses.server});
    relay_ = std::make_unique<LossyRelay>(the.addresses.clients, the.addresses.server, port(), the.lines, 7);
    const std::string host = the.addresses.clients;
    address_ = (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" + std::to_string(port());
  }
  std::unique_ptr<Process> start_load() {
    return start(
        "hairnet-load",
        {"--server", address_, "--transport", "webtransport", "--pose-hz", "30", "--groom", "made:bob", "--stage",
         "steady:10s:clients=5,characters=2,level=low,warm=4s", "--quiet", "--json", path("load.json")},
        "load");
  }
  // The figures of the run. A generator that was late says nothing of time, but all else.
  Json figures_of(Process& load) {
    const int code = load.wait();
    EXPECT_TRUE(code == 0 || code == 3) << load.out() << load.err();
    return Json::parse(std::ifstream(path("load.json")))["run"]["stages"].back()["figures"];
  }

  std::unique_ptr<Process> server_;
  std::unique_ptr<LossyRelay> relay_;
  std::string address_;
};

void expect_whole_session(const Json& figures) {
  EXPECT_EQ(figures["errors"], 0);
  EXPECT_EQ(figures["restarts"], 0);
  EXPECT_EQ(figures["resumes"], 0);
  EXPECT_EQ(figures["frames_undecodable"], 0);
  EXPECT_GT(figures["frames"], 500);
}

class DatagramsOverBadLines : public Datagrams, public ::testing::WithParamInterface<Addresses> {};

TEST_P(DatagramsOverBadLines, that_are_lost_cost_nothing_but_themselves) {
  const Line bad{.lost = 0.05, .repeated = 0.02, .late = 0.04, .delay_ms = 30};
  try {
    begin({GetParam(), {bad, bad}});
  } catch (const boost::system::system_error& error) {
    GTEST_SKIP() << "NOT TESTED: " << GetParam().name << ": " << error.what();
  }
  const auto load = start_load();
  const Json figures = figures_of(*load);
  expect_whole_session(figures);
  EXPECT_GT(relay_->lost(LossyRelay::to_client), 10u);
  EXPECT_GT(relay_->lost(LossyRelay::to_server), 10u);
  // A twentieth is lost, a few are late, and a busy server skips some.
  EXPECT_GT(figures["frames_missed_share"], 0.02);
  EXPECT_LT(figures["frames_missed_share"], 0.2);
  EXPECT_LT(figures["gap_ticks_max"], 15);
  drain(*server_);
}

INSTANTIATE_TEST_SUITE_P(Of, DatagramsOverBadLines,
                         ::testing::Values(Addresses{"ipv4", "127.0.0.2", "127.0.0.1"},
                                           Addresses{"ipv6_to_ipv4", "::1", "127.0.0.1"},
                                           Addresses{"ipv4_to_ipv6", "127.0.0.1", "::1"}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST_F(Datagrams, of_clients_whose_address_changes_belong_to_the_same_session) {
  begin({});
  const auto load = start_load();
  for (int changes = 0; changes < 3; ++changes) {
    const std::uint64_t before = relay_->passed(LossyRelay::to_client);
    while (load->running() && relay_->passed(LossyRelay::to_client) < before + 300)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    relay_->change_network();
  }
  ASSERT_TRUE(load->running());
  const Json figures = figures_of(*load);
  expect_whole_session(figures);
  EXPECT_LT(figures["gap_ticks_max"], 15);
  drain(*server_);
}

TEST_F(Datagrams, that_never_arrive_are_replaced_by_the_plain_connection) {
  begin({.lines = {Line{.lost = 1}, Line{.lost = 1}}});
  const auto view = start("hairnet-view",
                          {"--connect", address_, "--character", "groom=made:bob,motion=made:nod,level=low,strands=100",
                           "--duration", "1", "--no-draw"},
                          "view");
  finish(*view, 0);
  EXPECT_NE(view->err().find("connected over tcp"), std::string::npos) << view->err();
  EXPECT_GT(relay_->lost(LossyRelay::to_server), 0u);
  EXPECT_EQ(relay_->passed(LossyRelay::to_client), 0u);
  drain(*server_);
}

}  // namespace
}  // namespace hairnet::whole
