#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/session_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using wire::ErrorReason;

TEST_F(SessionTest, sends_a_groom_that_is_asked_for_in_pieces_and_from_where_it_is_asked) {
  hello();
  send(wire::GroomRequest{groom_service_.known, 50'000});
  std::vector<std::uint8_t> got;
  for (const wire::GroomData& data : connection_->all<wire::GroomData>()) {
    EXPECT_EQ(data.offset, 50'000 + got.size());
    EXPECT_EQ(data.byte_count, groom_service_.file->size());
    got.insert(got.end(), data.bytes.begin(), data.bytes.end());
  }
  EXPECT_EQ(got, std::vector<std::uint8_t>(groom_service_.file->begin() + 50'000, groom_service_.file->end()));
  send(wire::GroomRequest{wire::GroomHash{9}, 0});
  // The file has 200 000 bytes, so this offset lies beyond its end.
  send(wire::GroomRequest{groom_service_.known, 200'001});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::groom_unavailable, ErrorReason::groom_unavailable));
}

TEST_F(SessionTest, a_groom_on_disk_is_sent_once_it_has_been_read_and_others_wait_for_it) {
  hello();
  send(wire::GroomRequest{groom_service_.kept, 100});
  send(wire::GroomRequest{groom_service_.kept, 100});
  send(wire::GroomRequest{groom_service_.known, 0});
  EXPECT_THAT(groom_service_.fetched, ElementsAre(7u));
  EXPECT_THAT(connection_->all<wire::GroomData>(), IsEmpty());
  const auto read = std::make_shared<const std::vector<std::uint8_t>>(500, std::uint8_t{3});
  // Nobody has asked for the first of these files, and the last comes a second time: both are ignored.
  session_.on_groom_read(wire::GroomHash{9}, read, now_ns_);
  session_.on_groom_read(groom_service_.kept, read, now_ns_);
  session_.on_groom_read(groom_service_.kept, read, now_ns_);
  const auto sent = connection_->all<wire::GroomData>();
  ASSERT_GT(sent.size(), 2u);
  EXPECT_EQ(sent[0].hash, groom_service_.kept);
  EXPECT_EQ(sent[0].offset, 100u);
  EXPECT_EQ(sent[0].bytes.size(), 400u);
  EXPECT_EQ(sent[1].hash, groom_service_.known);
  EXPECT_THAT(errors(), IsEmpty());
}

TEST_F(SessionTest, a_groom_that_could_not_be_read_from_disk_is_unavailable) {
  hello();
  send(wire::GroomRequest{groom_service_.kept, 0});
  send(wire::GroomRequest{groom_service_.known, 0});
  session_.on_groom_read(groom_service_.kept, nullptr, now_ns_);
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::groom_unavailable));
  EXPECT_EQ(connection_->all<wire::Error>()[0].groom, groom_service_.kept);
  EXPECT_EQ(counters_.requests_refused_download.value(), 1u);
  EXPECT_EQ(connection_->all<wire::GroomData>().back().offset + connection_->all<wire::GroomData>().back().bytes.size(),
            groom_service_.file->size());
  send(wire::GroomRequest{groom_service_.kept, 501});
  session_.on_groom_read(groom_service_.kept, std::make_shared<const std::vector<std::uint8_t>>(500, std::uint8_t{3}),
                         now_ns_);
  EXPECT_EQ(errors().size(), 2u) << "beyond its end";
}

TEST_F(SessionTest, a_groom_is_sent_no_faster_than_its_limit) {
  context_.limits.download_bytes_per_s = 65'536;
  Session slow(8, connection_, context_, now_ns_);
  slow.on_message({now_ns_, wire::Hello{wire::kProtocolVersion, "test", "", "", wire::Role::participant, 0, {}}},
                  now_ns_);
  slow.on_message({now_ns_, wire::GroomRequest{groom_service_.known, 0}}, now_ns_);
  const auto got_bytes = [&] {
    std::size_t bytes = 0;
    for (const wire::GroomData& data : connection_->all<wire::GroomData>()) bytes += data.bytes.size();
    return bytes;
  };
  // The bytes of one second may go at once; after half a second more, half as many follow.
  EXPECT_EQ(got_bytes(), 65'536u);
  EXPECT_EQ(counters_.downloads_delayed.value(), 1u);
  slow.flush(now_ns_ + kSecond_ns / 2);
  EXPECT_EQ(got_bytes(), 65'536u + 32'768);
  slow.flush(now_ns_ + 10 * kSecond_ns);
  slow.flush(now_ns_ + 20 * kSecond_ns);
  EXPECT_EQ(got_bytes(), groom_service_.file->size());
}

TEST_F(SessionTest, limits_the_number_of_groom_requests_at_once) {
  context_.limits.downloads_per_session_max = 1;
  hello();
  send(wire::GroomRequest{groom_service_.kept, 0});
  send(wire::GroomRequest{groom_service_.known, 0});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::limit_exceeded));
  send(wire::GroomRequest{groom_service_.kept, 0});
  EXPECT_EQ(errors().size(), 1u) << "asked for already, it is one still";
}

TEST_F(SessionTest, frames_wait_for_one_piece_of_a_groom_at_most) {
  hello();
  connection_->is_writable = false;
  send(wire::GroomRequest{groom_service_.known, 0});
  session_.outbox().push_frames({{wire::encode_packet({1, wire::FrameBatch{}}), 1}});
  connection_->is_writable = true;
  session_.flush(now_ns_);
  const auto first_frame = std::ranges::find_if(connection_->received, [](const wire::Envelope& envelope) {
    return std::holds_alternative<wire::FrameBatch>(envelope.message);
  });
  ASSERT_NE(first_frame, connection_->received.end());
  EXPECT_LE(std::count_if(connection_->received.begin(), first_frame,
                          [](const wire::Envelope& envelope) {
                            return std::holds_alternative<wire::GroomData>(envelope.message);
                          }),
            1);
}

TEST_F(SessionTest, a_groom_arrives_though_frames_always_wait) {
  hello();
  connection_->room = 0;
  send(wire::GroomRequest{groom_service_.known, 0});
  wire::FrameBatch batch;
  const std::vector<std::uint8_t> content(2000);
  batch.frames.emplace_back().content = content;
  const std::vector<std::uint8_t> packet = wire::encode_packet({1, batch});
  // A download gets a piece when everything else has had three times as many bytes (Downloads), so a quarter of all.
  // After four times its own size it is complete; the fifth is a reserve.
  while (counters_.bytes_sent.value() < 5 * groom_service_.file->size()) {
    session_.outbox().drop_if_congested();
    session_.outbox().push_frames({{packet, 1}, {packet, 1}});
    connection_->room = 1;
    session_.flush(now_ns_);
    ASSERT_GT(session_.outbox().packet_count(), 0u);
  }
  std::size_t got_bytes = 0;
  for (const wire::GroomData& data : connection_->all<wire::GroomData>()) got_bytes += data.bytes.size();
  EXPECT_EQ(got_bytes, groom_service_.file->size());
}

// A session over a connection like WebTransport, in which each download has a stream beside the messages.
struct SessionDownloads : SessionTest {
  SessionDownloads() {
    connection_->has_streams = true;
    hello();
  }
  FakeConnection::Download& stream(DownloadStream number) { return connection_->downloads.at(number); }
  // Brings the file of `kept` from the disk. By default it fits one piece (Downloads::kPiece_bytes, 16 KiB).
  void read(std::size_t bytes = 500) {
    session_.on_groom_read(groom_service_.kept, std::make_shared<const std::vector<std::uint8_t>>(bytes), now_ns_);
  }
};

TEST_F(SessionDownloads, go_on_streams_of_their_own_which_end_with_them) {
  send(wire::GroomRequest{groom_service_.known, 50'000});
  send(wire::GroomRequest{groom_service_.kept, 0});
  read();
  ASSERT_EQ(connection_->downloads.size(), 2u);
  // A stream of the fake connection has room for two packets until a test gives it more (FakeConnection::Download).
  EXPECT_EQ(stream(1).pieces.size(), 2u) << "as much as there is room for";
  EXPECT_FALSE(stream(1).is_ended);
  EXPECT_EQ(stream(2).bytes(), 500u);
  EXPECT_TRUE(stream(2).is_ended);
  stream(1).room = 100;
  session_.on_streams_writable(now_ns_);
  EXPECT_EQ(stream(1).bytes(), 150'000u);
  EXPECT_TRUE(stream(1).is_ended);
  std::uint64_t offset = 50'000;
  for (const wire::GroomData& piece : stream(1).pieces) {
    EXPECT_EQ(piece.hash, groom_service_.known);
    EXPECT_EQ(piece.offset, offset);
    offset += piece.bytes.size();
  }
  EXPECT_THAT(connection_->all<wire::GroomData>(), IsEmpty());
  EXPECT_TRUE(connection_->valid);
}

TEST_F(SessionDownloads, delay_no_message_and_need_none_to_go_on) {
  send(wire::GroomRequest{groom_service_.known, 0});
  send(wire::GroomRequest{wire::GroomHash{9}, 0});
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::groom_unavailable)) << "the first has no room";
  connection_->is_writable = false;
  session_.send(wire::Error{ErrorReason::limit_exceeded, 0, {}, ""}, now_ns_);
  stream(1).room = 100;
  session_.on_streams_writable(now_ns_);
  EXPECT_TRUE(stream(1).is_ended) << "while the channel is full";
  EXPECT_EQ(errors().size(), 1u);
}

TEST_F(SessionDownloads, wait_for_a_stream) {
  connection_->streams_left = 0;
  send(wire::GroomRequest{groom_service_.known, 0});
  EXPECT_THAT(connection_->all<wire::GroomData>(), IsEmpty());
  EXPECT_TRUE(connection_->downloads.empty());
  connection_->streams_left = 1;
  session_.on_streams_writable(now_ns_);
  EXPECT_EQ(stream(1).pieces.size(), 2u);
}

TEST_F(SessionDownloads, that_are_unavailable_are_told_with_the_messages) {
  send(wire::GroomRequest{groom_service_.known, 0});
  send(wire::GroomRequest{groom_service_.kept, 501});
  read();
  session_.on_groom_read(groom_service_.kept, nullptr, now_ns_);  // it was not asked for again
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::groom_unavailable));
  EXPECT_EQ(connection_->downloads.size(), 1u);
}

TEST_F(SessionDownloads, that_the_client_stops_make_room_for_others) {
  send(wire::GroomRequest{groom_service_.known, 0});
  session_.on_download_stopped(2, now_ns_);  // there is none
  EXPECT_EQ(counters_.downloads_given_up_stopped.value(), 0u);
  session_.on_download_stopped(1, now_ns_);
  EXPECT_EQ(counters_.downloads_given_up_stopped.value(), 1u);
  EXPECT_THAT(errors(), IsEmpty());
  send(wire::GroomRequest{groom_service_.known, 32'768});
  EXPECT_EQ(stream(2).pieces.front().offset, 32'768u) << "asked for again, from there on";
}

TEST_F(SessionDownloads, that_are_never_read_are_given_up) {
  send(wire::GroomRequest{groom_service_.known, 0});
  const auto live = [&](double seconds) {
    now_ns_ += static_cast<std::int64_t>(seconds * 1e9);
    send(wire::PoseBatch{});
    session_.poll(now_ns_);
  };
  // A stream may have no room for 30 s (SessionLimits::download_stalled_ns). The empty batches of poses keep the
  // session itself alive.
  live(29);
  EXPECT_FALSE(stream(1).was_reset);
  stream(1).room = 1;
  session_.on_streams_writable(now_ns_);
  live(29);
  EXPECT_FALSE(stream(1).was_reset) << "it has moved";
  live(2);
  EXPECT_TRUE(stream(1).was_reset);
  EXPECT_EQ(counters_.downloads_given_up_stalled.value(), 1u);
  EXPECT_THAT(errors(), ElementsAre(ErrorReason::groom_unavailable));
  EXPECT_EQ(connection_->all<wire::Error>()[0].groom, groom_service_.known);
  EXPECT_EQ(session_.state(), Session::State::active);
  live(40);
  EXPECT_EQ(errors().size(), 1u);
  send(wire::GroomRequest{groom_service_.known, 0});
  EXPECT_EQ(stream(2).pieces.size(), 2u);
}

TEST_F(SessionDownloads, share_the_sessions_bytes_a_second_and_are_not_stalled_by_that) {
  // The session may have one piece of 16 KiB in a second. Its own limit, and not the client, makes the stream wait for
  // more than 30 s.
  context_.limits.download_bytes_per_s = 16'384;
  Session slow(8, connection_, context_, now_ns_);
  slow.on_message({now_ns_, wire::Hello{wire::kProtocolVersion, "test", "", "", wire::Role::participant, 0, {}}},
                  now_ns_);
  connection_->last_stream = 10;
  slow.on_message({now_ns_, wire::GroomRequest{groom_service_.known, 0}}, now_ns_);
  stream(11).room = 100;
  EXPECT_EQ(stream(11).pieces.size(), 1u);
  slow.poll(now_ns_ + 31 * kSecond_ns);
  EXPECT_FALSE(stream(11).was_reset);
  slow.flush(now_ns_ + 31 * kSecond_ns);
  EXPECT_EQ(stream(11).pieces.size(), 2u);
}

TEST_F(SessionDownloads, are_a_few_at_a_time_in_turn) {
  context_.limits.downloads_per_session_max = 10;
  const auto file = std::make_shared<const std::vector<std::uint8_t>>(100'000);
  for (std::uint8_t n = 10; n < 16; ++n) {
    groom_service_.more[wire::GroomHash{n}] = file;
    send(wire::GroomRequest{wire::GroomHash{n}, 0});
  }
  EXPECT_EQ(connection_->downloads.size(), Downloads::kStreamsMax);
  for (auto& [number, download] : connection_->downloads) EXPECT_EQ(download.pieces.size(), 2u) << number;
  stream(2).room = 100;
  session_.on_streams_writable(now_ns_);
  EXPECT_TRUE(stream(2).is_ended);
  EXPECT_EQ(stream(5).pieces.front().hash, wire::GroomHash{14}) << "the next one has its place";
  EXPECT_EQ(connection_->downloads.size(), Downloads::kStreamsMax + 1);
}

}  // namespace
}  // namespace hairnet::server
