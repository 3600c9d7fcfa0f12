#include "client/link/webtransport/http3_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "schema/http3/capsule.hpp"
#include "schema/http3/control_stream.hpp"
#include "schema/http3/field_section.hpp"
#include "schema/http3/opening.hpp"
#include "schema/http3/stream_type.hpp"
#include "tests/support/http3_client.hpp"
#include "tests/support/http3_client_owner.hpp"

namespace hairnet::link {
namespace {

using http3::Bytes;
using http3::ErrorCode;
using ::testing::ElementsAre;

// These are stream numbers of QUIC. Those of the server in one direction are 3, 7, 11 and so on; those of the client in
// both directions are 0, 4 and so on.
constexpr StreamId kControl = 3, kEncoder = 7, kDecoder = 11, kOther = 15, kSession = 0, kChannel = 4;

Bytes response(int status) {
  Bytes frame;
  const std::string text = std::to_string(status);
  http3::put_frame(frame, http3::kHeadersFrame, http3::encode_fields({{":status", text}}));
  return frame;
}

struct Session {
  RecordingHttp3Owner owner;
  Http3Session http3{owner, "here:7420", "/wt"};
  Session() { http3.start(); }
  void open() {
    http3.on_bytes(kControl, http3::control_stream_begin(), false);
    http3.on_bytes(kSession, response(200), false);
  }
};

// Returns the failure of a session, open or not, that gets these bytes. Expects that nothing is done after a failure.
std::optional<ErrorCode> failure_of(bool is_open, StreamId stream, const Bytes& bytes, bool is_last = false) {
  Session s;
  if (is_open) s.open();
  s.http3.on_bytes(stream, bytes, is_last);
  const std::optional<ErrorCode> failure = s.owner.failure;
  if (!failure) return failure;
  const std::size_t calls = s.owner.calls;
  s.http3.on_bytes(kSession, response(200), true);
  s.http3.on_datagram(Bytes{0, 1});
  EXPECT_EQ(s.owner.calls, calls) << "something follows a failure";
  return failure;
}

TEST(Http3Session, asks_once_the_server_allows_it_and_opens_the_channel_after_the_answer) {
  Session s;
  EXPECT_EQ(s.owner.sent[2], http3::control_stream_begin());
  EXPECT_TRUE(s.owner.sent[kSession].empty());
  s.http3.on_bytes(kControl, http3::control_stream_begin(), false);
  EXPECT_EQ(s.owner.sent[kSession], http3::connect_request("here:7420", "/wt"));
  EXPECT_EQ(s.http3.channel(), -1);
  s.http3.on_bytes(kSession, response(200), false);
  EXPECT_EQ(s.http3.channel(), kChannel);
  EXPECT_EQ(s.owner.sent[kChannel], http3::channel_begin(kSession));
  EXPECT_EQ(s.owner.channels, 1);
  s.http3.on_bytes(kChannel, Bytes{1, 2}, false);
  s.http3.on_bytes(kChannel, Bytes{3}, true);
  s.http3.on_datagram(Bytes{0, 7});
  // Another session's datagram is ignored.
  s.http3.on_datagram(Bytes{1, 7});
  EXPECT_EQ(s.owner.received, (Bytes{1, 2, 3}));
  EXPECT_EQ(s.owner.ends, 1);
  EXPECT_THAT(s.owner.datagrams, ElementsAre(Bytes{7}));
  EXPECT_FALSE(s.owner.failure);
}

TEST(Http3Session, does_the_same_when_every_byte_comes_alone) {
  Session s;
  const auto each = [&](StreamId stream, const Bytes& bytes) {
    for (const std::uint8_t byte : bytes) s.http3.on_bytes(stream, Bytes{byte}, false);
  };
  each(kControl, http3::control_stream_begin());
  each(kEncoder, {0x02, 0x20});
  each(kDecoder, {0x03, 9});
  // A response of status 103 is an early one: the final one follows.
  each(kSession, response(103));
  each(kSession, response(200));
  each(kSession, http3::drain_session_capsule());
  EXPECT_EQ(s.http3.channel(), kChannel);
  each(kSession, http3::close_session_capsule(1, "enough"));
  EXPECT_EQ(s.owner.failure, ErrorCode::no_error);
  EXPECT_EQ(s.owner.error, "enough");
}

TEST(Http3Session, ends_with_the_status_of_a_refusal) {
  // These are the statuses of an origin that is not allowed, an unknown path, a second session, and a server that
  // stops.
  for (const int status : {403, 404, 429, 503}) {
    Session s;
    s.http3.on_bytes(kControl, http3::control_stream_begin(), false);
    s.http3.on_bytes(kSession, response(status), true);
    EXPECT_EQ(s.owner.failure, ErrorCode::no_error);
    EXPECT_EQ(s.owner.error, "it answers " + std::to_string(status));
    EXPECT_EQ(s.http3.channel(), -1);
  }
}

TEST(Http3Session, needs_a_server_with_sessions_and_datagrams) {
  EXPECT_EQ(failure_of(false, kControl, http3::control_stream({0x33, 1})), ErrorCode::settings_error);
  EXPECT_EQ(failure_of(false, kControl, http3::control_stream({0x08, 1})), ErrorCode::settings_error);
  EXPECT_EQ(failure_of(false, kControl, http3::control_stream({})), ErrorCode::settings_error);
}

TEST(Http3Session, ends_when_the_server_breaks_http3) {
  EXPECT_EQ(failure_of(false, kControl, http3::control_stream({0x02, 0})), ErrorCode::settings_error);
  EXPECT_EQ(failure_of(false, kControl, http3::control_stream(Bytes(2000, 0))), ErrorCode::excessive_load);
  EXPECT_EQ(failure_of(false, kControl, {0x00, http3::kDataFrame, 0}), ErrorCode::missing_settings);
  EXPECT_EQ(failure_of(true, kControl, {http3::kSettingsFrame, 0}), ErrorCode::frame_unexpected);
  EXPECT_EQ(failure_of(true, kControl, {}, true), ErrorCode::closed_critical_stream);
  // A stream of type 0 is a second control stream.
  EXPECT_EQ(failure_of(true, kOther, {0x00}), ErrorCode::stream_creation_error);
  EXPECT_EQ(failure_of(true, kEncoder, {0x02, 0x3f}), ErrorCode::encoder_stream_error);
  EXPECT_EQ(failure_of(true, kSession, response(200)), ErrorCode::frame_unexpected);
  EXPECT_EQ(failure_of(true, kSession, {http3::kSettingsFrame, 0}), ErrorCode::frame_unexpected);
  EXPECT_EQ(failure_of(true, kSession, {http3::kDataFrame, 4, 0x68, 0x43, 1, 0}), ErrorCode::message_error);
  EXPECT_EQ(failure_of(true, kSession, {}, true), ErrorCode::no_error);
  for (const Bytes& wrong : {Bytes{http3::kDataFrame, 0}, Bytes{http3::kHeadersFrame, 3, 0, 0, 0xff},
                             Bytes{http3::kHeadersFrame, 2, 0, 0}, Bytes{http3::kHeadersFrame, 0x80, 1, 0, 0}}) {
    Session s;
    s.http3.on_bytes(kControl, http3::control_stream_begin(), false);
    s.http3.on_bytes(kSession, wrong, false);
    EXPECT_TRUE(s.owner.failure) << testing::PrintToString(wrong);
    EXPECT_NE(s.owner.failure, ErrorCode::no_error);
  }
  Session s;
  s.open();
  s.http3.on_datagram({});
  EXPECT_EQ(s.owner.failure, ErrorCode::datagram_error);
}

TEST(Http3Session, does_not_read_on_in_the_bytes_that_end_it) {
  Session s;
  s.http3.on_bytes(kControl, Bytes{0x00}, false);
  // This is a second control stream, with valid settings behind its type.
  s.http3.on_bytes(kOther, http3::control_stream_begin(), false);
  EXPECT_EQ(s.owner.failure, ErrorCode::stream_creation_error);
  EXPECT_TRUE(s.owner.sent[kSession].empty()) << "it asks for no session";
}

TEST(Http3Session, skips_what_it_does_not_know) {
  Session s;
  s.open();
  // The type 0x21 is unknown: as that of a stream, of a frame on each stream, and of a capsule. The server may not open
  // stream 1.
  s.http3.on_bytes(kOther, Bytes{0x21, 1, 2, 3}, false);
  s.http3.on_bytes(kControl, Bytes{0x21, 2, 1, 1}, false);
  s.http3.on_bytes(kSession, Bytes{0x21, 1, 1}, false);
  s.http3.on_bytes(kSession, Bytes{0x00, 3, 0x21, 1, 1}, false);
  s.http3.on_bytes(1, Bytes{1, 2}, false);
  s.http3.on_reset(kOther);
  EXPECT_FALSE(s.owner.failure);
  EXPECT_THAT(s.owner.stopped, ElementsAre(kOther));
}

Bytes download_of(std::uint64_t session, const Bytes& payload = {}) {
  Bytes bytes = http3::one_way_begin(session);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

// Streams may be mixed, and the first bytes of a stream, which name its session, may come one by one.
TEST(Http3Session, passes_the_sessions_one_way_streams_on_as_downloads) {
  constexpr StreamId kSecond = 19, kThird = 23;
  Session s;
  s.open();
  for (const std::uint8_t byte : download_of(kSession, {1, 2})) s.http3.on_bytes(kOther, Bytes{byte}, false);
  s.http3.on_bytes(kSecond, download_of(kSession, {7}), true);
  s.http3.on_bytes(kOther, Bytes{3}, false);
  EXPECT_EQ(s.owner.downloads[kOther], (Bytes{1, 2, 3}));
  EXPECT_EQ(s.owner.downloads[kSecond], Bytes{7});
  EXPECT_THAT(s.owner.downloads_ended, ElementsAre(kSecond));
  s.http3.on_reset(kOther);
  s.http3.on_reset(kOther);
  EXPECT_THAT(s.owner.downloads_reset, ElementsAre(kOther));
  s.http3.on_bytes(kThird, http3::one_way_begin(kSession), false);
  s.http3.on_bytes(kThird, {}, true);
  EXPECT_THAT(s.owner.downloads_ended, ElementsAre(kSecond, kThird)) << "an empty one";
  EXPECT_TRUE(s.owner.stopped.empty());
  EXPECT_FALSE(s.owner.failure);
}

// A server must not make a client store bytes for a session that the client has not opened.
TEST(Http3Session, reads_no_downloads_of_other_sessions_or_before_its_own) {
  Session early;
  early.http3.on_bytes(kOther, download_of(kSession, {1}), false);
  EXPECT_THAT(early.owner.stopped, ElementsAre(kOther));
  early.open();
  early.http3.on_bytes(kOther, Bytes{1}, true);
  EXPECT_TRUE(early.owner.downloads.empty());
  Session foreign;
  foreign.open();
  foreign.http3.on_bytes(kOther, download_of(8, {1, 2}), false);
  foreign.http3.on_bytes(kOther, Bytes{3}, false);
  foreign.http3.on_reset(kOther);
  EXPECT_THAT(foreign.owner.stopped, ElementsAre(kOther));
  EXPECT_TRUE(foreign.owner.downloads.empty());
  EXPECT_TRUE(foreign.owner.downloads_reset.empty());
  EXPECT_FALSE(foreign.owner.failure);
  EXPECT_EQ(failure_of(true, kOther, http3::one_way_begin(3)), ErrorCode::id_error);
}

// Stream 2 is the client's own control stream.
TEST(Http3Session, ends_with_its_session_and_with_a_stream_that_is_needed) {
  for (const StreamId stream : {kSession, kChannel, kControl}) {
    Session reset;
    reset.open();
    reset.http3.on_reset(stream);
    EXPECT_TRUE(reset.owner.failure) << stream;
  }
  for (const StreamId stream : {kSession, kChannel, StreamId{2}}) {
    Session stopped;
    stopped.open();
    stopped.http3.on_stop(stream);
    EXPECT_TRUE(stopped.owner.failure) << stream;
  }
  RecordingHttp3Owner owner;
  owner.allows_no_streams = true;
  Http3Session(owner, "here", "/").start();
  EXPECT_EQ(owner.failure, ErrorCode::stream_creation_error);
}

}  // namespace
}  // namespace hairnet::link
