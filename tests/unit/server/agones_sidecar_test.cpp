#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/agones/sidecar.hpp"

namespace hairnet::server::agones {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kMs = 1'000'000, kSecond_ns = 1'000'000'000;

std::string game_server_text(const std::string& status) {
  return R"({"object_meta":{"name":"hairnet-1","generation":"3"},"spec":{},"status":)" + status + "}";
}

// Agones names the two halves of a TCPUDP port hairnet-tcp and hairnet-udp. A single port may have any name; among
// several, one must be named hairnet (kPortName) or hairnet-tcp.
TEST(AgonesAddress, is_the_public_port_of_the_game_server) {
  const auto address = parse_address(game_server_text(
      R"({"state":"Ready","address":"203.0.113.7","ports":[{"name":"hairnet-tcp","port":7431},{"name":"hairnet-udp","port":7431}]})"));
  ASSERT_TRUE(address && *address);
  EXPECT_EQ((*address)->host, "203.0.113.7");
  EXPECT_EQ((*address)->port, 7431);
  const auto other_name =
      parse_address(game_server_text(R"({"address":"node1.example","ports":[{"name":"default","port":7777}]})"));
  ASSERT_TRUE(other_name && *other_name);
  EXPECT_EQ((*other_name)->port, 7777);
  const auto chosen = parse_address(
      game_server_text(R"({"address":"a","ports":[{"name":"voice","port":1},{"name":"hairnet","port":2}]})"));
  ASSERT_TRUE(chosen && *chosen);
  EXPECT_EQ((*chosen)->port, 2);
}

TEST(AgonesAddress, is_not_there_before_agones_has_given_one) {
  for (const char* status : {R"({"state":"Creating","address":"","ports":[]})", R"({"address":"a","ports":[]})",
                             R"({"address":"","ports":[{"name":"hairnet","port":1}]})"}) {
    const auto address = parse_address(game_server_text(status));
    ASSERT_TRUE(address) << address.error();
    EXPECT_FALSE(*address) << status;
  }
}

TEST(AgonesAddress, is_refused_in_one_line_where_the_text_is_malformed) {
  const std::vector<std::pair<std::string, std::string>> texts{
      {"", "not a JSON object"},
      {"[]", "not a JSON object"},
      {"{\"status\":", "not a JSON object"},
      {"{}", "no status"},
      {R"({"status":[]})", "no status"},
      {game_server_text("{}"), "no address"},
      {game_server_text(R"({"address":7,"ports":[]})"), "no address"},
      {game_server_text(R"({"address":"a"})"), "no ports"},
      {game_server_text(R"({"address":"a","ports":{}})"), "no ports"},
      {game_server_text(R"({"address":"a","ports":[7]})"), "no number"},
      {game_server_text(R"({"address":"a","ports":[{"name":"hairnet"}]})"), "no number"},
      {game_server_text(R"({"address":"a","ports":[{"name":"hairnet","port":"7"}]})"), "no number"},
      {game_server_text(R"({"address":"a","ports":[{"name":"hairnet","port":0}]})"), "no number"},
      {game_server_text(R"({"address":"a","ports":[{"name":"hairnet","port":65536}]})"), "no number"},
      {game_server_text(R"({"address":"a","ports":[{"name":"hairnet","port":-1}]})"), "no number"},
      {game_server_text(R"({"address":"a","ports":[{"name":"x","port":1},{"name":"y","port":2}]})"), "several ports"},
      {game_server_text(R"({"address":"a b","ports":[{"name":"hairnet","port":1}]})"), "host of a server"},
      {game_server_text("{\"address\":\"" + std::string(300, 'a') + R"(","ports":[{"name":"hairnet","port":1}]})"),
       "host of a server"}};
  for (const auto& [text, error] : texts) {
    const auto address = parse_address(text);
    ASSERT_FALSE(address) << text;
    EXPECT_THAT(address.error(), HasSubstr(error)) << text;
    EXPECT_THAT(address.error(), testing::Not(HasSubstr("\n")));
  }
}

