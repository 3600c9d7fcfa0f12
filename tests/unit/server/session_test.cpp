#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/server/session_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using wire::ErrorReason;
using wire::GoodbyeReason;
using State = Session::State;

template <class T>
const T& request(const Command& command) {
  return std::get<T>(std::get<FromClient>(command).message);
}

TEST_F(SessionTest, welcomes_a_hello_of_its_version) {
  hello();
  EXPECT_EQ(session_.state(), State::active);
  const auto welcomes = connection_->all<wire::Welcome>();
  ASSERT_EQ(welcomes.size(), 1u);
  // The fixture has session 7 at tick 42, with two characters for each session.
  EXPECT_EQ(welcomes[0].session, 7u);
  EXPECT_EQ(welcomes[0].tick, 42u);
  EXPECT_EQ(welcomes[0].character_count_max, 2u);
  EXPECT_EQ(commands<OpenSession>().size(), 1u);
}

TEST_F(SessionTest, sends_frame_datagrams_to_a_client_whose_hello_says_that_it_knows_them) {
  EXPECT_FALSE(session_.outbox().takes_frame_datagrams());
  wire::Hello knowing;
  knowing.datagram_layout = wire::kFrameDatagramLayout;
  send(knowing);
  EXPECT_EQ(session_.state(), State::active);
  EXPECT_TRUE(session_.outbox().takes_frame_datagrams());
}

TEST_F(SessionTest, sends_packets_alone_to_a_client_whose_hello_does_not) {
  hello();
  EXPECT_FALSE(session_.outbox().takes_frame_datagrams());
}

TEST_F(SessionTest, large_packets_are_allowed_once_it_has_joined_and_not_before) {
  EXPECT_FALSE(connection_->joined);
  hello();
  EXPECT_TRUE(connection_->joined);
}

TEST_F(SessionTest, a_refused_hello_allows_no_large_packets) {
  send(wire::Hello{wire::kProtocolVersion, "test", "no room of that name"});
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::room_refused));
  EXPECT_FALSE(connection_->joined);
}

TEST(Hello, the_largest_valid_one_fits_what_a_connection_takes_before_it_joins) {
  wire::Hello hello;
  hello.client_name = std::string(wire::kTextBytesMax, 'n');
  hello.room = std::string(wire::kRoomNameBytesMax, 'r');
  hello.token = std::string(wire::kTokenBytesMax, 't');
  const std::vector<std::uint8_t> packet = wire::encode_packet({1, hello});
  EXPECT_EQ(wire::decode_packet(packet).error, wire::DecodeError::none);
  // The comment of kHelloPacketBytesMax promises that the largest valid Hello has half as many bytes.
  EXPECT_LE(2 * packet.size(), kHelloPacketBytesMax);
}

TEST_F(SessionTest, refuses_another_version_by_name_and_closes) {
  send(wire::Hello{wire::kProtocolVersion + 1, "test"});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::version_unsupported));
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::version_unsupported));
  EXPECT_TRUE(connection_->closed);
  EXPECT_EQ(counters_.sessions_refused_version.value(), 1u);
  EXPECT_THAT(commands<OpenSession>(), IsEmpty());
}

TEST_F(SessionTest, closes_when_anything_comes_before_hello) {
  send(wire::RemoveCharacter{1});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::unexpected_message));
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::protocol_error));
  EXPECT_TRUE(connection_->closed);
  EXPECT_EQ(counters_.messages_refused_unexpected.value(), 1u);
}

TEST_F(SessionTest, refuses_frame_datagrams_which_only_servers_send) {
  hello();
  wire::FrameBatch batch;
  batch.frames.emplace_back().member = 1;
  batch.generations = {0};
  session_.on_datagram(wire::encode_frame_datagram(now_ns_, batch), now_ns_);
  EXPECT_THAT(goodbyes(), ElementsAre(wire::GoodbyeReason::protocol_error));
}

