#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "schema/wire/client_messages.hpp"
#include "schema/wire/server_messages.hpp"

// All messages, and packets of them. PROTOCOL.md states bytes, states, limits and reasons.
namespace hairnet::wire {

// The unit on every transport: a message and its sender's monotonic clock.
struct Envelope {
  std::int64_t clock_ns = 0;
  Message message;
};

enum class DecodeError : std::uint8_t { none, too_large, malformed, invalid };
const char* to_string(DecodeError error);

// One size-prefixed packet, ready to send. The message must keep to the limits of PROTOCOL.md. Strings are made valid:
// forbidden characters become '?' and long strings are cut. Empty when the packet would exceed kPacketBytesMax.
std::vector<std::uint8_t> encode_packet(const Envelope& envelope);
// Does the same for a client. A program that calls this has no code for what servers say.
std::vector<std::uint8_t> encode_client_packet(std::int64_t clock_ns, const ClientMessage& message);
// Makes the packet of a RoomHands as encode_packet does. Asserts that each person's bytes are at most kHandsBytesMax.
std::vector<std::uint8_t> encode_room_hands(std::int64_t clock_ns, const EncodedRoomHands& hands);

// Overwrites the clock of what encode_packet or encode_frame_datagram has made, for packets that waited in a queue.
void set_clock(std::span<std::uint8_t> packet, std::int64_t clock_ns);

// The most bytes that a frame takes in a batch. Batches whose frames sum to at most kPacketBytesMax -
// kPacketOverheadBytesMax can be sent.
std::size_t frame_bytes(const Frame& frame);

struct DecodedPacket {
  DecodeError error = DecodeError::none;
  std::string detail;
  Envelope envelope;
};
// `packet` is exactly one packet, size prefix included. It is verified, validated (ranges, counts, finite numbers,
// consistent geometry) and copied out. Values of poses, materials and winds are not checked here, so that one bad value
// does not refuse the whole packet: see validate_pose and validate.
DecodedPacket decode_packet(std::span<const std::uint8_t> packet);
// Does the same for a client, and refuses what only clients say.
DecodedPacket decode_server_packet(std::span<const std::uint8_t> packet);

// Why a pose is refused.
enum class PoseRefusal : std::uint8_t { none, not_finite, not_unit, too_far };
PoseRefusal validate_pose(const Pose& pose);
const char* to_string(PoseRefusal refusal);

}  // namespace hairnet::wire
