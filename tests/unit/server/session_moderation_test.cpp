#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>

#include "tests/unit/server/subject_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using wire::ErrorReason;
using wire::GoodbyeReason;
using enum wire::ModerateAction;

// A moderator is in the lobby. A test adds clients there and in another room, the attic.
class ModerationTest : public SubjectTest {
 protected:
  ModerationTest() {
    context_.room_grace_ns = 10 * kSecond_ns;
    context_.limits.messages_per_s = 1000;
  }
  static channel::TokenClaims moderator_claims(const std::string& subject = "mod") {
    channel::TokenClaims granted = claims(subject);
    granted.moderate = true;
    return granted;
  }
  [[nodiscard]] wire::Hello hello_to(const std::string& room, const channel::TokenClaims& claims) const {
    wire::Hello hello = hello_with(claims);
    hello.room = room;
    return hello;
  }
  // Sends the request as the moderator. Returns the error of a refused request, or else none.
  std::optional<ErrorReason> moderate(const wire::Moderate& request) { return moderate_as(moderator_, request); }
  std::optional<ErrorReason> moderate_as(Client& client, const wire::Moderate& request) {
    const std::size_t before = client.errors().size();
    send(client, request);
    const std::vector<ErrorReason> errors = client.errors();
    if (errors.size() == before) return std::nullopt;
    EXPECT_EQ(errors.size(), before + 1);
    return errors.back();
  }
  bool may_set_wind(Client& client) {
    const std::size_t before = client.errors().size();
    send(client, wire::SetWind{});
    return client.errors().size() == before;
  }
  static std::uint64_t session_of(const Client& client) { return client.welcome().session; }

  Client moderator_ = join(moderator_claims());
};

// Mallory has three sessions in the lobby, one of them detached, and one in the attic. The moderator names one of the
// three.
TEST_F(ModerationTest, a_removal_ends_all_sessions_of_the_subject_in_this_room_only) {
  Client mallory = join(claims("mallory")), second = join(claims("mallory")), detached = join(claims("mallory")),
         elsewhere = connect(hello_to("attic", claims("mallory"))), bob = join(claims("bob"));
  add(mallory, 1);
  break_connection(detached);
  EXPECT_EQ(moderate({remove, session_of(second), "", 0, "be kind"}), std::nullopt);
  for (const Client& client : {mallory, second}) {
    ASSERT_THAT(client.goodbyes(), ElementsAre(GoodbyeReason::removed));
    EXPECT_EQ(client.connection->all<wire::Goodbye>()[0].detail,
              "a moderator has removed this user from the room: be kind");
    EXPECT_TRUE(client.connection->closed);
  }
  EXPECT_THAT(elsewhere.goodbyes(), IsEmpty());
  EXPECT_THAT(bob.goodbyes(), IsEmpty());
  EXPECT_EQ(context_.rooms.count("lobby").sessions, 2u) << "the detached session has ended, too";
  EXPECT_EQ(context_.character_count, 0u);
  EXPECT_EQ(counters_.sessions_closed_by_server_removed.value(), 3u);
  EXPECT_EQ(counters_.moderations_remove.value(), 1u);
  EXPECT_TRUE(join(claims("mallory")).is_welcome()) << "a removal without seconds is no ban";
}

TEST_F(ModerationTest, a_banned_subject_enters_the_room_again_when_its_time_is_over) {
  Client mallory = join(claims("mallory"), "192.0.2.1");
  EXPECT_EQ(moderate({remove, 0, "sub:mallory", 60}), std::nullopt);
  EXPECT_THAT(mallory.goodbyes(), ElementsAre(GoodbyeReason::removed));
  // The ban lasts 60 s.
  now_ns_ += 59 * kSecond_ns;
  registry_.poll(now_ns_);
  EXPECT_EQ(counters_.gauges.bans.value(), 1);
  Client again = join(claims("mallory"), "192.0.2.2");
  EXPECT_FALSE(again.is_welcome());
  EXPECT_THAT(again.goodbyes(), ElementsAre(GoodbyeReason::removed));
  EXPECT_THAT(resume(mallory, hello_with(claims("mallory"))).goodbyes(), ElementsAre(GoodbyeReason::removed));
  EXPECT_EQ(counters_.sessions_refused_banned.value(), 2u);
  EXPECT_TRUE(connect(hello_to("attic", claims("mallory"))).is_welcome());
  EXPECT_TRUE(join(claims("bob")).is_welcome());
  poll_next_second();
  EXPECT_TRUE(join(claims("mallory")).is_welcome());
  EXPECT_EQ(counters_.gauges.bans.value(), 0);
}

