#include "server/app/room_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hairnet::server {
namespace {

using testing::HasSubstr;

class RoomPages : public testing::Test {
 protected:
  HttpResponse ask(std::string_view query, std::string_view authorization = "") {
    HttpRequest request;
    request.method = "GET";
    request.path = "/room";
    request.query = query;
    request.authorization = authorization;
    return page_.handle(request);
  }

  // The fleet answers every question with `place_` and notes the room in `asked_`. A token is valid when it equals
  // `needed_`, which is empty at first, so requests without a token are answered.
  RoomPlace place_{.kind = RoomPlace::Kind::held, .server_id = 2, .address = {"hair-2", 7421, ""}};
  std::string asked_, token_, needed_;
  FleetCounters counters_;
  RoomPage page_{counters_,
                 {[this](const std::string& room) {
                    asked_ = room;
                    return place_;
                  },
                  [this](std::string_view token, const std::string&) {
                    token_ = token;
                    return std::string(token == needed_ ? "" : "the token is not valid");
                  }}};
};

TEST_F(RoomPages, say_where_a_room_is) {
  const HttpResponse answer = ask("name=hall");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.content_type, "application/json");
  EXPECT_THAT(answer.body, HasSubstr(R"("host":"hair-2","port":7421)"));
  EXPECT_EQ(asked_, "hall");
  EXPECT_EQ(ask("x=1&name=other").status, 200);
  EXPECT_EQ(asked_, "other");
  ask("name=");
  // A client without a room name enters the lobby, so an empty name asks for it.
  EXPECT_EQ(asked_, "lobby");
  EXPECT_EQ(counters_.room_answers_held.value(), 3u);
}

TEST_F(RoomPages, say_why_there_is_no_server) {
  place_ = {.kind = RoomPlace::Kind::full, .reason = "no server takes it"};
  const HttpResponse answer = ask("name=hall");
  EXPECT_EQ(answer.status, 503);
  EXPECT_THAT(answer.body, HasSubstr(R"("state":"full","reason":"no server takes it")"));
  EXPECT_EQ(counters_.room_answers_full.value(), 1u);
  place_ = {.kind = RoomPlace::Kind::unknown, .reason = "etcd does not answer"};
  EXPECT_EQ(ask("name=hall").status, 503);
  EXPECT_EQ(counters_.room_answers_unknown.value(), 1u);
}

TEST_F(RoomPages, refuse_names_that_no_room_has) {
  // A room's name has at most 64 bytes (kRoomNameBytesMax).
  const std::string long_name = "name=" + std::string(65, 'a');
  for (const std::string_view query : {"", "name", "nam=hall", "name=a%20b", "name=a/b", "&&&", long_name.c_str()}) {
    EXPECT_EQ(ask(query).status, 400) << query;
  }
  EXPECT_EQ(counters_.room_answers_refused_name.value(), 7u);
  // A refused name never reaches the fleet.
  EXPECT_EQ(asked_, "");
}

TEST_F(RoomPages, tell_nothing_without_a_token_that_is_good_for_the_room) {
  needed_ = "good";
  // Only the scheme Bearer with one space before the token counts.
  for (const char* authorization : {"", "good", "Basic good", "Bearer bad", "Bearer  good"}) {
    EXPECT_EQ(ask("name=hall", authorization).status, 401) << authorization;
  }
  EXPECT_EQ(asked_, "");
  EXPECT_EQ(counters_.room_answers_refused_token.value(), 5u);
  EXPECT_EQ(ask("name=hall", "Bearer good").status, 200);
}

}  // namespace
}  // namespace hairnet::server
