#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "schema/quic/socket_address.hpp"

namespace hairnet::quic {

// Packets of one path that follow each other in memory, each of `segment_bytes`, but the last one, which may be
// shorter. The system can take them in one call (UDP_SEGMENT).
struct Burst {
  Path path;
  std::span<const std::uint8_t> bytes;
  std::size_t segment_bytes = 0;
  std::uint8_t ecn = 0;
};

// Gathers the packets of a wake-up, and hands them over when it is full or told to. A system call costs more than most
// packets, so packets of all connections leave together. One thread.
class Outgoing {
 public:
  // No packet is longer: an Ethernet frame carries 1500 bytes.
  static constexpr std::size_t kPacketBytesMax = 1500;
  // UDP_SEGMENT takes no more.
  static constexpr std::size_t kBurstPacketsMax = 64;
  // A burst goes through the system as one IP packet until it is cut, and an IP packet has fewer than 65 536 bytes.
  static constexpr std::size_t kBurstBytesMax = 65'000;

  using Writer = std::function<void(std::span<const Burst>)>;

  explicit Outgoing(Writer writer);
  // Memory for a packet of at most kPacketBytesMax.
  std::span<std::uint8_t> room();
  // The packet is written at the begin of room().
  void add(const Path& path, std::size_t bytes, std::uint8_t ecn);
  // Hands all bursts to the writer, which must be done with their memory when it returns.
  void flush();

 private:
  // The memory holds the packets of one wake-up; a fuller one is handed over in several parts.
  static constexpr std::size_t kBytes = std::size_t{256} << 10;

  Writer writer_;
  std::unique_ptr<std::uint8_t[]> memory_;
  // The bytes of memory_ that have packets, and the packets as bursts.
  std::size_t filled_ = 0;
  std::vector<Burst> bursts_;
};

}  // namespace hairnet::quic
