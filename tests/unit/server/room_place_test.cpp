#include "server/fleet/room_place.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/fleet/fleet_values.hpp"
#include "tests/unit/server/fake_directory.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kNow_ns = 1;

// Asks where the room "hall" is, in a fleet of two servers: this one (fleet_.all[0]) and hair-2 (fleet_.all[1]).
class RoomPlaces : public testing::Test {
 protected:
  RoomPlaces() { fleet_.all.push_back(server_at(kOtherId, "hair-2", 7421)); }
  RoomPlace find() { return find_room(fleet_, "hall", kNow_ns); }

  FakeDirectory fleet_;
};

TEST_F(RoomPlaces, a_room_that_a_server_holds_is_there) {
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  EXPECT_EQ(find().kind, RoomPlace::Kind::held);
  EXPECT_EQ(find().server_id, kOtherId);
  EXPECT_EQ(find().address.port, 7421);
}

// Placement prefers the server with more free time. Asking must claim nothing, or anyone could fill the directory with
// made-up rooms.
TEST_F(RoomPlaces, a_room_that_nobody_holds_would_be_where_placement_says_and_asking_claims_nothing) {
  fleet_.all[0].load.free_share = 0;
  EXPECT_EQ(find().kind, RoomPlace::Kind::placed);
  EXPECT_EQ(find().server_id, kOtherId);
  fleet_.all[0].load.free_share = 1;
  fleet_.all[1].draining = true;
  EXPECT_EQ(find().server_id, kOwnId);
  EXPECT_TRUE(fleet_.claimed.empty());
}

// The draining server gives the room up soon. Clients that are sent there would be sent on a moment later.
TEST_F(RoomPlaces, a_room_of_a_draining_server_is_going_to_the_next_one) {
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, ""});
  fleet_.all[1].draining = true;
  EXPECT_EQ(find().kind, RoomPlace::Kind::draining);
  EXPECT_EQ(find().server_id, kOwnId);
  fleet_.all[0].load.free_characters = 0;
  EXPECT_EQ(find().kind, RoomPlace::Kind::draining);
  EXPECT_EQ(find().server_id, 0u);
  EXPECT_NE(find().reason, "");
}

// The operator has named the hall as a room that needs a server of its own.
TEST_F(RoomPlaces, a_room_that_is_called_big_goes_to_a_server_without_rooms) {
  fleet_.set_big_rooms({"hall"});
  fleet_.all[0].load.rooms = 1;
  EXPECT_EQ(find().server_id, kOtherId);
  fleet_.all[0].load.rooms = 0;
  fleet_.all[1].load.rooms = 1;
  EXPECT_EQ(find().server_id, kOwnId);
}

TEST_F(RoomPlaces, nobody_has_a_room_while_all_servers_are_full) {
  for (ServerStatus& server : fleet_.all) server.load.free_characters = 0;
  EXPECT_EQ(find().kind, RoomPlace::Kind::full);
  EXPECT_EQ(find().server_id, 0u);
}

// Server 77 holds the room, but no address of such a server is known.
TEST_F(RoomPlaces, is_unknown_where_the_directory_or_the_address_is) {
  fleet_.places["hall"] = {.kind = Placement::Kind::unavailable, .reason = "etcd does not answer"};
  EXPECT_EQ(find().kind, RoomPlace::Kind::unknown);
  EXPECT_EQ(find().reason, "etcd does not answer");
  fleet_.places["hall"] = {.kind = Placement::Kind::elsewhere, .server_id = 77};
  EXPECT_EQ(find().kind, RoomPlace::Kind::unknown);
  EXPECT_NE(find().reason, "");
  fleet_.places["hall"] = {.kind = Placement::Kind::pending};
  EXPECT_EQ(find().kind, RoomPlace::Kind::deciding);
}

TEST_F(RoomPlaces, as_json_name_the_server_or_the_reason) {
  fleet_.put_elsewhere("hall", kOtherId, {"hair-2", 7421, "https://hair-2/"});
  const auto held = nlohmann::json::parse(room_json("hall", find()));
  EXPECT_EQ(held, (nlohmann::json{{"room", "hall"},
                                  {"state", "held"},
                                  {"server", "0000000000000002"},
                                  {"host", "hair-2"},
                                  {"port", 7421},
                                  {"page", "https://hair-2/"}}));
  fleet_.places["hall"] = {.kind = Placement::Kind::unavailable, .reason = "etcd does not answer"};
  EXPECT_EQ(nlohmann::json::parse(room_json("hall", find())),
            (nlohmann::json{{"room", "hall"}, {"state", "unknown"}, {"reason", "etcd does not answer"}}));
}

}  // namespace
}  // namespace hairnet::server
