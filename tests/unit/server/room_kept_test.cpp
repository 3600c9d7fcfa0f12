#include <gtest/gtest.h>

#include <string>

#include "server/fleet/fleet_values.hpp"

namespace hairnet::server {
namespace {

// An example with every field. It has quotes and letters outside of ASCII, which the JSON must carry, and bytes from 0
// to 255, which are no valid text by themselves. Ban times are seconds since 1970.
RoomKept some() {
  return {.bans = {{"sub:mallory", 1'800'000'000}, {"sub:eve \"x\"", 5}},
          .mutes = {"sub:loud"},
          .is_locked = true,
          .members = {"sub:alice", "sub:b\xc3\xb6"},
          .wind = {0, 1, 255, 7},
          .props = {9, 8, 0}};
}

// Returns the text that the directory stores, from which nothing may have been left out.
std::string text_of(const RoomKept& kept) {
  std::size_t left_out = 0;
  std::string text = to_value(kept, left_out);
  EXPECT_EQ(left_out, 0u);
  return text;
}

TEST(RoomKeptText, comes_back_as_it_was) {
  EXPECT_EQ(*parse_kept(text_of(some())), some());
  EXPECT_EQ(text_of({}), "") << "there is nothing to keep";
  EXPECT_EQ(*parse_kept(text_of({.mutes = {"a"}})), RoomKept{.mutes = {"a"}});
  EXPECT_EQ(*parse_kept(text_of({.props = {1}})), RoomKept{.props = {1}});
}

// An entry of etcd may be cut short. Half of it must not pass for a room without bans.
TEST(RoomKeptText, refuses_every_truncation) {
  const std::string text = text_of(some());
  for (std::size_t length = 0; length < text.size(); ++length) EXPECT_FALSE(parse_kept(text.substr(0, length)));
}

// The text comes from etcd, where another program may have written it. Each of these has one wrong part: a wrong type,
// a missing or negative time, a time that does not fit, bytes that are not encoded, or an empty member.
TEST(RoomKeptText, refuses_what_no_server_writes) {
  for (const char* text : {
           "[]",
           "{}",
           R"({"locked":1,"wind":"","members":[],"mutes":[],"bans":[]})",
           R"({"locked":false,"wind":"?","members":[],"mutes":[],"bans":[]})",
           R"({"locked":false,"wind":"","props":"?","members":[],"mutes":[],"bans":[]})",
           R"({"locked":false,"wind":"","props":7,"members":[],"mutes":[],"bans":[]})",
           R"({"locked":false,"wind":"","members":[""],"mutes":[],"bans":[]})",
           R"({"locked":false,"wind":"","members":[],"mutes":[7],"bans":[]})",
           R"({"locked":false,"wind":"","members":[],"mutes":[],"bans":[["a"]]})",
           R"({"locked":false,"wind":"","members":[],"mutes":[],"bans":[["a",-1]]})",
           R"({"locked":false,"wind":"","members":[],"mutes":[],"bans":[["a",18446744073709551615]]})",
           R"({"locked":false,"wind":"","members":[],"mutes":[],"bans":{"a":1}})",
       }) {
    const auto kept = parse_kept(text);
    ASSERT_FALSE(kept) << text;
    EXPECT_NE(kept.error(), "");
  }
  EXPECT_TRUE(parse_kept(R"({"locked":false,"wind":"","members":[],"mutes":[],"bans":[["a",1]]})"));
  EXPECT_FALSE(parse_kept(std::string(kKeptBytesMax + 1, ' ')));
}

// Bytes become longer as text, so props of half of kKeptBytesMax (60 KiB) fit, and props of all of it do not.
TEST(RoomKeptText, leaves_out_and_counts_props_that_do_not_fit) {
  RoomKept kept = some();
  kept.props.assign(kKeptBytesMax / 2, 7);
  EXPECT_EQ(*parse_kept(text_of(kept)), kept);
  kept.props.assign(kKeptBytesMax, 7);
  std::size_t left_out = 0;
  const std::string text = to_value(kept, left_out);
  EXPECT_EQ(left_out, 1u);
  kept.props.clear();
  EXPECT_EQ(text, text_of(kept)) << "all else is kept";
}

// The loop makes the props shorter by one byte until they fit; then the last removed byte is put back. The text must
// use the bound but for the few bytes by which the encoding of one byte more would exceed it.
TEST(RoomKeptText, takes_the_largest_props_that_fit) {
  RoomKept kept{.props = std::vector<std::uint8_t>(kKeptBytesMax * 3 / 4, 7)};
  std::size_t left_out = 1;
  for (; left_out > 0 && !kept.props.empty(); kept.props.pop_back()) to_value(kept, left_out);
  kept.props.push_back(7);
  const std::string text = text_of(kept);
  EXPECT_LE(text.size(), kKeptBytesMax);
  EXPECT_GT(text.size(), kKeptBytesMax - 10);
}

TEST(RoomKeptText, is_bounded_and_leaves_out_the_last_bans) {
  RoomKept kept = some();
  kept.members.clear();
  kept.props.clear();
  for (int i = 0; i < 3000; ++i) kept.bans.push_back({"sub:someone-with-a-name-" + std::to_string(i), 2'000'000'000});
  std::size_t left_out = 0;
  const std::string text = to_value(kept, left_out);
  EXPECT_LE(text.size(), kKeptBytesMax);
  EXPECT_GT(text.size(), kKeptBytesMax - 100);
  const auto read = parse_kept(text);
  ASSERT_TRUE(read) << read.error();
  EXPECT_EQ(read->bans.size() + left_out, kept.bans.size());
  EXPECT_GT(left_out, 0u);
  EXPECT_EQ(read->bans.front(), kept.bans.front());
  EXPECT_TRUE(read->is_locked);
}

}  // namespace
}  // namespace hairnet::server
