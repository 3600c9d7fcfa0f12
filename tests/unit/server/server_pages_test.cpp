#include "server/app/server_pages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/app/room_page.hpp"
#include "tests/unit/server/exposition.hpp"

namespace hairnet::server {
namespace {

// The present of all cases. The last tick of valid() ended 30 ms ago, about one period at 30 Hz.
constexpr std::int64_t kNow_ns = 5'000'000'000;

Health valid() {
  return {.accepting = true, .draining = false, .last_tick_ns = kNow_ns - 30'000'000, .now_ns = kNow_ns};
}

TEST(Health, is_ready_while_it_accepts_and_ticks_are_on_time) {
  EXPECT_EQ(why_not_ready(valid()), "");
  Health health = valid();
  // Ticks count as stalled after more than a second (kTickStallMax_ns), so exactly a second is still on time.
  health.last_tick_ns = kNow_ns - kTickStallMax_ns;
  EXPECT_EQ(why_not_ready(health), "");
}

TEST(Health, is_not_ready_while_draining_before_accepting_or_when_ticks_stall) {
  Health health = valid();
  health.draining = true;
  EXPECT_EQ(why_not_ready(health), "draining");
  health = valid();
  health.accepting = false;
  EXPECT_EQ(why_not_ready(health), "not accepting yet");
  health = valid();
  health.last_tick_ns = 0;
  EXPECT_EQ(why_not_ready(health), "no tick has run yet");
  health = valid();
  // The last tick ended 2.5 s ago, which is above the second that kTickStallMax_ns allows.
  health.last_tick_ns = kNow_ns - 2'500'000'000;
  EXPECT_EQ(why_not_ready(health), "ticks stalled: the last was 2.5 s ago");
}

// Readiness keeps new clients away. Ticks on time keep Agones from replacing the server, which would end the sessions
// that it still has.
TEST(Health, is_not_ready_without_a_valid_lease_but_its_ticks_go_on) {
  Health health = valid();
  health.in_fleet = false;
  EXPECT_THAT(why_not_ready(health), testing::HasSubstr("lease"));
  EXPECT_TRUE(has_ticks_on_time(health));
  health.draining = true;
  EXPECT_EQ(why_not_ready(health), "draining");
}

TEST(Health, ticks_are_on_time_also_while_the_server_takes_no_clients) {
  Health health = valid();
  health.draining = health.memory_full = true;
  EXPECT_TRUE(has_ticks_on_time(health));
  health.last_tick_ns = 0;
  EXPECT_FALSE(has_ticks_on_time(health));
  health.last_tick_ns = kNow_ns - kTickStallMax_ns - 1;
  EXPECT_FALSE(has_ticks_on_time(health));
}

class Pages : public testing::Test {
 protected:
  HttpResponse page(std::string_view path) {
    HttpRequest request;
    request.method = "GET";
    request.path = path;
    return pages_.handle(request);
  }

  Health health_ = valid();
  Metrics metrics_;
  RoomPage room_{metrics_.fleet, {[](const std::string&) { return RoomPlace{.server_id = 2}; }}};
  ServerPages pages_{metrics_, [this] { return health_; }, {}, room_};
};

TEST_F(Pages, the_fleet_is_shown_only_where_the_public_cannot_ask) {
  EXPECT_EQ(page("/fleet.json").status, 404);
  EXPECT_EQ(page("/fleet").status, 404);
  // The page of the fleet has names and addresses of all servers. Only pages that were made with functions for it, as
  // for the service's own port, show it.
  ServerPages service(
      metrics_, [this] { return health_; }, {[] { return std::string("{}"); }, [] { return std::string("<p>"); }},
      room_);
  HttpRequest request;
  request.path = "/fleet.json";
  EXPECT_EQ(service.handle(request).body, "{}");
  EXPECT_EQ(service.handle(request).content_type, "application/json");
  request.path = "/fleet";
  EXPECT_EQ(service.handle(request).body, "<p>");
}

TEST_F(Pages, alive_even_when_not_ready) {
  health_.draining = true;
  EXPECT_EQ(page("/healthz").status, 200);
  const HttpResponse ready = page("/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_EQ(ready.body, "draining\n");
}

TEST_F(Pages, ready_when_all_is_well) {
  EXPECT_EQ(page("/readyz").status, 200);
}

TEST_F(Pages, metrics_are_valid_and_show_readiness) {
  for (const bool draining : {false, true}) {
    health_.draining = draining;
    const HttpResponse answer = page("/metrics");
    EXPECT_EQ(answer.status, 200);
    EXPECT_THAT(answer.content_type, testing::HasSubstr("version=0.0.4"));
    Exposition exposition;
    std::string error;
    ASSERT_TRUE(parse_exposition(answer.body, exposition, error)) << error;
    EXPECT_EQ(exposition.value("hairnet_ready"), draining ? 0 : 1);
  }
}

TEST_F(Pages, where_a_room_is_the_public_may_ask) {
  HttpRequest request;
  request.path = "/room";
  request.query = "name=hall";
  EXPECT_EQ(pages_.handle(request).status, 200);
}

TEST_F(Pages, unknown_paths_are_not_found) {
  for (const char* path : {"", "/", "/metrics/", "/healthzz", "/../metrics"}) EXPECT_EQ(page(path).status, 404) << path;
}

}  // namespace
}  // namespace hairnet::server
