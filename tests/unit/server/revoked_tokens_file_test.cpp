#include "server/app/revoked_tokens_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "tests/unit/server/fake_client.hpp"

namespace hairnet::server {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

// A folder with the file of revoked tokens, one subject a line. The tokens of people in it are refused before they
// expire.
class RevokedTokensFileTest : public testing::Test {
 protected:
  ~RevokedTokensFileTest() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& text) { std::ofstream(file_) << text; }
  static channel::TokenClaims claims(const std::string& subject) {
    channel::TokenClaims claims;
    claims.subject = subject;
    claims.expires_s = channel::kTokenTimeMax_s;
    return claims;
  }
  [[nodiscard]] bool revokes(const std::string& subject) const { return tokens_.contains(claims(subject)); }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("revoked_tokens_" + std::to_string(::getpid()));
  const bool made_ = std::filesystem::create_directories(folder_);
  const std::string file_ = folder_ / "revoked", key_file_ = folder_ / "key";
  RevokedTokens tokens_;
  Metrics metrics_;
};

TEST_F(RevokedTokensFileTest, is_read_again_when_it_changes_and_at_most_once_a_second) {
  write("alice\n");
  RevokedTokensFile file(file_);
  file.poll(tokens_, 0);
  EXPECT_TRUE(revokes("alice"));
  write("alice\nbob\n");
  file.poll(tokens_, kSecond_ns - 1);
  EXPECT_FALSE(revokes("bob"));
  file.poll(tokens_, kSecond_ns);
  EXPECT_TRUE(revokes("bob"));
  // A blank line empties the list on purpose. A file without any byte is an error instead, as the case of errors below
  // shows.
  write("\n");
  EXPECT_EQ(file.poll(tokens_, 2 * kSecond_ns), "");
  EXPECT_FALSE(revokes("alice"));
}

TEST_F(RevokedTokensFileTest, may_come_from_windows) {
  write(
      "\xef\xbb\xbf"
      "alice\r\nbob\r\n");
  RevokedTokensFile file(file_);
  EXPECT_EQ(file.poll(tokens_, 0), "");
  EXPECT_TRUE(revokes("alice"));
  EXPECT_TRUE(revokes("bob"));
  EXPECT_EQ(tokens_.count(), 2u);
}

TEST_F(RevokedTokensFileTest, keeps_its_names_while_it_cannot_be_read_or_is_empty) {
  write("alice\n");
  RevokedTokensFile file(file_);
  file.poll(tokens_, 0);
  // The file is absent, then empty, then a pipe that would block a reader, and then a folder. In each case nobody who
  // is revoked may come in again.
  const std::vector<std::function<void()>> errors{[] {},  // absent
                                                  [this] { write(""); },
                                                  [this] { ASSERT_EQ(::mkfifo(file_.c_str(), 0600), 0); },
                                                  [this] { std::filesystem::create_directory(file_); }};
  std::int64_t now_ns = 0;
  for (const auto& make_error : errors) {
    std::filesystem::remove_all(file_);
    make_error();
    EXPECT_NE(file.poll(tokens_, now_ns += kSecond_ns), "");
    EXPECT_TRUE(revokes("alice"));
  }
  std::filesystem::remove_all(file_);
  write("bob\n");
  EXPECT_EQ(file.poll(tokens_, now_ns + kSecond_ns), "");
  EXPECT_FALSE(revokes("alice"));
  EXPECT_TRUE(revokes("bob"));
}

TEST_F(RevokedTokensFileTest, a_server_does_not_start_without_it_and_ends_the_sessions_that_it_names) {
  const channel::TokenKey key = channel::TokenKey::make_random();
  std::ofstream(key_file_) << key.to_text() << '\n';
  Config config;
  config.workers = 1;
  config.token_revoked_file = file_;
  EXPECT_THAT(Server::create(config, metrics_, 0).error(), HasSubstr("needs server.token_key_file"));
  config.token_key_file = key_file_;
  EXPECT_THAT(Server::create(config, metrics_, 0).error(), HasSubstr(file_ + ": No such file or directory"));
  write("");
  auto server = Server::create(config, metrics_, 0);
  ASSERT_TRUE(server) << server.error();
  FakeClient client(**server, 0);
  wire::Hello hello;
  hello.token = channel::sign(claims("alice"), key);
  client.send(hello, 0);
  (*server)->poll_io(0);
  ASSERT_EQ(client.connection->all<wire::Welcome>().size(), 1u);
  EXPECT_EQ(metrics_.session.gauges.subjects.value(), 1);
  write("alice\n");
  // The server looks at the file at most once a second (kLookInterval_ns), so after two seconds it looks again.
  (*server)->poll_io(2 * kSecond_ns);
  ASSERT_EQ(client.connection->all<wire::Goodbye>().size(), 1u);
  EXPECT_EQ(client.connection->all<wire::Goodbye>()[0].reason, wire::GoodbyeReason::token_refused);
  EXPECT_EQ(metrics_.session.sessions_closed_by_server_token_revoked.value(), 1u);
}

}  // namespace
}  // namespace hairnet::server
