#include "server/quic/connection.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::quic {
namespace {

// A connection in the state closing is destroyed after three probe time-outs, as RFC 9000 asks, but no later than this:
// it costs memory, and a slow peer could make three time-outs long.
constexpr std::int64_t kClosing_ns_max = 1'000'000'000;
// The congestion window counts as the limit for this long after it held something back.
constexpr std::int64_t kHeldBack_ns = 1'000'000'000;

constexpr std::uint64_t value_of(http3::ErrorCode code) {
  return static_cast<std::uint64_t>(code);
}

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

Connection::Connection(ConnectionHost& host, const ConnectionOptions& options, QuicCounters& counters)
    : host_(&host), options_(options), counters_(&counters) {}

Connection::~Connection() {
  ngtcp2_conn_del(quic_);
  if (tls_) gnutls_deinit(tls_);
}

// The functions from here to on_quic_datagram() handle what comes in.

void Connection::receive(const Path& path, std::uint8_t ecn, std::span<const std::uint8_t> packet,
                         std::int64_t now_ns) {
  if (state_ == State::over) return;
  if (state_ == State::closing) {
    // The peer has not read CONNECTION_CLOSE yet, so it is repeated whenever as many bytes have come as it has. A
    // stranger's address gets no more bytes than came from there.
    closing_bytes_ += packet.size();
    if (close_packet_.empty() || closing_bytes_ < close_packet_.size()) return;
    closing_bytes_ = 0;
    is_close_due_ = true;
    return;
  }
  now_ns_ = now_ns;
  // A packet on another path, or with ECN's mark of congestion (CE, RFC 3168), is acknowledged at once: the peer's
  // sending rate depends on the answer.
  constexpr std::uint8_t kCongested = 3;
  if (path != path_ || ecn == kCongested) answer_.send_soon();
  path_ = path;
  Path copy = path;
  const ngtcp2_path native{copy.local.native(), copy.remote.native(), nullptr};
  const ngtcp2_pkt_info info{ecn};
  is_in_quic_ = true;
  const int error =
      ngtcp2_conn_read_pkt(quic_, &native, &info, packet.data(), packet.size(), static_cast<ngtcp2_tstamp>(now_ns));
  is_in_quic_ = false;
  if (error != 0) return end_with_error(error, now_ns);
  advance_finish(now_ns);
}

void Connection::poll(std::int64_t now_ns) {
  if (state_ == State::over) return;
  now_ns_ = now_ns;
  if (deadline_ns_ != 0 && now_ns >= deadline_ns_) {
    if (state_ == State::closing) {
      state_ = State::over;
      return;
    }
    // The peer has not acknowledged the last bytes in time.
    if (state_ == State::finishing) return cut(now_ns);
    if (!sink_) {
      counters_->closed_opening_timeout.add();
      return cut(now_ns);
    }
  }
  if (state_ == State::closing || static_cast<ngtcp2_tstamp>(now_ns) < ngtcp2_conn_get_expiry(quic_)) return;
  const int error = ngtcp2_conn_handle_expiry(quic_, static_cast<ngtcp2_tstamp>(now_ns));
  if (error != 0) return end_with_error(error, now_ns);
  advance_finish(now_ns);
}

std::int64_t Connection::due_ns() const {
  std::int64_t due_ns = std::numeric_limits<std::int64_t>::max();
  if (deadline_ns_ != 0) due_ns = deadline_ns_;
  if (state_ == State::closing || state_ == State::over) return due_ns;
  const ngtcp2_tstamp expiry = ngtcp2_conn_get_expiry(quic_);
  if (expiry >= static_cast<ngtcp2_tstamp>(due_ns)) return due_ns;
  const auto expiry_ns = static_cast<std::int64_t>(expiry);
  return is_quiet() ? answer_.due_ns(expiry_ns) : expiry_ns;
}

bool Connection::on_handshake_done() {
  gnutls_datum_t protocol{};
  if (gnutls_alpn_get_selected_protocol(tls_, &protocol) != 0) {
    failure_ = Failure::alpn;
    return false;
  }
  counters_->handshakes_done.add();
  deadline_ns_ = now_ns_ + options_.opening_timeout_ns;
  // The end of the handshake proves that the peer reads at its address; only now it takes a place among the
  // connections.
  if (!is_verified_ && !host_->on_verified(*this, now_ns_)) {
    failure_ = Failure::refused;
    return false;
  }
  is_verified_ = true;
  const std::vector<std::uint8_t> token = host_->make_address_token(remote_, now_ns_);
  if (!token.empty()) ngtcp2_conn_submit_new_token(quic_, token.data(), token.size());
  http3::StreamId control = 0;
  // HTTP/3 demands a control stream of the server; a client that allows none cannot be served.
  if (ngtcp2_conn_open_uni_stream(quic_, &control, nullptr) != 0) {
    fail(http3::ErrorCode::stream_creation_error, "the client allows no control stream");
    return false;
  }
  http3_.start(control);
  return failure_ == Failure::none;
}

void Connection::on_stream_bytes(http3::StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) {
  answer_.send_soon();
  http3_.on_bytes(stream, bytes, is_last);
  // http3_ has taken all bytes, so the peer may send as many again: both limits of flow control grow, the stream's and
  // the connection's.
  ngtcp2_conn_extend_max_stream_offset(quic_, stream, bytes.size());
  ngtcp2_conn_extend_max_offset(quic_, bytes.size());
}

void Connection::on_stream_closed(http3::StreamId stream) {
  forget_download(stream);
  http3_.on_stream_closed(stream);
  queues_.erase(stream);
  // A closed stream of the peer gives it the right to open another one.
  if (ngtcp2_conn_is_local_stream(quic_, stream)) return;
  if (ngtcp2_is_bidi_stream(stream))
    ngtcp2_conn_extend_max_streams_bidi(quic_, 1);
  else
    ngtcp2_conn_extend_max_streams_uni(quic_, 1);
}

void Connection::on_quic_datagram(std::span<const std::uint8_t> bytes) {
  answer_.on_datagram(now_ns_);
  switch (http3_.on_datagram(bytes)) {
    case http3::DatagramFate::no_session:
      return counters_->datagrams_dropped_early.add();
    case http3::DatagramFate::other_session:
      return counters_->datagrams_dropped_other.add();
    case http3::DatagramFate::delivered:
    case http3::DatagramFate::malformed:
      return;
  }
}

// The functions from here to on_session_end() are what HTTP/3 asks for and reports.

void Connection::send(http3::StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) {
  SendBuffer& buffer = queues_.stream(stream);
  buffer.push({bytes.begin(), bytes.end()});
  if (is_last) buffer.end();
  touch();
}

void Connection::stop_reading(http3::StreamId stream, http3::ErrorCode code) {
  ngtcp2_conn_shutdown_stream_read(quic_, stream, value_of(code));
  touch();
}

void Connection::reset(http3::StreamId stream, http3::ErrorCode code) {
  queues_.stream(stream).reset();
  ngtcp2_conn_shutdown_stream_write(quic_, stream, value_of(code));
  touch();
}

void Connection::fail(http3::ErrorCode code, std::string_view error) {
  if (failure_ != Failure::none) return;
  failure_ = Failure::http3;
  http3_error_ = code;
  error_ = error;
}

int Connection::on_request(const http3::Request& request) {
  if (state_ != State::open) return 503;
  return host_->on_request(*this, request, now_ns_);
}

void Connection::on_channel_open(http3::StreamId stream) {
  HAIRNET_ASSERT(!sink_);
  // Makes the channel's queue before the session is asked, so that send() finds it at once.
  queues_.stream(stream);
  if (state_ != State::open) return;
  queues_.set_datagram_prefix(http3_.datagram_prefix());
  deadline_ns_ = 0;
  sink_ = host_->on_session(*this, now_ns_);
  if (!sink_ && state_ == State::open) failure_ = Failure::refused;
}

void Connection::on_channel_bytes(std::span<const std::uint8_t> bytes) {
  // The copy keeps the sink alive while it runs: it may close the connection from within.
  if (const auto sink = sink_) sink->on_bytes(bytes, now_ns_);
}

void Connection::on_datagram(std::span<const std::uint8_t> bytes) {
  counters_->datagrams_received.add();
  if (const auto sink = sink_) sink->on_datagram(bytes, now_ns_);
}

void Connection::on_session_end() {
  end("the peer closed", now_ns_);
  if (state_ != State::open) return;
  has_peer_ended_ = true;
  // Nothing is left to send but the acknowledgements, which the next flush writes before it ends the connection.
  state_ = State::finishing;
  deadline_ns_ = now_ns_;
}

// The functions from here to advance_finish() are what the session asks for.

SendBuffer* Connection::channel() {
  const auto id = http3_.channel();
  return id ? queues_.find(*id) : nullptr;
}

void Connection::send(std::vector<std::uint8_t> bytes) {
  SendBuffer* buffer = channel();
  if (!buffer || state_ != State::open) return;
  buffer->push(std::move(bytes));
  was_full_ = was_full_ || !is_writable();
  touch();
}

void Connection::send_datagram(std::vector<std::uint8_t> bytes) {
  HAIRNET_ASSERT(bytes.size() <= datagram_bytes_max());
  if (state_ != State::open) return;
  queues_.push_datagram(std::move(bytes));
  was_full_ = was_full_ || !is_writable();
  touch();
}

// Downloads do not count: a peer that does not read one still reads the channel.
bool Connection::is_writable() const {
  // Unsent bytes delay new frames; unacknowledged ones only cost memory, so more of them are allowed.
  const SendBuffer* buffer = queues_.find(http3_.channel().value_or(-1));
  const std::size_t unsent = buffer ? buffer->unsent_bytes() : 0, kept = buffer ? buffer->kept_bytes() : 0;
  return takes_datagrams() && queues_.datagrams().bytes() + unsent < kUnsentBytesMax && kept < kKeptBytesMax;
}

std::optional<http3::StreamId> Connection::open_download() {
  if (state_ != State::open || !sink_) return std::nullopt;
  http3::StreamId stream = 0;
  was_download_refused_ =
      downloads_.size() >= kDownloadsMax || ngtcp2_conn_open_uni_stream(quic_, &stream, nullptr) != 0;
  if (was_download_refused_) return std::nullopt;
  // The first bytes of the stream name the session that it belongs to, as WebTransport demands.
  queues_.add_bulk_stream(stream).push(http3_.one_way_begin());
  downloads_[stream];
  counters_->downloads_opened.add();
  return stream;
}

bool Connection::is_writable(http3::StreamId download) const {
  const SendBuffer* buffer = queues_.find(download);
  return state_ == State::open && buffer && downloads_.contains(download) &&
         buffer->unsent_bytes() < kDownloadUnsentBytesMax && queues_.bulk_kept_bytes() < kKeptBytesMax;
}

void Connection::send_download(http3::StreamId download, std::vector<std::uint8_t> bytes, bool is_last) {
  const auto found = downloads_.find(download);
  if (state_ != State::open || found == downloads_.end()) return;
  SendBuffer& buffer = queues_.stream(download);
  buffer.push(std::move(bytes));
  if (is_last) buffer.end();
  found->second.is_ended = is_last;
  // tell_of_downloads() reports room only where it was missing.
  found->second.was_full = !is_last && !is_writable(download);
  touch();
}

void Connection::reset_download(http3::StreamId download) {
  if (downloads_.erase(download) == 0) return;
  counters_->downloads_reset.add();
  reset(download, http3::ErrorCode::session_error);
}

void Connection::forget_download(http3::StreamId stream) {
  const auto found = downloads_.find(stream);
  if (found == downloads_.end()) return;
  if (!found->second.is_ended) stopped_downloads_.push_back(stream);
  downloads_.erase(found);
}

std::size_t Connection::datagram_bytes_max() const {
  const ngtcp2_transport_params* peer = ngtcp2_conn_get_remote_transport_params(quic_);
  // The type and the length of the frame take 3 bytes at most; then comes the number of the session.
  constexpr std::size_t kFrame = 3 + http3::kVarintBytesMax;
  if (!peer || peer->max_datagram_frame_size < kFrame) return 0;
  return std::min<std::size_t>(kDatagramBytesMax, peer->max_datagram_frame_size - kFrame);
}

void Connection::close(std::string_view reason, std::int64_t now_ns) {
  sink_ = nullptr;
  if (state_ != State::open) return;
  state_ = State::finishing;
  close_reason_ = reason;
  // Frames that wait have no use for a client that gets a Goodbye.
  queues_.drop_datagrams();
  // Downloads are not worth the wait; the channel has the Goodbye.
  for (const auto& [stream, download] : downloads_) reset(stream, http3::ErrorCode::session_gone);
  downloads_.clear();
  deadline_ns_ = now_ns + options_.linger_ns;
  if (SendBuffer* buffer = channel()) buffer->end();
  touch();
}

void Connection::cut(std::int64_t now_ns) {
  if (state_ == State::closing || state_ == State::over) return;
  if (is_in_quic_) {
    // ngtcp2 must not be closed from within its own calls: the next poll() does it.
    state_ = State::finishing;
    deadline_ns_ = now_ns;
    end("closed", now_ns);
    return touch();
  }
  ngtcp2_connection_close_error error;
  ngtcp2_connection_close_error_default(&error);
  ngtcp2_connection_close_error_set_application_error(&error, value_of(http3::ErrorCode::no_error), nullptr, 0);
  // A connection without a session was counted as an opening time-out or a refusal already.
  if (!is_opening()) (has_peer_ended_ ? counters_->closed_by_peer : counters_->closed_by_server).add();
  begin_closing(error, now_ns);
  end("closed", now_ns);
}

// When the peer has acknowledged all bytes of the channel, a capsule closes the session with the reason. When the peer
// has acknowledged everything, the connection ends.
void Connection::advance_finish(std::int64_t now_ns) {
  if (state_ != State::finishing) return;
  const SendBuffer* buffer = channel();
  if (buffer && !buffer->is_done()) return;
  if (!std::exchange(is_session_closed_, true)) {
    http3_.close_session(0, close_reason_);
    touch();
  }
  if (queues_.kept_bytes() == 0) cut(now_ns);
}

// The functions from here to begin_closing() end the connection.

void Connection::end(std::string_view error, std::int64_t now_ns) {
  if (const auto sink = std::exchange(sink_, nullptr)) sink->on_closed(error, now_ns);
}

void Connection::end_with_error(int ngtcp2_error, std::int64_t now_ns) {
  if (state_ == State::closing || state_ == State::over) return;
  ngtcp2_connection_close_error error;
  ngtcp2_connection_close_error_default(&error);
  // For errors after which nothing can be sent, or need be: the connection is over at once.
  const auto leave = [&](server::Counter& counter, std::string_view reason) {
    counter.add();
    state_ = State::over;
    end(reason, now_ns);
  };
  switch (ngtcp2_error) {
    case NGTCP2_ERR_DRAINING:
      return leave(counters_->closed_by_peer, "the peer closed");
    case NGTCP2_ERR_IDLE_CLOSE:
      return leave(counters_->closed_idle, "nothing came for too long");
    case NGTCP2_ERR_HANDSHAKE_TIMEOUT:
      return leave(counters_->closed_handshake_timeout, "the handshake took too long");
    case NGTCP2_ERR_DROP_CONN:
    case NGTCP2_ERR_RETRY:
      return leave(counters_->closed_quic_error, "not a handshake");
    case NGTCP2_ERR_CLOSING:
      return;
    default:
      break;
  }
  std::string_view reason = "the QUIC connection broke";
  if (failure_ == Failure::http3) {
    ngtcp2_connection_close_error_set_application_error(
        &error, value_of(http3_error_), const_cast<std::uint8_t*>(bytes_of(error_).data()), error_.size());
    counters_->closed_http3_error.add();
    reason = error_;
  } else if (failure_ == Failure::refused) {
    ngtcp2_connection_close_error_set_transport_error(&error, NGTCP2_CONNECTION_REFUSED, nullptr, 0);
    reason = "refused";
  } else if (failure_ == Failure::alpn) {
    // TLS has this alert for a client without a protocol in common.
    constexpr std::uint8_t kNoApplicationProtocol = 120;
    ngtcp2_connection_close_error_set_transport_error_tls_alert(&error, kNoApplicationProtocol, nullptr, 0);
    counters_->refused_protocol.add();
    reason = "not HTTP/3";
  } else if (failure_ == Failure::no_memory) {
    ngtcp2_connection_close_error_set_transport_error(&error, NGTCP2_INTERNAL_ERROR, nullptr, 0);
    reason = "no memory was left";
  } else if (ngtcp2_error == NGTCP2_ERR_CRYPTO) {
    ngtcp2_connection_close_error_set_transport_error_tls_alert(&error, ngtcp2_conn_get_tls_alert(quic_), nullptr, 0);
    counters_->closed_tls.add();
  } else {
    ngtcp2_connection_close_error_set_transport_error_liberr(&error, ngtcp2_error, nullptr, 0);
    counters_->closed_quic_error.add();
  }
  begin_closing(error, now_ns);
  end(reason, now_ns);
}

void Connection::begin_closing(const ngtcp2_connection_close_error& error, std::int64_t now_ns) {
  HAIRNET_ASSERT(state_ != State::closing && state_ != State::over);
  close_packet_.resize(NGTCP2_MAX_UDP_PAYLOAD_SIZE);
  ngtcp2_path_storage path;
  ngtcp2_path_storage_zero(&path);
  ngtcp2_pkt_info info{};
  const ngtcp2_ssize bytes = ngtcp2_conn_write_connection_close(
      quic_, &path.path, &info, close_packet_.data(), close_packet_.size(), &error, static_cast<ngtcp2_tstamp>(now_ns));
  close_packet_.resize(bytes > 0 ? static_cast<std::size_t>(bytes) : 0);
  is_close_due_ = !close_packet_.empty();
  state_ = is_close_due_ ? State::closing : State::over;
  const auto pto_ns = static_cast<std::int64_t>(ngtcp2_conn_get_pto(quic_));
  deadline_ns_ = now_ns + std::min(3 * pto_ns, kClosing_ns_max);
  queues_.clear();
  ticket_ = nullptr;
  touch();
}

// The functions from here on write what goes out.

void Connection::write(Outgoing& out, std::int64_t now_ns) {
  if (state_ == State::over) return;
  now_ns_ = now_ns;
  if (state_ == State::closing) {
    if (!std::exchange(is_close_due_, false)) return;
    std::ranges::copy(close_packet_, out.room().begin());
    const ngtcp2_path* path = ngtcp2_conn_get_path(quic_);
    out.add({Address::of(path->local.addr, path->local.addrlen), Address::of(path->remote.addr, path->remote.addrlen)},
            close_packet_.size(), 0);
    return;
  }
  const std::size_t packets_max =
      // Pacing: so many packets may leave together; the next ones wait for the time that ngtcp2 names as its expiry.
      std::max<std::size_t>(1, ngtcp2_conn_get_send_quantum(quic_) / ngtcp2_conn_get_max_tx_udp_payload_size(quic_));
  was_full_ = was_full_ || !is_writable();
  std::size_t packets = 0;
  for (; packets < packets_max && write_packet(out, now_ns); ++packets) {
    tell_writable();
    tell_of_downloads();
  }
  answer_.on_written(packets > 0, now_ns);
  // Acknowledgements of the peer make room even when no packet was written.
  tell_writable();
  tell_of_downloads();
  if (!queues_.datagrams().empty() && ngtcp2_conn_get_cwnd_left(quic_) < ngtcp2_conn_get_max_tx_udp_payload_size(quic_))
    held_back_ns_ = now_ns;
  // An error while writing has made a CONNECTION_CLOSE, which leaves in the same flush.
  if (state_ == State::closing) return write(out, now_ns);
  if (state_ != State::over) ngtcp2_conn_update_pkt_tx_time(quic_, static_cast<ngtcp2_tstamp>(now_ns));
}

void Connection::tell_writable() {
  if (!was_full_ || !sink_ || !is_writable()) return;
  const auto sink = sink_;
  sink->on_writable(now_ns_);
  was_full_ = !is_writable();
}

void Connection::tell_of_downloads() {
  for (const http3::StreamId stream : std::exchange(stopped_downloads_, {}))
    if (const auto sink = sink_) sink->on_download_stopped(stream, now_ns_);
  bool has_room =
      was_download_refused_ && downloads_.size() < kDownloadsMax && ngtcp2_conn_get_streams_uni_left(quic_) > 0;
  if (has_room) was_download_refused_ = false;
  for (auto& [stream, download] : downloads_)
    if (download.was_full && is_writable(stream)) {
      download.was_full = false;
      has_room = true;
    }
  if (const auto sink = sink_; sink && has_room) sink->on_downloads_writable(now_ns_);
}

bool Connection::write_packet(Outgoing& out, std::int64_t now_ns) {
  ngtcp2_path_storage path;
  ngtcp2_path_storage_zero(&path);
  ngtcp2_pkt_info info{};
  const ngtcp2_ssize bytes = queues_.write(quic_, path.path, info, out.room(), now_ns, *this);
  if (bytes < 0) end_with_error(static_cast<int>(bytes), now_ns);
  if (bytes <= 0) return false;
  const ngtcp2_path& used = path.path;
  out.add({Address::of(used.local.addr, used.local.addrlen), Address::of(used.remote.addr, used.remote.addrlen)},
          static_cast<std::size_t>(bytes), static_cast<std::uint8_t>(info.ecn));
  return true;
}

void Connection::on_stream_sent(http3::StreamId stream, std::size_t bytes) {
  if (sink_ && (http3_.channel() == stream || downloads_.contains(stream))) sink_->on_sent(bytes);
}

void Connection::on_datagram_sent(std::size_t bytes, bool is_sent) {
  (is_sent ? counters_->datagrams_sent : counters_->datagrams_dropped_unsent).add();
  if (sink_ && is_sent) sink_->on_sent(bytes);
}

bool Connection::on_stopped(http3::StreamId stream) {
  if (queues_.is_bulk(stream))
    forget_download(stream);
  else
    http3_.on_stop(stream);
  return failure_ == Failure::none;
}

void Connection::widen() {
  // With kStreamBytesMax (connection_callbacks.cpp, 64 KiB) this makes 512 KiB of flow control, so that an upload is
  // not held up on a line with a long round trip.
  constexpr std::uint64_t kMore = std::uint64_t{448} << 10;
  if (state_ != State::open) return;
  if (const auto id = http3_.channel()) ngtcp2_conn_extend_max_stream_offset(quic_, *id, kMore);
  ngtcp2_conn_extend_max_offset(quic_, kMore);
  answer_.send_soon();
  touch();
}

ngtcp2_conn_stat Connection::statistics() const {
  ngtcp2_conn_stat statistics{};
  ngtcp2_conn_get_conn_stat(quic_, &statistics);
  return statistics;
}

double Connection::bytes_per_s() const {
  if (!held_back_ns_ || now_ns_ - *held_back_ns_ > kHeldBack_ns) return 0;
  const ngtcp2_conn_stat is = statistics();
  return is.smoothed_rtt == 0 ? 0 : 1e9 * static_cast<double>(is.cwnd) / static_cast<double>(is.smoothed_rtt);
}

}  // namespace hairnet::quic