TEST_F(SessionTest, tells_the_tick_what_the_network_carries) {
  hello();
  const auto sink = commands<OpenSession>().at(0).sink;
  EXPECT_EQ(sink->bytes_per_s(), 0);
  connection_->network_bytes_per_s = 12'345;
  session_.flush(now_ns_);
  EXPECT_EQ(sink->bytes_per_s(), 12'345);
}

TEST_F(SessionTest, refuses_a_second_hello_and_continues) {
  hello();
  hello();
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::unexpected_message));
  EXPECT_EQ(session_.state(), State::active);
  EXPECT_EQ(connection_->all<wire::Welcome>().size(), 1u);
}

TEST_F(SessionTest, refuses_messages_that_only_servers_send) {
  hello();
  send(wire::Welcome{});
  send(wire::FrameBatch{});
  send(wire::GroomBasis{});
  EXPECT_THAT(errors(), testing::Each(ErrorReason::unexpected_message));
  EXPECT_EQ(counters_.messages_refused_unexpected.value(), 3u);
  EXPECT_EQ(session_.state(), State::active);
}

TEST_F(SessionTest, passes_on_valid_materials_and_winds) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::medium});
  wire::SetMaterial material{1, {}};
  material.scale.stiffness = 3;
  wire::SetWind wind;
  wind.wind.mean_m_per_s = {4, 0, 1};
  send(material);
  send(wind);
  EXPECT_THAT(errors(), IsEmpty());
  std::vector<Command> taken;
  commands_.take_all(taken);
  ASSERT_EQ(taken.size(), 4u);
  EXPECT_EQ(std::get<FromClient>(taken[2]).session, 7u);
  EXPECT_EQ(request<wire::SetMaterial>(taken[2]).character, 1u);
  EXPECT_EQ(request<wire::SetMaterial>(taken[2]).scale, material.scale);
  EXPECT_EQ(request<wire::SetWind>(taken[3]).wind.mean_m_per_s, wind.wind.mean_m_per_s);
}

TEST_F(SessionTest, refuses_invalid_materials_and_winds_completely_and_continues) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::medium});
  send(wire::SetMaterial{2, {}});
  wire::SetMaterial material{1, {}};
  material.scale.density = std::numeric_limits<float>::quiet_NaN();
  send(material);
  wire::SetWind wind;
  // The least scale is 0.3 m (kTurbulenceScaleMin_m in core/solver/wind.hpp).
  wind.wind.turbulence_scale_m = 0.1;
  send(wind);
  EXPECT_THAT(errors(),
              ElementsAre(ErrorReason::character_unknown, ErrorReason::material_invalid, ErrorReason::wind_invalid));
  EXPECT_THAT(connection_->all<wire::Error>()[1].detail, testing::HasSubstr("density"));
  EXPECT_THAT(connection_->all<wire::Error>()[2].detail, testing::HasSubstr("turbulence scale"));
  EXPECT_EQ(counters_.requests_refused_material.value(), 2u);
  EXPECT_EQ(counters_.requests_refused_wind.value(), 1u);
  EXPECT_EQ(session_.state(), State::active);
  std::vector<Command> taken;
  commands_.take_all(taken);
  EXPECT_EQ(taken.size(), 2u) << "the session and its character";
}

TEST_F(SessionTest, refuses_winds_of_clients_when_so_configured) {
  context_.limits.wind_from_clients = AllowedClients::off;
  hello();
  send(wire::SetWind{});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::not_allowed));
  EXPECT_EQ(counters_.requests_refused_wind.value(), 1u);
  EXPECT_THAT(requests<wire::SetWind>(), IsEmpty());
}

