#include "client/link/webtransport/session.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

using http3::ErrorCode;

// The server ends the channel, and says the reason in a capsule on another stream, which may arrive later. This client
// waits this long for the capsule.
constexpr std::int64_t kReasonWait_ns = 500'000'000;

}  // namespace

Result<std::unique_ptr<WebTransportSession>> WebTransportSession::create(WebTransportTarget target,
                                                                         WebTransportEvents& events,
                                                                         std::int64_t now_ns,
                                                                         const QuicOptions& options) {
  std::unique_ptr<WebTransportSession> made(new WebTransportSession(target, events));
  auto quic = QuicConnection::create(target.path, std::move(target.certificate), options, *made, now_ns);
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

// What is sent.

void WebTransportSession::send(std::vector<std::uint8_t> bytes) {
  HAIRNET_ASSERT(http3_.channel() >= 0);
  if (!is_over()) quic_->send(http3_.channel(), std::move(bytes));
}

void WebTransportSession::end_channel() {
  HAIRNET_ASSERT(http3_.channel() >= 0);
  if (!is_over()) quic_->send(http3_.channel(), {}, true);
}

bool WebTransportSession::send_datagram(std::vector<std::uint8_t> bytes, std::int64_t now_ns) {
  HAIRNET_ASSERT(http3_.channel() >= 0);
  // Before its bytes, a datagram has QUIC's frame type and length, three bytes, and the session's number.
  constexpr std::size_t kFrame = 3 + http3::kVarintBytesMax;
  const std::size_t taken = quic_->datagram_frame_bytes_max();
  if (bytes.size() > quic::kDatagramBytesMax || bytes.size() + kFrame > taken) return false;
  // The packet is dropped; the caller learns of the end by is_over().
  if (is_over()) return true;
  // The times of datagrams that have left go first: both queues have the same order.
  while (datagram_ns_.size() > quic_->datagram_count()) datagram_ns_.pop_front();
  while (!datagram_ns_.empty() &&
         (datagram_ns_.size() >= kDatagramsMax || now_ns - datagram_ns_.front() > kDatagramAge_ns)) {
    // A pose that has waited too long is worth nothing, and sending it would delay newer ones.
    quic_->drop_first_datagram();
    datagram_ns_.pop_front();
  }
  quic_->send_datagram(std::move(bytes));
  datagram_ns_.push_back(now_ns);
  return true;
}

void WebTransportSession::take(std::size_t bytes) {
  if (bytes > 0) quic_->take(http3_.channel(), bytes);
}

void WebTransportSession::take_download(StreamId download, std::size_t bytes) {
  if (bytes > 0) quic_->take(download, bytes);
}

bool WebTransportSession::is_writable() const {
  return is_open() && quic_->unsent_bytes() < kUnsentBytesMax && quic_->kept_bytes() < kKeptBytesMax;
}

// What QUIC tells.

void WebTransportSession::on_ready() {
  // QUIC's handshake has a time-out of its own; from here on, the session's opening has the same time again.
  deadline_ns_ = now_ns_ + opening_ns_max_;
  http3_.start();
}

void WebTransportSession::on_stream_bytes(StreamId id, std::span<const std::uint8_t> bytes, bool is_last) {
  passed_bytes_ = 0;
  http3_.on_bytes(id, bytes, is_last);
  // What HTTP/3 has used itself goes back to the window at once. What it has passed on stays in the window until the
  // caller takes it.
  if (passed_bytes_ < bytes.size()) quic_->take(id, bytes.size() - passed_bytes_);
}

// What HTTP/3 tells.

void WebTransportSession::fail(ErrorCode code, std::string_view error) {
  quic_->close(code, error, now_ns_);
}

void WebTransportSession::on_channel_open() {
  quic_->set_datagram_prefix(http3_.datagram_prefix());
  deadline_ns_ = 0;
}

void WebTransportSession::on_channel_bytes(std::span<const std::uint8_t> bytes) {
  passed_bytes_ = bytes.size();
  events_->on_channel_bytes(bytes);
}

void WebTransportSession::on_download_bytes(StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) {
  passed_bytes_ = bytes.size();
  events_->on_download_bytes(stream, bytes, is_last);
}

void WebTransportSession::on_channel_end() {
  if (!std::exchange(has_ended_, true)) deadline_ns_ = now_ns_ + kReasonWait_ns;
}

}  // namespace hairnet::link
