#include "server/fleet/etcd_directory.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/unit/server/fleet_of_two.hpp"

namespace hairnet::server {
namespace {

using Kind = Placement::Kind;
using testing::HasSubstr;
constexpr std::int64_t kMs = 1'000'000, kSecond_ns = 1'000'000'000;

TEST(EtcdDirectory, stays_out_of_the_fleet_until_it_knows_its_address) {
  support::SimulatedEtcd etcd;
  EtcdDirectoryDef def;
  def.server_id = 1;
  FleetMember member(etcd, def);
  std::int64_t now_ns = 1000 * kSecond_ns;
  const auto run = [&] {
    for (int i = 0; i < 50; ++i, now_ns += 20 * kMs) member.step(now_ns);
  };
  run();
  EXPECT_EQ(member.counters.requests.value(), 0u);
  EXPECT_FALSE(member.directory.fence().is_open(now_ns));
  const Placement placement = member.directory.where("hall", now_ns);
  EXPECT_EQ(placement.kind, Kind::unavailable);
  EXPECT_THAT(placement.reason, HasSubstr("public address"));
  member.directory.set_address({.host = "203.0.113.7", .port = 7431, .page = ""});
  run();
  EXPECT_TRUE(member.directory.fence().is_open(now_ns));
  EXPECT_EQ(member.directory.servers().front().address.port, 7431);
  EXPECT_EQ(member.directory.where("hall", now_ns).kind, Kind::unowned);
}

TEST(EtcdDirectory, that_never_knew_its_address_stops_at_once) {
  support::SimulatedEtcd etcd;
  EtcdDirectoryDef def;
  def.server_id = 1;
  FleetMember member(etcd, def);
  member.directory.drain(kSecond_ns);
  member.directory.stop(kSecond_ns);
  EXPECT_TRUE(member.directory.is_stopped());
}

TEST_F(FleetOfTwo, requests_have_time_outs) {
  first_.is_silent = true;
  run(10);
  // A request has 0.2 to 2 s (kRequestTimeoutMin_ns and kRequestTimeoutMax_ns in etcd_calls.cpp).
  EXPECT_GT(first_.counters.requests_failed_timeout.value(), 3u);
  EXPECT_LE(first_.directory.call_count(), 3u);
}

TEST_F(FleetOfTwo, a_server_tells_its_load_at_most_once_a_second) {
  run(1);
  const std::int64_t before = etcd_.revision();
  for (int i = 0; i < 250; ++i) {
    first_.directory.tell({.free_share = 0.5, .characters = static_cast<std::uint32_t>(i)});
    run(0.02);
  }
  // The load changes in each of 250 steps, 5 s, and each write goes to all servers of the fleet: one a second may be
  // written (kTellInterval_ns in etcd_entry.cpp).
  EXPECT_LE(etcd_.revision() - before, 6);
  EXPECT_GE(etcd_.revision() - before, 4);
  run(2);
  const std::int64_t quiet = etcd_.revision();
  for (int i = 0; i < 100; ++i) {
    // The free share is announced in steps of 1/32 (kAnnouncedShareSteps), so a change of 0.001 is none.
    first_.directory.tell({.free_share = 0.5 + 1e-3 * (i % 2), .characters = 249});
    run(0.02);
  }
  EXPECT_EQ(etcd_.revision(), quiet) << "nothing has changed";
}

TEST_F(FleetOfTwo, a_server_that_stops_leaves_nothing) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.stop(now_ns_);
  EXPECT_FALSE(first_.directory.holds("hall", now_ns_));
  EXPECT_FALSE(first_.directory.is_stopped());
  run(0.1);
  EXPECT_TRUE(first_.directory.is_stopped());
  EXPECT_EQ(kind(second_), Kind::unowned);
  EXPECT_EQ(second_.directory.servers().size(), 1u);
}

// Its requests still reach etcd, so the keys must vanish, though no answer confirms it.
TEST_F(FleetOfTwo, a_server_that_stops_and_does_not_hear_etcd_leaves_nothing) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.is_deaf = true;
  run(1);
  first_.directory.stop(now_ns_);
  run(1);
  EXPECT_EQ(kind(second_), Kind::unowned);
  EXPECT_EQ(second_.directory.servers().size(), 1u);
}

}  // namespace
}  // namespace hairnet::server