TEST_F(SessionTest, passes_on_what_names_its_own_characters) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::medium});
  send(wire::SetLevel{1, LevelIndex::low});
  send(one_pose(rigid_pose({}), now_ns_));
  send(wire::RemoveCharacter{1});
  EXPECT_THAT(errors(), IsEmpty());
  std::vector<Command> taken;
  commands_.take_all(taken);
  ASSERT_EQ(taken.size(), 5u);
  for (const std::size_t i : {1, 2, 4}) EXPECT_EQ(std::get<FromClient>(taken[i]).session, 7u);
  EXPECT_EQ(request<wire::AddCharacter>(taken[1]).character, 1u);
  EXPECT_EQ(request<wire::SetLevel>(taken[2]).level, LevelIndex::low);
  EXPECT_EQ(std::get<PutPoses>(taken[3]).session, 7u);
  EXPECT_EQ(std::get<PutPoses>(taken[3]).poses[0].character, 1u);
  EXPECT_EQ(std::get<PutPoses>(taken[3]).poses[0].capture_time_ns, now_ns_);
  EXPECT_EQ(request<wire::RemoveCharacter>(taken[4]).character, 1u);
}

TEST_F(SessionTest, names_the_reason_of_every_refused_character) {
  hello();
  // The refused messages are, in order: the invalid number 0, a groom that was never uploaded, number 1 twice, one
  // character more than the two of small_limits(), and a level and a removal of a character that does not exist.
  send(wire::AddCharacter{0, groom_service_.known, LevelIndex::low});
  send(wire::AddCharacter{1, wire::GroomHash{9}, LevelIndex::low});
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  send(wire::AddCharacter{2, groom_service_.known, LevelIndex::low});
  send(wire::AddCharacter{3, groom_service_.known, LevelIndex::low});
  send(wire::SetLevel{5, LevelIndex::low});
  send(wire::RemoveCharacter{5});
  EXPECT_THAT(errors(),
              ElementsAre(ErrorReason::malformed, ErrorReason::groom_unknown, ErrorReason::character_exists,
                          ErrorReason::limit_exceeded, ErrorReason::character_unknown, ErrorReason::character_unknown));
  EXPECT_EQ(requests<wire::AddCharacter>().size(), 2u);
}

TEST_F(SessionTest, the_limit_of_all_characters_covers_sessions_and_is_released) {
  // The server may have three characters and a session two (small_limits()), so the second session gets only one until
  // the first session leaves.
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  send(wire::AddCharacter{2, groom_service_.known, LevelIndex::low});
  auto other_connection = std::make_shared<FakeConnection>();
  Session other(8, other_connection, context_, now_ns_);
  other.on_message({now_ns_, wire::Hello{}}, now_ns_);
  other.on_message({now_ns_, wire::AddCharacter{1, groom_service_.known, LevelIndex::low}}, now_ns_);
  other.on_message({now_ns_, wire::AddCharacter{2, groom_service_.known, LevelIndex::low}}, now_ns_);
  ASSERT_EQ(other_connection->all<wire::Error>().size(), 1u);
  EXPECT_EQ(other_connection->all<wire::Error>()[0].reason, ErrorReason::limit_exceeded);
  send(wire::Goodbye{GoodbyeReason::client_leaves, ""});
  EXPECT_EQ(context_.character_count, 1u);
  other.on_message({now_ns_, wire::AddCharacter{2, groom_service_.known, LevelIndex::low}}, now_ns_);
  EXPECT_EQ(other_connection->all<wire::Error>().size(), 1u);
}

TEST_F(SessionTest, maps_capture_times_to_the_servers_clock) {
  // The client's clock is a minute behind the server's. The pose was captured 4 ms before it was sent.
  const std::int64_t offset_ns = -60 * kSecond_ns;
  session_.on_message({now_ns_ + offset_ns, wire::Hello{}}, now_ns_);
  session_.on_message({now_ns_ + offset_ns, wire::AddCharacter{1, groom_service_.known, LevelIndex::low}}, now_ns_);
  session_.on_message({now_ns_ + offset_ns, one_pose(rigid_pose({}), now_ns_ + offset_ns - 4'000'000)}, now_ns_);
  const auto puts = commands<PutPoses>();
  ASSERT_EQ(puts.size(), 1u);
  EXPECT_EQ(puts[0].poses[0].capture_time_ns, now_ns_ - 4'000'000);
}