TEST(AgonesPort, is_a_number_from_1_to_65535) {
  EXPECT_EQ(*parse_port("9358"), 9358);
  for (const char* wrong : {"", "0", "65536", "-1", "9358x", " 9358", "http://a"}) {
    const auto port = parse_port(wrong);
    ASSERT_FALSE(port) << wrong;
    EXPECT_THAT(port.error(), HasSubstr("AGONES_SDK_HTTP_PORT"));
  }
}

TEST(AgonesRequests, are_those_of_the_sdk) {
  EXPECT_EQ(ready().path, "/ready");
  EXPECT_EQ(health().path, "/health");
  EXPECT_EQ(allocate().body, "{}");
  EXPECT_EQ(game_server().method, Request::Method::get);
  const Request rooms = set_rooms(3, 16);
  EXPECT_EQ(rooms.method, Request::Method::patch);
  EXPECT_EQ(rooms.path, "/v1beta1/counters/rooms");
  EXPECT_EQ(rooms.body, R"({"capacity":"16","count":"3"})");
}

// Takes the place of the sidecar process, and answers each call within the step of 20 ms in which it was sent. Time is
// counted in steps.
class Life : public testing::Test, public SidecarTransport {
 protected:
  void send(std::uint64_t call, Request request) override {
    std::string text = request.path.substr(1);
    if (request.method == Request::Method::patch) text += " " + request.body;
    if (request.path == "/health")
      ++healths_;
    else
      sent_.push_back(text);
    waiting_.push_back({call, std::move(request)});
  }
  void cancel(std::uint64_t call) override {
    std::erase_if(waiting_, [call](const auto& one) { return one.first == call; });
  }
  // Polls every 20 ms. Each of the four duties (health, state, rooms, address) has at most one call under way.
  void run(double seconds) {
    const std::int64_t end_ns = now_ns_ + static_cast<std::int64_t>(seconds * 1e9);
    for (; now_ns_ < end_ns; now_ns_ += 20 * kMs) {
      sidecar().poll(server_, now_ns_);
      EXPECT_LE(waiting_.size(), 4u) << "a call of each duty";
      if (is_silent_) continue;
      for (const auto& [call, request] : std::exchange(waiting_, {})) {
        if (error_)
          sidecar().on_error(call, *error_, now_ns_);
        else
          sidecar().on_answer(call, status_, request.path == "/gameserver" ? game_server_ : "{}", now_ns_);
      }
    }
  }
  std::vector<std::string> sent() { return std::exchange(sent_, {}); }
  Sidecar& sidecar() {
    if (!sidecar_) sidecar_.emplace(def_, *this, counters_);
    return *sidecar_;
  }

  SidecarDef def_{.room_count_max = 16, .asks_for_address = false, .seed = 1};
  AgonesCounters counters_;
  ServerNow server_;
  std::int64_t now_ns_ = 1000 * kSecond_ns;
  std::vector<std::pair<std::uint64_t, Request>> waiting_;
  // The paths, and bodies where there are any, of all calls but reports of health.
  std::vector<std::string> sent_;
  int healths_ = 0;
  // A silent sidecar never answers; an error takes the place of all answers.
  bool is_silent_ = false;
  std::optional<SidecarError> error_;
  int status_ = 200;
  std::string game_server_;
  std::optional<Sidecar> sidecar_;
};

