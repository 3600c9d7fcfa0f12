#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "server/fleet/etcd_directory.hpp"
#include "server/transport/etcd_client.hpp"
#include "tests/whole/fake_sidecar.hpp"
#include "tests/whole/loopback.hpp"
#include "tests/whole/process.hpp"
#include "tests/whole/whole_test.hpp"

namespace hairnet::whole {
namespace {

using server::EtcdDirectory;
using server::FleetEvent;
using server::Placement;

constexpr const char* kEtcd = "/usr/bin/etcd";

// A real etcd of one member, on free ports. Skips, and says so, where the package etcd-server is not installed.
class RealEtcd : public WholeTest {
 protected:
  void SetUp() override {
    WholeTest::SetUp();
    if (::access(kEtcd, X_OK) != 0) GTEST_SKIP() << "NOT TESTED: there is no " << kEtcd << "; deploy/setup installs it";
    port_ = free_port();
    peer_port_ = free_port();
    start_etcd();
  }
  void start_etcd() {
    const std::string client = url(), peer = "http://127.0.0.1:" + std::to_string(peer_port_);
    etcd_ = std::make_unique<Process>(
        std::vector<std::string>{kEtcd, "--data-dir", path("etcd_data"), "--listen-client-urls", client,
                                 "--advertise-client-urls", client, "--listen-peer-urls", peer,
                                 "--initial-advertise-peer-urls", peer, "--initial-cluster", "default=" + peer},
        path("etcd"));
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (get(port_, "/health").find("true") == std::string::npos && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ASSERT_NE(get(port_, "/health").find("true"), std::string::npos) << etcd_->err();
  }
  void kill_etcd() { etcd_.reset(); }
  [[nodiscard]] std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }

  std::uint16_t port_ = 0, peer_port_ = 0;
  std::unique_ptr<Process> etcd_;
};

// A directory with its own loop and client, as in a server.
struct Member {
  Member(const std::string& url, std::uint64_t id, std::int64_t lease_s = 5) {
    client = *server::EtcdClient::create(
        loop, {.endpoints = {url}, .ca = "", .certificate = "", .key = "", .user = "", .password_file = ""});
    server::EtcdDirectoryDef def;
    def.server_id = id;
    def.address = {.host = "server-" + std::to_string(id), .port = 7420, .page = ""};
    def.lease_s = lease_s;
    def.seed = id;
    directory = std::make_unique<EtcdDirectory>(def, *client, counters);
    client->set_sink(directory.get());
  }
  ~Member() { client->set_sink(nullptr); }
  void poll() {
    loop.poll();
    directory->poll(channel::monotonic_ns());
    for (FleetEvent& event : directory->take_events()) events.push_back(std::move(event));
  }
  [[nodiscard]] bool holds(const std::string& room) const { return directory->holds(room, channel::monotonic_ns()); }
  [[nodiscard]] Placement where(const std::string& room) const {
    return directory->where(room, channel::monotonic_ns());
  }
  [[nodiscard]] std::size_t count(FleetEvent::Kind kind) const {
    return static_cast<std::size_t>(
        std::ranges::count_if(events, [kind](const FleetEvent& event) { return event.kind == kind; }));
  }

