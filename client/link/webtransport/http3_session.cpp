#include "client/link/webtransport/http3_session.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "schema/http3/capsule.hpp"
#include "schema/http3/control_stream.hpp"
#include "schema/http3/field_section.hpp"
#include "schema/http3/opening.hpp"
#include "schema/http3/stream_type.hpp"

namespace hairnet::link {
namespace {

using http3::ErrorCode;

// The most bytes of the server's settings; those of hairnet-server take some tens.
constexpr std::size_t kSettingsBytesMax = 1024;

// The lowest two bits of a stream's number say who opened it and whether it is one-way (RFC 9000, 2.1).
bool is_of_server(StreamId id) {
  return (id & 1) != 0;
}

bool is_one_way(StreamId id) {
  return (id & 2) != 0;
}

}  // namespace

void Http3Session::start() {
  const StreamId control = owner_->open_stream(true);
  if (control < 0)
    fail(ErrorCode::stream_creation_error, "the server allows no control stream");
  else
    owner_->send(control, http3::control_stream_begin());
}

void Http3Session::on_bytes(StreamId id, std::span<const std::uint8_t> bytes, bool is_last) {
  HAIRNET_ASSERT(id >= 0);
  if (has_failed_) return;
  if (id == channel_) {
    if (!bytes.empty()) owner_->on_channel_bytes(bytes);
    if (is_last) owner_->on_channel_end();
  } else if (id == session_) {
    frames_.feed(bytes, [this](const http3::FrameReader::Piece& piece) { return take_response(piece); });
    // The end of the CONNECT stream ends the session, with or without a capsule.
    if (is_last) fail(ErrorCode::no_error, "");
  } else if (is_of_server(id) && is_one_way(id)) {
    // The server opens no two-way streams: our parameters allow it none.
    take_one_way(id, bytes, is_last);
  }
}

void Http3Session::on_reset(StreamId id) {
  if (id == session_ || id == channel_) {
    fail(ErrorCode::no_error, "");
    return;
  }
  const auto found = one_way_.find(id);
  if (has_failed_ || found == one_way_.end()) return;
  const Kind kind = found->second.kind;
  // These streams live as long as the connection (RFC 9114, 6.2.1; RFC 9204, 4.2).
  if (kind == Kind::control || kind == Kind::encoder || kind == Kind::decoder) {
    fail(ErrorCode::closed_critical_stream, "the server has reset a critical stream");
    return;
  }
  one_way_.erase(found);
  if (kind == Kind::download) owner_->on_download_reset(id);
}

void Http3Session::on_stop(StreamId id) {
  if (id == session_ || id == channel_)
    fail(ErrorCode::no_error, "");
  else
    fail(ErrorCode::closed_critical_stream, "the server does not read the control stream");
}

void Http3Session::on_datagram(std::span<const std::uint8_t> bytes) {
  if (has_failed_) return;
  const http3::Varint quarter = http3::read_varint(bytes);
  // A datagram names its session by a quarter of the number of the session's stream (RFC 9297). A datagram of another
  // session, or from before the channel, is dropped.
  if (quarter.bytes == 0)
    fail(ErrorCode::datagram_error, "a datagram without its stream");
  else if (channel_ >= 0 && quarter.value == static_cast<std::uint64_t>(session_) / 4)
    owner_->on_datagram(bytes.subspan(quarter.bytes));
}

http3::Bytes Http3Session::datagram_prefix() const {
  HAIRNET_ASSERT(channel_ >= 0);
  http3::Bytes prefix;
  http3::put_varint(prefix, static_cast<std::uint64_t>(session_) / 4);
  return prefix;
}

bool Http3Session::fail(ErrorCode code, std::string_view error) {
  if (!std::exchange(has_failed_, true)) owner_->fail(code, error);
  return false;
}

std::span<const std::uint8_t> Http3Session::take_kind(StreamId id, Stream& stream,
                                                      std::span<const std::uint8_t> bytes) {
  while (stream.kind == Kind::unknown && !bytes.empty()) {
    stream.begin.push_back(bytes[0]);
    bytes = bytes.subspan(1);
    // The type may come in pieces, so it is read again with each byte until it is whole.
    const http3::Varint type = http3::read_varint(stream.begin);
    if (type.bytes == 0) continue;
    if (type.value == http3::kSessionStream) {
      const http3::Varint session = http3::read_varint(std::span(stream.begin).subspan(type.bytes));
      if (session.bytes == 0) continue;
      // A session's stream is two-way and the client's, so its number is a multiple of 4. A download before the
      // channel, or of another session, is nothing that this client has asked for.
      if (session.value % 4 != 0)
        fail(ErrorCode::id_error, "a stream of a session that cannot be");
      else if (channel_ < 0 || session.value != static_cast<std::uint64_t>(session_))
        ignore(id, stream, ErrorCode::session_unknown);
      else
        stream.kind = Kind::download;
      stream.begin = {};
      return bytes;
    }
    stream.begin.clear();
    const Kind kind = type.value == http3::kControlStream   ? Kind::control
                      : type.value == http3::kEncoderStream ? Kind::encoder
                      : type.value == http3::kDecoderStream ? Kind::decoder
                                                            : Kind::ignored;
    stream.kind = kind;
    const auto is_same = [&](const auto& entry) { return entry.second.kind == kind; };
    // HTTP/3 reserves unknown types for extensions, and servers may send some on purpose (RFC 9114, 6.2.3): they are no
    // error.
    if (kind == Kind::ignored)
      ignore(id, stream, ErrorCode::stream_creation_error);
    else if (std::ranges::count_if(one_way_, is_same) > 1)
      fail(ErrorCode::stream_creation_error, "a second stream of its kind");
  }
  return bytes;
}

void Http3Session::ignore(StreamId id, Stream& stream, ErrorCode code) {
  stream.kind = Kind::ignored;
  owner_->stop_reading(id, code);
}

void Http3Session::take_one_way(StreamId id, std::span<const std::uint8_t> bytes, bool is_last) {
  Stream& stream = one_way_[id];
  bytes = take_kind(id, stream, bytes);
  if (has_failed_) return;
  const Kind kind = stream.kind;
  if (kind == Kind::control)
    stream.frames.feed(bytes, [&](const http3::FrameReader::Piece& piece) { return take_control(stream, piece); });
  else if (kind == Kind::encoder && !http3::is_valid_encoder_stream(bytes))
    fail(ErrorCode::encoder_stream_error, "there is no dynamic table");
  else if (kind == Kind::download && (!bytes.empty() || is_last))
    owner_->on_download_bytes(id, bytes, is_last);
  if (!is_last) return;
  if (kind == Kind::control || kind == Kind::encoder || kind == Kind::decoder)
    fail(ErrorCode::closed_critical_stream, "the server has ended a critical stream");
  else
    one_way_.erase(id);
}

bool Http3Session::take_control(Stream& stream, const http3::FrameReader::Piece& piece) {
  // Settings come once, and first (RFC 9114, 7.2.4). Later frames of the control stream, such as GOAWAY, change nothing
  // for one session.
  if (stream.has_settings) {
    if (piece.type == http3::kSettingsFrame || piece.type == http3::kDataFrame || piece.type == http3::kHeadersFrame)
      return fail(ErrorCode::frame_unexpected, "a frame on the wrong stream");
    return true;
  }
  if (piece.type != http3::kSettingsFrame) return fail(ErrorCode::missing_settings, "settings come first");
  // The length is checked before the bytes are collected, so that a server cannot fill the memory.
  if (piece.length > kSettingsBytesMax) return fail(ErrorCode::excessive_load, "too many settings");
  stream.begin.insert(stream.begin.end(), piece.bytes.begin(), piece.bytes.end());
  if (!piece.is_last) return true;
  stream.has_settings = true;
  auto settings = http3::read_settings(std::exchange(stream.begin, {}));
  if (!settings) return fail(ErrorCode::settings_error, "the settings are not valid");
  // The request may leave only after these settings: a server without them would take it for an ordinary CONNECT.
  if ((*settings)[http3::kEnableConnectProtocol] != 1 || (*settings)[http3::kH3Datagram] != 1)
    return fail(ErrorCode::settings_error, "the server has HTTP/3, but no sessions with datagrams");
  request();
  return true;
}

void Http3Session::request() {
  session_ = owner_->open_stream(false);
  if (session_ < 0)
    fail(ErrorCode::stream_creation_error, "the server allows no request");
  else
    owner_->send(session_, http3::connect_request(authority_, url_path_));
}

bool Http3Session::take_response(const http3::FrameReader::Piece& piece) {
  if (piece.type == http3::kDataFrame && has_response_) {
    capsules_.feed(piece.bytes, [this](const http3::FrameReader::Piece& capsule) { return take_capsule(capsule); });
    return true;
  }
  if (piece.type == http3::kDataFrame || piece.type == http3::kSettingsFrame)
    return fail(ErrorCode::frame_unexpected, "a frame on the wrong stream, or before the fields");
  // Frames of unknown types are passed over.
  if (piece.type != http3::kHeadersFrame) return true;
  if (has_response_) return fail(ErrorCode::frame_unexpected, "fields come once");
  if (piece.length > http3::kFieldSectionBytesMax) return fail(ErrorCode::excessive_load, "too many fields");
  begin_.insert(begin_.end(), piece.bytes.begin(), piece.bytes.end());
  if (!piece.is_last) return true;
  const http3::DecodedFields decoded = http3::decode_fields(std::exchange(begin_, {}));
  if (decoded.outcome != http3::DecodedFields::Outcome::decoded)
    return fail(ErrorCode::decompression_failed, "the fields cannot be decoded");
  const auto status = std::ranges::find(decoded.fields, ":status", &http3::Field::name);
  if (status == decoded.fields.end() || status->value.size() != 3)
    return fail(ErrorCode::message_error, "the answer has no status");
  // This answer is informational; the final one follows.
  if (status->value.starts_with('1')) return true;
  has_response_ = true;
  if (!status->value.starts_with('2')) return fail(ErrorCode::no_error, "it answers " + status->value);
  open_channel();
  return true;
}

void Http3Session::open_channel() {
  channel_ = owner_->open_stream(false);
  if (channel_ < 0) {
    fail(ErrorCode::stream_creation_error, "the server allows no channel");
    return;
  }
  // The first bytes of the stream name its session; the channel's packets follow.
  owner_->send(channel_, http3::channel_begin(static_cast<std::uint64_t>(session_)));
  owner_->on_channel_open();
}

bool Http3Session::take_capsule(const http3::FrameReader::Piece& piece) {
  constexpr std::size_t kCodeBytes = 4;
  // Other capsules are optional, and are passed over.
  if (piece.type != http3::kCloseSessionCapsule) return true;
  if (piece.length < kCodeBytes || piece.length > kCodeBytes + http3::kCloseReasonBytesMax)
    return fail(ErrorCode::message_error, "a capsule is not valid");
  begin_.insert(begin_.end(), piece.bytes.begin(), piece.bytes.end());
  if (!piece.is_last) return true;
  // The code is the application's own, and this protocol gives it no meaning.
  std::string reason(begin_.begin() + kCodeBytes, begin_.end());
  const bool is_printable = std::ranges::all_of(reason, [](char c) { return c >= ' ' && c < '\x7f'; });
  return fail(ErrorCode::no_error, is_printable ? reason : "");
}

}  // namespace hairnet::link
