#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <vector>

#include "client/link/webtransport/http3_session.hpp"
#include "schema/channel/packet_splitter.hpp"
#include "schema/limits.hpp"

namespace hairnet::link {

// Cuts the downloads of a session into packets, which wait here until they are taken. The streams' windows bound the
// bytes. No I/O.
class DownloadReader {
 public:
  // A download has packets of at most one chunk. So a packet fits the window of its stream.
  static constexpr std::size_t kPacketBytesMax = wire::kGroomChunkBytesMax + wire::kPacketOverheadBytesMax;

  struct Packet {
    StreamId download = -1;
    std::vector<std::uint8_t> bytes;
  };

  // Takes bytes of a download; `is_last` marks the end of its stream. False means that a size is out of bounds, or that
  // the stream ends within a packet: the server breaks the protocol.
  [[nodiscard]] bool feed(StreamId download, std::span<const std::uint8_t> bytes, bool is_last);
  // Forgets what has come of a download of which the server sends no more. Returns how many bytes that was.
  std::size_t drop(StreamId download);
  [[nodiscard]] const std::deque<Packet>& packets() const { return packets_; }
  // Returns the first packet. Asserts that there is one.
  Packet take();

 private:
  std::map<StreamId, channel::PacketSplitter> splitters_;
  std::deque<Packet> packets_;
};

}  // namespace hairnet::link
