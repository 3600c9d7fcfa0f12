#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/session_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using wire::GoodbyeReason;
using State = Session::State;

// A client whose connection breaks may come back within resume_grace_ns, and finds its characters with their hair.
TEST_F(SessionTest, outlives_its_connection_for_the_grace_and_then_gives_everything_back) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  session_.on_closed("reset", now_ns_);
  EXPECT_EQ(session_.state(), State::detached);
  EXPECT_EQ(commands<DetachSession>().size(), 1u);
  session_.send(wire::CharacterRemoved{1}, now_ns_);
  session_.flush(now_ns_);
  session_.poll(now_ns_ + context_.limits.resume_grace_ns);
  EXPECT_EQ(session_.state(), State::detached);
  EXPECT_THAT(groom_service_.released, IsEmpty());
  session_.poll(now_ns_ + context_.limits.resume_grace_ns + 1);
  EXPECT_EQ(session_.state(), State::closed);
  EXPECT_EQ(commands<CloseSession>().size(), 1u);
  EXPECT_EQ(context_.character_count, 0u);
  EXPECT_EQ(counters_.sessions_closed_by_server_grace_over.value(), 1u);
}

TEST_F(SessionTest, before_its_hello_or_without_a_grace_ends_with_its_connection) {
  session_.on_closed("reset", now_ns_);
  EXPECT_EQ(session_.state(), State::closed);
  context_.limits.resume_grace_ns = 0;
  Session session(9, std::make_shared<FakeConnection>(), context_, now_ns_);
  session.on_message({now_ns_, wire::Hello{}}, now_ns_);
  session.on_closed("reset", now_ns_);
  EXPECT_EQ(session.state(), State::closed);
}

// Clients of a server with a registry, which a resume needs to find the earlier session. A connection with `session`
// and `secret` asks to go on with that session.
class ResumeTest : public SessionTest {
 protected:
  struct Client {
    std::shared_ptr<FakeConnection> connection = std::make_shared<FakeConnection>();
    PacketSink* sink = nullptr;
    [[nodiscard]] wire::Welcome welcome() const { return connection->all<wire::Welcome>().at(0); }
  };
  Client connect(std::uint64_t session = 0, const wire::SessionSecret& secret = {}, const std::string& room = "") {
    Client client;
    client.sink = registry_.open(client.connection, now_ns_);
    wire::Hello hello;
    hello.session = session;
    hello.secret = secret;
    hello.room = room;
    send(client, hello);
    return client;
  }
  void send(Client& client, const wire::Message& message) {
    client.sink->on_packet(wire::encode_packet({now_ns_, message}), now_ns_);
  }
  SessionRegistry registry_{context_};
};