TEST_F(ModerationTest, a_removal_without_seconds_ends_a_ban) {
  EXPECT_EQ(moderate({remove, 0, "sub:mallory", 60}), std::nullopt) << "who has just left";
  EXPECT_FALSE(join(claims("mallory")).is_welcome());
  EXPECT_EQ(moderate({remove, 0, "sub:mallory", 0}), std::nullopt);
  EXPECT_TRUE(join(claims("mallory")).is_welcome());
}

// The banned Alice joins as a moderator, to whom bans do not apply. A resume with a plain token must not carry that
// right on.
TEST_F(ModerationTest, a_resume_needs_that_the_subject_is_not_banned) {
  Client alice = join(moderator_claims("alice"));
  leave(alice);
  EXPECT_EQ(moderate({remove, 0, "sub:alice", 60}), std::nullopt);
  alice = join(moderator_claims("alice"));
  ASSERT_TRUE(alice.is_welcome()) << "a ban does not apply to a moderator";
  EXPECT_THAT(resume(alice, hello_with(claims("alice"))).goodbyes(), ElementsAre(GoodbyeReason::removed));
  EXPECT_TRUE(resume(alice, hello_with(moderator_claims("alice"))).is_welcome());
}

// The five actions are refused for a plain token, and a removal for a client of a server without tokens.
TEST_F(ModerationTest, only_a_token_makes_a_moderator) {
  Client bob = join(claims("bob")), carol = join(claims("carol"));
  for (const wire::ModerateAction action : {remove, mute, unmute, lock, unlock})
    EXPECT_EQ(moderate_as(bob, {action, session_of(carol), "", 60}), ErrorReason::not_allowed);
  EXPECT_EQ(counters_.requests_refused_moderate.value(), 5u);
  context_.token_key.reset();
  Client open = connect(wire::Hello{});
  EXPECT_EQ(moderate_as(open, {remove, session_of(carol), "", 60}), ErrorReason::not_allowed);
  EXPECT_THAT(carol.goodbyes(), IsEmpty());
  EXPECT_EQ(context_.rules.entry_count(), 0u);
}

TEST_F(ModerationTest, the_newest_token_makes_a_moderator_or_not) {
  Client bob = join(claims("bob")), carol = join(claims("carol"));
  bob = resume(bob, hello_with(moderator_claims("bob")));
  EXPECT_EQ(moderate_as(bob, {mute, session_of(carol), ""}), std::nullopt);
  // A session may resume once in a second (SessionLimits::resume_interval_ns).
  now_ns_ += 2 * kSecond_ns;
  bob = resume(bob, hello_with(claims("bob")));
  EXPECT_EQ(moderate_as(bob, {unmute, session_of(carol), ""}), ErrorReason::not_allowed);
}

// `plain` and `own` are sessions of moderators that joined with a plain token: their subjects are those of moderators
// all the same.
TEST_F(ModerationTest, a_moderator_removes_and_mutes_neither_itself_nor_another_moderator) {
  Client other = join(moderator_claims("other")), plain = join(claims("other")), own = join(claims("mod"));
  for (const wire::ModerateAction action : {remove, mute, unmute}) {
    for (const std::uint64_t session : {session_of(moderator_), session_of(own), session_of(other), session_of(plain)})
      EXPECT_EQ(moderate({action, session, "", 60}), ErrorReason::not_allowed);
    for (const char* subject : {"sub:mod", "sub:other"})
      EXPECT_EQ(moderate({action, 0, subject, 60}), ErrorReason::not_allowed);
  }
  for (const Client& client : {moderator_, other, plain, own}) EXPECT_THAT(client.goodbyes(), IsEmpty());
  EXPECT_EQ(context_.rules.entry_count(), 0u);
}

