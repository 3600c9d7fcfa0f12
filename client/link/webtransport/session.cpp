#include "client/link/webtransport/session.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "schema/http3/capsule.hpp"
#include "schema/http3/field_section.hpp"
#include "schema/http3/opening.hpp"
#include "schema/http3/settings.hpp"
#include "schema/http3/stream_type.hpp"

namespace hairnet::link {
namespace {

using http3::ErrorCode;

constexpr std::size_t kSettingsBytesMax = 1024;
// After the end of the channel, for the reason, which comes on another stream.
constexpr std::int64_t kReasonWait_ns = 500'000'000;

bool is_one_way(StreamId id) {
  return (id & 2) != 0;
}

}  // namespace

Result<std::unique_ptr<WebTransportSession>> WebTransportSession::create(WebTransportTarget target,
                                                                         WebTransportEvents& events,
                                                                         std::int64_t now_ns,
                                                                         const QuicOptions& options) {
  CertificateCheck check = std::move(target.certificate);
  std::unique_ptr<WebTransportSession> made(new WebTransportSession(std::move(target), events));
  auto quic = QuicConnection::create(made->target_.path, std::move(check), options, *made, now_ns);
  if (!quic) return Refusal(std::move(quic.error()));
  made->quic_ = std::move(*quic);
  made->opening_ns_max_ = options.handshake_timeout_ns;
  return made;
}

void WebTransportSession::receive(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  now_ns_ = now_ns;
  quic_->receive(packet, now_ns);
}

void WebTransportSession::poll(std::int64_t now_ns) {
  now_ns_ = now_ns;
  if (deadline_ns_ != 0 && now_ns >= deadline_ns_) {
    deadline_ns_ = 0;
    quic_->close(ErrorCode::no_error, has_ended_ ? "" : "the server opens no session in time", now_ns);
  }
  quic_->poll(now_ns);
}

std::int64_t WebTransportSession::due_ns() const {
  const std::int64_t due_ns = quic_->due_ns();
  return deadline_ns_ != 0 && !is_over() ? std::min(due_ns, deadline_ns_) : due_ns;
}

bool WebTransportSession::fail(ErrorCode code, std::string_view why) {
  quic_->close(code, why, now_ns_);
  return false;
}

// What is sent.

void WebTransportSession::send(std::vector<std::uint8_t> bytes) {
  HAIRNET_ASSERT(channel_ >= 0);
  if (!is_over()) quic_->send(channel_, std::move(bytes));
}

void WebTransportSession::end_channel() {
  HAIRNET_ASSERT(channel_ >= 0);
  if (!is_over()) quic_->send(channel_, {}, true);
}

bool WebTransportSession::send_datagram(std::vector<std::uint8_t> bytes) {
  HAIRNET_ASSERT(channel_ >= 0);
  constexpr std::size_t kFrame = 3 + http3::kVarintBytesMax;  // a frame's type and length, and the session
  const std::size_t taken = quic_->datagram_frame_bytes_max();
  if (bytes.size() > quic::kDatagramBytesMax || bytes.size() + kFrame > taken) return false;
  if (!is_over() && quic_->datagram_count() < kDatagramsMax) quic_->send_datagram(std::move(bytes));
  return true;
}

void WebTransportSession::take(std::size_t bytes) {
  if (bytes > 0) quic_->take(channel_, bytes);
}

bool WebTransportSession::is_writable() const {
  return is_open() && quic_->unsent_bytes() < kUnsentBytesMax && quic_->kept_bytes() < kKeptBytesMax;
}

// What QUIC tells.

void WebTransportSession::on_ready() {
  deadline_ns_ = now_ns_ + opening_ns_max_;
  const StreamId control = quic_->open_stream(true);
  if (control < 0) {
    fail(ErrorCode::stream_creation_error, "the server allows no control stream");
    return;
  }
  quic_->send(control, http3::control_stream_begin());
}

void WebTransportSession::on_stream_bytes(StreamId id, std::span<const std::uint8_t> bytes, bool is_last) {
  if (id == channel_) {
    if (!bytes.empty()) events_->on_channel_bytes(bytes);
    if (is_last && !std::exchange(has_ended_, true)) deadline_ns_ = now_ns_ + kReasonWait_ns;
    return;
  }
  if (id == session_)
    take_session(bytes, is_last);
  else if (is_one_way(id))
    take_one_way(id, bytes, is_last);
  quic_->take(id, bytes.size());  // at once
}

void WebTransportSession::on_stream_reset(StreamId id, std::uint64_t) {
  const auto found = one_way_.find(id);
  if (id == session_ || id == channel_)
    fail(ErrorCode::no_error, "");
  else if (found != one_way_.end() && found->second.kind != Kind::ignored)
    fail(ErrorCode::closed_critical_stream, "the server has reset a critical stream");
}

void WebTransportSession::on_stream_stopped(StreamId id) {
  if (id == session_ || id == channel_)
    fail(ErrorCode::no_error, "");
  else
    fail(ErrorCode::closed_critical_stream, "the server does not read the control stream");
}

void WebTransportSession::on_quic_datagram(std::span<const std::uint8_t> bytes) {
  const http3::Varint quarter = http3::read_varint(bytes);
  if (quarter.bytes == 0) {
    fail(ErrorCode::datagram_error, "a datagram without its stream");
    return;
  }
  if (channel_ >= 0 && quarter.value == static_cast<std::uint64_t>(session_) / 4)
    events_->on_datagram(bytes.subspan(quarter.bytes));
}

// HTTP/3.

void WebTransportSession::take_one_way(StreamId id, std::span<const std::uint8_t> bytes, bool is_last) {
  Stream& stream = one_way_[id];
  while (stream.kind == Kind::unknown && !bytes.empty()) {
    stream.begin.push_back(bytes[0]);
    bytes = bytes.subspan(1);
    const http3::Varint type = http3::read_varint(stream.begin);
    if (type.bytes == 0) continue;
    stream.begin.clear();
    const Kind kind = type.value == http3::kControlStream   ? Kind::control
                      : type.value == http3::kEncoderStream ? Kind::encoder
                      : type.value == http3::kDecoderStream ? Kind::decoder
                                                            : Kind::ignored;
    stream.kind = kind;
    const auto is_same = [&](const auto& entry) { return entry.second.kind == kind; };
    if (kind == Kind::ignored)
      quic_->stop_reading(id, ErrorCode::stream_creation_error);
    else if (std::ranges::count_if(one_way_, is_same) > 1)
      fail(ErrorCode::stream_creation_error, "a second stream of its kind");
  }
  if (stream.kind == Kind::control)
    stream.frames.feed(bytes, [&](const http3::FrameReader::Piece& piece) { return take_control(stream, piece); });
  else if (stream.kind == Kind::encoder && !http3::is_valid_encoder_stream(bytes))
    fail(ErrorCode::encoder_stream_error, "there is no dynamic table");
  if (!is_last) return;
  if (stream.kind == Kind::unknown || stream.kind == Kind::ignored)
    one_way_.erase(id);
  else
    fail(ErrorCode::closed_critical_stream, "the server has ended a critical stream");
}

bool WebTransportSession::take_control(Stream& stream, const http3::FrameReader::Piece& piece) {
  if (stream.has_settings) {
    if (piece.type == http3::kSettingsFrame || piece.type == http3::kDataFrame || piece.type == http3::kHeadersFrame)
      return fail(ErrorCode::frame_unexpected, "a frame on the wrong stream");
    return true;
  }
  if (piece.type != http3::kSettingsFrame) return fail(ErrorCode::missing_settings, "settings come first");
  if (piece.length > kSettingsBytesMax) return fail(ErrorCode::excessive_load, "too many settings");
  stream.begin.insert(stream.begin.end(), piece.bytes.begin(), piece.bytes.end());
  if (!piece.is_last) return true;
  stream.has_settings = true;
  auto settings = http3::read_settings(std::exchange(stream.begin, {}));
  if (!settings) return fail(ErrorCode::settings_error, "the settings are not valid");
  if ((*settings)[http3::kEnableConnectProtocol] != 1 || (*settings)[http3::kH3Datagram] != 1)
    return fail(ErrorCode::settings_error, "the server has HTTP/3, but no sessions with datagrams");
  request();
  return true;
}

void WebTransportSession::request() {
  session_ = quic_->open_stream(false);
  if (session_ < 0)
    fail(ErrorCode::stream_creation_error, "the server allows no request");
  else
    quic_->send(session_, http3::connect_request(target_.authority, target_.url_path));
}

void WebTransportSession::take_session(std::span<const std::uint8_t> bytes, bool is_last) {
  frames_.feed(bytes, [this](const http3::FrameReader::Piece& piece) { return take_response(piece); });
  if (is_last) fail(ErrorCode::no_error, "");
}

bool WebTransportSession::take_response(const http3::FrameReader::Piece& piece) {
  if (piece.type == http3::kDataFrame && has_response_) {
    capsules_.feed(piece.bytes, [this](const http3::FrameReader::Piece& capsule) { return take_capsule(capsule); });
    return true;
  }
  if (piece.type == http3::kDataFrame || piece.type == http3::kSettingsFrame)
    return fail(ErrorCode::frame_unexpected, "a frame on the wrong stream, or before the fields");
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
  if (status->value.starts_with('1')) return true;  // a final one follows
  has_response_ = true;
  if (!status->value.starts_with('2')) return fail(ErrorCode::no_error, "it answers " + status->value);
  open_channel();
  return true;
}

void WebTransportSession::open_channel() {
  channel_ = quic_->open_stream(false);
  if (channel_ < 0) {
    fail(ErrorCode::stream_creation_error, "the server allows no channel");
    return;
  }
  const auto session = static_cast<std::uint64_t>(session_);
  quic_->send(channel_, http3::channel_begin(session));
  http3::Bytes prefix;
  http3::put_varint(prefix, session / 4);
  quic_->set_datagram_prefix(std::move(prefix));
  deadline_ns_ = 0;
}

bool WebTransportSession::take_capsule(const http3::FrameReader::Piece& piece) {
  constexpr std::size_t kCodeBytes = 4;
  if (piece.type != http3::kCloseSessionCapsule) return true;
  if (piece.length < kCodeBytes || piece.length > kCodeBytes + http3::kCloseReasonBytesMax)
    return fail(ErrorCode::message_error, "a capsule is not valid");
  begin_.insert(begin_.end(), piece.bytes.begin(), piece.bytes.end());
  if (!piece.is_last) return true;
  std::string reason(begin_.begin() + kCodeBytes, begin_.end());
  const bool is_printable = std::ranges::all_of(reason, [](char c) { return c >= ' ' && c < '\x7f'; });
  return fail(ErrorCode::no_error, is_printable ? reason : "");
}

}  // namespace hairnet::link
