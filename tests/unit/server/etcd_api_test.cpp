#include "server/fleet/etcd_api.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "server/fleet/fleet_values.hpp"

namespace hairnet::server::etcd {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

// These are answers of etcd 3.4.23. Keys and values are in base64: "L2gvcg==" is "/h/r", and "bWU=" is "me".
constexpr const char* kGrant =
    R"({"header":{"cluster_id":"324952591200643719","member_id":"3319814642761637952","revision":"1","raft_term":"2"},"ID":"2324035592752441093","TTL":"5"})";
constexpr const char* kKeepAlive =
    R"({"result":{"header":{"revision":"1","raft_term":"2"},"ID":"2324035592752441095","TTL":"60"}})";
constexpr const char* kLeaseUnknown = R"({"result":{"header":{"revision":"1","raft_term":"2"},"ID":"12345"}})";
constexpr const char* kClaimLost =
    R"({"header":{"revision":"3"},"responses":[{"response_range":{"header":{"revision":"3"},"kvs":[{"key":"L2gvcg==","create_revision":"3","mod_revision":"3","version":"1","value":"bWU=","lease":"2324035592752441095"}],"count":"1"}}]})";
constexpr const char* kChange =
    R"({"result":{"header":{"revision":"3"},"events":[{"kv":{"key":"L2gvcg==","create_revision":"3","mod_revision":"3","version":"1","value":"bWU="}}]}})";
constexpr const char* kDeletion =
    R"({"result":{"header":{"revision":"4"},"events":[{"type":"DELETE","kv":{"key":"L2gvcg==","mod_revision":"4"}}]}})";
constexpr const char* kCompacted = R"({"result":{"header":{"raft_term":"2"},"canceled":true,"compact_revision":"3"}})";

TEST(EtcdApi, writes_numbers_as_text_and_keys_as_base64) {
  const Request request = claim("/h/r", "me", 2324035592752441095, "/h/k");
  EXPECT_EQ(request.path, "/v3/kv/txn");
  EXPECT_EQ(json::parse(request.body), json::parse(R"({
    "compare": [{"target": "CREATE", "result": "EQUAL", "key": "L2gvcg==", "create_revision": "0"}],
    "success": [{"request_put": {"key": "L2gvcg==", "value": "bWU=", "lease": "2324035592752441095"}},
                {"request_range": {"key": "L2gvaw=="}}],
    "failure": [{"request_range": {"key": "L2gvcg=="}}, {"request_range": {"key": "L2gvaw=="}}]})"));
  EXPECT_EQ(grant(9).body, R"({"TTL":"9"})");
  EXPECT_EQ(json::parse(remove("/h/r", 7, {}).body).at("compare").at(0).at("create_revision"), "7");
  EXPECT_EQ(json::parse(remove("/h/r", 7, {}).body).at("success").size(), 1u);
  const Beside put{.action = Beside::Action::put, .key = "/h/k", .value = "me", .lease = 5};
  EXPECT_EQ(json::parse(remove("/h/r", 7, put).body).at("success").size(), 2u);
  EXPECT_EQ(json::parse(put_beside("/h/r", 7, put).body), json::parse(R"({
    "compare": [{"target": "CREATE", "result": "EQUAL", "key": "L2gvcg==", "create_revision": "7"}],
    "success": [{"request_put": {"key": "L2gvaw==", "value": "bWU=", "lease": "5"}}]})"));
}

TEST(EtcdApi, the_end_of_a_prefix_is_the_next_text) {
  EXPECT_EQ(end_of("/h/"), "/h0");
  // A byte of 0xff cannot be raised by one, so it is cut off and the byte before it is raised.
  EXPECT_EQ(end_of("a\xff\xff"), "b");
}

TEST(EtcdApi, reads_what_etcd_sends) {
  EXPECT_EQ(parse_grant(kGrant)->lease, 2324035592752441093);
  EXPECT_EQ(parse_grant(kGrant)->ttl_s, 5);
  EXPECT_EQ(parse_keep_alive(kKeepAlive)->ttl_s, 60);
  EXPECT_EQ(parse_keep_alive(kLeaseUnknown)->ttl_s, 0) << "the lease does not exist";
  const auto lost = parse_txn(kClaimLost);
  ASSERT_TRUE(lost) << lost.error();
  EXPECT_FALSE(lost->succeeded);
  EXPECT_EQ(lost->found.at(0).key, "/h/r");
  EXPECT_EQ(lost->found.at(0).value, "me");
  EXPECT_EQ(lost->found.at(0).create_revision, 3);
  const auto change = parse_watch(kChange), deletion = parse_watch(kDeletion), compacted = parse_watch(kCompacted);
  EXPECT_FALSE(change->changes.at(0).is_deleted);
  EXPECT_EQ(change->changes.at(0).entry.value, "me");
  EXPECT_TRUE(deletion->changes.at(0).is_deleted);
  EXPECT_EQ(deletion->changes.at(0).entry.mod_revision, 4);
  EXPECT_TRUE(compacted->is_canceled);
  EXPECT_EQ(compacted->compact_revision, 3);
  EXPECT_EQ(parse_range(R"({"header":{"revision":"3"}})")->entries.size(), 0u);
  EXPECT_EQ(*parse_token(R"({"header":{},"token":"abc.9"})"), "abc.9");
}

TEST(EtcdApi, refuses_every_truncation) {
  const auto refuses_all = [](const std::string& text, auto parse) {
    for (std::size_t length = 0; length < text.size(); ++length)
      EXPECT_FALSE(parse(std::string_view(text).substr(0, length))) << length;
  };
  refuses_all(kGrant, parse_grant);
  refuses_all(kKeepAlive, parse_keep_alive);
  refuses_all(kClaimLost, parse_txn);
  refuses_all(kChange, parse_watch);
}

TEST(EtcdApi, refuses_fields_of_wrong_type_and_range) {
  const auto errors = [](const std::string& text) {
    const auto answer = parse_grant(text);
    return answer ? "" : answer.error();
  };
  EXPECT_THAT(errors("[]"), HasSubstr("not a JSON object"));
  EXPECT_THAT(errors("{}"), HasSubstr("names no lease"));
  EXPECT_THAT(errors(R"({"ID":"1"})"), HasSubstr("has no time"));
  EXPECT_THAT(errors(R"({"ID":"-1","TTL":"5"})"), HasSubstr("ID is not a whole number"));
  EXPECT_THAT(errors(R"({"ID":"9223372036854775808","TTL":"5"})"), HasSubstr("ID is not a whole number"));
  EXPECT_THAT(errors(R"({"ID":18446744073709551615,"TTL":"5"})"), HasSubstr("ID is not a whole number"));
  EXPECT_THAT(errors(R"({"ID":"1 ","TTL":"5"})"), HasSubstr("ID is not a whole number"));
  EXPECT_THAT(errors(R"({"ID":"1","TTL":5.5})"), HasSubstr("TTL is not a whole number"));
  EXPECT_THAT(errors(R"({"ID":{},"TTL":"5"})"), HasSubstr("ID is not a whole number"));
  EXPECT_FALSE(parse_range(R"({"header":[]})"));
  EXPECT_FALSE(parse_range(R"({"header":{"revision":"3"},"kvs":{}})"));
  EXPECT_FALSE(parse_range(R"({"header":{"revision":"3"},"kvs":[7]})"));
  EXPECT_FALSE(
      parse_range(R"({"header":{"revision":"3"},"kvs":[{"key":"%%","mod_revision":"3","create_revision":"3"}]})"));
  EXPECT_FALSE(parse_range(R"({"header":{"revision":"3"},"kvs":[{"mod_revision":"3","create_revision":"3"}]})"));
  EXPECT_FALSE(parse_watch(R"({"result":{"events":[{"type":"MOVE","kv":{"key":"YQ==","mod_revision":"4"}}]}})"));
  EXPECT_FALSE(parse_watch(R"({"result":{"events":[{}]}})"));
  EXPECT_FALSE(parse_watch(R"({"error":{"grpc_code":14,"message":"gone"}})"));
  EXPECT_FALSE(parse_token(R"({"token":"a b"})"));
  EXPECT_FALSE(parse_grant(std::string(kAnswerBytesMax + 1, ' ')));
  EXPECT_FALSE(parse_grant(std::string(100'000, '['))) << "deep nesting";
}

TEST(EtcdApi, leaves_out_keys_and_values_that_are_too_long_and_reads_the_rest) {
  const auto is_left_out = [](std::size_t key_bytes, std::size_t value_bytes) {
    const std::string entry = R"("create_revision":"3","mod_revision":"3","value":")";
    const auto answer =
        parse_range(R"({"header":{"revision":"3"},"kvs":[{"key":")" + std::string(key_bytes / 3 * 4, 'A') + "\"," +
                    entry + std::string(value_bytes / 3 * 4, 'A') + R"("},{"key":"YQ==",)" + entry + R"("}]})");
    EXPECT_EQ(answer->entries.at(1).key, "a");
    EXPECT_EQ(answer->entries.at(0).key.size(), key_bytes) << "a list goes on behind it";
    EXPECT_EQ(answer->entries.at(0).value.size(), answer->entries.at(0).is_too_long ? 0 : value_bytes);
    return answer->entries.at(0).is_too_long;
  };
  // A key has at most 512 bytes (kKeyBytesMax) and a value 65 536 (kValueBytesMax). The lengths here are multiples of
  // 3, which base64 writes without padding.
  EXPECT_FALSE(is_left_out(510, 65'535));
  EXPECT_TRUE(is_left_out(510, 65'538));
  EXPECT_TRUE(is_left_out(513, 3));
}

TEST(EtcdApi, a_lease_with_less_than_a_second_left_is_not_gone) {
  EXPECT_EQ(parse_time_to_live(R"({"ID":"7","TTL":"4","grantedTTL":"5"})")->ttl_s, 4);
  EXPECT_EQ(parse_time_to_live(R"({"ID":"7","grantedTTL":"5"})")->ttl_s, 1);
  EXPECT_EQ(parse_time_to_live(R"({"ID":"7","TTL":"-1"})")->ttl_s, 0);
  EXPECT_FALSE(parse_time_to_live(R"({"ID":"7","TTL":"-2"})"));
  EXPECT_FALSE(parse_time_to_live(R"({"TTL":"4"})"));
}

TEST(EtcdApi, tells_a_lease_that_is_gone_from_other_errors) {
  EXPECT_TRUE(is_lease_gone(404, R"({"error":"etcdserver: requested lease not found","code":5})"));
  EXPECT_TRUE(is_lease_gone(404, R"({"code":5,"message":"etcdserver: requested lease not found","details":[]})"));
  EXPECT_FALSE(is_lease_gone(503, R"({"error":"etcdserver: no leader","code":14})"));
  EXPECT_FALSE(is_lease_gone(404, "Not Found"));
  EXPECT_EQ(parse_error("Not Found"), "");
}

ServerStatus some_status() {
  return {.id = 7,
          .address = {.host = "hair1.example", .port = 7420, .page = "https://hair1.example/"},
          .load = {.free_share = 0.5, .free_characters = 10, .characters = 20, .rooms = 3},
          .draining = true};
}

TEST(FleetValues, a_status_comes_back_as_it_was) {
  ServerStatus status = some_status();
  EXPECT_EQ(*parse_status(to_value(status)), status);
  status.grooms = {ContentHash{1}, ContentHash{2, 255}};
  EXPECT_EQ(*parse_status(to_value(status)), status);
  EXPECT_EQ(parse_owner(owner_value(0xabcdef)), 0xabcdefu);
}

TEST(FleetValues, refuses_a_status_that_is_not_valid) {
  EXPECT_FALSE(parse_status("{}"));
  EXPECT_FALSE(parse_status("7"));
  for (const auto& [name, wrong] : std::vector<std::pair<const char*, json>>{{"id", "7"},
                                                                             {"id", "0000000000000000"},
                                                                             {"host", ""},
                                                                             {"host", "a b"},
                                                                             {"host", std::string(256, 'a')},
                                                                             {"port", 65536},
                                                                             {"port", -1},
                                                                             {"page", "https://a\n"},
                                                                             {"free", 1.5},
                                                                             {"free", "1"},
                                                                             {"free_characters", 1e300},
                                                                             {"draining", 1}}) {
    json status = json::parse(to_value(some_status()));
    status[name] = wrong;
    EXPECT_FALSE(parse_status(status.dump())) << name << " " << wrong;
    status.erase(name);
    EXPECT_FALSE(parse_status(status.dump())) << name;
  }
  // The length in base64 of one hash more than a status may name; four more characters cover the rounding.
  const std::string too_many((kPassedGroomsMax + 1) * sizeof(ContentHash) / 3 * 4 + 4, 'A');
  for (const json& wrong : {json(7), json("AA"), json("no base64"), json(too_many)}) {
    json status = json::parse(to_value(some_status()));
    status["grooms"] = wrong;
    EXPECT_FALSE(parse_status(status.dump())) << wrong;
  }
  // An owner is written as 16 hexadecimal digits.
  EXPECT_FALSE(parse_owner("7"));
  EXPECT_FALSE(parse_owner("000000000000000g"));
}

TEST(FleetValues, the_page_shows_servers_and_rooms) {
  const std::vector<ServerStatus> servers{some_status()};
  const std::vector<RoomOwner> rooms{{.room = "hall", .server_id = 7, .claim = 12}};
  const json page = json::parse(fleet_json(7, true, servers, rooms));
  EXPECT_EQ(page.at("self"), "0000000000000007");
  EXPECT_EQ(page.at("servers").at(0).at("host"), "hair1.example");
  EXPECT_EQ(page.at("rooms").at(0).at("claim"), 12);
}

TEST(FleetValues, the_page_for_people_shows_them_and_trusts_no_name) {
  ServerStatus spiteful = some_status();
  spiteful.address.host = "<script>";
  // Any server that may write into etcd chooses these values, and an operator's browser shows them.
  spiteful.address.page = "javascript:alert(1)";
  const std::vector<ServerStatus> servers{spiteful};
  const std::vector<RoomOwner> rooms{{.room = "hall", .server_id = 7, .claim = 12}, {.room = "lost", .server_id = 8}};
  const std::string page = fleet_html(7, false, servers, rooms);
  EXPECT_THAT(page, HasSubstr("<td>hall<td>&lt;script&gt;:"));
  EXPECT_THAT(page, HasSubstr("<td>lost<td>a server that is gone"));
  EXPECT_THAT(page, HasSubstr("etcd does not answer"));
  EXPECT_THAT(page, Not(HasSubstr("<script>")));
  EXPECT_THAT(page, Not(HasSubstr("javascript")));
}

}  // namespace
}  // namespace hairnet::server::etcd
