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
  session_.on_groom_read(wire::GroomHash{9}, read, now_ns_);  // not asked for
  session_.on_groom_read(groom_service_.kept, read, now_ns_);
  session_.on_groom_read(groom_service_.kept, read, now_ns_);  // nor that again
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
  connection_->takes_more = false;
  send(wire::GroomRequest{groom_service_.known, 0});
  session_.outbox().push_frames({{wire::encode_packet({1, wire::FrameBatch{}}), 1}});
  connection_->takes_more = true;
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

}  // namespace
}  // namespace hairnet::server
