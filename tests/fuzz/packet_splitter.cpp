#include <algorithm>
#include <vector>

#include "schema/channel/packet_splitter.hpp"
#include "tests/fuzz/target.hpp"

// For any pieces of a stream, the packets are the same, and memory stays within one packet. The first byte sets the
// length of the pieces.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  if (size == 0) return 0;
  // The limit is far below that of the protocol, so that short inputs reach it.
  constexpr std::size_t kPacketBytesMax = 4096;
  const std::span<const std::uint8_t> stream(data + 1, size - 1);
  const auto split = [&](std::size_t piece_bytes, std::vector<std::uint8_t>& packets) {
    channel::PacketSplitter splitter(kPacketBytesMax);
    for (std::size_t at = 0; at < stream.size(); at += piece_bytes) {
      const bool alive = splitter.feed(stream.subspan(at, std::min(piece_bytes, stream.size() - at)), [&](auto packet) {
        fuzz::require(packet.size() <= kPacketBytesMax && packet.size() >= wire::kPacketBytesMin, "its length");
        fuzz::require(reinterpret_cast<std::uintptr_t>(packet.data()) % 8 == 0, "aligned");
        packets.insert(packets.end(), packet.begin(), packet.end());
      });
      fuzz::require(splitter.capacity_bytes() <= 2 * kPacketBytesMax, "memory of one packet");
      if (!alive) return false;
    }
    return true;
  };
  std::vector<std::uint8_t> whole, pieces;
  const bool whole_alive = split(std::max<std::size_t>(stream.size(), 1), whole);
  const bool pieces_alive = split(1 + data[0] % 64, pieces);
  fuzz::require(whole_alive == pieces_alive && whole == pieces, "the same packets however they arrive");
  return 0;
}