TEST_F(Life, is_ready_in_use_ready_again_and_ended) {
  run(1);
  EXPECT_THAT(sent(), IsEmpty());
  EXPECT_EQ(healths_, 0) << "no tick has run";
  server_.has_ticks_on_time = true;
  run(1);
  EXPECT_THAT(sent(), IsEmpty()) << "its directory does not work yet";
  server_.takes_clients = true;
  run(3);
  EXPECT_THAT(sent(), ElementsAre("ready", R"(v1beta1/counters/rooms {"capacity":"16","count":"0"})"));
  server_.rooms = 2;
  run(3);
  EXPECT_THAT(sent(), ElementsAre("allocate", R"(v1beta1/counters/rooms {"capacity":"16","count":"2"})"));
  EXPECT_EQ(counters_.gauges.allocated.value(), 1);
  server_.rooms = 1;
  run(30);
  EXPECT_THAT(sent(), ElementsAre(R"(v1beta1/counters/rooms {"capacity":"16","count":"1"})"));
  // A server must be without rooms for 5 s (kUnusedFor_ns in sidecar.cpp) before Agones may end it: 4 s are not enough,
  // and 2 s more are.
  server_.rooms = 0;
  run(4);
  EXPECT_THAT(sent(), ElementsAre(R"(v1beta1/counters/rooms {"capacity":"16","count":"0"})"));
  run(2);
  EXPECT_THAT(sent(), ElementsAre("ready"));
  EXPECT_EQ(counters_.gauges.allocated.value(), 0);
  server_.rooms = 1;
  run(3);
  sent();
  server_.drains = true;
  server_.takes_clients = false;
  server_.rooms = 0;
  run(30);
  EXPECT_THAT(sent(), IsEmpty()) << "a server that drains is not offered again";
  EXPECT_FALSE(sidecar().is_shut_down(now_ns_));
  sidecar().shut_down(now_ns_);
  sidecar().shut_down(now_ns_);
  run(1);
  EXPECT_THAT(sent(), ElementsAre("shutdown"));
  EXPECT_TRUE(sidecar().is_shut_down(now_ns_));
  EXPECT_EQ(counters_.requests_failed_unreachable.value(), 0u);
}

TEST_F(Life, reports_health_every_two_seconds_only_while_ticks_are_on_time) {
  server_ = {.takes_clients = true, .has_ticks_on_time = true};
  run(60);
  // A report every 2 s (kHealthInterval_ns) makes 30 in a minute.
  EXPECT_GE(healths_, 29);
  EXPECT_LE(healths_, 31);
  healths_ = 0;
  server_.has_ticks_on_time = false;
  run(60);
  EXPECT_EQ(healths_, 0);
}

TEST_F(Life, tells_the_rooms_at_a_bounded_rate_and_never_more_than_the_capacity) {
  server_ = {.takes_clients = true, .has_ticks_on_time = true};
  run(5);
  sent();
  for (int i = 0; i < 600; ++i) {
    server_.rooms = 1 + static_cast<std::size_t>(i % 7);
    run(0.1);
  }
  std::vector<std::string> all = sent();
  // The number of rooms changes every 100 ms, and is sent every 2 s at most (kRoomsInterval_ns): 30 times in a minute.
  EXPECT_LE(all.size(), 31u);
  EXPECT_GE(all.size(), 25u);
  server_.rooms = 100;
  run(3);
  EXPECT_THAT(sent(), testing::Contains(R"(v1beta1/counters/rooms {"capacity":"16","count":"16"})"));
}

// Waits between tries double from 0.5 s to 16 s, each times 0.5 to 1 at random (kBackoffMin_ns in sidecar.cpp). Health
// is never put off for more than 2 s: without its reports Agones replaces the server.
TEST_F(Life, goes_on_trying_less_and_less_often_while_the_sidecar_is_away) {
  error_ = SidecarError::unreachable;
  server_ = {.takes_clients = true, .has_ticks_on_time = true};
  run(60);
  const std::size_t in_a_minute = sent().size();
  EXPECT_GE(in_a_minute, 6u);
  EXPECT_LE(in_a_minute, 20u);
  EXPECT_GE(healths_, 29) << "never put off";
  EXPECT_LE(healths_, 45);
  EXPECT_EQ(counters_.gauges.up.value(), 0);
  EXPECT_EQ(counters_.requests_failed_unreachable.value(), counters_.requests.value());
  error_.reset();
  run(20);
  EXPECT_EQ(sent().front(), "ready");
  EXPECT_EQ(counters_.gauges.up.value(), 1);
}

