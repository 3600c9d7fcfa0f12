#include "schema/quic/send_queues.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::quic {
namespace {

// The most pieces of a stream that one call offers to ngtcp2. What does not fit the packet is offered again.
constexpr std::size_t kPiecesMax = 16;

}  // namespace

SendBuffer& SendQueues::add_bulk_stream(std::int64_t id) {
  HAIRNET_ASSERT(!streams_.contains(id));
  bulk_.push_back(id);
  return streams_[id];
}

SendBuffer* SendQueues::find(std::int64_t id) {
  const auto found = streams_.find(id);
  return found == streams_.end() ? nullptr : &found->second;
}

const SendBuffer* SendQueues::find(std::int64_t id) const {
  const auto found = streams_.find(id);
  return found == streams_.end() ? nullptr : &found->second;
}

void SendQueues::erase(std::int64_t id) {
  streams_.erase(id);
  std::erase(bulk_, id);
}

void SendQueues::clear() {
  streams_.clear();
  bulk_.clear();
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

std::size_t SendQueues::bulk_kept_bytes() const {
  std::size_t bytes = 0;
  for (const std::int64_t id : bulk_) bytes += streams_.at(id).kept_bytes();
  return bytes;
}

bool SendQueues::is_bulk(std::int64_t id) const {
  return std::ranges::find(bulk_, id) != bulk_.end();
}

bool SendQueues::is_idle() const {
  return datagrams_.empty() && std::ranges::none_of(streams_, [](const auto& entry) {
           return entry.second.has_unsent() || entry.second.kept_bytes() > 0;
         });
}

std::int64_t SendQueues::next_stream(std::span<const std::int64_t> blocked) const {
  const auto is_ready = [&](std::int64_t id) {
    return streams_.at(id).has_unsent() && std::ranges::count(blocked, id) == 0;
  };
  const auto first =
      std::ranges::find_if(streams_, [&](const auto& entry) { return !is_bulk(entry.first) && is_ready(entry.first); });
  const bool has_first = first != streams_.end();
  // Messages go before bulk, but only so many in a row, so that a download still gets through beside frames.
  if (has_first && in_a_row_ < kInARowMax) return first->first;
  const auto bulk = std::ranges::find_if(bulk_, is_ready);
  if (bulk != bulk_.end()) return *bulk;
  return has_first ? first->first : -1;
}

void SendQueues::on_stream_sent(std::int64_t id) {
  datagrams_.on_stream_sent();
  const auto bulk = std::ranges::find(bulk_, id);
  in_a_row_ = bulk == bulk_.end() ? in_a_row_ + 1 : 0;
  // The bulk stream that has sent goes to the end: downloads share the line in turn.
  if (bulk != bulk_.end()) std::rotate(bulk, bulk + 1, bulk_.end());
}

ngtcp2_ssize SendQueues::write(ngtcp2_conn* quic, ngtcp2_path& path, ngtcp2_pkt_info& info,
                               std::span<std::uint8_t> room, std::int64_t now_ns, SendObserver& observer) {
  const auto time = static_cast<ngtcp2_tstamp>(now_ns);
  // The streams that have no flow-control credit of their own, and must not hold the other streams back.
  std::vector<std::int64_t> blocked;
  while (true) {
    // Without flow-control credit of the connection no stream can send, and ngtcp2 would wait. Datagrams need no
    // credit.
    const std::int64_t id = ngtcp2_conn_get_max_data_left(quic) > 0 ? next_stream(blocked) : -1;
    SendBuffer* const next = find(id);
    const bool has_stream = next != nullptr;
    // The peer's parameters, which say whether it takes datagrams, are certain only after the handshake.
    if (datagrams_.is_next(has_stream) && ngtcp2_conn_get_handshake_completed(quic)) {
      std::vector<std::uint8_t>& first = datagrams_.front();
      // No piece may be empty.
      std::array<ngtcp2_vec, 2> pieces{};
      std::size_t count = 0;
      for (std::vector<std::uint8_t>* piece : {&datagram_prefix_, &first})
        if (!piece->empty()) pieces[count++] = {piece->data(), piece->size()};
      int is_taken = 0;
      const ngtcp2_ssize bytes =
          ngtcp2_conn_writev_datagram(quic, &path, &info, room.data(), room.size(), &is_taken,
                                      NGTCP2_WRITE_DATAGRAM_FLAG_MORE, 0, pieces.data(), count, time);
      // The peer takes no datagrams, or none of this size. Such a datagram would block all others forever, so it is
      // dropped.
      const bool is_unusable = bytes == NGTCP2_ERR_INVALID_ARGUMENT || bytes == NGTCP2_ERR_INVALID_STATE;
      if (is_taken || is_unusable) {
        observer.on_datagram_sent(datagrams_.pop().size(), is_taken != 0);
      }
      if (bytes == NGTCP2_ERR_WRITE_MORE || is_unusable) continue;
      return bytes;
    }
    std::array<ngtcp2_vec, kPiecesMax> pieces{};
    const std::size_t count = has_stream ? next->peek(pieces) : 0;
    const bool with_end = has_stream && next->reaches_end(std::span(pieces).first(count));
    // MORE leaves the packet open while it has room, so that several pieces and datagrams share one. Without a stream
    // the call writes what QUIC itself has to say, such as acknowledgements.
    std::uint32_t flags = has_stream ? NGTCP2_WRITE_STREAM_FLAG_MORE : NGTCP2_WRITE_STREAM_FLAG_NONE;
    if (with_end) flags |= NGTCP2_WRITE_STREAM_FLAG_FIN;
    ngtcp2_ssize taken = -1;
    const ngtcp2_ssize bytes = ngtcp2_conn_writev_stream(quic, &path, &info, room.data(), room.size(), &taken, flags,
                                                         id, pieces.data(), count, time);
    if (has_stream && taken >= 0) {
      observer.on_stream_sent(id, static_cast<std::size_t>(taken));
      next->mark_sent(static_cast<std::size_t>(taken), with_end);
      on_stream_sent(id);
    }
    if (bytes == NGTCP2_ERR_WRITE_MORE) continue;
    if (has_stream && bytes == NGTCP2_ERR_STREAM_DATA_BLOCKED) {
      blocked.push_back(id);
      continue;
    }
    if (has_stream && (bytes == NGTCP2_ERR_STREAM_SHUT_WR || bytes == NGTCP2_ERR_STREAM_NOT_FOUND)) {
      // The peer has stopped reading; ngtcp2 has no other way to tell.
      next->reset();
      if (observer.on_stopped(id)) continue;
      return NGTCP2_ERR_CALLBACK_FAILURE;
    }
    return bytes;
  }
}

}  // namespace hairnet::quic
