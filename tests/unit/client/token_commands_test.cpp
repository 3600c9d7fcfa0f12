#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "client/tools/token/commands.hpp"
#include "client/tools/token/duration.hpp"

namespace hairnet::token {
namespace {

using testing::HasSubstr;

// This is 2023-11-14 22:13:20 UTC.
constexpr std::int64_t kNow_s = 1'700'000'000;

class TokenCommands : public testing::Test {
 protected:
  void SetUp() override {
    file_ = testing::TempDir() + "hairnet_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".key";
    const Result<std::string> key = make_key();
    ASSERT_TRUE(key) << key.error();
    std::ofstream(file_) << *key << '\n';
  }
  void TearDown() override { std::remove(file_.c_str()); }

  std::string file_;
};

TEST_F(TokenCommands, a_made_token_shows_what_it_grants) {
  MakeOptions make{.key_file = file_, .claims = {}, .expires_s = 60, .not_before_s = 10};
  make.claims.room = "stage";
  make.claims.characters_max = 2;
  make.claims.name = "a \"b\"";
  make.claims.subject = "alice";
  make.claims.id = "t-1";
  make.claims.upload = false;
  make.claims.wind = true;
  make.claims.touch = false;
  make.claims.props = true;
  make.claims.moderate = true;
  const Result<std::string> token = make_token(make, kNow_s);
  ASSERT_TRUE(token) << token.error();
  const auto shown = [&](std::int64_t now_s) { return show_token({file_, *token}, now_s).value_or("refused"); };
  EXPECT_THAT(shown(kNow_s), HasSubstr("\"not yet good\""));
  // The token holds from 10 s after it was made until 60 s after it.
  EXPECT_THAT(shown(kNow_s + 60), HasSubstr("\"expired\""));
  EXPECT_EQ(shown(kNow_s + 10), R"({
  "state": "good",
  "room": "stage",
  "role": "participant",
  "expires": "2023-11-14T22:14:20Z",
  "not_before": "2023-11-14T22:13:30Z",
  "characters_max": 2,
  "name": "a \"b\"",
  "subject": "alice",
  "id": "t-1",
  "upload": false,
  "wind": true,
  "touch": false,
  "props": true,
  "moderate": true
})");
}

TEST_F(TokenCommands, what_is_wrong_is_one_line) {
  MakeOptions make{.key_file = file_ + "x", .claims = {}, .expires_s = 60, .not_before_s = {}};
  EXPECT_THAT(make_token(make, kNow_s).error(), testing::StartsWith(file_ + "x: "));
  make.key_file = file_;
  make.claims.name = "\xff";
  EXPECT_EQ(make_token(make, kNow_s).error(), "the name, subject or id is not valid UTF-8");
  make.claims.room = "a b";
  EXPECT_THAT(make_token(make, kNow_s).error(), HasSubstr("a room's name is"));
  EXPECT_THAT(show_token({file_, "a.b.c"}, kNow_s).error(), testing::StartsWith("this is not a token: "));
  std::ofstream(file_) << "no key\n";
  EXPECT_THAT(make_token(make, kNow_s).error(), HasSubstr("is no key"));
}

TEST(TokenDuration, has_a_number_and_a_unit) {
  EXPECT_EQ(parse_duration_s("90"), 90);
  EXPECT_EQ(parse_duration_s("90s"), 90);
  EXPECT_EQ(parse_duration_s("15m"), 900);
  EXPECT_EQ(parse_duration_s("12h"), 43'200);
  EXPECT_EQ(parse_duration_s("30d"), 2'592'000);
  // A token lasts at most ten years, 3653 days.
  for (const char* text : {"", "h", "1w", "1hh", "-1h", "0", "1.5h", " 1h", "3654d", "99999999999999999999s"})
    EXPECT_EQ(parse_duration_s(text), std::nullopt) << text;
}

}  // namespace
}  // namespace hairnet::token
