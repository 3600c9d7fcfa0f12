#include "client/link/download_reader.hpp"

#include <utility>

#include "client/link/webtransport/quic_connection.hpp"
#include "core/assert.hpp"

namespace hairnet::link {

static_assert(DownloadReader::kPacketBytesMax <= QuicOptions::kOneWayWindowBytes);

bool DownloadReader::feed(StreamId download, std::span<const std::uint8_t> bytes, bool is_last) {
  channel::PacketSplitter& splitter = splitters_.try_emplace(download, kPacketBytesMax).first->second;
  const bool is_valid = splitter.feed(bytes, [&](std::span<const std::uint8_t> packet) {
    packets_.push_back({download, {packet.begin(), packet.end()}});
  });
  const bool is_whole = splitter.buffered_bytes() == 0;
  if (is_last) splitters_.erase(download);
  // A stream that ends within a packet was cut, or is not made of packets.
  return is_valid && (is_whole || !is_last);
}

std::size_t DownloadReader::drop(StreamId download) {
  const auto found = splitters_.find(download);
  if (found == splitters_.end()) return 0;
  // Bytes that are dropped here were never taken, so the caller gives them back to the connection's window. Otherwise
  // each broken download would shrink it.
  std::size_t bytes = found->second.buffered_bytes();
  splitters_.erase(found);
  std::erase_if(packets_, [&](const Packet& packet) {
    bytes += packet.download == download ? packet.bytes.size() : 0;
    return packet.download == download;
  });
  return bytes;
}

DownloadReader::Packet DownloadReader::take() {
  HAIRNET_ASSERT(!packets_.empty());
  Packet first = std::move(packets_.front());
  packets_.pop_front();
  return first;
}

}  // namespace hairnet::link