// Three actions with three wrong targets, and one removal by a misspelt name, are ten refusals.
TEST_F(ModerationTest, who_is_not_in_the_room_is_unknown) {
  Client elsewhere = connect(hello_to("attic", claims("mallory")));
  for (const wire::ModerateAction action : {remove, mute, unmute}) {
    EXPECT_EQ(moderate({action, session_of(elsewhere), "", 60}), ErrorReason::character_unknown);
    EXPECT_EQ(moderate({action, 999'999, "", 60}), ErrorReason::character_unknown);
    EXPECT_EQ(moderate({action, 0, "", 60}), ErrorReason::character_unknown) << "names nobody";
  }
  EXPECT_EQ(moderate({remove, 0, "sub:malory", 0}), ErrorReason::character_unknown);
  EXPECT_THAT(elsewhere.goodbyes(), IsEmpty());
  EXPECT_EQ(counters_.requests_refused_moderate.value(), 10u);
}

TEST_F(ModerationTest, of_an_exempt_address_only_one_session_is_removed) {
  // All clients of exempt addresses without a subject in their token share the name "exempt". A ban or a mute of this
  // name would hit all of them.
  Client first = join(claims("")), second = join(claims(""));
  ASSERT_EQ(registry_.find(static_cast<SessionId>(session_of(first)))->identity().subject.name, "exempt");
  EXPECT_EQ(moderate({remove, session_of(first), "", 60}), ErrorReason::not_allowed);
  EXPECT_EQ(moderate({mute, session_of(first), ""}), ErrorReason::not_allowed);
  EXPECT_EQ(moderate({remove, 0, "exempt", 0}), ErrorReason::not_allowed);
  EXPECT_EQ(moderate({remove, session_of(first), "", 0}), std::nullopt);
  EXPECT_THAT(first.goodbyes(), ElementsAre(GoodbyeReason::removed));
  EXPECT_THAT(second.goodbyes(), IsEmpty());
}

// `granted` is another session of Mallory's, whose token allows the wind; the mute goes before the token.
TEST_F(ModerationTest, a_muted_subject_sets_no_wind_until_it_is_unmuted) {
  Client mallory = join(claims("mallory")), bob = join(claims("bob")),
         elsewhere = connect(hello_to("attic", claims("mallory")));
  channel::TokenClaims wind_claims = claims("mallory");
  wind_claims.wind = true;
  Client granted = join(wind_claims);
  EXPECT_EQ(moderate({mute, session_of(mallory), ""}), std::nullopt);
  EXPECT_EQ(moderate({mute, session_of(mallory), ""}), std::nullopt) << "again";
  EXPECT_FALSE(may_set_wind(mallory));
  EXPECT_FALSE(may_set_wind(granted));
  EXPECT_TRUE(may_set_wind(bob));
  EXPECT_TRUE(may_set_wind(elsewhere));
  EXPECT_TRUE(may_set_wind(moderator_));
  break_connection(mallory);
  mallory = resume(mallory, hello_with(claims("mallory")));
  EXPECT_FALSE(may_set_wind(mallory)) << "after a resume";
  leave(mallory);
  leave(granted);
  mallory = join(claims("mallory"));
  EXPECT_FALSE(may_set_wind(mallory)) << "in a new session";
  EXPECT_EQ(moderate({unmute, 0, "sub:mallory"}), std::nullopt);
  EXPECT_TRUE(may_set_wind(mallory));
  EXPECT_EQ(counters_.moderations_mute.value(), 2u);
  EXPECT_EQ(counters_.moderations_unmute.value(), 1u);
}

TEST_F(ModerationTest, a_locked_room_lets_only_moderators_and_resumes_in) {
  Client alice = join(claims("alice"));
  EXPECT_EQ(moderate({lock, 0, ""}), std::nullopt);
  Client bob = join(claims("bob"));
  EXPECT_THAT(bob.goodbyes(), ElementsAre(GoodbyeReason::room_refused));
  EXPECT_EQ(bob.connection->all<wire::Goodbye>()[0].detail, "a moderator has locked the room");
  EXPECT_THAT(bob.errors(), ElementsAre(ErrorReason::not_allowed));
  EXPECT_EQ(counters_.sessions_refused_locked.value(), 1u);
  EXPECT_TRUE(connect(hello_to("attic", claims("bob"))).is_welcome());
  break_connection(alice);
  EXPECT_TRUE(resume(alice, hello_with(claims("alice"))).welcome().resumed);
  EXPECT_TRUE(join(moderator_claims("other")).is_welcome());
  EXPECT_EQ(moderate({unlock, 0, ""}), std::nullopt);
  EXPECT_TRUE(join(claims("bob")).is_welcome());
  EXPECT_EQ(counters_.moderations_lock.value(), 1u);
  EXPECT_EQ(counters_.moderations_unlock.value(), 1u);
}

// The empty room exists for 10 s (room_grace_ns above): a lock must hold while its moderator is away for a moment, and
// must not keep people out of the room forever.
TEST_F(ModerationTest, a_lock_ends_with_its_room) {
  EXPECT_EQ(moderate({lock, 0, ""}), std::nullopt);
  leave(moderator_);
  now_ns_ += 9 * kSecond_ns;
  registry_.poll(now_ns_);
  EXPECT_FALSE(join(claims("bob")).is_welcome()) << "the empty room exists for room_grace_s";
  poll_next_second();
  EXPECT_TRUE(join(claims("bob")).is_welcome());
}

TEST_F(ModerationTest, a_full_list_refuses_more_and_drops_nothing) {
  context_.limits.bans_max = 2;
  Client mallory = join(claims("mallory")), bob = join(claims("bob"));
  // A ban and a mute fill the list: bans_max bounds bans, mutes and locks together.
  EXPECT_EQ(moderate({remove, 0, "sub:a", 60}), std::nullopt);
  EXPECT_EQ(moderate({mute, session_of(bob), ""}), std::nullopt);
  EXPECT_EQ(moderate({remove, session_of(mallory), "", 60}), ErrorReason::limit_exceeded);
  EXPECT_EQ(moderate({mute, session_of(mallory), ""}), ErrorReason::limit_exceeded);
  EXPECT_EQ(moderate({lock, 0, ""}), ErrorReason::limit_exceeded);
  EXPECT_THAT(mallory.goodbyes(), IsEmpty()) << "a refused removal changes nothing";
  EXPECT_EQ(counters_.requests_refused_moderate.value(), 3u);
  EXPECT_FALSE(join(claims("a")).is_welcome());
  EXPECT_FALSE(may_set_wind(bob));
  EXPECT_EQ(moderate({remove, session_of(mallory), "", 0}), std::nullopt) << "needs no entry";
  EXPECT_THAT(mallory.goodbyes(), ElementsAre(GoodbyeReason::removed));
}

// The five clients are a moderator, one that only observes, one whose token forbids the wind, a user whose token allows
// it, and a plain user.
TEST_F(ModerationTest, moderators_set_the_wind_where_the_setting_lets_them) {
  channel::TokenClaims watching = moderator_claims("watching"), windless = moderator_claims("windless"),
                       windy = claims("windy");
  watching.role = wire::Role::observer;
  windless.wind = false;
  windy.wind = true;
  Client observer = join(watching), calm = join(windless), granted = join(windy), plain = join(claims("plain"));
  const auto who_may = [&](AllowedClients setting) {
    context_.limits.wind_from_clients = setting;
    return std::array{may_set_wind(moderator_), may_set_wind(observer), may_set_wind(calm), may_set_wind(granted),
                      may_set_wind(plain)};
  };
  EXPECT_THAT(who_may(AllowedClients::off), ElementsAre(false, false, false, true, false));
  EXPECT_THAT(who_may(AllowedClients::moderators), ElementsAre(true, true, false, true, false));
  EXPECT_THAT(who_may(AllowedClients::participants), ElementsAre(true, true, false, true, true));
  EXPECT_THAT(who_may(AllowedClients::everyone), ElementsAre(true, true, false, true, true));
}

TEST_F(ModerationTest, the_log_says_who_did_what_to_whom_and_why) {
  Client mallory = connect(hello_to("hall", claims("mallory"))),
         moderator = connect(hello_to("hall", moderator_claims()));
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_st>(log)));
  send(moderator, wire::Moderate{remove, session_of(mallory), "", 60, "so \"loud\""});
  send(moderator, wire::Moderate{lock, 0, ""});
  spdlog::set_default_logger(before);
  EXPECT_THAT(log.str(),
              HasSubstr(R"(event=moderated session=3 action=remove by="sub:mod" target="sub:mallory" room="hall" )"
                        R"(seconds=60 reason="so \"loud\"")"));
  EXPECT_THAT(log.str(), HasSubstr(R"(action=lock by="sub:mod" target="" room="hall" seconds=0 reason="")"));
}

}  // namespace
}  // namespace hairnet::server