TEST_F(SessionTest, a_full_command_queue_refuses_and_loses_nothing) {
  hello();
  // The tick is so late that its queue of commands is full.
  for (Command filler = DetachSession{}; commands_.try_put(filler);) filler = DetachSession{};
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::limit_exceeded));
  EXPECT_EQ(context_.character_count, 0u);
  // This call also empties the queue, so the same message succeeds next.
  EXPECT_THAT(requests<wire::AddCharacter>(), IsEmpty());
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  EXPECT_EQ(requests<wire::AddCharacter>().size(), 1u);
}

TEST_F(SessionTest, frames_are_dropped_once_the_connection_was_seen_to_be_blocked) {
  hello();
  connection_->is_writable = false;
  Outbox& outbox = session_.outbox();
  for (std::size_t i = 0; i < Outbox::kTicksWaitingMax; ++i)
    outbox.push_frames({{wire::encode_packet({1, wire::FrameBatch{}}), 1}});
  EXPECT_FALSE(outbox.drop_if_congested()) << "the ticks of a late server, made one after the other";
  session_.flush(now_ns_);
  EXPECT_TRUE(outbox.drop_if_congested());
}

TEST_F(SessionTest, an_overflowing_outbox_closes_as_a_slow_consumer) {
  context_.limits.control_bytes_max = 1000;
  auto connection = std::make_shared<FakeConnection>();
  Session session(9, connection, context_, now_ns_);
  session.on_message({now_ns_, wire::Hello{}}, now_ns_);
  connection->is_writable = false;
  // Each message is answered with an error, and 30 errors exceed the 1000 bytes that may wait. They stay below
  // messages_burst (40), so the rate of messages does not end the session first.
  for (int i = 0; i < 30; ++i) session.on_message({now_ns_, wire::RemoveCharacter{5}}, now_ns_);
  session.poll(now_ns_);
  connection->is_writable = true;
  session.on_writable(now_ns_);
  ASSERT_EQ(connection->all<wire::Goodbye>().size(), 1u);
  EXPECT_EQ(connection->all<wire::Goodbye>()[0].reason, GoodbyeReason::slow_consumer);
  EXPECT_TRUE(connection->closed);
}

TEST_F(SessionTest, closes_on_a_malformed_packet) {
  hello();
  const std::vector<std::uint8_t> garbage(64, 0xa5);
  session_.on_packet(garbage, now_ns_);
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::malformed));
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::protocol_error));
  EXPECT_EQ(counters_.packets_refused_malformed.value(), 1u);
}

TEST_F(SessionTest, closes_on_a_broken_stream) {
  hello();
  session_.on_broken_stream(now_ns_);
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::protocol_error));
  EXPECT_EQ(counters_.packets_refused_oversize.value(), 1u);
}

TEST_F(SessionTest, gives_everything_back_once_when_it_leaves) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  send(wire::Goodbye{GoodbyeReason::client_leaves, ""});
  session_.on_closed("reset", now_ns_);
  EXPECT_EQ(session_.state(), State::closed);
  EXPECT_EQ(commands<CloseSession>().size(), 1u);
  EXPECT_THAT(groom_service_.released, ElementsAre(7u));
  EXPECT_EQ(context_.character_count, 0u);
  EXPECT_EQ(counters_.characters_added.value(), 1u);
  EXPECT_EQ(counters_.characters_removed.value(), 1u);
  EXPECT_EQ(context_.rooms.size(), 0u);
}

TEST_F(SessionTest, joins_the_room_that_hello_names) {
  send(wire::Hello{wire::kProtocolVersion, "test", "hall-2.b_c", "", wire::Role::participant, 0, {}});
  EXPECT_EQ(connection_->all<wire::Welcome>().at(0).room, "hall-2.b_c");
  EXPECT_EQ(commands<OpenSession>().at(0).room, "hall-2.b_c");
  EXPECT_EQ(context_.rooms.count("hall-2.b_c").sessions, 1u);
}

