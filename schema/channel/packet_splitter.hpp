#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "schema/limits.hpp"

namespace hairnet::channel {

// Cuts a byte stream into size-prefixed packets (u32 little endian, not counting itself). It does not look into the
// packets, which the decoder verifies. After a wrong size it cannot find the next packet, so the stream ends there. It
// does no I/O; one thread uses it.
class PacketSplitter {
 public:
  // The memory of a packet with more bytes than this is freed after it, while that of smaller ones is used again.
  static constexpr std::size_t kRetainedBytesMax = std::size_t{64} << 10;

  // Asserts that the limit is at least kPacketBytesMin.
  explicit PacketSplitter(std::size_t packet_bytes_max);
  // Raises the limit, from the next packet on. Asserts that it does not become lower. A callback of feed() may call it.
  void allow(std::size_t packet_bytes_max);
  // Calls `on_packet` with each complete packet: prefix included, 8-byte aligned, valid only during the call.
  // Asserts that the callback does not call the splitter. Returns false when a prefix is larger than the limit or
  // smaller than the smallest packet; from then on the stream is unusable. Memory grows with the bytes received, not
  // with the announced size, up to one packet.
  bool feed(std::span<const std::uint8_t> bytes, const std::function<void(std::span<const std::uint8_t>)>& on_packet);
  [[nodiscard]] std::size_t buffered_bytes() const { return filled_; }
  [[nodiscard]] std::size_t capacity_bytes() const { return buffer_.capacity() * sizeof(std::uint64_t); }

 private:
  // Moves bytes over until the buffer holds `until` of them; returns the rest.
  std::span<const std::uint8_t> take(std::span<const std::uint8_t> bytes, std::size_t until);
  [[nodiscard]] const std::uint8_t* data() const;
  // Ends the stream and frees the memory.
  void kill();
  void check_invariants() const;

  // The most bytes of a packet, prefix included.
  std::size_t packet_bytes_max_;
  // Words of 64 bits give the alignment that FlatBuffers need.
  std::vector<std::uint64_t> buffer_;
  // How many bytes of the current packet have come.
  std::size_t filled_ = 0;
  // Whether a wrong size has ended the stream, and whether feed() is running.
  bool dead_ = false, is_feeding_ = false;
};

}  // namespace hairnet::channel
