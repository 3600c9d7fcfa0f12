#include "server/http3/connection.hpp"

#include <utility>

#include "core/assert.hpp"
#include "schema/http3/capsule.hpp"
#include "schema/http3/control_stream.hpp"
#include "schema/http3/field_section.hpp"
#include "schema/http3/opening.hpp"
#include "schema/http3/stream_type.hpp"

namespace hairnet::http3 {
namespace {

// Browsers send a few settings; a long list would only be stored.
constexpr std::size_t kSettingsBytesMax = 1024;

// The two lowest bits of a stream's number say who opened it and whether it is unidirectional (RFC 9000, section 2.1).
bool is_of_client(StreamId id) {
  return (id & 1) == 0;
}

bool is_unidirectional(StreamId id) {
  return (id & 2) != 0;
}

}  // namespace

void Connection::start(StreamId stream) {
  HAIRNET_ASSERT(!is_of_client(stream) && is_unidirectional(stream));
  // A server's control stream stays open as long as the connection (RFC 9114, section 6.2.1).
  owner_->send(stream, control_stream_begin(), false);
}

void Connection::on_bytes(StreamId id, std::span<const std::uint8_t> bytes, bool is_last) {
  HAIRNET_ASSERT(id >= 0);
  // Our one-way streams bring no bytes, and after a failure QUIC is about to end.
  if (has_failed_ || !is_of_client(id)) return;
  // QUIC bounds how many streams a peer has open, and on_stream_closed() removes each, so the map stays small.
  Stream& stream = streams_[id];
  if (stream.kind == Kind::unknown) bytes = take_type(id, stream, bytes);
  if (!has_failed_ && !bytes.empty()) take_bytes(id, stream, bytes);
  if (!has_failed_ && is_last) take_end(id, stream);
}

std::span<const std::uint8_t> Connection::take_type(StreamId id, Stream& stream, std::span<const std::uint8_t> bytes) {
  // Bytes may come one by one, so the type is gathered until it is whole. It takes at most 8 bytes.
  while (!bytes.empty()) {
    stream.begin.push_back(bytes[0]);
    bytes = bytes.subspan(1);
    const Varint type = read_varint(stream.begin);
    if (type.bytes == 0) continue;
    if (type.value == (is_unidirectional(id) ? kSessionStream : kSessionSignal))
      return take_session_signal(id, stream, type, bytes);
    if (!is_unidirectional(id)) {
      stream.kind = Kind::request;
      // The first integer is the type of a frame, which the reader of frames needs.
      const Bytes begin = std::exchange(stream.begin, {});
      take_bytes(id, stream, begin);
      return bytes;
    }
    stream.begin.clear();
    if (type.value == kControlStream || type.value == kEncoderStream || type.value == kDecoderStream) {
      bool& has_one = type.value == kControlStream   ? has_control_
                      : type.value == kEncoderStream ? has_encoder_
                                                     : has_decoder_;
      // A client has one stream of each of these kinds: a second one could contradict the first (RFC 9114, section
      // 6.2.1).
      if (std::exchange(has_one, true)) fail(ErrorCode::stream_creation_error, "a second stream of its kind");
      stream.kind = type.value == kControlStream   ? Kind::control
                    : type.value == kEncoderStream ? Kind::encoder
                                                   : Kind::decoder;
    } else if (type.value == kPushStream) {
      fail(ErrorCode::stream_creation_error, "a client cannot push");
    } else {
      stream.kind = Kind::ignored;
      owner_->stop_reading(id, ErrorCode::stream_creation_error);
    }
    return bytes;
  }
  return bytes;
}

std::span<const std::uint8_t> Connection::take_session_signal(StreamId id, Stream& stream, const Varint& signal,
                                                              std::span<const std::uint8_t> bytes) {
  while (true) {
    const Varint session = read_varint(std::span(stream.begin).subspan(signal.bytes));
    if (session.bytes != 0) {
      stream.begin.clear();
      // Only a client's bidirectional stream carries a CONNECT, and its number is a multiple of four.
      if (session.value % 4 != 0) {
        fail(ErrorCode::id_error, "a stream of a session that cannot be");
      } else if (!session_ || session_ended_ || session.value != static_cast<std::uint64_t>(*session_)) {
        // A stream may overtake the CONNECT of its session. It is rejected, not kept: storing early streams would let
        // strangers fill the memory.
        reject(id, stream, ErrorCode::session_unknown);
      } else if (is_unidirectional(id) || channel_) {
        reject(id, stream, ErrorCode::session_error);
      } else {
        stream.kind = Kind::channel;
        channel_ = id;
        owner_->on_channel_open(id);
      }
      return bytes;
    }
    if (bytes.empty()) return bytes;
    stream.begin.push_back(bytes[0]);
    bytes = bytes.subspan(1);
  }
}

void Connection::take_bytes(StreamId id, Stream& stream, std::span<const std::uint8_t> bytes) {
  switch (stream.kind) {
    case Kind::control:
      return stream.frames.feed(bytes, [&](const FrameReader::Piece& piece) { return take_control(stream, piece); });
    case Kind::encoder:
      // Our settings allow no dynamic table, so an encoder has nothing to insert.
      if (!is_valid_encoder_stream(bytes)) fail(ErrorCode::encoder_stream_error, "there is no dynamic table");
      return;
    case Kind::request:
    case Kind::session:
      return stream.frames.feed(bytes,
                                [&](const FrameReader::Piece& piece) { return take_request(id, stream, piece); });
    case Kind::channel:
      if (!session_ended_) owner_->on_channel_bytes(bytes);
      return;
    case Kind::unknown:
    // The bytes of a decoder stream concern a dynamic table, of which our encoder has none.
    case Kind::decoder:
    case Kind::ignored:
      return;
  }
}

bool Connection::take_control(Stream& stream, const FrameReader::Piece& piece) {
  if (!stream.has_settings) {
    if (piece.type != kSettingsFrame) return fail(ErrorCode::missing_settings, "settings come first");
    // The announced length is checked before bytes are stored.
    if (piece.length > kSettingsBytesMax) return fail(ErrorCode::excessive_load, "too many settings");
    stream.begin.insert(stream.begin.end(), piece.bytes.begin(), piece.bytes.end());
    if (!piece.is_last) return true;
    if (!read_settings(stream.begin)) return fail(ErrorCode::settings_error, "the settings are not valid");
    stream.begin = {};
    return stream.has_settings = true;
  }
  // RFC 9114, section 7.2, says which frame may come where. Unknown types are allowed and skipped (section 9).
  const bool is_misplaced = piece.type == kSettingsFrame || piece.type == kDataFrame || piece.type == kHeadersFrame ||
                            piece.type == kPushPromiseFrame || is_forbidden_frame(piece.type);
  return is_misplaced ? fail(ErrorCode::frame_unexpected, "a frame on the wrong stream") : true;
}

bool Connection::take_request(StreamId id, Stream& stream, const FrameReader::Piece& piece) {
  const bool is_misplaced = piece.type == kSettingsFrame || piece.type == kCancelPushFrame ||
                            piece.type == kPushPromiseFrame || piece.type == kGoawayFrame ||
                            piece.type == kMaxPushIdFrame || is_forbidden_frame(piece.type);
  if (is_misplaced || (!stream.has_fields && piece.type == kDataFrame))
    return fail(ErrorCode::frame_unexpected, "a frame on the wrong stream, or before the fields");
  if (piece.type == kHeadersFrame) {
    if (stream.has_fields) return fail(ErrorCode::frame_unexpected, "fields come once");
    if (piece.length > kFieldSectionBytesMax) {
      reject(id, stream, ErrorCode::excessive_load);
      return false;
    }
    stream.begin.insert(stream.begin.end(), piece.bytes.begin(), piece.bytes.end());
    return !piece.is_last || take_fields(id, stream);
  }
  if (piece.type == kDataFrame && stream.kind == Kind::session) {
    stream.capsules.feed(piece.bytes, [this](const FrameReader::Piece& capsule) { return take_capsule(capsule); });
    return !has_failed_;
  }
  return true;
}

bool Connection::take_fields(StreamId id, Stream& stream) {
  stream.has_fields = true;
  const DecodedFields decoded = decode_fields(std::exchange(stream.begin, {}));
  if (decoded.outcome == DecodedFields::Outcome::damaged)
    return fail(ErrorCode::decompression_failed, "the fields cannot be decoded");
  const bool are_too_many = decoded.outcome == DecodedFields::Outcome::too_many;
  const Result<Request> request = are_too_many ? Refusal("too many fields") : read_request(decoded.fields);
  if (!request) {
    reject(id, stream, are_too_many ? ErrorCode::excessive_load : ErrorCode::message_error);
    return false;
  }
  int status = 404;
  // A second session on the connection is refused as one too many.
  if (request->asks_for_session()) status = session_ ? 429 : owner_->on_request(*request);
  if (status == 200) {
    HAIRNET_ASSERT(!session_);
    session_ = id;
    stream.kind = Kind::session;
  }
  respond(id, status);
  if (status == 200) return true;
  stream.kind = Kind::ignored;
  // The answer is complete, so the rest of the request is not wanted (RFC 9114, section 4.1).
  owner_->stop_reading(id, ErrorCode::no_error);
  return false;
}

void Connection::respond(StreamId id, int status) {
  Bytes frame;
  put_frame(frame, kHeadersFrame, encode_response(status, status == 200));
  owner_->send(id, frame, status != 200);
}

bool Connection::take_capsule(const FrameReader::Piece& piece) {
  // Unknown capsules must be skipped (RFC 9297, section 3.2).
  if (piece.type != kCloseSessionCapsule) return true;
  // The capsule has a code of 4 bytes, and then the reason as text.
  if (piece.length < 4 || piece.length > 4 + kCloseReasonBytesMax)
    return fail(ErrorCode::message_error, "a capsule is not valid");
  if (piece.is_last) end_session();
  return true;
}

void Connection::take_end(StreamId id, Stream& stream) {
  switch (stream.kind) {
    case Kind::control:
    case Kind::encoder:
    case Kind::decoder:
      // Without its control and QPACK streams the peer could not go on (RFC 9114, section 6.2.1).
      fail(ErrorCode::closed_critical_stream, "a critical stream has ended");
      return;
    case Kind::request:
    case Kind::session:
      if (!stream.frames.is_between_frames()) {
        fail(ErrorCode::frame_error, "a stream ends within a frame");
      } else if (stream.kind == Kind::session) {
        end_session();
      } else if (!stream.has_fields) {
        reject(id, stream, ErrorCode::message_error);
      }
      return;
    case Kind::channel:
      return end_session();
    // The stream has ended before its type was complete.
    case Kind::unknown:
      if (!is_unidirectional(id)) reject(id, stream, ErrorCode::message_error);
      stream.kind = Kind::ignored;
      return;
    case Kind::ignored:
      return;
  }
}

void Connection::on_reset(StreamId id) {
  const auto found = streams_.find(id);
  if (has_failed_ || found == streams_.end()) return;
  Stream& stream = found->second;
  if (stream.kind == Kind::session || stream.kind == Kind::channel) return end_session();
  if (stream.kind == Kind::control || stream.kind == Kind::encoder || stream.kind == Kind::decoder) {
    fail(ErrorCode::closed_critical_stream, "a critical stream has been reset");
    return;
  }
  if (stream.kind == Kind::request) owner_->reset(id, ErrorCode::request_rejected);
  stream.kind = Kind::ignored;
}

void Connection::on_stop(StreamId id) {
  if (has_failed_) return;
  if (!is_of_client(id)) {
    fail(ErrorCode::closed_critical_stream, "the control stream is not read");
  } else if (id == session_ || id == channel_) {
    end_session();
  } else if (const auto found = streams_.find(id); found != streams_.end() && found->second.kind != Kind::ignored) {
    // The stream can no longer become the session or the channel: nothing could be sent there.
    reject(id, found->second, ErrorCode::request_rejected);
  }
}

void Connection::on_stream_closed(StreamId id) {
  streams_.erase(id);
}

DatagramFate Connection::on_datagram(std::span<const std::uint8_t> bytes) {
  if (has_failed_) return DatagramFate::malformed;
  const Varint quarter = read_varint(bytes);
  // A datagram begins with a quarter of its request's number, since those are multiples of four (RFC 9297, section
  // 2.1).
  if (quarter.bytes == 0 || quarter.value > kVarintMax / 4) {
    fail(ErrorCode::datagram_error, "a datagram without its stream");
    return DatagramFate::malformed;
  }
  // A datagram may overtake the CONNECT; poses are sent again, so it is dropped and not kept.
  if (!session_ || session_ended_) return DatagramFate::no_session;
  if (4 * quarter.value != static_cast<std::uint64_t>(*session_)) return DatagramFate::other_session;
  owner_->on_datagram(bytes.subspan(quarter.bytes));
  return DatagramFate::delivered;
}

Bytes Connection::datagram_prefix() const {
  HAIRNET_ASSERT(session_);
  Bytes prefix;
  put_varint(prefix, static_cast<std::uint64_t>(*session_) / 4);
  return prefix;
}

Bytes Connection::one_way_begin() const {
  HAIRNET_ASSERT(session_);
  return http3::one_way_begin(static_cast<std::uint64_t>(*session_));
}

void Connection::close_session(std::uint32_t code, std::string_view reason) {
  if (has_failed_ || !session_ || std::exchange(session_ended_, true)) return;
  // The capsule is the last of the stream, whose end the client takes for the session's.
  owner_->send(*session_, close_session_capsule(code, reason), true);
}

std::size_t Connection::buffered_bytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, stream] : streams_) bytes += stream.begin.capacity();
  return bytes;
}

void Connection::reject(StreamId id, Stream& stream, ErrorCode code) {
  stream.kind = Kind::ignored;
  stream.begin = {};
  owner_->stop_reading(id, code);
  // A one-way stream of the peer has no direction in which we could send.
  if (!is_unidirectional(id)) owner_->reset(id, code);
}

bool Connection::fail(ErrorCode code, std::string_view error) {
  if (!std::exchange(has_failed_, true)) owner_->fail(code, error);
  return false;
}

void Connection::end_session() {
  if (!std::exchange(session_ended_, true)) owner_->on_session_end();
}

}  // namespace hairnet::http3
