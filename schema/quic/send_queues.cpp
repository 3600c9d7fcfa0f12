#include "schema/quic/send_queues.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace hairnet::quic {
namespace {

constexpr std::size_t kPiecesMax = 16;

}  // namespace

SendBuffer* SendQueues::find(std::int64_t id) {
  const auto found = streams_.find(id);
  return found == streams_.end() ? nullptr : &found->second;
}

void SendQueues::clear() {
  streams_.clear();
  drop_datagrams();
}

std::size_t SendQueues::unsent_bytes() const {
  std::size_t bytes = datagrams_.bytes();
  for (const auto& [id, buffer] : streams_) bytes += buffer.unsent_bytes();
  return bytes;
}

std::size_t SendQueues::kept_bytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, buffer] : streams_) bytes += buffer.kept_bytes();
  return bytes;
}

ngtcp2_ssize SendQueues::write(ngtcp2_conn* quic, ngtcp2_path& path, ngtcp2_pkt_info& info,
                               std::span<std::uint8_t> room, std::int64_t now_ns, SendObserver& observer) {
  const auto time = static_cast<ngtcp2_tstamp>(now_ns);
  std::vector<std::int64_t> blocked;
  while (true) {
    const auto next = std::ranges::find_if(streams_, [&](const auto& entry) {
      return entry.second.has_unsent() && std::ranges::count(blocked, entry.first) == 0;
    });
    const bool has_stream = next != streams_.end();
    if (datagrams_.is_next(has_stream) && ngtcp2_conn_get_handshake_completed(quic)) {
      std::vector<std::uint8_t>& first = datagrams_.front();
      std::array<ngtcp2_vec, 2> pieces{};  // of which none may be empty
      std::size_t count = 0;
      for (std::vector<std::uint8_t>* piece : {&datagram_prefix_, &first})
        if (!piece->empty()) pieces[count++] = {piece->data(), piece->size()};
      int is_taken = 0;
      const ngtcp2_ssize bytes =
          ngtcp2_conn_writev_datagram(quic, &path, &info, room.data(), room.size(), &is_taken,
                                      NGTCP2_WRITE_DATAGRAM_FLAG_MORE, 0, pieces.data(), count, time);
      const bool is_unusable = bytes == NGTCP2_ERR_INVALID_ARGUMENT || bytes == NGTCP2_ERR_INVALID_STATE;
      if (is_taken || is_unusable) {
        observer.on_datagram_sent(datagrams_.pop().size(), is_taken != 0);
      }
      if (bytes == NGTCP2_ERR_WRITE_MORE || is_unusable) continue;
      return bytes;
    }
    const std::int64_t id = has_stream ? next->first : -1;
    std::array<ngtcp2_vec, kPiecesMax> pieces{};
    const std::size_t count = has_stream ? next->second.peek(pieces) : 0;
    const bool with_end = has_stream && next->second.reaches_end(std::span(pieces).first(count));
    std::uint32_t flags = has_stream ? NGTCP2_WRITE_STREAM_FLAG_MORE : NGTCP2_WRITE_STREAM_FLAG_NONE;
    if (with_end) flags |= NGTCP2_WRITE_STREAM_FLAG_FIN;
    ngtcp2_ssize taken = -1;
    const ngtcp2_ssize bytes = ngtcp2_conn_writev_stream(quic, &path, &info, room.data(), room.size(), &taken, flags,
                                                         id, pieces.data(), count, time);
    if (has_stream && taken >= 0) {
      observer.on_stream_sent(id, static_cast<std::size_t>(taken));
      next->second.mark_sent(static_cast<std::size_t>(taken), with_end);
      datagrams_.on_stream_sent();
    }
    if (bytes == NGTCP2_ERR_WRITE_MORE) continue;
    if (has_stream && bytes == NGTCP2_ERR_STREAM_DATA_BLOCKED) {
      blocked.push_back(id);
      continue;
    }
    if (has_stream && (bytes == NGTCP2_ERR_STREAM_SHUT_WR || bytes == NGTCP2_ERR_STREAM_NOT_FOUND)) {
      // The peer has stopped reading; ngtcp2 has no other way to tell.
      next->second.reset();
      if (observer.on_stopped(id)) continue;
      return NGTCP2_ERR_CALLBACK_FAILURE;
    }
    return bytes;
  }
}

}  // namespace hairnet::quic
