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

// A token's `sub` comes first, then its `name`, then the address. The third part of a token is its signature, which
// stands for a token without a name. The network 192.0.2.1 is an example's address; an empty one is exempt from limits.
TEST(Subject, is_that_of_the_token_or_else_the_address) {
  channel::TokenClaims claims;
  const auto of = [&claims](std::string_view network) { return subject_of(claims, "head.payload.signature", network); };
  EXPECT_EQ(of("").kind, Subject::Kind::exempt);
  EXPECT_EQ(of("192.0.2.1").kind, Subject::Kind::address);
  EXPECT_EQ(of("192.0.2.1").name, "address:192.0.2.1");
  EXPECT_EQ(of("192.0.2.1").token_holder, "token:signature");
  claims.name = "Alice";
  EXPECT_EQ(of("192.0.2.1").kind, Subject::Kind::token);
  EXPECT_EQ(of("192.0.2.1").name, "name:Alice");
  claims.subject = "alice";
  EXPECT_EQ(of("").name, "sub:alice");
  EXPECT_EQ(of("").token_holder, "sub:alice");
  EXPECT_EQ(subject_of(std::nullopt, "anything", "192.0.2.1").token_holder, "address:192.0.2.1")
      << "no token was checked";
}

// The operator's file may have spaces, empty lines and the line ends of Windows.
TEST(RevokedTokens, are_named_by_id_or_subject) {
  const RevokedTokens revoked(" t-1 \r\n\nalice\nBob Builder");
  channel::TokenClaims claims;
  EXPECT_FALSE(revoked.contains(claims));
  claims.name = "Bob Builder";
  EXPECT_TRUE(revoked.contains(claims));
  claims.subject = "bob";
  EXPECT_FALSE(revoked.contains(claims)) << "a name counts only without a subject";
  claims.id = "t-1";
  EXPECT_TRUE(revoked.contains(claims));
  claims.id = "t-2";
  claims.subject = "alice";
  EXPECT_TRUE(revoked.contains(claims));
  EXPECT_FALSE(RevokedTokens("").contains(claims));
}

