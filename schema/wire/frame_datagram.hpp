#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "schema/wire/messages.hpp"

// A FrameBatch in a datagram without an envelope around it, for clients that know this layout:
//
//   bytes 0-1    "FB". In a packet they would belong to its size, which would be 16970 or more; no datagram is so large
//   bytes 2-9    i64: sample_time_ns
//   bytes 10-14  40 bits with sign: clock_ns - sample_time_ns, the nearest that these can be (nine minutes)
//   varint       u64: tick
//   rest         of each frame its generation, u8, and the frame as in FrameBatch.frames; at least one
//
// Little endian. This is the only format on the wire without FlatBuffers, whose envelope would take an eighth of the
// bytes.
namespace hairnet::wire {

// The number of this layout, for Hello.datagram_layout.
inline constexpr std::uint8_t kFrameDatagramLayout = 1;

// The number of bytes before the first frame.
std::size_t frame_datagram_head_bytes(std::uint64_t tick);

// Asserts that the batch has a frame, and a generation for each. The result is empty when it would exceed
// kDatagramBytesMax.
std::vector<std::uint8_t> encode_frame_datagram(std::int64_t clock_ns, const FrameBatch& batch);

// Overwrites the clock of a datagram. wire::set_clock() does so for packets and for such datagrams.
void set_frame_datagram_clock(std::span<std::uint8_t> datagram, std::int64_t clock_ns);

// Whether bytes are of this layout; no packet is.
bool is_frame_datagram(std::span<const std::uint8_t> bytes);

// Decodes bytes of this layout. They are validated like a packet's, and copied out.
DecodedPacket decode_frame_datagram(std::span<const std::uint8_t> bytes);

}  // namespace hairnet::wire