TEST_F(SessionTest, the_empty_name_and_lobby_are_one_room) {
  context_.limits.session_count_max = 3;
  const auto join = [&](const std::string& room) {
    auto connection = std::make_shared<FakeConnection>();
    auto session = std::make_unique<Session>(9, connection, context_, now_ns_);
    session->on_message({now_ns_, wire::Hello{wire::kProtocolVersion, "", room, "", wire::Role::participant, 0, {}}},
                        now_ns_);
    kept_.push_back(std::move(session));
    return connection->all<wire::Welcome>().at(0).room;
  };
  EXPECT_EQ(join(""), "lobby");
  EXPECT_EQ(join("lobby"), "lobby");
  EXPECT_EQ(join("Lobby"), "Lobby") << "another room";
  EXPECT_EQ(context_.rooms.count("lobby").sessions, 2u);
  EXPECT_EQ(context_.rooms.count("").sessions, 0u);
}

TEST_F(SessionTest, refuses_a_room_whose_name_cannot_be_and_a_room_too_many) {
  send(wire::Hello{wire::kProtocolVersion, "test", "no/slash", "", wire::Role::participant, 0, {}});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::room_invalid));
  EXPECT_THAT(goodbyes(), ElementsAre(GoodbyeReason::room_refused));
  EXPECT_THAT(commands<OpenSession>(), IsEmpty());
  context_.limits.room_count_max = 1;
  context_.limits.sessions_per_room_max = 1;
  const auto refused = [&](const std::string& room) {
    auto connection = std::make_shared<FakeConnection>();
    auto session = std::make_unique<Session>(9, connection, context_, now_ns_);
    session->on_message({now_ns_, wire::Hello{wire::kProtocolVersion, "", room, "", wire::Role::participant, 0, {}}},
                        now_ns_);
    kept_.push_back(std::move(session));
    return connection->all<wire::Welcome>().empty();
  };
  EXPECT_FALSE(refused("a"));
  EXPECT_TRUE(refused("b")) << "a room too many";
  EXPECT_TRUE(refused("a")) << "a client too many in the room";
  EXPECT_EQ(counters_.sessions_refused_room.value(), 3u);
}

TEST_F(SessionTest, requires_a_token_by_its_key_and_enforces_its_claims) {
  context_.token_key.emplace(std::vector<std::uint8_t>(32, 7));
  context_.limits.session_count_max = 100;
  context_.unix_time_s = [] { return std::int64_t{1000}; };
  // Opens a session with the token. Returns 0 when the token is refused. Otherwise returns the number of characters
  // that the session may have, plus one, so that an observer's 0 differs from a refusal.
  const auto try_token = [&](const std::string& token, wire::Role role, const std::string& room = "hall") {
    auto connection = std::make_shared<FakeConnection>();
    auto session = std::make_unique<Session>(9, connection, context_, now_ns_);
    session->on_message({now_ns_, wire::Hello{wire::kProtocolVersion, "", room, token, role, 0, {}}}, now_ns_);
    kept_.push_back(std::move(session));
    if (!connection->all<wire::Goodbye>().empty()) {
      EXPECT_EQ(connection->all<wire::Goodbye>()[0].reason, GoodbyeReason::token_refused);
      EXPECT_EQ(connection->all<wire::Error>().at(0).reason, ErrorReason::token_invalid);
      return std::uint32_t{0};
    }
    return connection->all<wire::Welcome>().at(0).character_count_max + 1;
  };
  channel::TokenClaims claims;
  claims.room = "hall";
  // The clock of the test stands at 1000 s, so the token is valid for a second more.
  claims.expires_s = 1001;
  claims.characters_max = 1;
  claims.strands_max = 5000;
  const std::string good = channel::sign(claims, *context_.token_key);
  EXPECT_EQ(try_token(good, wire::Role::participant), 2u) << "one character, whatever the server allows";
  EXPECT_EQ(groom_service_.strands_max.at(9), 5000u);
  EXPECT_EQ(try_token(good, wire::Role::participant, "attic"), 0u);
  EXPECT_EQ(try_token("", wire::Role::participant), 0u);
  EXPECT_EQ(try_token(good + "A", wire::Role::participant), 0u);
  claims.role = wire::Role::observer;
  const std::string observer = channel::sign(claims, *context_.token_key);
  EXPECT_EQ(try_token(observer, wire::Role::participant), 0u);
  EXPECT_EQ(try_token(observer, wire::Role::observer), 1u);
  context_.unix_time_s = [] { return std::int64_t{1001}; };
  EXPECT_EQ(try_token(good, wire::Role::participant), 0u) << "expired";
  // The five are the attic, no token, a token with one more letter, an observer's token for a participant, and the
  // expired token.
  EXPECT_EQ(counters_.sessions_refused_token.value(), 5u);
}

