#include "server/fleet/choose_server.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "core/random.hpp"

namespace hairnet::server {
namespace {

// A hash of names decides, so the number of rooms of a server varies as if drawn at random. Bounds are five standard
// deviations: the root of n p (1 - p), for n rooms and a share p.
constexpr int kRooms = 6000;

std::vector<ServerStatus> servers_of(std::size_t count, double free_share = 1) {
  Random random(9);
  std::vector<ServerStatus> servers(count);
  for (ServerStatus& server : servers) {
    server.id = random.next() | 1;
    server.load = {.free_share = free_share, .free_characters = 100};
  }
  return servers;
}

std::string room(int i) {
  return "room-" + std::to_string(i);
}

std::map<std::uint64_t, int> spread(const std::vector<ServerStatus>& servers) {
  std::map<std::uint64_t, int> count;
  for (int i = 0; i < kRooms; ++i) ++count[choose_server(room(i), servers).value_or(0)];
  return count;
}

TEST(Placement, spreads_rooms_evenly_over_equal_servers) {
  for (const auto& [id, count] : spread(servers_of(10))) {
    EXPECT_NE(id, 0u);
    EXPECT_NEAR(count, kRooms / 10, 5 * 24) << "five standard deviations";
  }
}

TEST(Placement, gives_rooms_by_the_free_share) {
  std::vector<ServerStatus> servers = servers_of(2);
  servers[1].load.free_share = 0.25;
  // Weights of 1 and 0.25 are shares of 0.8 and 0.2.
  const auto count = spread(servers);
  EXPECT_NEAR(count.at(servers[0].id), kRooms * 0.8, 5 * 31);
  EXPECT_NEAR(count.at(servers[1].id), kRooms * 0.2, 5 * 31);
}

TEST(Placement, does_not_depend_on_the_order_of_servers) {
  std::vector<ServerStatus> servers = servers_of(7), reversed = servers;
  std::ranges::reverse(reversed);
  for (int i = 0; i < 500; ++i) EXPECT_EQ(choose_server(room(i), servers), choose_server(room(i), reversed));
}

TEST(Placement, moves_only_rooms_of_the_server_that_leaves_or_fills_up) {
  const std::vector<ServerStatus> all = servers_of(8);
  std::vector<ServerStatus> fewer = all, fuller = all;
  fewer.erase(fewer.begin() + 3);
  fuller[3].load.free_share = 0;
  int moved = 0;
  for (int i = 0; i < kRooms; ++i) {
    const auto before = choose_server(room(i), all), after = choose_server(room(i), fewer);
    EXPECT_EQ(after, choose_server(room(i), fuller));
    if (before == all[3].id)
      ++moved;
    else
      EXPECT_EQ(before, after);
  }
  EXPECT_NEAR(moved, kRooms / 8, 5 * 26);
}

TEST(Placement, moves_rooms_only_to_a_server_that_joins_or_has_more_room) {
  const std::vector<ServerStatus> all = servers_of(5, 0.5);
  std::vector<ServerStatus> freer = all;
  freer[2].load.free_share = 1;
  for (int i = 0; i < kRooms; ++i) {
    const auto before = choose_server(room(i), all), after = choose_server(room(i), freer);
    EXPECT_TRUE(before == after || after == all[2].id);
  }
}

TEST(Placement, chooses_no_full_and_no_draining_server) {
  std::vector<ServerStatus> servers = servers_of(3);
  servers[0].draining = true;
  servers[1].load.free_characters = 0;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(choose_server(room(i), servers), servers[2].id);
  servers[2].load.free_share = kFreeShareMin / 2;
  EXPECT_EQ(choose_server("hall", servers), std::nullopt);
}

TEST(Placement, puts_rooms_beside_a_big_one_only_where_no_other_server_takes_them) {
  std::vector<ServerStatus> servers = servers_of(3);
  servers[0].load.has_big_room = true;
  int on_second = 0;
  for (int i = 0; i < 300; ++i) {
    EXPECT_NE(choose_server(room(i), servers), servers[0].id);
    on_second += choose_server(room(i), servers) == servers[1].id;
  }
  // Two servers share 300 rooms by halves; the bounds are more than five standard deviations of 9 away.
  EXPECT_GT(on_second, 100);
  EXPECT_LT(on_second, 200);
  servers[1].draining = true;
  servers[2].load.free_characters = 0;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(choose_server(room(i), servers), servers[0].id);
}

TEST(Placement, gives_a_big_room_a_server_without_rooms) {
  std::vector<ServerStatus> servers = servers_of(3);
  servers[0].load.rooms = servers[1].load.rooms = 2;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(choose_server(room(i), servers, true), servers[2].id);
  servers[2].load.has_big_room = true;
  for (int i = 0; i < 100; ++i) EXPECT_NE(choose_server(room(i), servers, true), servers[2].id);
  servers[0].draining = servers[1].draining = true;
  EXPECT_EQ(choose_server("hall", servers, true), servers[2].id);
}

TEST(Placement, moves_only_rooms_of_the_server_that_gets_a_big_room) {
  const std::vector<ServerStatus> all = servers_of(6);
  std::vector<ServerStatus> marked = all;
  marked[2].load.has_big_room = true;
  for (int i = 0; i < 1000; ++i) {
    const auto before = choose_server(room(i), all), after = choose_server(room(i), marked);
    EXPECT_TRUE(before == after || before == all[2].id);
  }
}

TEST(Placement, of_no_servers_is_none) {
  EXPECT_EQ(choose_server("hall", {}), std::nullopt);
}

}  // namespace
}  // namespace hairnet::server