// A call without an answer for 2 s has failed (kCallTimeout_ns), but Agones may have executed it. Here it may take the
// server for one in use when the last room has already ended, so the server must tell its state until a call succeeds.
TEST_F(Life, takes_a_slow_answer_for_none_and_says_again_what_may_have_been_heard_or_not) {
  server_ = {.takes_clients = true, .has_ticks_on_time = true};
  run(5);
  sent();
  is_silent_ = true;
  server_.rooms = 1;
  run(1);
  EXPECT_THAT(sent(), ElementsAre("allocate", HasSubstr("\"count\":\"1\"")));
  // Agones may have heard of the allocation, without an answer.
  server_.rooms = 0;
  run(20);
  EXPECT_GT(counters_.requests_failed_timeout.value(), 2u);
  EXPECT_THAT(sent(), testing::Contains("ready"));
  is_silent_ = false;
  run(20);
  EXPECT_EQ(counters_.gauges.allocated.value(), 0);
  const std::uint64_t requests = counters_.requests.value();
  run(10);
  // Reports of health are five in 10 s.
  EXPECT_LE(counters_.requests.value() - requests, 6u) << "only health is told when nothing changes";
}

// Every call is answered with 500, as Agones answers where a fleet lacks the counter of rooms. Such an error must not
// be repeated without pause: the bounds allow a report of health every 2 s, and tries of other duties at growing
// distances.
TEST_F(Life, is_not_kept_from_its_states_by_a_fleet_without_the_counter) {
  server_ = {.takes_clients = true, .has_ticks_on_time = true, .rooms = 1};
  run(0.02);
  status_ = 500;
  run(60);
  EXPECT_GT(counters_.requests_failed_refused.value(), 5u);
  EXPECT_LT(counters_.requests_failed_refused.value(), 80u);
  EXPECT_EQ(counters_.gauges.up.value(), 1) << "it answers";
  status_ = 200;
  run(20);
  EXPECT_EQ(counters_.gauges.allocated.value(), 1);
}

TEST_F(Life, learns_the_address_once_agones_has_given_one) {
  def_.asks_for_address = true;
  game_server_ = game_server_text(R"({"address":"","ports":[]})");
  run(5);
  EXPECT_FALSE(sidecar().address());
  const std::size_t asked = sent().size();
  // Once a second (kAddressInterval_ns) for 5 s; afterwards, malformed answers count as failures, and the waits grow.
  EXPECT_GE(asked, 4u);
  EXPECT_LE(asked, 6u);
  game_server_ = "what?";
  run(20);
  EXPECT_FALSE(sidecar().address());
  EXPECT_GE(counters_.requests_failed_malformed.value(), 2u);
  EXPECT_LE(counters_.requests_failed_malformed.value(), 10u);
  game_server_ = game_server_text(R"({"address":"203.0.113.7","ports":[{"name":"hairnet-tcp","port":7431}]})");
  run(20);
  ASSERT_TRUE(sidecar().address());
  EXPECT_EQ(sidecar().address()->port, 7431);
  sent();
  run(20);
  EXPECT_THAT(sent(), IsEmpty()) << "asked no more";
}

// The limit is kShutdownPatience_ns: a server that ends must not wait for a sidecar that hangs.
TEST_F(Life, ends_without_a_sidecar_after_two_seconds) {
  server_ = {.takes_clients = true, .has_ticks_on_time = true};
  is_silent_ = true;
  run(0.1);
  server_.drains = true;
  sidecar().shut_down(now_ns_);
  run(1.9);
  EXPECT_FALSE(sidecar().is_shut_down(now_ns_));
  run(0.2);
  EXPECT_TRUE(sidecar().is_shut_down(now_ns_));
  EXPECT_THAT(sent(), testing::Contains("shutdown")) << "the call that was under way does not hold it back";
}

TEST_F(Life, ignores_answers_to_calls_that_it_did_not_send) {
  sidecar().on_answer(77, 200, "{}", now_ns_);
  sidecar().on_error(0, SidecarError::broken, now_ns_);
  EXPECT_EQ(counters_.requests_failed_broken.value(), 0u);
}

}  // namespace
}  // namespace hairnet::server::agones