TEST_F(ResumeTest, continues_with_characters_and_grooms_over_another_connection) {
  Client first = connect(0, {}, "hall");
  send(first, wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  const wire::Welcome welcome = first.welcome();
  EXPECT_FALSE(welcome.resumed);
  first.sink->on_closed("reset", now_ns_);
  registry_.poll(now_ns_);
  EXPECT_EQ(counters_.gauges.clients.value(), 1);
  EXPECT_EQ(counters_.gauges.clients_detached.value(), 1);
  Client second = connect(welcome.session, welcome.secret, "ignored");
  const wire::Welcome again = second.welcome();
  EXPECT_TRUE(again.resumed);
  EXPECT_EQ(counters_.sessions_closed_by_server_taken_over.value(), 0u) << "nobody was sent away";
  EXPECT_EQ(counters_.characters_removed.value(), 0u);
  EXPECT_EQ(again.session, welcome.session);
  EXPECT_EQ(again.room, "hall");
  EXPECT_EQ(again.secret, welcome.secret);
  EXPECT_THAT(groom_service_.resent, ElementsAre(static_cast<SessionId>(welcome.session)));
  EXPECT_THAT(groom_service_.released, IsEmpty());
  registry_.poll(now_ns_ + context_.limits.resume_grace_ns + 1);
  EXPECT_EQ(registry_.count(), 1u);
  EXPECT_EQ(counters_.gauges.clients_detached.value(), 0);
  EXPECT_EQ(context_.character_count, 1u);
  commands<CloseSession>();
  send(second, wire::SetLevel{1, LevelIndex::high});
  const std::vector<FromClient> commanded = commands<FromClient>();
  ASSERT_EQ(commanded.size(), 1u);
  EXPECT_EQ(commanded[0].session, welcome.session);
  EXPECT_EQ(std::get<wire::SetLevel>(commanded[0].message).character, 1u);
}

// A phone's address has changed, and the server has not yet seen that the earlier connection is dead. The client must
// not have to wait for a time-out.
TEST_F(ResumeTest, takes_over_from_a_connection_that_still_looks_alive) {
  Client first = connect();
  const wire::Welcome welcome = first.welcome();
  Client second = connect(welcome.session, welcome.secret);
  EXPECT_TRUE(second.welcome().resumed);
  ASSERT_EQ(first.connection->all<wire::Goodbye>().size(), 1u);
  EXPECT_EQ(first.connection->all<wire::Goodbye>()[0].reason, GoodbyeReason::session_taken_over);
  EXPECT_TRUE(first.connection->closed);
  EXPECT_EQ(commands<CloseSession>().size(), 0u);
  registry_.poll(now_ns_);
  EXPECT_EQ(registry_.count(), 1u);
  EXPECT_EQ(counters_.sessions_closed_by_server_taken_over.value(), 1u);
}

// Session numbers are easy to guess, so only the secret lets a client in. One wrong bit must be enough to refuse it.
TEST_F(ResumeTest, with_a_wrong_secret_is_a_new_session_and_leaves_the_other_alone) {
  Client first = connect();
  const wire::Welcome welcome = first.welcome();
  wire::SessionSecret wrong = welcome.secret;
  wrong[15] ^= 1;
  Client second = connect(welcome.session, wrong);
  EXPECT_FALSE(second.welcome().resumed);
  EXPECT_NE(second.welcome().session, welcome.session);
  EXPECT_FALSE(first.connection->closed);
  EXPECT_EQ(counters_.sessions_not_resumed.value(), 1u);
}

TEST_F(ResumeTest, after_the_grace_is_a_new_session) {
  Client first = connect();
  const wire::Welcome welcome = first.welcome();
  first.sink->on_closed("reset", now_ns_);
  now_ns_ += context_.limits.resume_grace_ns + 1;
  registry_.poll(now_ns_);
  registry_.poll(now_ns_);
  EXPECT_FALSE(connect(welcome.session, welcome.secret).welcome().resumed);
}

// The number does not fit into a SessionId. Cut off, it could name another client's session.
TEST_F(ResumeTest, of_a_session_above_any_number_is_refused_kindly) {
  EXPECT_FALSE(connect(~std::uint64_t{0}).welcome().resumed);
}

// A resume announces the whole room again. A client that resumes all the time would cost the server more than others,
// so 1 s must pass between two (resume_interval_ns).
TEST_F(ResumeTest, of_a_session_resumed_a_moment_ago_is_refused_and_leaves_it_alone) {
  const wire::Welcome welcome = connect().welcome();
  Client second = connect(welcome.session, welcome.secret);
  ASSERT_TRUE(second.welcome().resumed);
  commands<OpenSession>();
  now_ns_ += context_.limits.resume_interval_ns - 1;
  const Client early = connect(welcome.session, welcome.secret);
  EXPECT_THAT(early.connection->all<wire::Welcome>(), IsEmpty());
  EXPECT_EQ(early.connection->all<wire::Goodbye>().at(0).reason, GoodbyeReason::over_rate);
  EXPECT_TRUE(early.connection->closed);
  EXPECT_EQ(counters_.sessions_refused_early.value(), 1u);
  EXPECT_THAT(commands<OpenSession>(), IsEmpty());
  EXPECT_FALSE(second.connection->closed);
  now_ns_ += 1;
  EXPECT_TRUE(connect(welcome.session, welcome.secret).welcome().resumed);
}

// The refusal "too early" would tell a stranger that the session exists.
TEST_F(ResumeTest, with_a_wrong_secret_does_not_say_when_the_session_was_resumed) {
  const wire::Welcome welcome = connect().welcome();
  connect(welcome.session, welcome.secret);
  EXPECT_FALSE(connect(welcome.session).welcome().resumed);
  EXPECT_EQ(counters_.sessions_refused_early.value(), 0u);
}

// The tick is late, and its queue of commands is full. A hello that cannot reach the tick is refused, and costs nobody
// a session.
TEST_F(ResumeTest, waits_for_room_in_the_queue_to_the_tick) {
  Client first = connect();
  const wire::Welcome welcome = first.welcome();
  for (Command filler = DetachSession{}; commands_.try_put(filler);) filler = DetachSession{};
  for (const bool is_new : {true, false}) {
    const Client refused = is_new ? connect() : connect(welcome.session, welcome.secret);
    EXPECT_THAT(refused.connection->all<wire::Welcome>(), IsEmpty());
    EXPECT_EQ(refused.connection->all<wire::Goodbye>().at(0).reason, GoodbyeReason::server_full);
  }
  EXPECT_EQ(counters_.sessions_refused_busy.value(), 2u);
  EXPECT_EQ(context_.session_count, 1u);
  EXPECT_FALSE(first.connection->closed);
  commands<OpenSession>();
  EXPECT_TRUE(connect(welcome.session, welcome.secret).welcome().resumed);
}

TEST_F(ResumeTest, weighs_as_much_as_its_room_has_members) {
  Client first = connect();
  for (const std::uint32_t character : {1u, 2u})
    send(first, wire::AddCharacter{character, groom_service_.known, LevelIndex::low});
  commands<OpenSession>();
  connect(first.welcome().session, first.welcome().secret);
  // The command weighs 1, and each of the room's two members as much, since the tick announces them again.
  EXPECT_EQ(commands_.weight(), 3u);
}

TEST_F(ResumeTest, a_full_server_gives_the_place_of_a_lost_client_without_characters_to_a_new_client) {
  context_.limits.session_count_max = 2;
  Client with = connect(), without = connect();
  send(with, wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  EXPECT_EQ(connect().connection->all<wire::Goodbye>().at(0).reason, GoodbyeReason::server_full);
  with.sink->on_closed("reset", now_ns_);
  without.sink->on_closed("reset", now_ns_);
  // The session without characters makes room; the one with a character does not, since its hair would be lost.
  EXPECT_FALSE(connect().welcome().resumed);
  EXPECT_EQ(connect().connection->all<wire::Goodbye>().at(0).reason, GoodbyeReason::server_full);
  EXPECT_TRUE(connect(with.welcome().session, with.welcome().secret).welcome().resumed);
  EXPECT_EQ(context_.session_count, 2u);
}

TEST_F(ResumeTest, a_stranger_who_is_refused_anyway_ends_nobodys_session_on_a_full_server) {
  context_.limits.session_count_max = 1;
  Client lost = connect();
  lost.sink->on_closed("reset", now_ns_);
  context_.token_key.emplace(std::vector<std::uint8_t>(32, 7));
  context_.unix_time_s = [] { return std::int64_t{1000}; };
  EXPECT_EQ(connect().connection->all<wire::Goodbye>().at(0).reason, GoodbyeReason::token_refused);
  EXPECT_EQ(context_.session_count, 1u) << "the lost client may still come back";
  context_.token_key.reset();
  EXPECT_TRUE(connect(lost.welcome().session, lost.welcome().secret).welcome().resumed);
}

TEST_F(ResumeTest, does_not_refill_what_a_client_may_send) {
  // Both connections together may send the 40 messages of small_limits(), and the resume counts as one of them: 30, 1
  // and 9 pass.
  Client first = connect();
  for (int i = 0; i < 30; ++i) send(first, wire::SetLevel{1, LevelIndex::low});
  Client second = connect(first.welcome().session, first.welcome().secret);
  for (int i = 0; i < 9; ++i) send(second, wire::SetLevel{1, LevelIndex::low});
  EXPECT_FALSE(second.connection->closed);
  send(second, wire::SetLevel{1, LevelIndex::low});
  ASSERT_THAT(second.connection->all<wire::Goodbye>(), testing::SizeIs(1));
  EXPECT_EQ(second.connection->all<wire::Goodbye>()[0].reason, GoodbyeReason::over_rate);
}

}  // namespace
}  // namespace hairnet::server
