#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "schema/channel/token.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/unit/server/build_quickly.hpp"
#include "tests/unit/server/fake_client.hpp"
#include "tests/unit/server/small_groom.hpp"

// The whole server without a socket: a moderator acts on what it sees.
namespace hairnet::server {
namespace {

using wire::ModerateAction;

class ModerationPollTest : public testing::Test {
 protected:
  ModerationPollTest() {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "key") << key_.to_text() << '\n';
    Config config;
    config.workers = 1;
    config.token_key_file = folder_ / "key";
    // A room without people lasts for 30 s. One ban at most is possible, so a second action of this kind must be
    // refused.
    config.room_grace_ns = 30 * kNsPerSecond;
    config.sessions.bans_max = 1;
    auto created = Server::create(config, metrics_, now_ns_, nullptr, build_quickly);
    if (created) server_ = std::move(*created);
  }
  ~ModerationPollTest() override { std::filesystem::remove_all(folder_); }
  std::unique_ptr<FakeClient> join(const std::string& subject, bool moderate = false) {
    channel::TokenClaims claims;
    claims.subject = subject;
    claims.moderate = moderate;
    claims.expires_s = channel::kTokenTimeMax_s;
    wire::Hello hello;
    hello.token = channel::sign(claims, key_);
    auto client = std::make_unique<FakeClient>(*server_, now_ns_);
    client->send(hello, now_ns_);
    return client;
  }
  void run_s(int count) {
    for (int i = 0; i < 10 * count; ++i) {
      now_ns_ += kNsPerSecond / 10;
      server_->poll(now_ns_);
    }
  }
  static bool is_welcome(const FakeClient& client) { return !client.connection->all<wire::Welcome>().empty(); }

  static constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("moderation_poll_" + std::to_string(::getpid()));
  const channel::TokenKey key_ = channel::TokenKey::make_random();
  Metrics metrics_;
  std::int64_t now_ns_ = 1000 * kNsPerSecond;
  std::unique_ptr<Server> server_;
};

TEST_F(ModerationPollTest, the_owner_of_a_member_is_removed_and_its_characters_leave_the_room) {
  ASSERT_TRUE(server_);
  const auto moderator = join("mod", true), mallory = join("mallory");
  const std::vector<std::uint8_t> bytes = wire::encode_groom(small_groom());
  mallory->upload(bytes, wire::hash_groom(bytes), now_ns_);
  mallory->send(wire::AddCharacter{1, wire::hash_groom(bytes), LevelIndex::low}, now_ns_);
  run_s(1);
  ASSERT_EQ(moderator->connection->all<wire::MemberJoined>().size(), 1u);
  const wire::MemberJoined seen = moderator->connection->all<wire::MemberJoined>()[0];
  // The owner of the member is named by session, not by subject. It may not come back for 5 s, and the last text is the
  // reason that it gets.
  moderator->send(wire::Moderate{ModerateAction::remove, seen.session, "", 5, "be kind"}, now_ns_);
  run_s(1);
  EXPECT_EQ(mallory->connection->all<wire::Goodbye>().at(0).reason, wire::GoodbyeReason::removed);
  EXPECT_EQ(moderator->connection->all<wire::MemberLeft>().at(0).member, seen.member);
  EXPECT_EQ(join("mallory")->connection->all<wire::Goodbye>().at(0).reason, wire::GoodbyeReason::removed);
  // A lock counts like a ban, and Mallory's ban still lasts.
  moderator->send(wire::Moderate{ModerateAction::lock, 0, ""}, now_ns_);
  EXPECT_THAT(moderator->errors(), testing::ElementsAre(wire::ErrorReason::limit_exceeded)) << "bans_max is 1";
  // After 5 more seconds the ban is over.
  run_s(5);
  EXPECT_TRUE(is_welcome(*join("mallory")));
}

TEST_F(ModerationPollTest, a_lock_lasts_as_long_as_the_empty_room) {
  ASSERT_TRUE(server_);
  const auto moderator = join("mod", true);
  moderator->send(wire::Moderate{ModerateAction::lock, 0, ""}, now_ns_);
  moderator->send(wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}, now_ns_);
  // The room has been empty for 29 of its 30 s, so its lock still keeps Bob out. After 32 s the lock is gone with the
  // room, since Bob's refused attempt does not prolong them.
  run_s(29);
  EXPECT_FALSE(is_welcome(*join("bob")));
  run_s(3);
  EXPECT_TRUE(is_welcome(*join("bob")));
}

}  // namespace
}  // namespace hairnet::server