TEST_F(SessionTest, an_observer_has_no_characters) {
  send(wire::Hello{wire::kProtocolVersion, "test", "", "", wire::Role::observer, 0, {}});
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::not_allowed));
}

TEST_F(SessionTest, passes_on_what_it_wants_to_see_and_refuses_what_is_out_of_range) {
  hello();
  wire::Observe observe;
  observe.mode = wire::ObserveMode::radius;
  observe.radius_m = 3;
  send(observe);
  EXPECT_EQ(requests<wire::Observe>().at(0).radius_m, 3);
  observe.radius_m = -1;
  send(observe);
  observe.radius_m = 1;
  // A stride may be 1, 2 or 4.
  observe.stride = 3;
  send(observe);
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::observe_invalid, ErrorReason::observe_invalid));
  EXPECT_THAT(requests<wire::Observe>(), IsEmpty());
  EXPECT_EQ(counters_.requests_refused_observe.value(), 2u);
  send(wire::ReportImportance{{{4, 0.5f, false}}});
  EXPECT_EQ(requests<wire::ReportImportance>().at(0).members.size(), 1u);
}

TEST_F(SessionTest, a_hair_state_out_of_range_leaves_the_character_at_rest) {
  hello();
  wire::HairState state{0.5e-3f, {1, 2, 3}, {}};
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low, state});
  EXPECT_TRUE(requests<wire::AddCharacter>().at(0).state.has_value());
  // The greatest step is 1 mm (kHairStateStepMax_m).
  state.step_m = 1;
  send(wire::AddCharacter{2, groom_service_.known, LevelIndex::low, state});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::state_invalid));
  EXPECT_FALSE(requests<wire::AddCharacter>().at(0).state.has_value());
}

TEST_F(SessionTest, characters_of_a_groom_that_the_session_may_not_have_leave) {
  hello();
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  send(wire::AddCharacter{2, groom_service_.known, LevelIndex::low});
  session_.revoke_groom(wire::GroomHash{9});
  EXPECT_EQ(context_.character_count, 2u);
  session_.revoke_groom(groom_service_.known);
  EXPECT_EQ(requests<wire::RemoveCharacter>().size(), 2u);
  EXPECT_EQ(context_.character_count, 0u);
  EXPECT_EQ(counters_.characters_removed.value(), 2u);
  send(wire::AddCharacter{1, groom_service_.known, LevelIndex::low});
  EXPECT_THAT(errors(), IsEmpty());
}

TEST_F(SessionTest, a_full_server_refuses_and_continues_with_its_clients) {
  SessionRegistry registry(context_);
  context_.directory = &registry;
  context_.limits.resume_grace_ns = kSecond_ns;
  const auto dial = [&](const wire::Hello& hello) {
    auto connection = std::make_shared<FakeConnection>();
    PacketSink* sink = registry.open(connection, now_ns_);
    EXPECT_NE(sink, nullptr);
    sink->on_packet(wire::encode_packet({now_ns_, hello}), now_ns_);
    return std::pair(connection, sink);
  };
  wire::Hello hello;
  hello.client_name = "test";
  const auto [first, first_sink] = dial(hello);
  dial(hello);
  const auto [third, third_sink] = dial(hello);
  EXPECT_TRUE(third->all<wire::Welcome>().empty());
  ASSERT_EQ(third->all<wire::Goodbye>().size(), 1u);
  EXPECT_EQ(third->all<wire::Goodbye>()[0].reason, GoodbyeReason::server_full);
  EXPECT_EQ(third->all<wire::Goodbye>()[0].detail, "the server is full: at most 2 clients");

  first_sink->on_closed("reset", now_ns_);
  const wire::Welcome welcome = first->all<wire::Welcome>().at(0);
  wire::Hello again = hello;
  again.session = welcome.session;
  again.secret = welcome.secret;
  const auto [resumed, resumed_sink] = dial(again);
  ASSERT_EQ(resumed->all<wire::Welcome>().size(), 1u);
  EXPECT_TRUE(resumed->all<wire::Welcome>()[0].resumed);
  EXPECT_EQ(context_.session_count, 2u);

  resumed_sink->on_packet(wire::encode_packet({now_ns_, wire::Goodbye{GoodbyeReason::client_leaves, ""}}), now_ns_);
  EXPECT_EQ(context_.session_count, 1u);
  EXPECT_EQ(dial(hello).first->all<wire::Welcome>().size(), 1u) << "there is room again";
}

