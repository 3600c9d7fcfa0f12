#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "server/http3/connection.hpp"
#include "tests/support/http3_client.hpp"
#include "tests/support/http3_owner.hpp"

namespace hairnet::http3 {
namespace {

// The client's bidirectional streams are 0, 4, 8 and so on, and its unidirectional ones 2, 6, 10. The server's first
// unidirectional stream is 3 (RFC 9000, section 2.1).
constexpr StreamId kOurControl = 3, kControl = 2, kEncoder = 6, kDecoder = 10, kOther = 14;
constexpr StreamId kRequest = 0, kChannel = 4, kSecond = 8;

struct Http3Connection : testing::Test {
  RecordingOwner owner;
  Connection connection{owner};

  void open_session() {
    connection.start(kOurControl);
    connection.on_bytes(kControl, control_stream(), false);
    connection.on_bytes(kRequest, connect_request("localhost:7420", "/ws"), false);
  }
  void open_channel() {
    open_session();
    connection.on_bytes(kChannel, channel_begin(kRequest), false);
  }
  // Returns the connection error that these bytes cause on a fresh connection, or nothing.
  std::optional<ErrorCode> failure_of(StreamId id, const Bytes& bytes, bool is_last = false) {
    RecordingOwner fresh;
    Connection alone(fresh);
    alone.on_bytes(id, bytes, is_last);
    EXPECT_EQ(fresh.failures, fresh.failure ? 1 : 0);
    return fresh.failure;
  }
};

TEST_F(Http3Connection, opens_a_session_and_passes_its_channel_and_datagrams_on) {
  open_channel();
  ASSERT_EQ(owner.requests.size(), 1u);
  EXPECT_EQ(owner.requests[0].path, "/ws");
  EXPECT_EQ(owner.sent[kRequest][0], kHeadersFrame);
  EXPECT_EQ(owner.channel, kChannel);
  EXPECT_EQ(connection.channel(), kChannel);
  connection.on_bytes(kChannel, Bytes{1, 2}, false);
  connection.on_bytes(kChannel, Bytes{3}, false);
  EXPECT_EQ(owner.received, (Bytes{1, 2, 3}));
  // A datagram begins with a quarter of the number of its session's stream (RFC 9297, section 2.1), here of stream 0.
  EXPECT_EQ(connection.datagram_prefix(), Bytes{0});
  EXPECT_EQ(connection.on_datagram(Bytes{0, 8, 9}), DatagramFate::delivered);
  EXPECT_THAT(owner.datagrams, testing::ElementsAre(Bytes{8, 9}));
  EXPECT_FALSE(owner.failure);
}

TEST_F(Http3Connection, does_the_same_when_every_byte_comes_alone) {
  connection.start(kOurControl);
  const auto each = [this](StreamId id, const Bytes& bytes) {
    for (const std::uint8_t byte : bytes) connection.on_bytes(id, std::span(&byte, 1), false);
  };
  each(kControl, control_stream());
  each(kRequest, connect_request("localhost:7420", "/ws"));
  Bytes channel = channel_begin(kRequest);
  put(channel, "bytes");
  each(kChannel, channel);
  EXPECT_EQ(owner.requests.size(), 1u);
  EXPECT_EQ(owner.received.size(), 5u);
  EXPECT_FALSE(owner.failure);
  each(kRequest, close_session_capsule(7, "done"));
  EXPECT_EQ(owner.ends, 1);
}

TEST_F(Http3Connection, waits_for_the_rest_at_every_truncation) {
  const Bytes request = connect_request("localhost:7420", "/ws");
  for (std::size_t cut = 0; cut < request.size(); ++cut) {
    RecordingOwner fresh;
    Connection alone(fresh);
    alone.on_bytes(kRequest, std::span(request).first(cut), false);
    EXPECT_EQ(fresh.calls, 0u) << cut;
    alone.on_bytes(kRequest, {}, true);
    // A stream that ends within a frame is an error of the whole connection. One that ends elsewhere has no complete
    // request, so only the stream is reset.
    EXPECT_TRUE(fresh.failure == ErrorCode::frame_error || fresh.resets.contains(kRequest)) << cut;
    EXPECT_TRUE(fresh.requests.empty());
  }
}

// The server serves no pages over HTTP/3, and each connection has one session.
TEST_F(Http3Connection, answers_other_requests_with_404_and_a_second_session_with_429) {
  open_session();
  connection.on_bytes(
      kChannel, headers_frame({{":method", "GET"}, {":scheme", "https"}, {":authority", "a"}, {":path", "/"}}), true);
  Bytes not_found, too_many;
  put_frame(not_found, kHeadersFrame, encode_response(404, false));
  put_frame(too_many, kHeadersFrame, encode_response(429, false));
  EXPECT_EQ(owner.sent[kChannel], not_found);
  EXPECT_TRUE(owner.ended.contains(kChannel));
  EXPECT_EQ(owner.requests.size(), 1u);
  connection.on_bytes(kSecond, connect_request("localhost:7420", "/ws"), false);
  EXPECT_EQ(owner.sent[kSecond], too_many);
  EXPECT_TRUE(owner.ended.contains(kSecond));
  EXPECT_EQ(owner.requests.size(), 1u);
  EXPECT_FALSE(owner.failure);
  EXPECT_TRUE(connection.has_session());
}

TEST_F(Http3Connection, refuses_with_the_status_that_its_owner_says) {
  owner.status = 403;
  open_session();
  EXPECT_FALSE(connection.has_session());
  EXPECT_TRUE(owner.ended.contains(kRequest));
  EXPECT_EQ(owner.stopped.at(kRequest), ErrorCode::no_error);
  EXPECT_EQ(connection.on_datagram(Bytes{0, 1}), DatagramFate::no_session);
}

TEST_F(Http3Connection, rejects_streams_of_no_session_and_more_than_one_channel) {
  connection.on_bytes(kChannel, channel_begin(kRequest), false);
  EXPECT_EQ(owner.resets.at(kChannel), ErrorCode::session_unknown);
  owner = {};
  connection.on_bytes(kRequest, connect_request("localhost:7420", "/ws"), false);
  connection.on_bytes(kSecond, channel_begin(kRequest), false);
  EXPECT_EQ(owner.channel, kSecond);
  connection.on_bytes(12, channel_begin(kRequest), false);
  EXPECT_EQ(owner.resets.at(12), ErrorCode::session_error);
  Bytes one_way;
  put_varint(one_way, kSessionStream);
  put_varint(one_way, kRequest);
  connection.on_bytes(kOther, one_way, false);
  EXPECT_EQ(owner.stopped.at(kOther), ErrorCode::session_error);
  EXPECT_FALSE(owner.resets.contains(kOther));
  EXPECT_FALSE(owner.failure);
}

TEST_F(Http3Connection, ends_with_the_close_capsule_the_end_of_the_request_or_of_the_channel) {
  using End = void (*)(Connection&);
  for (const End end : std::vector<End>{
           [](Connection& c) { c.on_bytes(kRequest, close_session_capsule(0, "bye"), false); },
           [](Connection& c) { c.on_bytes(kRequest, {}, true); }, [](Connection& c) { c.on_reset(kRequest); },
           [](Connection& c) { c.on_bytes(kChannel, {}, true); }, [](Connection& c) { c.on_reset(kChannel); },
           [](Connection& c) { c.on_stop(kChannel); }}) {
    RecordingOwner fresh;
    Connection alone(fresh);
    alone.on_bytes(kRequest, connect_request("localhost:7420", "/ws"), false);
    alone.on_bytes(kChannel, channel_begin(kRequest), false);
    end(alone);
    end(alone);
    EXPECT_EQ(fresh.ends, 1);
    EXPECT_FALSE(fresh.failure);
    EXPECT_EQ(alone.on_datagram(Bytes{0, 1}), DatagramFate::no_session);
    const std::size_t sent = fresh.sent[kRequest].size();
    alone.close_session(0, "late");
    EXPECT_EQ(fresh.sent[kRequest].size(), sent);
  }
}

TEST_F(Http3Connection, tells_the_peer_why_it_closes_the_session) {
  open_channel();
  const std::size_t before = owner.sent[kRequest].size();
  connection.close_session(3, "full");
  const Bytes& sent = owner.sent[kRequest];
  EXPECT_EQ(Bytes(sent.begin() + static_cast<std::ptrdiff_t>(before), sent.end()), close_session_capsule(3, "full"));
  EXPECT_TRUE(owner.ended.contains(kRequest));
  EXPECT_EQ(owner.ends, 0);
}

TEST_F(Http3Connection, skips_unknown_frames_streams_and_capsules) {
  open_channel();
  Bytes grease;
  // Frame types of the form 0x21 + 0x1f n are reserved (RFC 9114, section 7.2.8): peers send them to see that unknown
  // ones are ignored. The connection must not store what it skips.
  put_frame(grease, 0x21 + 0x1f * 7, Bytes(5000, 1));
  connection.on_bytes(kControl, grease, false);
  Bytes capsule;
  put_frame(capsule, 0x1234, Bytes(2000, 2));
  Bytes data;
  put_frame(data, kDataFrame, capsule);
  put_frame(data, 0x21, Bytes(10, 3));
  connection.on_bytes(kRequest, data, false);
  connection.on_bytes(kRequest, drain_session_capsule(), false);
  connection.on_bytes(kOther, Bytes{0x21, 1, 2, 3}, false);
  EXPECT_EQ(owner.stopped.at(kOther), ErrorCode::stream_creation_error);
  EXPECT_FALSE(owner.failure);
  EXPECT_EQ(owner.ends, 0);
  EXPECT_LT(connection.buffered_bytes(), 100u);
}

TEST_F(Http3Connection, fails_on_what_the_control_stream_may_not_have) {
  Bytes wrong{0x00};
  put_frame(wrong, kGoawayFrame, {0});
  EXPECT_EQ(failure_of(kControl, wrong), ErrorCode::missing_settings);
  // The numbers 2, 6, 8 and 9 are frame types of HTTP/2, which HTTP/3 reserves (RFC 9114, section 7.2.8).
  for (const std::uint64_t type : {kDataFrame, kHeadersFrame, kSettingsFrame, kPushPromiseFrame, std::uint64_t{0x02},
                                   std::uint64_t{0x06}, std::uint64_t{0x08}, std::uint64_t{0x09}}) {
    wrong = control_stream();
    put_frame(wrong, type, {0});
    EXPECT_EQ(failure_of(kControl, wrong), ErrorCode::frame_unexpected) << type;
  }
  // The number 2 is a setting of HTTP/2, which HTTP/3 reserves (RFC 9114, section 7.2.4.1).
  EXPECT_EQ(failure_of(kControl, control_stream({0x02, 0})), ErrorCode::settings_error);
  // Settings have at most 1024 bytes (kSettingsBytesMax in connection.cpp).
  EXPECT_EQ(failure_of(kControl, control_stream(Bytes(2000, 0))), ErrorCode::excessive_load);
  EXPECT_EQ(failure_of(kControl, control_stream(), true), ErrorCode::closed_critical_stream);
  // Stream type 1 is a push, which only servers may open.
  EXPECT_EQ(failure_of(kControl, Bytes{0x01}), ErrorCode::stream_creation_error);
  // Stream types 2 and 3 are those of QPACK's encoder and decoder (RFC 9204, section 4.2). The first instruction sets a
  // dynamic table of 32 bytes, although the server allows none. The second one sets a table of 0 bytes, and the last
  // one cancels a stream; both are allowed.
  EXPECT_EQ(failure_of(kEncoder, Bytes{0x02, 0x3f, 0x01}), ErrorCode::encoder_stream_error);
  EXPECT_EQ(failure_of(kEncoder, Bytes{0x02, 0x20}), std::nullopt);
  EXPECT_EQ(failure_of(kDecoder, Bytes{0x03, 0x40}), std::nullopt);
}

TEST_F(Http3Connection, fails_on_second_critical_streams_and_on_lost_ones) {
  connection.on_bytes(kControl, control_stream(), false);
  connection.on_bytes(kEncoder, control_stream(), false);
  EXPECT_EQ(owner.failure, ErrorCode::stream_creation_error);
  const std::size_t calls = owner.calls;
  connection.on_bytes(kRequest, connect_request("localhost:7420", "/ws"), false);
  connection.on_datagram(Bytes{0});
  connection.close_session(0, "");
  // The owner is told of nothing after a failure.
  EXPECT_EQ(owner.calls, calls);

  RecordingOwner fresh;
  Connection alone(fresh);
  alone.on_bytes(kDecoder, Bytes{0x03}, false);
  alone.on_reset(kDecoder);
  EXPECT_EQ(fresh.failure, ErrorCode::closed_critical_stream);
}

TEST_F(Http3Connection, fails_on_wrong_requests) {
  Bytes wrong;
  put_frame(wrong, kDataFrame, {1});
  EXPECT_EQ(failure_of(kRequest, wrong), ErrorCode::frame_unexpected);
  wrong = connect_request("localhost:7420", "/ws");
  // The request has its fields twice.
  const Bytes again = wrong;
  wrong.insert(wrong.end(), again.begin(), again.end());
  EXPECT_EQ(failure_of(kRequest, wrong), ErrorCode::frame_unexpected);
  wrong = {};
  // The section of fields refers to a dynamic table (its first byte is not 0), which the server does not have.
  put_frame(wrong, kHeadersFrame, {0x02, 0x00, 0x80});
  EXPECT_EQ(failure_of(kRequest, wrong), ErrorCode::decompression_failed);
  // Stream 3 belongs to the server, so it cannot be the request of a session.
  EXPECT_EQ(failure_of(kChannel, channel_begin(3)), ErrorCode::id_error);
  wrong = connect_request("localhost:7420", "/ws");
  Bytes capsule, data;
  // This capsule begins with an error code of four bytes, and has only three here.
  put_frame(capsule, kCloseSessionCapsule, Bytes(3, 0));
  put_frame(data, kDataFrame, capsule);
  wrong.insert(wrong.end(), data.begin(), data.end());
  EXPECT_EQ(failure_of(kRequest, wrong), ErrorCode::message_error);
}

TEST_F(Http3Connection, resets_a_malformed_or_too_large_request_and_goes_on) {
  connection.on_bytes(kRequest, headers_frame({{":method", "CONNECT"}, {"Upper", "x"}}), false);
  EXPECT_EQ(owner.resets.at(kRequest), ErrorCode::message_error);
  Bytes large;
  put_frame(large, kHeadersFrame, Bytes(kFieldSectionBytesMax + 1, 0));
  connection.on_bytes(kChannel, large, false);
  EXPECT_EQ(owner.resets.at(kChannel), ErrorCode::excessive_load);
  connection.on_bytes(kSecond, connect_request("localhost:7420", "/ws"), false);
  EXPECT_TRUE(connection.has_session());
  EXPECT_FALSE(owner.failure);
}

TEST_F(Http3Connection, drops_datagrams_of_no_session_and_fails_on_malformed_ones) {
  EXPECT_EQ(connection.on_datagram(Bytes{0, 1}), DatagramFate::no_session);
  open_session();
  // The first byte names stream 4, and the session has stream 0.
  EXPECT_EQ(connection.on_datagram(Bytes{1, 1}), DatagramFate::other_session);
  EXPECT_EQ(connection.on_datagram({}), DatagramFate::malformed);
  EXPECT_EQ(owner.failure, ErrorCode::datagram_error);
  EXPECT_TRUE(owner.datagrams.empty());
}

// A client that sends STOP_SENDING reads no more of the stream. A session or channel there could not be answered.
TEST_F(Http3Connection, makes_no_session_or_channel_of_a_stream_that_is_not_read) {
  connection.start(kOurControl);
  connection.on_bytes(kControl, control_stream(), false);
  const Bytes request = connect_request("localhost:7420", "/ws");
  connection.on_bytes(kRequest, std::span(request).first(3), false);
  connection.on_stop(kRequest);
  connection.on_bytes(kRequest, std::span(request).subspan(3), false);
  EXPECT_TRUE(owner.requests.empty());
  EXPECT_TRUE(owner.resets.contains(kRequest));
  connection.on_bytes(kSecond, request, false);
  ASSERT_EQ(owner.requests.size(), 1u);
  const Bytes begin = channel_begin(kSecond);
  connection.on_bytes(kChannel, std::span(begin).first(1), false);
  connection.on_stop(kChannel);
  connection.on_bytes(kChannel, std::span(begin).subspan(1), false);
  EXPECT_FALSE(owner.channel);
  EXPECT_TRUE(owner.resets.contains(kChannel));
  EXPECT_FALSE(owner.failure);
  EXPECT_EQ(owner.ends, 0);
}

TEST_F(Http3Connection, forgets_closed_streams) {
  open_channel();
  // A thousand streams come and go; each leaves one byte of its type behind unless it is forgotten.
  for (StreamId id = kSecond; id < 4000; id += 4) {
    connection.on_bytes(id, Bytes{0x40}, false);
    connection.on_reset(id);
    connection.on_stream_closed(id);
  }
  EXPECT_LT(connection.buffered_bytes(), 200u);
}

}  // namespace
}  // namespace hairnet::http3
