#include "server/fleet/local_directory.hpp"

#include <gtest/gtest.h>

namespace hairnet::server {
namespace {

TEST(LocalDirectory, has_every_room_until_it_stops) {
  LocalDirectory directory(5, {.host = "", .port = 7420, .page = ""});
  EXPECT_EQ(directory.where("hall", 7).kind, Placement::Kind::here);
  EXPECT_TRUE(directory.holds("hall", 7));
  EXPECT_TRUE(directory.claim("hall", 7));
  EXPECT_FALSE(directory.claim("a b", 7));
  EXPECT_EQ(directory.servers().size(), 1u);
  directory.drain(8);
  EXPECT_FALSE(directory.claim("hall", 8));
  EXPECT_TRUE(directory.holds("hall", 8));
  directory.stop(9);
  EXPECT_TRUE(directory.is_stopped());
  EXPECT_FALSE(directory.holds("hall", 9));
  EXPECT_EQ(directory.where("hall", 9).kind, Placement::Kind::unavailable);
}

}  // namespace
}  // namespace hairnet::server