TEST_F(SessionTest, of_too_many_silent_connections_the_longest_waiting_ends) {
  // The fixture's own session must not count among those that wait for a Hello.
  send(wire::Goodbye{GoodbyeReason::client_leaves, ""});
  SessionRegistry registry(context_);
  std::vector<std::shared_ptr<FakeConnection>> connections;
  // As many connections may wait for a Hello as there may be sessions, which are two in small_limits().
  for (int i = 0; i < 3; ++i) {
    connections.push_back(std::make_shared<FakeConnection>());
    EXPECT_TRUE(registry.open(connections.back(), now_ns_ + i));
  }
  ASSERT_EQ(connections[0]->all<wire::Goodbye>().size(), 1u);
  EXPECT_EQ(connections[0]->all<wire::Goodbye>()[0].reason, GoodbyeReason::server_full);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(connections[i]->closed, i == 0);
  EXPECT_EQ(context_.awaiting_hello_count, context_.limits.session_count_max);
  // A connection without a Hello ends after 5 s (SessionLimits::handshake_timeout_ns).
  registry.poll(now_ns_ + 6 * kSecond_ns);
  registry.poll(now_ns_ + 6 * kSecond_ns);
  EXPECT_EQ(registry.count(), 0u);
}

TEST_F(SessionTest, an_observer_sets_the_wind_only_where_everyone_may) {
  send(wire::Hello{wire::kProtocolVersion, "test", "", "", wire::Role::observer, 0, {}});
  send(wire::SetWind{});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::not_allowed));
  EXPECT_THAT(requests<wire::SetWind>(), IsEmpty());
  context_.limits.wind_from_clients = AllowedClients::everyone;
  send(wire::SetWind{});
  EXPECT_EQ(requests<wire::SetWind>().size(), 1u);
}

TEST_F(SessionTest, closes_a_client_that_reads_but_leaves_messages_waiting) {
  hello();
  // The client takes one packet in each second, so it is never without progress. But three messages are queued in each
  // of ten seconds, so in the end the first in the queue has waited longer than slow_consumer_ns (10 s).
  session_.outbox().push_frames({{wire::encode_packet({1, wire::FrameBatch{}}), 1}});
  const auto takes_one = [&] {
    connection_->room = 1;
    session_.on_writable(now_ns_);
    session_.poll(now_ns_);
  };
  connection_->room = 0;
  for (int second = 0; second < 10; ++second) {
    for (int i = 0; i < 3; ++i) session_.send(wire::CharacterRemoved{1}, now_ns_);
    takes_one();
    now_ns_ += kSecond_ns;
    send(wire::PoseBatch{});
  }
  EXPECT_EQ(session_.state(), State::active);
  for (int second = 0; second < 10 && session_.state() == State::active; ++second) {
    takes_one();
    now_ns_ += kSecond_ns;
  }
  EXPECT_EQ(session_.state(), State::draining);
  EXPECT_EQ(counters_.sessions_closed_by_server_slow.value(), 1u);
}

}  // namespace
}  // namespace hairnet::server
