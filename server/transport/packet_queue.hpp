#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/assert.hpp"

namespace hairnet::server {

// Packets that wait to be sent in one write, in order. The queue itself has no bound: senders ask whether the
// connection is writable first, and may then add one packet more.
struct PacketQueue {
  // A connection with this many bytes queued is not writable. A larger queue would only delay a slow peer's frames.
  static constexpr std::size_t kBytesMax = std::size_t{64} << 10;

  std::vector<std::vector<std::uint8_t>> packets;
  std::size_t bytes = 0;

  [[nodiscard]] bool empty() const { return packets.empty(); }
  void push(std::vector<std::uint8_t> packet) {
    HAIRNET_ASSERT(!packet.empty());
    bytes += packet.size();
    packets.push_back(std::move(packet));
  }
  void clear() {
    packets.clear();
    bytes = 0;
  }
};

}  // namespace hairnet::server
