#include "client/link/link_core.hpp"

#include <gmock/gmock.h>

#include <numeric>

#include "schema/wire/groom_file.hpp"
#include "tests/unit/client/link_core_driver.hpp"

namespace hairnet::link {
namespace {

using ::testing::HasSubstr;

RequestedState::Bytes some_bytes(std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
}

std::vector<wire::PoseSample> pose_of(std::uint32_t character, bool teleport = false) {
  wire::PoseSample pose;
  pose.character = character;
  pose.teleport = teleport;
  return {pose};
}

TEST(LinkCore, wants_a_connection_once_started_and_not_before) {
  LinkCoreDriver d;
  d.pass(1000 * kMs);
  EXPECT_FALSE(d.core.wants_connection());
  d.core.start();
  EXPECT_TRUE(d.core.wants_connection());
  d.core.on_opening(d.now_ns);
  EXPECT_FALSE(d.core.wants_connection());
}

// Before the welcome the client sends its Hello alone, and drops poses.
TEST(LinkCore, says_hello_first_and_nothing_more_before_the_welcome) {
  LinkCoreOptions options;
  options.client_name = "tester";
  options.room = "hall";
  options.token = "a.b.c";
  options.role = wire::Role::observer;
  LinkCoreDriver d(options);
  d.core.send(wire::AddCharacter{1, hash_of(1), LevelIndex::low});
  d.core.start();
  d.open();
  const auto hello = d.expect<wire::Hello>();
  EXPECT_EQ(hello.protocol_version, wire::kProtocolVersion);
  EXPECT_EQ(hello.client_name, "tester");
  EXPECT_EQ(hello.room, "hall");
  EXPECT_EQ(hello.token, "a.b.c");
  EXPECT_EQ(hello.role, wire::Role::observer);
  EXPECT_EQ(hello.session, 0u);
  d.core.push_poses(pose_of(1));
  EXPECT_FALSE(d.take());
  EXPECT_EQ(d.core.counters().poses_dropped, 1u);
}

// A program may add its characters while the connection still opens.
TEST(LinkCore, requests_before_the_welcome_are_sent_after_it) {
  LinkCoreDriver d;
  d.core.offer_groom(hash_of(1), some_bytes(100));
  d.core.send(wire::AddCharacter{7, hash_of(1), LevelIndex::high});
  d.core.send(wire::SetLevel{7, LevelIndex::low});
  d.core.send(wire::SetWind{});
  d.core.send(wire::AddCharacter{8, hash_of(1), LevelIndex::high});
  d.core.send(wire::RemoveCharacter{8});
  d.connect();
  EXPECT_EQ(d.expect<wire::GroomOffer>().byte_count, 100u);
  EXPECT_EQ(d.expect<wire::AddCharacter>().level, LevelIndex::low);
  d.expect<wire::SetWind>();
  EXPECT_FALSE(d.take());
  EXPECT_TRUE(d.core.active());
  EXPECT_FALSE(d.event<Connected>()->again);
}

// TCP delivers bytes in pieces of any size, down to one byte.
TEST(LinkCore, a_stream_is_understood_however_it_is_cut) {
  LinkCoreDriver d;
  d.core.start();
  d.open();
  std::vector<std::uint8_t> stream = d.packet(welcome_to(5));
  for (std::uint32_t member = 1; member <= 3; ++member) {
    const auto joined = d.packet(wire::MemberJoined{member, 9, 1, hash_of(2)});
    stream.insert(stream.end(), joined.begin(), joined.end());
  }
  for (const std::uint8_t& byte : stream) d.core.on_bytes({&byte, 1}, d.now_ns);
  EXPECT_EQ(d.events<wire::MemberJoined>().size(), 3u);
}

TEST(LinkCore, a_first_attempt_that_fails_is_the_last) {
  LinkCoreDriver d;
  d.core.start();
  d.core.on_opening(d.now_ns);
  d.core.on_closed("cannot connect to there", d.now_ns);
  ASSERT_TRUE(d.core.ended());
  EXPECT_EQ(d.event<Disconnected>()->detail, "cannot connect to there");
  EXPECT_EQ(d.core.next_deadline_ns(), std::numeric_limits<std::int64_t>::max());
}

TEST(LinkCore, a_silent_server_runs_into_the_time_out) {
  for (const bool opened : {false, true}) {
    LinkCoreDriver d;
    d.core.start();
    d.core.on_opening(d.now_ns);
    if (opened) d.core.on_open(d.now_ns);
    // LinkCoreOptions::connect_timeout_s is 5 s by default.
    d.pass(4999 * kMs);
    EXPECT_FALSE(d.core.ended());
    d.pass(kMs);
    EXPECT_TRUE(d.core.ended());
    EXPECT_TRUE(d.core.wants_close());
    d.close_as_wanted();
    EXPECT_FALSE(d.core.wants_close());
    EXPECT_THAT(d.event<Disconnected>()->detail, HasSubstr("time-out"));
  }
}

TEST(LinkCore, a_server_that_falls_silent_is_given_up_and_asked_again) {
  wire::Welcome welcome = welcome_to(5);
  welcome.signs_of_life = true;
  for (const bool has_datagrams : {false, true}) {
    LinkCoreDriver d;
    d.core.start();
    d.core.on_opening(d.now_ns);
    d.core.on_open(d.now_ns, has_datagrams);
    d.expect<wire::Hello>();
    d.send(welcome);
    d.event<Connected>();
    // Empty frame batches are the signs of life of a server. One every 2.5 s, a quarter of wire::kSilence_ms, is
    // enough.
    for (int i = 0; i < 20; ++i) {
      d.pass(2500 * kMs);
      if (has_datagrams)
        d.core.on_packet(d.packet(wire::FrameBatch{}), d.now_ns);
      else
        d.send(wire::FrameBatch{});
      EXPECT_TRUE(d.core.active());
    }
    // A client's own packets must not count as signs of the server. After 9 s without a packet it is not yet given up,
    // after 10 s it is.
    d.core.push_poses(pose_of(1));
    for (int s = 0; s < 9; ++s) d.pass(1000 * kMs);
    EXPECT_TRUE(d.core.active());
    EXPECT_LE(d.core.next_deadline_ns(), d.now_ns + 1000 * kMs);
    d.pass(1000 * kMs);
    EXPECT_FALSE(d.core.active());
    EXPECT_TRUE(d.core.wants_close());
    EXPECT_THAT(d.event<Reconnecting>()->detail, HasSubstr("silent"));
    EXPECT_EQ(d.core.counters().servers_silent, 1u);
    d.close_as_wanted();
    d.open();
    d.send(welcome);
    EXPECT_TRUE(d.event<Connected>()->again);
  }
}

// A server takes a silent client for gone. With a sign in every quarter of the time, three may get lost.
TEST(LinkCore, promises_signs_of_life_and_gives_one_in_every_quarter_of_the_time_for_them) {
  LinkCoreDriver d;
  d.core.start();
  d.open();
  EXPECT_TRUE(d.expect<wire::Hello>().signs_of_life);
  d.send(welcome_to(5));
  d.event<Connected>();
  for (int i = 0; i < 10; ++i) {
    const std::int64_t sent_ns = d.now_ns;
    std::optional<wire::Message> sign;
    for (int turn = 0; turn < 10 && !sign; ++turn) {
      d.pass_to_deadline();
      sign = d.take();
    }
    ASSERT_TRUE(sign && std::holds_alternative<wire::PoseBatch>(*sign));
    EXPECT_TRUE(std::get<wire::PoseBatch>(*sign).poses.empty());
    EXPECT_LE(d.now_ns - sent_ns, channel::kSilence_ns / 4);
  }
}

TEST(LinkCore, the_silence_of_a_server_does_not_count_while_this_program_is_stopped_nor_of_one_that_gives_no_signs) {
  LinkCoreDriver stopped;
  wire::Welcome welcome = welcome_to(5);
  welcome.signs_of_life = true;
  stopped.connect(welcome);
  // A single poll after an hour means that this program was stopped, as by a debugger or a suspended laptop.
  stopped.pass(3600'000 * kMs);
  EXPECT_TRUE(stopped.core.active());
  // The default Welcome does not promise signs of life, so 100 s of silence mean nothing.
  LinkCoreDriver older;
  older.connect(welcome_to(5));
  for (int s = 0; s < 100; ++s) older.pass(1000 * kMs);
  EXPECT_TRUE(older.core.active());
}

TEST(LinkCore, only_a_welcome_an_error_or_a_goodbye_may_come_first) {
  for (const wire::Message& message :
       {wire::Message(wire::GroomStatus{}), wire::Message(wire::FrameBatch{}), wire::Message(wire::MemberLeft{1})}) {
    LinkCoreDriver d;
    d.core.start();
    d.open();
    d.send(message);
    EXPECT_EQ(d.event<Disconnected>()->reason, wire::GoodbyeReason::protocol_error);
  }
  LinkCoreDriver d;
  d.core.start();
  d.open();
  d.send(wire::Error{wire::ErrorReason::token_invalid, 0, {}, "expired"});
  d.send(wire::Goodbye{wire::GoodbyeReason::token_refused, "go away"});
  const std::vector<Event> events = d.core.take_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(std::get<wire::Error>(events[0]).reason, wire::ErrorReason::token_invalid);
  EXPECT_EQ(std::get<Disconnected>(events[1]).reason, wire::GoodbyeReason::token_refused);
}

TEST(LinkCore, a_server_that_breaks_the_protocol_is_left_for_good) {
  // The cases are a size that no packet has, a packet whose content cannot be decoded, a second welcome, and a message
  // that only clients send.
  std::vector<std::uint8_t> garbage{64, 0, 0, 0};
  garbage.resize(68, 0x40);
  LinkCoreDriver sender;
  for (const std::vector<std::uint8_t>& bytes :
       {std::vector<std::uint8_t>{0xff, 0xff, 0xff, 0xff}, garbage, sender.packet(wire::Welcome{}),
        sender.packet(wire::SetLevel{1, LevelIndex::low})}) {
    LinkCoreDriver d;
    d.connect();
    d.core.on_bytes(bytes, d.now_ns);
    EXPECT_EQ(d.event<Disconnected>()->reason, wire::GoodbyeReason::protocol_error);
    EXPECT_TRUE(d.core.wants_close());
  }
}

// WebSockets and datagrams carry whole messages, so a message that is no packet is an error at once.
TEST(LinkCore, a_message_transport_gives_one_packet_a_message) {
  LinkCoreDriver d;
  d.core.start();
  d.open();
  d.core.on_packet(d.packet(welcome_to(1)), d.now_ns);
  EXPECT_TRUE(d.core.active());
  std::vector<std::uint8_t> two = d.packet(wire::MemberLeft{1});
  const std::vector<std::uint8_t> second = two;
  two.insert(two.end(), second.begin(), second.end());
  d.core.on_packet(two, d.now_ns);
  EXPECT_EQ(d.event<Disconnected>()->reason, wire::GoodbyeReason::protocol_error);
}

TEST(LinkCore, leaving_sends_goodbye_and_waits_a_moment_until_it_is_sent) {
  LinkCoreDriver d;
  d.connect();
  d.core.push_poses(pose_of(1));
  d.core.leave(d.now_ns);
  EXPECT_FALSE(d.core.wants_half_close());
  d.expect<wire::PoseBatch>();
  EXPECT_EQ(d.expect<wire::Goodbye>().reason, wire::GoodbyeReason::client_leaves);
  EXPECT_TRUE(d.core.wants_half_close());
  EXPECT_FALSE(d.core.ended());
  d.core.on_closed("the server closed", d.now_ns);
  EXPECT_EQ(d.event<Disconnected>()->reason, wire::GoodbyeReason::client_leaves);

  LinkCoreDriver stuck;
  stuck.connect();
  stuck.core.leave(stuck.now_ns);
  // A server that does not close has kGoodbyeWait_ns, 400 ms, for it (link_core.cpp).
  stuck.pass(400 * kMs);
  EXPECT_TRUE(stuck.core.ended());
  EXPECT_TRUE(stuck.core.wants_close());
}

TEST(LinkCore, leaving_before_there_is_a_session_ends_at_once) {
  LinkCoreDriver d;
  d.core.start();
  d.open();
  d.core.leave(d.now_ns);
  EXPECT_TRUE(d.core.ended());
  EXPECT_FALSE(d.take());
}

TEST(LinkCore, poses_go_out_after_any_number_of_signs_of_life) {
  LinkCoreDriver d;
  d.connect();
  for (int i = 0; i < 3; ++i) {
    d.pass_to_deadline();
    EXPECT_TRUE(d.expect<wire::PoseBatch>().poses.empty());
  }
  d.core.push_poses({wire::PoseSample{1, 1, d.now_ns, false, rigid_pose({})}});
  EXPECT_EQ(d.expect<wire::PoseBatch>().poses.size(), 1u);
  EXPECT_EQ(d.core.counters().poses_dropped, 0u);
}

TEST(LinkCore, deadlines_move_on_when_no_caller_takes_the_packets) {
  LinkCoreDriver d;
  d.connect();
  for (int i = 0; i < 100; ++i) {
    d.core.poll(d.now_ns = d.core.next_deadline_ns());
    EXPECT_GT(d.core.next_deadline_ns(), d.now_ns);
  }
  // Only the first deadline has queued a sign of life: no second one is queued while one waits.
  EXPECT_EQ(d.take_all().size(), 1u);
}

TEST(LinkCore, server_times_map_to_the_cores_clock) {
  LinkCoreDriver d;
  d.connect();
  EXPECT_EQ(d.core.to_local_ns(kServerClock_ns + d.now_ns), d.now_ns);
}

TEST(LinkCore, grooms_of_others_come_in_pieces_and_are_checked) {
  const std::vector<std::uint8_t> bytes = *some_bytes(1000);
  const wire::GroomHash hash = wire::hash_groom(bytes);
  const auto piece = [&](std::size_t begin, std::size_t end) {
    return wire::GroomData{
        hash,
        bytes.size(),
        begin,
        {bytes.begin() + static_cast<std::ptrdiff_t>(begin), bytes.begin() + static_cast<std::ptrdiff_t>(end)}};
  };
  LinkCoreDriver d;
  d.connect();
  d.core.request_groom(hash);
  d.core.request_groom(hash);
  EXPECT_EQ(d.expect<wire::GroomRequest>().offset, 0u);
  EXPECT_FALSE(d.take());
  d.send(piece(0, 300));
  EXPECT_FALSE(d.event<GroomFetched>());
  d.send(piece(300, 1000));
  const std::optional<GroomFetched> fetched = d.event<GroomFetched>();
  ASSERT_TRUE(fetched && fetched->bytes);
  EXPECT_EQ(*fetched->bytes, bytes);

  d.core.request_groom(hash);
  d.send(piece(0, 600));
  // This piece is late: its download was given up before.
  d.send(piece(0, 300));
  d.send(piece(300, 700));
  EXPECT_FALSE(d.event<GroomFetched>());
  d.send(piece(700, 1000));
  EXPECT_EQ(*d.event<GroomFetched>()->bytes, bytes);

  d.core.request_groom(hash);
  // A download begins at 0, so a piece from 1 on leaves a hole.
  d.send(piece(1, 300));
  EXPECT_FALSE(d.event<GroomFetched>()->error.empty());
  d.core.request_groom(hash);
  wire::GroomData wrong = piece(0, 1000);
  wrong.bytes[10] ^= 1;
  d.send(wrong);
  EXPECT_THAT(d.event<GroomFetched>()->error, HasSubstr("hash"));
  // The download has failed, so this piece was not asked for.
  d.send(piece(0, 1000));
  EXPECT_FALSE(d.event<GroomFetched>());
}

TEST(LinkCore, a_groom_that_is_not_to_be_had_can_be_asked_for_again) {
  LinkCoreDriver d;
  d.connect();
  d.core.offer_groom(hash_of(3), some_bytes(10));
  d.core.request_groom(hash_of(3));
  d.take_all();
  d.send(wire::Error{wire::ErrorReason::groom_unavailable, 0, hash_of(3), ""});
  EXPECT_TRUE(d.event<wire::Error>());
  d.core.request_groom(hash_of(3));
  d.expect<wire::GroomRequest>();
  // The upload of the same groom by this client goes on, from byte 4 of 10.
  d.send(wire::GroomNeed{hash_of(3), 4});
  EXPECT_EQ(d.expect<wire::GroomChunk>().bytes.size(), 6u);
}

TEST(LinkCore, a_groom_refused_for_there_are_too_many_can_be_asked_for_again) {
  LinkCoreDriver d;
  d.connect();
  d.core.request_groom(hash_of(3));
  d.take_all();
  d.send(wire::Error{wire::ErrorReason::limit_exceeded, 0, hash_of(3), "too many"});
  EXPECT_TRUE(d.event<wire::Error>());
  d.core.request_groom(hash_of(3));
  d.expect<wire::GroomRequest>();
}

TEST(LinkCore, a_character_that_was_not_requested_breaks_the_protocol) {
  LinkCoreDriver d;
  d.connect();
  d.send(wire::CharacterAdded{3, hash_of(1), LevelIndex::low, 1});
  EXPECT_EQ(d.event<Disconnected>()->reason, wire::GoodbyeReason::protocol_error);
}

TEST(LinkCore, a_groom_goes_out_though_poses_always_wait) {
  LinkCoreDriver d;
  d.connect();
  // The groom takes 13 chunks. Without the scheduler, poses that always wait would keep it back forever, or its chunks
  // would keep poses back. The loop ends in either case, after five times the bytes of the groom.
  const std::size_t groom_bytes = 200'000;
  d.core.offer_groom(hash_of(3), some_bytes(groom_bytes));
  d.take_all();
  d.send(wire::GroomNeed{hash_of(3), 0});
  std::size_t chunk_bytes = 0, run_bytes = 0, sent_before = d.core.counters().bytes_sent;
  while (chunk_bytes < groom_bytes && d.core.counters().bytes_sent < sent_before + 5 * groom_bytes) {
    d.core.push_poses(std::vector<wire::PoseSample>(10, wire::PoseSample{1, 1, d.now_ns, false, rigid_pose({})}));
    d.core.push_poses({wire::PoseSample{1, 1, d.now_ns, false, rigid_pose({})}});
    const std::optional<wire::Message> message = d.take();
    ASSERT_TRUE(message);
    const auto* chunk = std::get_if<wire::GroomChunk>(&*message);
    run_bytes = chunk ? run_bytes + chunk->bytes.size() : 0;
    if (chunk) chunk_bytes += chunk->bytes.size();
    // A chunk has at most kChunkBytes, 16 KiB (link_core.cpp).
    EXPECT_LE(run_bytes, 16'384u) << "poses wait for one chunk at most";
  }
  EXPECT_EQ(chunk_bytes, groom_bytes);
}

// Members have numbers, which the server gives to others later. If the client did not take its report back, a late
// joiner with the number of a hidden member would count as hidden too.
TEST(LinkCore, what_was_reported_of_a_member_is_undone_when_it_leaves) {
  LinkCoreDriver d;
  d.connect();
  const std::vector<wire::MemberImportance> seen{{1, 0.5f, false}};
  d.core.report_importance(seen);
  d.core.poll(d.now_ns);
  d.expect<wire::ReportImportance>();
  d.send(wire::MemberLeft{1});
  // A report may follow the last one after ImportanceReporter::kInterval_ns, 250 ms.
  d.pass(250 * kMs);
  const auto undone = d.expect<wire::ReportImportance>();
  ASSERT_EQ(undone.members.size(), 1u);
  EXPECT_EQ(undone.members[0].member, 1u);
  EXPECT_TRUE(undone.members[0].in_view);
  d.send(wire::MemberLeft{1});
  d.send(wire::MemberLeft{2});
  d.pass(250 * kMs);
  EXPECT_FALSE(d.take()) << "nothing is left to undo";
}

TEST(LinkCore, importance_is_sent_a_few_times_a_second_and_only_when_it_changes) {
  LinkCoreDriver d;
  d.connect();
  std::vector<wire::MemberImportance> seen{{1, 0.5f, true}, {2, 0.25f, false}};
  const auto report = [&] {
    d.core.report_importance(seen);
    d.core.poll(d.now_ns);
  };
  report();
  EXPECT_EQ(d.expect<wire::ReportImportance>().members.size(), 2u);
  report();
  d.pass(1000 * kMs);
  EXPECT_FALSE(d.take());
  // A change of 4 % is below ImportanceReporter::kChange, 10 %, so this member is not reported again.
  seen[0].screen_height = 0.52f;
  seen[1].in_view = true;
  report();
  const auto said = d.expect<wire::ReportImportance>();
  ASSERT_EQ(said.members.size(), 1u);
  EXPECT_EQ(said.members[0].member, 2u);
  EXPECT_TRUE(said.members[0].in_view);
  // For one second the height changes at every 10 ms. One report every 250 ms is allowed.
  std::size_t count = 0;
  for (int ms = 0; ms < 1000; ms += 10) {
    d.pass(10 * kMs);
    seen[0].screen_height = 0.1f + 0.001f * static_cast<float>(ms);
    report();
    count += d.take_all().size();
  }
  EXPECT_GE(count, 2u);
  EXPECT_LE(count, 4u);
}

}  // namespace
}  // namespace hairnet::link