// Alice's token allows two characters. Without a count over all her sessions, she could open a second session and have
// four. Bob's token allows as many as the server does.
TEST_F(SubjectTest, characters_of_a_token_count_over_all_sessions_of_its_subject) {
  channel::TokenClaims alice = claims("alice");
  alice.characters_max = 2;
  Client first = join(alice), second = join(alice), bob = join(claims("bob"));
  add(first, 1);
  add(second, 1);
  add(second, 2);
  EXPECT_THAT(second.errors(), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(counters_.requests_refused_character.value(), 1u);
  add(bob, 1);
  add(bob, 2);
  add(bob, 3);
  EXPECT_THAT(bob.errors(), IsEmpty());
  send(first, wire::RemoveCharacter{1});
  add(second, 2);
  EXPECT_EQ(second.errors().size(), 1u) << "there is a place again";
  leave(second);
  add(first, 1);
  add(first, 2);
  EXPECT_THAT(first.errors(), IsEmpty());
}

// The token names nobody, so the token itself is counted: from whatever address it is used, it allows one character in
// all. A token with another end has another signature, and so is another one.
TEST_F(SubjectTest, characters_of_a_token_without_a_subject_count_over_all_its_sessions) {
  channel::TokenClaims nameless = claims("");
  nameless.characters_max = 1;
  Client first = join(nameless), second = join(nameless, "192.0.2.1");
  nameless.expires_s += 1;
  Client other = join(nameless);
  add(first, 1);
  add(second, 1);
  add(other, 1);
  EXPECT_THAT(first.errors(), IsEmpty());
  EXPECT_THAT(second.errors(), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_THAT(other.errors(), IsEmpty()) << "another token";
}

// Alice's connection broke, and her client did not resume but joined again. Her own lost session must not keep her from
// the characters that her token allows; Bob's lost session must not end for her sake.
TEST_F(SubjectTest, a_detached_session_gives_way_to_a_new_one_of_its_subject_and_to_no_other) {
  channel::TokenClaims alice = claims("alice");
  alice.characters_max = 2;
  Client lost = join(alice), back = join(alice), bob = join(claims("bob"));
  add(lost, 1);
  add(back, 1);
  add(bob, 1);
  break_connection(lost);
  break_connection(bob);
  EXPECT_EQ(context_.token_holders.count("sub:alice").characters, 2u) << "detached sessions count";
  add(back, 2);
  EXPECT_THAT(back.errors(), IsEmpty());
  EXPECT_EQ(context_.token_holders.count("sub:alice").sessions, 1u);
  EXPECT_EQ(context_.token_holders.count("sub:bob").sessions, 1u);
  EXPECT_EQ(counters_.sessions_closed_by_server_grace_over.value(), 1u);
  EXPECT_FALSE(resume(lost, hello_with(alice)).welcome().resumed);
}

TEST_F(SubjectTest, sessions_of_a_subject_are_limited) {
  context_.limits.sessions_per_subject_max = 2;
  Client first = join(claims("alice")), second = join(claims("alice"), "192.0.2.1"), third = join(claims("alice"));
  EXPECT_TRUE(first.is_welcome() && second.is_welcome());
  EXPECT_FALSE(third.is_welcome());
  EXPECT_THAT(third.goodbyes(), ElementsAre(GoodbyeReason::server_full));
  EXPECT_EQ(counters_.sessions_refused_subject.value(), 1u);
  EXPECT_TRUE(join(claims("bob")).is_welcome());
  break_connection(second);
  EXPECT_TRUE(join(claims("alice")).is_welcome()) << "the detached session gives way";
  EXPECT_FALSE(join(claims("alice")).is_welcome());
  leave(first);
  EXPECT_TRUE(join(claims("alice")).is_welcome());
}

// Five clients of exempt addresses are more than the two that an address may have.
TEST_F(SubjectTest, sessions_of_an_address_are_limited_but_not_those_of_exempt_ones) {
  context_.limits.sessions_per_address_max = 2;
  Client first = join_without_token("192.0.2.1");
  EXPECT_TRUE(join_without_token("192.0.2.1").is_welcome());
  EXPECT_THAT(join_without_token("192.0.2.1").goodbyes(), ElementsAre(GoodbyeReason::server_full));
  EXPECT_EQ(counters_.sessions_refused_address.value(), 1u);
  EXPECT_TRUE(join_without_token("192.0.2.2").is_welcome());
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(join_without_token("").is_welcome());
  break_connection(first);
  EXPECT_FALSE(join_without_token("192.0.2.1").is_welcome()) << "another user's detached session does not give way";
}

// The limit is two characters for a subject, or for all clients of an address together. Alice asks for three, and so
// does the exempt client; the two clients of 192.0.2.1 have one each, and the second asks for one more.
TEST_F(SubjectTest, characters_of_a_subject_or_an_address_are_limited_but_not_those_of_exempt_ones) {
  context_.limits.characters_per_subject_max = 2;
  Client alice = join(claims("alice"));
  Client first = join_without_token("192.0.2.1"), second = join_without_token("192.0.2.1"),
         other = join_without_token("192.0.2.2"), local = join_without_token("");
  for (Client* client : {&first, &second, &other}) add(*client, 1);
  add(second, 2);
  EXPECT_THAT(second.errors(), ElementsAre(ErrorReason::limit_exceeded));
  for (const std::uint32_t character : {1u, 2u, 3u}) {
    add(alice, character);
    add(local, character);
  }
  EXPECT_THAT(alice.errors(), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_THAT(first.errors(), IsEmpty());
  EXPECT_THAT(other.errors(), IsEmpty());
  EXPECT_THAT(local.errors(), IsEmpty());
}

// Tokens of claims() end at kUnixEnd_s, and Bob's one second later. Alice's detached session ends, too, so two sessions
// end.
TEST_F(SubjectTest, a_session_ends_with_its_token) {
  Client alice = join(claims("alice")), detached = join(claims("alice"));
  channel::TokenClaims longer = claims("bob");
  longer.expires_s = kUnixEnd_s + 1;
  Client bob = join(longer);
  break_connection(detached);
  unix_s_ = kUnixEnd_s - 1;
  poll_next_second();
  EXPECT_EQ(context_.session_count, 3u);
  unix_s_ = kUnixEnd_s;
  poll_next_second();
  EXPECT_THAT(alice.errors(), ElementsAre(ErrorReason::token_invalid));
  EXPECT_THAT(alice.goodbyes(), ElementsAre(GoodbyeReason::token_refused));
  EXPECT_EQ(context_.session_count, 1u);
  EXPECT_EQ(counters_.sessions_closed_by_server_token_expired.value(), 2u);
  EXPECT_THAT(bob.goodbyes(), IsEmpty());
}

// Somebody has stolen the secret of Alice's session. The secret alone must not be enough to take the session over: the
// hello needs a valid token, of the same subject, role and room. The last part shows that a resume takes the end of the
// newest token.
TEST_F(SubjectTest, a_resume_needs_a_token_of_the_same_subject) {
  Client alice = join(claims("alice"));
  add(alice, 1);
  wire::Hello no_token, expired = hello_with(claims("alice"));
  channel::TokenClaims observer = claims("alice"), other_room = claims("alice"), later = claims("alice");
  observer.role = wire::Role::observer;
  other_room.room = "attic";
  later.expires_s = kUnixEnd_s + 100;
  for (const wire::Hello& hello :
       {no_token, hello_with(claims("bob")), hello_with(claims("")), hello_with(observer), hello_with(other_room)}) {
    Client refused = resume(alice, hello);
    EXPECT_THAT(refused.errors(), ElementsAre(ErrorReason::token_invalid));
    EXPECT_THAT(refused.goodbyes(), ElementsAre(GoodbyeReason::token_refused));
  }
  EXPECT_EQ(counters_.sessions_refused_token.value(), 5u);
  EXPECT_FALSE(alice.connection->closed) << "her session goes on";
  EXPECT_EQ(context_.character_count, 1u);

  Client back = resume(alice, hello_with(later), "192.0.2.1");
  ASSERT_TRUE(back.is_welcome());
  EXPECT_TRUE(back.welcome().resumed);
  EXPECT_EQ(context_.token_holders.count("sub:alice").characters, 1u);
  unix_s_ = kUnixEnd_s;
  poll_next_second();
  EXPECT_THAT(back.goodbyes(), IsEmpty()) << "the newest token counts";
  EXPECT_THAT(resume(back, expired).goodbyes(), ElementsAre(GoodbyeReason::token_refused));
  unix_s_ = kUnixEnd_s + 100;
  poll_next_second();
  EXPECT_THAT(back.goodbyes(), ElementsAre(GoodbyeReason::token_refused));
}

// A refusal that does not name the cure would make people try again in vain. `unix_s_` is the present time, so the
// token that ends then has just expired.
TEST_F(SubjectTest, a_refused_token_is_told_in_words_that_name_the_cure) {
  channel::TokenClaims other_room = claims("alice"), expired = claims("alice"), observer = claims("alice");
  other_room.room = "attic";
  expired.expires_s = unix_s_;
  observer.role = wire::Role::observer;
  wire::Hello none = hello_with(claims("alice")), garbage = none, only_observes = hello_with(observer);
  only_observes.role = wire::Role::participant;
  none.token.clear();
  garbage.token = "letmein";
  const auto announced = [&](const wire::Hello& hello) {
    Client refused = connect(hello);
    const std::string error = refused.connection->all<wire::Error>().at(0).detail;
    EXPECT_EQ(refused.connection->all<wire::Goodbye>().at(0).detail, error) << "a client may show either";
    return error;
  };
  EXPECT_THAT(announced(none), HasSubstr("this room needs a token; ask the operator"));
  EXPECT_THAT(announced(garbage), HasSubstr("this is not a token"));
  EXPECT_THAT(announced(hello_with(expired)), HasSubstr("the token has expired, on "));
  EXPECT_THAT(announced(hello_with(other_room)), HasSubstr("the token is for room 'attic', and not for the lobby"));
  EXPECT_THAT(announced(only_observes), HasSubstr("observe only"));
  EXPECT_EQ(counters_.sessions_refused_token.value(), 5u);
}

// A phone that leaves its WLAN has another address. The session still counts for the address that it came from.
TEST_F(SubjectTest, a_session_without_a_subject_resumes_from_another_address) {
  Client client = join(claims(""), "192.0.2.1");
  EXPECT_TRUE(resume(client, hello_with(claims("")), "192.0.2.2").welcome().resumed);
  EXPECT_EQ(context_.subjects.count("address:192.0.2.1").sessions, 1u);
}

// The operator has given the client a better token. Without this rule the client would have to leave, and lose its
// hair.
TEST_F(SubjectTest, a_resume_takes_the_quotas_of_the_newest_token) {
  channel::TokenClaims small = claims("alice"), large = claims("alice");
  small.characters_max = 1;
  small.strands_max = 10;
  large.characters_max = 3;
  large.strands_max = 30;
  Client client = join(small);
  EXPECT_EQ(client.welcome().character_count_max, 1u);
  Client again = resume(client, hello_with(large));
  EXPECT_EQ(again.welcome().character_count_max, 3u);
  EXPECT_EQ(groom_service_.strands_max.at(static_cast<SessionId>(client.welcome().session)), 30u);
  for (const std::uint32_t character : {1u, 2u, 3u}) add(again, character);
  EXPECT_THAT(again.errors(), IsEmpty());
}

// `upload` and `wind` are claims of the token; where it lacks them, the role and the server's setting decide. may()
// returns whether the client may upload and whether it may set the wind. A claim goes before the setting.
TEST_F(SubjectTest, observers_upload_and_everyone_sets_wind_as_the_token_says) {
  const auto may = [this](wire::Role role, std::optional<bool> upload, std::optional<bool> wind,
                          AllowedClients setting) {
    context_.limits.wind_from_clients = setting;
    channel::TokenClaims granted = claims("");
    granted.role = role;
    granted.upload = upload;
    granted.wind = wind;
    Client client = join(granted);
    send(client, wire::GroomOffer{wire::GroomHash{3}, 100});
    const bool uploads = client.errors().empty();
    send(client, wire::SetWind{});
    const std::size_t refused = client.errors().size() - (uploads ? 0 : 1);
    for (const ErrorReason reason : client.errors()) EXPECT_EQ(reason, ErrorReason::not_allowed);
    return std::pair(uploads, refused == 0);
  };
  using enum wire::Role;
  using enum AllowedClients;
  EXPECT_EQ(may(participant, {}, {}, participants), std::pair(true, true));
  EXPECT_EQ(may(participant, false, false, everyone), std::pair(false, false));
  EXPECT_EQ(may(participant, {}, {}, off), std::pair(true, false));
  EXPECT_EQ(may(participant, true, true, off), std::pair(true, true));
  EXPECT_EQ(may(observer, {}, {}, participants), std::pair(false, false));
  EXPECT_EQ(may(observer, {}, {}, everyone), std::pair(false, true));
  EXPECT_EQ(may(observer, true, true, off), std::pair(true, true));
  EXPECT_EQ(counters_.requests_refused_groom.value(), 3u);
  EXPECT_EQ(counters_.requests_refused_wind.value(), 3u);
}

TEST_F(SubjectTest, an_observer_without_a_token_uploads_nothing) {
  context_.token_key.reset();
  wire::Hello hello;
  hello.role = wire::Role::observer;
  Client observer = connect(hello);
  send(observer, wire::GroomOffer{wire::GroomHash{3}, 100});
  EXPECT_THAT(observer.errors(), ElementsAre(ErrorReason::not_allowed));
}

// The operator has revoked the token t-1, which was stolen from Alice. Her own session has another token, so it stays
// until all her tokens are revoked.
TEST_F(SubjectTest, a_revoked_token_neither_joins_nor_resumes_nor_stays) {
  channel::TokenClaims stolen = claims("alice");
  stolen.id = "t-1";
  Client thief = join(stolen), alice = join(claims("alice"));
  context_.revoked_tokens = RevokedTokens("t-1\n");
  EXPECT_THAT(join(stolen).goodbyes(), ElementsAre(GoodbyeReason::token_refused));
  EXPECT_THAT(resume(alice, hello_with(stolen)).goodbyes(), ElementsAre(GoodbyeReason::token_refused));
  EXPECT_EQ(counters_.sessions_refused_token.value(), 2u);
  poll_next_second();
  EXPECT_THAT(thief.errors(), ElementsAre(ErrorReason::token_invalid));
  EXPECT_THAT(thief.goodbyes(), ElementsAre(GoodbyeReason::token_refused));
  EXPECT_THAT(alice.goodbyes(), IsEmpty());
  EXPECT_EQ(counters_.sessions_closed_by_server_token_revoked.value(), 1u);
  context_.revoked_tokens = RevokedTokens("alice\n");
  poll_next_second();
  EXPECT_THAT(alice.goodbyes(), ElementsAre(GoodbyeReason::token_refused));
}

// The tick shares its time between subjects by these numbers. A number whose last session has left is given to the next
// subject.
TEST_F(SubjectTest, the_tick_and_the_grooms_get_one_small_number_for_a_subject) {
  Client first = join(claims("alice")), bob = join(claims("bob")), second = join(claims("alice"));
  std::vector<OpenSession> opened = commands<OpenSession>();
  ASSERT_EQ(opened.size(), 3u);
  EXPECT_EQ(opened[0].subject, 1u);
  EXPECT_EQ(opened[1].subject, 2u);
  EXPECT_EQ(opened[2].subject, 1u);
  EXPECT_EQ(groom_service_.token_holders.at(opened[0].session), groom_service_.token_holders.at(opened[2].session));
  EXPECT_NE(groom_service_.token_holders.at(opened[0].session), groom_service_.token_holders.at(opened[1].session));
  leave(bob);
  Client carol = join(claims("carol")), dave = join(claims("dave"));
  opened = commands<OpenSession>();
  ASSERT_EQ(opened.size(), 2u);
  EXPECT_EQ(opened[0].subject, 2u) << "numbers are used again";
  EXPECT_EQ(opened[1].subject, 3u);
}

// The quotes in the subject must be escaped, or a user could write a line of the log.
TEST_F(SubjectTest, the_log_names_subject_token_and_groom) {
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_st>(log)));
  channel::TokenClaims alice = claims("alice \"a\"");
  alice.id = "t-1";
  Client client = join(alice);
  send(client, wire::GroomOffer{wire::GroomHash{0xab, 0xcd, 0x01, 0x23, 0x45}, 100});
  spdlog::set_default_logger(before);
  EXPECT_THAT(
      log.str(),
      HasSubstr(
          R"(event=session_opened session=1 trace=0000000000000000 subject="sub:alice \"a\"" token="t-1" client="")"));
  EXPECT_THAT(log.str(), HasSubstr(R"(event=groom_offered session=1 subject="sub:alice \"a\"" groom=abcd0123)"));
}

}  // namespace
}  // namespace hairnet::server
