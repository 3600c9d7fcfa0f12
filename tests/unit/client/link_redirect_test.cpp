#include <gmock/gmock.h>

#include "tests/unit/client/settled_client.hpp"

namespace hairnet::link {
namespace {

wire::Redirect redirect_to(std::string host, std::uint16_t port) {
  return {wire::ServerAt{std::move(host), port}};
}

TEST_F(Settled, a_redirect_is_followed_at_once_with_a_new_session) {
  d.send(redirect_to("hair-2", 7421));
  const auto moved = d.event<Reconnecting>();
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->detail, "the room is held by hair-2, port 7421");
  EXPECT_EQ(moved->wait_s, 0);
  EXPECT_TRUE(d.core.wants_close());
  d.close_as_wanted();
  ASSERT_TRUE(d.core.wants_connection());
  EXPECT_EQ(d.core.redirected_to(), (wire::ServerAt{"hair-2", 7421}));
  come_back(welcome_to(6));
  EXPECT_EQ(hello.session, 0u) << "the session was another server's";
  EXPECT_EQ(hello.redirects, 1);
  d.expect<wire::GroomOffer>();
  EXPECT_EQ(d.expect<wire::AddCharacter>().character, 7u);
  EXPECT_EQ(d.core.counters().redirects, 1u);

  // That server has the session from now on.
  break_off();
  EXPECT_EQ(d.core.redirected_to(), (wire::ServerAt{"hair-2", 7421}));
  come_back(welcome_to(6, true));
  EXPECT_EQ(hello.session, 6u);
  EXPECT_EQ(hello.redirects, 0);
}

// Gives the client a trace, the number by which the logs of several servers can be joined.
class Traced : public Settled {
 protected:
  static LinkCoreOptions options() {
    LinkCoreOptions options;
    options.trace = 0x4f1d20c6a93be751;
    return options;
  }
  Traced() : Settled(options()) {}
};

TEST_F(Traced, each_server_on_the_way_hears_of_the_same_trace) {
  d.send(redirect_to("hair-2", 7421));
  d.close_as_wanted();
  come_back(welcome_to(6));
  EXPECT_EQ(hello.trace, 0x4f1d20c6a93be751);
  break_off();
  come_back(welcome_to(6, true));
  EXPECT_EQ(hello.trace, 0x4f1d20c6a93be751);
}

TEST_F(Settled, where_the_named_server_does_not_answer_the_first_one_is_asked_again) {
  d.send(redirect_to("hair-2", 7421));
  d.close_as_wanted();
  d.core.on_opening(d.now_ns);
  d.core.on_closed("nobody listens", d.now_ns);
  EXPECT_FALSE(d.core.redirected_to());
  come_back(welcome_to(5, true));
  EXPECT_EQ(hello.session, 5u) << "the first server may still have the session";
}

// A welcome names the fleet's other servers, so that clients find the room when the server that they know dies.
TEST_F(Settled, where_the_first_server_does_not_answer_either_those_it_has_named_are_asked) {
  break_off();
  wire::Welcome welcome = welcome_to(6);
  welcome.others = {{"hair-2", 7421}, {"hair-3", 7422}};
  come_back(welcome);
  d.take_all();
  break_off();
  std::vector<std::string> asked;
  std::vector<bool> waited;
  for (int i = 0; i < 5; ++i) {
    const std::int64_t before_ns = d.now_ns;
    while (!d.core.wants_connection()) d.pass_to_deadline();
    asked.push_back(d.core.redirected_to() ? d.core.redirected_to()->host : "first");
    waited.push_back(d.now_ns > before_ns);
    d.core.on_opening(d.now_ns);
    d.core.on_closed("nobody listens", d.now_ns);
  }
  EXPECT_THAT(asked, ::testing::ElementsAre("first", "first", "hair-2", "hair-3", "first"));
  EXPECT_THAT(waited, ::testing::ElementsAre(true, true, false, false, true)) << "a round has one wait";
  come_back(welcome_to(9));
  EXPECT_EQ(hello.session, 0u) << "another server does not know the session";
}

TEST_F(Settled, a_redirect_to_nobody_asks_the_first_server_after_a_wait) {
  d.send(redirect_to("hair-2", 7421));
  d.close_as_wanted();
  come_back(welcome_to(6));
  d.send(wire::Redirect{});
  EXPECT_FALSE(d.core.redirected_to());
  EXPECT_FALSE(d.core.wants_connection());
  d.close_as_wanted();
  come_back(welcome_to(7));
  EXPECT_EQ(hello.session, 0u);
}

TEST_F(Settled, servers_that_send_it_on_and_on_are_left) {
  // A client follows kRedirectsMax, 4, redirects in a row (link_core.cpp). At the fifth it starts again at the first
  // server, after a wait.
  for (std::uint16_t port = 1; port <= 5; ++port) {
    d.send(redirect_to("hair", port));
    d.close_as_wanted();
    if (port == 5) break;
    ASSERT_TRUE(d.core.wants_connection()) << port;
    d.open();
    EXPECT_EQ(d.expect<wire::Hello>().redirects, port);
  }
  EXPECT_FALSE(d.core.wants_connection());
  EXPECT_FALSE(d.core.redirected_to());
  EXPECT_EQ(d.core.counters().redirect_loops, 1u);
  come_back(welcome_to(5, true));
  EXPECT_EQ(hello.redirects, 0);
}

TEST(LinkCoreRedirects, a_first_welcome_may_come_from_another_server) {
  LinkCoreDriver d;
  d.core.start();
  d.open();
  d.expect<wire::Hello>();
  d.send(redirect_to("::1", 7421));
  d.close_as_wanted();
  EXPECT_TRUE(d.core.take_events().empty());
  d.open();
  EXPECT_EQ(d.expect<wire::Hello>().redirects, 1);
  d.send(wire::Welcome{});
  EXPECT_TRUE(d.core.active());
}

// Plays a client before its first welcome. Its server sends it to hair-2, which has died.
class OfDeadServer : public ::testing::Test {
 protected:
  OfDeadServer() { d.core.start(); }
  void ask() {
    while (!d.core.wants_connection() && !d.core.ended()) d.pass_to_deadline();
    if (d.core.ended()) return;
    EXPECT_FALSE(d.core.redirected_to()) << "the first server is asked";
    d.open();
    hello = d.expect<wire::Hello>();
  }
  void be_sent_to_the_dead() {
    d.send(redirect_to("hair-2", 7421));
    d.close_as_wanted();
    ASSERT_TRUE(d.core.wants_connection());
    d.core.on_opening(d.now_ns);
    d.core.on_closed("nobody listens", d.now_ns);
  }