  server::IoLoop loop;
  server::FleetCounters counters;
  std::unique_ptr<server::EtcdClient> client;
  std::unique_ptr<EtcdDirectory> directory;
  std::vector<FleetEvent> events;
};

// Polls the members until `done`. Returns false after `seconds_max`, which is far longer than any lease here.
bool wait(std::initializer_list<Member*> members, const std::function<bool()>& done, double seconds_max = 60) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds_max);
  while (!done()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    for (Member* member : members) member->poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

TEST_F(RealEtcd, one_of_two_servers_wins_a_room_and_both_know_it) {
  Member first(url(), 1), second(url(), 2);
  const auto sees_both = [](const Member& member) { return member.directory->servers().size() == 2; };
  ASSERT_TRUE(wait({&first, &second}, [&] { return sees_both(first) && sees_both(second); }));
  EXPECT_EQ(first.where("hall").kind, Placement::Kind::unowned);
  first.directory->claim("hall", channel::monotonic_ns());
  second.directory->claim("hall", channel::monotonic_ns());
  ASSERT_TRUE(wait({&first, &second}, [&] {
    return first.where("hall").kind == Placement::Kind::here || second.where("hall").kind == Placement::Kind::here;
  }));
  Member& owner = first.holds("hall") ? first : second;
  Member& other = first.holds("hall") ? second : first;
  ASSERT_TRUE(wait({&first, &second}, [&] { return other.where("hall").kind == Placement::Kind::elsewhere; }));
  EXPECT_FALSE(other.holds("hall"));
  EXPECT_EQ(other.where("hall").address, owner.where("hall").address);
  EXPECT_EQ(other.where("hall").claim, owner.where("hall").claim);
  EXPECT_EQ(other.counters.claims_lost.value(), 1u);

  owner.directory->release("hall", channel::monotonic_ns());
  ASSERT_TRUE(wait({&first, &second}, [&] { return other.where("hall").kind == Placement::Kind::unowned; }));
  other.directory->claim("hall", channel::monotonic_ns());
  ASSERT_TRUE(wait({&first, &second}, [&] { return other.holds("hall"); }));
  EXPECT_GT(other.where("hall").claim, 0);
  for (Member* member : {&first, &second}) member->directory->stop(channel::monotonic_ns());
  EXPECT_TRUE(wait({&first, &second}, [&] { return first.directory->is_stopped() && second.directory->is_stopped(); }));
  for (const Member* member : {&first, &second}) {
    EXPECT_EQ(member->counters.requests_failed_malformed.value(), 0u);
    EXPECT_EQ(member->counters.requests_failed_refused.value(), 0u);
  }
}

TEST_F(RealEtcd, a_server_that_stands_still_stops_before_another_gets_its_room) {
  Member still(url(), 1), other(url(), 2);
  still.directory->claim("hall", channel::monotonic_ns());
  ASSERT_TRUE(wait({&still, &other}, [&] { return still.holds("hall"); }));
  ASSERT_TRUE(wait({&still, &other}, [&] { return other.where("hall").kind == Placement::Kind::elsewhere; }));
  bool was_both = false;
  // `still` is not polled any more, as with SIGSTOP.
  ASSERT_TRUE(wait({&other}, [&] {
    was_both |= still.holds("hall") && other.holds("hall");
    if (other.where("hall").kind == Placement::Kind::unowned) other.directory->claim("hall", channel::monotonic_ns());
    return other.holds("hall");
  }));
  EXPECT_FALSE(was_both);
  EXPECT_FALSE(still.holds("hall"));
  ASSERT_TRUE(wait({&still, &other}, [&] { return still.count(FleetEvent::Kind::room_lost) == 1; }));
  EXPECT_TRUE(other.holds("hall"));
  EXPECT_FALSE(still.holds("hall"));
  EXPECT_EQ(still.counters.leases_lost.value(), 1u);
}

TEST_F(RealEtcd, what_is_kept_of_a_room_goes_to_its_next_owner_when_it_is_given_up_and_when_its_server_has_died) {
  const auto kept_by = [](const Member& member) {
    std::string kept = "no claim";
    for (const FleetEvent& event : member.events)
      if (event.kind == FleetEvent::Kind::room_claimed) kept = event.kept;
    return kept;
  };
  Member first(url(), 1), second(url(), 2);
  first.directory->claim("hall", channel::monotonic_ns());
  ASSERT_TRUE(wait({&first, &second}, [&] { return first.holds("hall"); }));
  first.directory->keep("hall", "a ban", channel::monotonic_ns());
  first.directory->release("hall", channel::monotonic_ns());
  ASSERT_TRUE(wait({&first, &second}, [&] { return first.directory->room_count() == 0; }));
  ASSERT_TRUE(wait({&first, &second}, [&] { return second.where("hall").kind == Placement::Kind::unowned; }));
  second.directory->claim("hall", channel::monotonic_ns());
  ASSERT_TRUE(wait({&first, &second}, [&] { return second.holds("hall"); }));
  ASSERT_TRUE(wait({&first, &second}, [&] { return kept_by(second) != "no claim"; }));
  EXPECT_EQ(kept_by(second), "a ban");
  ASSERT_TRUE(wait({&first, &second}, [&] { return second.counters.rooms_kept.value() == 1; }))
      << "under its own lease";
  const std::string large(60'000, 'x');
  second.directory->keep("hall", large, channel::monotonic_ns());
  ASSERT_TRUE(wait({&first, &second}, [&] { return second.counters.rooms_kept.value() >= 2; }));
  // Only the call of the directory's watch is still open, so etcd has answered the write of the large value.
  ASSERT_TRUE(wait({&first, &second}, [&] { return second.directory->call_count() <= 1; }));
  // `second` is not polled any more, as if it were dead.
  ASSERT_TRUE(wait({&first}, [&] {
    if (first.where("hall").kind == Placement::Kind::unowned) first.directory->claim("hall", channel::monotonic_ns());
    return first.holds("hall");
  }));
  ASSERT_TRUE(wait({&first}, [&] { return first.count(FleetEvent::Kind::room_claimed) == 2; }));
  EXPECT_EQ(kept_by(first), large);
  for (const Member* member : {&first, &second}) {
    EXPECT_EQ(member->counters.requests_failed_malformed.value(), 0u);
    EXPECT_EQ(member->counters.requests_failed_refused.value(), 0u);
  }
}

TEST_F(RealEtcd, rooms_pause_while_etcd_is_dead_and_come_back_with_it) {
  Member member(url(), 1);
  member.directory->claim("hall", channel::monotonic_ns());
  ASSERT_TRUE(wait({&member}, [&] { return member.holds("hall"); }));
  const std::int64_t claim = member.where("hall").claim;
  kill_etcd();
  ASSERT_TRUE(wait({&member}, [&] { return !member.holds("hall"); }));
  EXPECT_EQ(member.where("hall").kind, Placement::Kind::unavailable);
  EXPECT_FALSE(member.directory->is_reachable());
  std::this_thread::sleep_for(std::chrono::seconds(2));
  start_etcd();
  ASSERT_TRUE(wait({&member}, [&] { return member.holds("hall"); }));
  EXPECT_EQ(member.where("hall").claim, claim) << "its lease has outlived etcd";
  EXPECT_EQ(member.counters.leases_lost.value(), 0u);
}

TEST_F(RealEtcd, servers_see_each_other_on_their_page_until_one_is_stopped) {
  const auto start_one = [this](const std::string& name, std::uint16_t port) {
    return start("hairnet-server",
                 {"--port", "0", "--service-port", std::to_string(port), "--etcd", url(), "--fleet-address",
                  "127.0.0.1:" + std::to_string(port), "--fleet-lease", "5", "--workers", "1"},
                 name);
  };
  const std::uint16_t first_port = free_port(), second_port = free_port();
  const auto first = start_one("first", first_port), second = start_one("second", second_port);
  EXPECT_TRUE(wait({}, [&] { return get(first_port, "/readyz") == "ready\n"; })) << get(first_port, "/readyz");
  EXPECT_THAT(get(first_port, "/room?name=hall"), testing::HasSubstr("\"state\":\"placed\""));
  const auto server_count = [&] {
    const auto page = nlohmann::json::parse(get(first_port, "/fleet.json"), nullptr, false);
    return page.is_object() ? page.at("servers").size() : 0;
  };
  EXPECT_TRUE(wait({}, [&] { return server_count() == 2; })) << get(first_port, "/fleet.json") << first->err();
  second->send(SIGSTOP);
  EXPECT_TRUE(wait({}, [&] { return server_count() == 1; }));
  second->send(SIGCONT);
  EXPECT_TRUE(wait({}, [&] { return server_count() == 2; }));
  second->send(SIGTERM);
  EXPECT_EQ(second->wait(), 0);
  EXPECT_TRUE(wait(
      // The wait is shorter than the lease of 5 s: the server must have left by itself, before its lease ends.
      {}, [&] { return server_count() == 1; }, 4))
      << "it gives its lease back";
  kill_etcd();
  EXPECT_TRUE(wait({}, [&] { return get(first_port, "/readyz").find("lease") != std::string::npos; }));
  EXPECT_EQ(get(first_port, "/healthz"), "alive\n");
  first->send(SIGTERM);
  EXPECT_EQ(first->wait(), 0);
}

// Returns the value of a metric without labels, or 0 while there is none.
double metric(std::uint16_t service_port, const std::string& name) {
  const std::string text = get(service_port, "/metrics");
  const auto found = text.find("\n" + name + " ");
  return found == std::string::npos ? 0 : std::stod(text.substr(found + name.size() + 2));
}

#if defined(__clang__)
constexpr bool kIsThreadSanitized = __has_feature(thread_sanitizer);
#else
constexpr bool kIsThreadSanitized = false;
#endif

// Together the rooms want some five times what the first server's budget gives them on a busy machine. Below once it is
// not short of time, and above twenty times no room seems to fit the second server: servers take each other to be
// equally fast. So machines of a fourth to four times this speed will do.
TEST_F(RealEtcd, a_server_that_is_short_of_time_hands_rooms_over_to_one_that_joins) {
  if (kIsThreadSanitized) GTEST_SKIP() << "with the thread sanitizer a server is ten times slower: no room fits it";
  constexpr int kRooms = 24;
  const auto start_one = [this](const std::string& name, std::uint16_t port, std::uint16_t service_port,
                                const std::string& tick_budget) {
    return start("hairnet-server", {"--port",          std::to_string(port),
                                    "--service-port",  std::to_string(service_port),
                                    "--etcd",          url(),
                                    "--fleet-address", "127.0.0.1",
                                    "--fleet-lease",   "5",
                                    "--workers",       "1",
                                    "--level-cache",   path("levels"),
                                    "--groom-cache",   path("grooms"),
                                    "--learn-hair",    "never",
                                    "--tick-budget",   tick_budget,
                                    "--log-level",     "info"},
                 name);
  };
  const std::uint16_t port = free_port(), service_port = free_port(), next_service_port = free_port();
  // The first server may use 20 % of each tick, so that its characters are too many. The second one may use 95 %.
  const auto first = start_one("first", port, service_port, "0.2");
  ASSERT_TRUE(wait({}, [&] { return get(service_port, "/readyz") == "ready\n"; })) << first->err();
  std::vector<std::unique_ptr<Process>> views;
  for (int i = 0; i < kRooms; ++i) {
    views.push_back(start("hairnet-view",
                          {"--connect", "127.0.0.1:" + std::to_string(port), "--room", "room-" + std::to_string(i),
                           "--character", "groom=made:bob,motion=made:nod,level=high,strands=200", "--duration",
                           "forever", "--reconnect", "forever", "--no-draw"},
                          "view" + std::to_string(i)));
  }
  ASSERT_TRUE(wait({}, [&] { return metric(service_port, "hairnet_characters_below_wanted") > 0; }))
      << get(service_port, "/metrics") << views[0]->err();
  EXPECT_EQ(metric(service_port, "hairnet_fleet_rooms_handed_over_total"), 0) << "there is nobody else";
  const auto second = start_one("second", free_port(), next_service_port, "0.95");
  const auto is_handed_over = [&] { return metric(service_port, "hairnet_fleet_rooms_handed_over_total") >= 1; };
  ASSERT_TRUE(wait({}, is_handed_over, 150)) << first->err() << get(service_port, "/metrics");
  ASSERT_TRUE(wait({}, [&] { return metric(next_service_port, "hairnet_fleet_rooms_owned") >= 1; })) << second->err();
  ASSERT_TRUE(wait({}, [&] {
    return metric(next_service_port, "hairnet_clients") >= 1 &&
           metric(next_service_port, "hairnet_frames_sent_total") >= 30;
  })) << get(next_service_port, "/metrics");
  for (const auto& view : views) {
    view->send(SIGINT);
    EXPECT_EQ(view->wait(), 0) << view->err();
  }
  for (Process* server : {first.get(), second.get()}) {
    server->send(SIGTERM);
    EXPECT_EQ(server->wait(), 0) << server->err();
  }
  EXPECT_EQ(first->out().find("sessions_redirected 0\n"), std::string::npos) << first->out();
  EXPECT_NE(first->err().find("event=room_handed_over"), std::string::npos) << first->err();
  EXPECT_EQ(second->err().find("event=room_handed_over"), std::string::npos) << "nothing comes back";
}

TEST_F(RealEtcd, agones_hears_of_a_servers_life_and_says_where_it_is) {
  const std::uint16_t port = free_port(), service_port = free_port();
  FakeSidecar sidecar;
  sidecar.is_away = true;
  ::setenv("AGONES_SDK_HTTP_PORT", std::to_string(sidecar.port()).c_str(), 1);
  const auto server = start("hairnet-server",
                            {"--port", std::to_string(port), "--service-port", std::to_string(service_port), "--etcd",
                             url(), "--fleet-address", "agones", "--fleet-lease", "5", "--workers", "1",
                             "--room-grace-s", "0.1", "--rooms-max", "16", "--level-cache", path("levels")},
                            "server");
  ::unsetenv("AGONES_SDK_HTTP_PORT");
  ASSERT_TRUE(wait({}, [&] { return get(service_port, "/healthz") == "alive\n"; })) << server->err();
  ASSERT_TRUE(wait({}, [&] { return server->err().find("event=agones_unreachable") != std::string::npos; }));
  EXPECT_THAT(sidecar.states(), testing::IsEmpty());
  sidecar.is_away = false;
  sidecar.set_address("");
  ASSERT_TRUE(wait({}, [&] { return sidecar.count("GET /gameserver") > 0; })) << server->err();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_THAT(sidecar.states(), testing::IsEmpty()) << "without an address it is in no fleet";
  EXPECT_THAT(get(service_port, "/readyz"), testing::HasSubstr("lease"));
  sidecar.set_address("127.0.0.1", port);
  ASSERT_TRUE(wait({}, [&] { return sidecar.states() == std::vector<std::string>{"ready"}; })) << server->err();
  const nlohmann::json page = nlohmann::json::parse(get(service_port, "/fleet.json"), nullptr, false);
  ASSERT_EQ(page.at("servers").size(), 1u);
  EXPECT_EQ(page.at("servers")[0].at("host"), "127.0.0.1");
  EXPECT_EQ(page.at("servers")[0].at("port"), port);

  auto view = start("hairnet-view",
                    {"--connect", "127.0.0.1:" + std::to_string(port), "--room", "hall", "--character",
                     "groom=made:bob,motion=made:nod,level=rigid,strands=200", "--duration", "forever", "--no-draw"},
                    "view");
  ASSERT_TRUE(wait({},
                   [&] {
                     return sidecar.states() == std::vector<std::string>{"ready", "allocate"};
                   }))
      << server->err() << view->err();
  ASSERT_TRUE(wait({}, [&] { return sidecar.count(R"({"capacity":"16","count":"1"})") == 1; })) << server->err();
  view->send(SIGINT);
  EXPECT_EQ(view->wait(), 0) << view->err();
  ASSERT_TRUE(wait({}, [&] {
    return sidecar.states() == std::vector<std::string>{"ready", "allocate", "ready"};
  })) << server->err();
  EXPECT_GT(sidecar.count("POST /health"), 2u);
  server->send(SIGTERM);
  EXPECT_EQ(server->wait(), 0) << server->err();
  EXPECT_EQ(sidecar.states(), (std::vector<std::string>{"ready", "allocate", "ready", "shutdown"}));
}

// Three servers of a fleet, and a client that knows the address of one.
class RealFleet : public RealEtcd {
 protected:
  void SetUp() override {
    RealEtcd::SetUp();
    if (IsSkipped()) return;
    for (Server& server : servers_) {
      server.port = free_port();
      server.service_port = free_port();
      const std::string name = "server" + std::to_string(server.port);
      server.process =
          start("hairnet-server",
                {"--port", std::to_string(server.port), "--service-port", std::to_string(server.service_port), "--etcd",
                 url(), "--fleet-address", "127.0.0.1", "--fleet-lease", "5", "--workers", "1", "--level-cache",
                 path("levels"), "--groom-cache", path("grooms"), "--learn-hair", "never"},
                name);
    }
    ASSERT_TRUE(wait({}, [&] { return page().value("servers", nlohmann::json::array()).size() == servers_.size(); }));
  }
  // Asks any server that still runs.
  nlohmann::json page() {
    for (Server& server : servers_) {
      auto page = nlohmann::json::parse(get(server.service_port, "/fleet.json"), nullptr, false);
      if (page.is_object()) return page;
    }
    return nlohmann::json::object();
  }
  // The server that owns the only room, and has as many characters; null while there is none.
  auto* owner(std::size_t characters) {
    const nlohmann::json fleet = page();
    Server* found = nullptr;
    if (!fleet.contains("rooms") || fleet["rooms"].size() != 1) return found;
    for (const auto& status : fleet["servers"]) {
      if (status["id"] != fleet["rooms"][0]["server"] || status["characters"] != characters) continue;
      for (Server& server : servers_)
        if (server.port == status["port"]) found = &server;
    }
    return found;
  }

  struct Server {
    std::uint16_t port = 0, service_port = 0;
    std::unique_ptr<Process> process;
  };
  std::array<Server, 3> servers_;
};

TEST_F(RealFleet, hair_goes_on_when_its_server_is_stopped_and_when_the_next_one_is_killed) {
  auto view = start("hairnet-view",
                    {"--connect", "127.0.0.1:" + std::to_string(servers_[0].port), "--room", "hall", "--character",
                     "groom=made:bob,motion=made:nod,level=low,strands=200", "--duration", "forever", "--reconnect",
                     "forever", "--no-draw"},
                    "view");
  Server* first = nullptr;
  ASSERT_TRUE(wait({}, [&] { return (first = owner(1)) != nullptr; })) << page() << view->err();
  first->process->send(SIGTERM);
  EXPECT_EQ(first->process->wait(), 0) << first->process->err();
  EXPECT_NE(first->process->out().find("sessions_redirected 1"), std::string::npos) << first->process->out();
  Server* second = nullptr;
  ASSERT_TRUE(wait({}, [&] { return (second = owner(1)) != nullptr && second != first; })) << page() << view->err();
  second->process->send(SIGKILL);
  second->process->wait();
  Server* third = nullptr;
  ASSERT_TRUE(wait({},
                   [&] {
                     third = owner(1);
                     return third != nullptr && third != first && third != second;
                   }))
      << page() << view->err();
  view->send(SIGINT);
  EXPECT_EQ(view->wait(), 0) << view->err();
  third->process->send(SIGTERM);
  EXPECT_EQ(third->process->wait(), 0);
  EXPECT_NE(third->process->out().find("sessions_welcomed 1"), std::string::npos) << third->process->out();
}

}  // namespace
}  // namespace hairnet::whole