  LinkCoreDriver d;
  wire::Hello hello;
};

TEST_F(OfDeadServer, the_first_server_is_asked_until_it_takes_the_room) {
  // Waits grow with the outage, up to 5 s, and are random (Backoff): 20 s see between 5 and 100 attempts.
  int asked = 0;
  for (const std::int64_t begin_ns = d.now_ns; d.now_ns - begin_ns < 20'000 * kMs; ++asked) {
    ask();
    EXPECT_LE(hello.redirects, 1) << "no chain of redirects has led here";
    be_sent_to_the_dead();
    ASSERT_FALSE(d.core.ended()) << asked;
  }
  EXPECT_GT(asked, 5);
  EXPECT_LT(asked, 100);
  ask();
  d.send(wire::Welcome{});
  EXPECT_TRUE(d.core.active());
  EXPECT_EQ(d.core.counters().redirect_loops, 0u);
}

TEST_F(OfDeadServer, the_link_ends_when_the_room_does_not_come_back) {
  const std::int64_t begin_ns = d.now_ns;
  while (!d.core.ended()) {
    ask();
    if (!d.core.ended()) be_sent_to_the_dead();
  }
  // A client without a welcome gives up after kRoomPatience_ns, 30 s (link_core.cpp), at the next failure. The waits
  // between failures are at most 5 s.
  EXPECT_GE(d.now_ns - begin_ns, 30'000 * kMs);
  EXPECT_LT(d.now_ns - begin_ns, 40'000 * kMs);
  EXPECT_EQ(d.core.end_detail(), "nobody listens");
}

TEST_F(OfDeadServer, a_refusal_that_would_be_repeated_ends_the_link) {
  ask();
  be_sent_to_the_dead();
  ask();
  d.send(wire::Goodbye{wire::GoodbyeReason::token_refused, "expired"});
  EXPECT_TRUE(d.core.ended());
}

// Two servers each say that the other one holds the room. The client must not go back and forth without end.
TEST(LinkCoreRedirects, servers_that_contradict_each_other_end_a_first_connection_with_that_reason) {
  LinkCoreDriver d;
  d.core.start();
  const std::int64_t begin_ns = d.now_ns;
  for (std::uint16_t turn = 0; !d.core.ended(); ++turn) {
    while (!d.core.wants_connection()) d.pass_to_deadline();
    d.open();
    d.expect<wire::Hello>();
    d.send(redirect_to(turn % 2 == 0 ? "hair-2" : "hair-1", 7420));
    d.close_as_wanted();
  }
  EXPECT_EQ(d.core.end_detail(), "the servers do not agree on who holds the room");
  EXPECT_GE(d.now_ns - begin_ns, 30'000 * kMs);
  EXPECT_GT(d.core.counters().redirect_loops, 1u);
}

}  // namespace
}  // namespace hairnet::link
