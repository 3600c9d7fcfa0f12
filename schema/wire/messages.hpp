#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/build/level.hpp"
#include "core/pose/pose.hpp"
#include "core/result.hpp"

// What client and server say to each other, as plain structs. PROTOCOL.md states bytes, states, limits and reasons.
namespace hairnet::wire {

inline constexpr std::uint16_t kProtocolVersion = 1;
inline constexpr std::size_t kPacketBytesMax = 4u << 20;      // size prefix included
inline constexpr std::size_t kPacketBytesMin = 16;            // prefix, root, identifier, an empty table
inline constexpr std::size_t kPacketOverheadBytesMax = 4096;  // of any packet, beside poses, frames, geometry or chunk
inline constexpr std::size_t kGroomChunkBytesMax = 256u << 10;
inline constexpr std::size_t kPosesPerBatchMax = 4096;
inline constexpr std::size_t kTextBytesMax = 1024;                  // any string
inline constexpr double kPositionMax_m = 10'000;                    // any coordinate of a pose, absolute
inline constexpr std::int64_t kTimeMax_ns = std::int64_t{1} << 61;  // any time, absolute: sums cannot overflow
inline constexpr std::uint32_t kTickRateMax_hz = 1000;
inline constexpr float kQuantumMin_m = 1e-4f;
inline constexpr float kQuantumMax_m = kQuantumMin_m * 8192;
inline constexpr std::size_t kNodeBytes = 3 * sizeof(std::int16_t);
inline constexpr std::uint32_t kLatticeNodesPerAxisMax = 64;
inline constexpr float kLatticeCoordinateMax_m = 100;  // origin and spacing, absolute

using GroomHash = std::array<std::uint8_t, 32>;  // BLAKE2b-256 of the groom's file bytes

enum class ErrorReason : std::uint8_t {
  none,
  malformed,
  version_unsupported,
  unexpected_message,
  limit_exceeded,
  groom_unknown,
  groom_invalid,
  groom_hash_mismatch,
  groom_build_queue_full,
  character_unknown,
  character_exists,
  level_invalid,
  pose_invalid
};
enum class GoodbyeReason : std::uint8_t {
  none,
  client_leaves,
  server_draining,
  protocol_error,
  version_unsupported,
  handshake_timeout,
  idle_timeout,
  slow_consumer,
  server_full,
  over_rate
};

// Client to server.
struct Hello {
  std::uint16_t protocol_version = kProtocolVersion;
  std::string client_name;
};
struct GroomOffer {
  GroomHash hash{};
  std::uint64_t byte_count = 0;
};
struct GroomChunk {
  GroomHash hash{};
  std::uint64_t offset = 0;
  std::vector<std::uint8_t> bytes;
};
struct AddCharacter {
  std::uint32_t character = 0;
  GroomHash groom{};
  LevelIndex level = LevelIndex::high;
};
struct SetLevel {
  std::uint32_t character = 0;
  LevelIndex level = LevelIndex::high;
};
struct RemoveCharacter {
  std::uint32_t character = 0;
};
struct PoseSample {
  std::uint32_t character = 0;
  std::uint32_t sequence = 0;        // rises by any amount with each newer pose of the character
  std::int64_t capture_time_ns = 0;  // the client's monotonic clock, the one in its envelopes
  bool teleport = false;
  Pose pose;
};
struct PoseBatch {
  std::vector<PoseSample> poses;
};

// Server to client.
struct Welcome {
  std::uint16_t protocol_version = kProtocolVersion;
  std::uint64_t session = 0;
  std::uint32_t tick_rate_hz = 30;
  std::uint64_t tick = 0;
  std::uint32_t character_count_max = 0;
  std::uint64_t groom_bytes_max = 0;
};
struct GroomNeed {
  GroomHash hash{};
  std::uint64_t offset = 0;
};  // send from here on; offset = byte_count: all there
enum class GroomState : std::uint8_t { queued, building, ready, refused };
struct GroomStatus {
  GroomHash hash{};
  GroomState state = GroomState::queued;
};
struct CharacterAdded {
  std::uint32_t character = 0;
  GroomHash groom{};
  LevelIndex level = LevelIndex::rigid;
};
struct CharacterRemoved {
  std::uint32_t character = 0;
};
struct LevelRecord {
  GroomHash groom{};
  LevelIndex level = LevelIndex::high;
  LevelGeometry geometry;
};
struct Frame {
  std::uint32_t character = 0;
  LevelIndex level = LevelIndex::rigid;
  bool discontinuous = false;               // teleport, reset or level switch: do not interpolate from the last frame
  bool asleep = false;                      // nothing will change, and no frame come, before the character wakes
  Pose pose;                                // the one the step used
  float quantum_m = 0;                      // displacement = quantum * integer; error at most quantum / 2 a coordinate
  std::vector<std::int16_t> displacements;  // 3 an active node, head space; empty = rigid or asleep
};
struct FrameBatch {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;  // server clock: when the poses were sampled (tick time - pose delay)
  std::vector<Frame> frames;
};
struct Error {
  ErrorReason reason = ErrorReason::none;
  std::uint32_t character = 0;  // 0 = none
  GroomHash groom{};            // zero = none
  std::string detail;
};

// Either way.
struct Goodbye {
  GoodbyeReason reason = GoodbyeReason::none;
  std::string detail;
};

using Message =
    std::variant<Hello, GroomOffer, GroomChunk, AddCharacter, SetLevel, RemoveCharacter, PoseBatch, Welcome, GroomNeed,
                 GroomStatus, CharacterAdded, CharacterRemoved, LevelRecord, FrameBatch, Error, Goodbye>;

// The unit on every transport: a message and its sender's monotonic clock.
struct Envelope {
  std::int64_t clock_ns = 0;
  Message message;
};

enum class DecodeError : std::uint8_t { none, too_large, malformed, invalid };
const char* to_string(DecodeError error);
const char* to_string(ErrorReason reason);
const char* to_string(GoodbyeReason reason);

// One size-prefixed packet, ready to send. The message must keep to the limits of PROTOCOL.md; text is made to (what
// may not travel becomes '?', what is too long is cut). Empty when the packet would exceed kPacketBytesMax.
std::vector<std::uint8_t> encode_packet(const Envelope& envelope);

// Bytes that a frame takes in a batch. Batches whose frames sum to at most kPacketBytesMax - kPacketOverheadBytesMax
// can be sent.
std::size_t frame_bytes(const Frame& frame);

// `packet` is exactly one packet, size prefix included. Verified, validated (ranges, counts, finite numbers, unit
// rotations, consistent geometry), then copied out. Pose values are not refused here: their validity is a matter of
// one pose, see validate_pose.
struct Decoded {
  DecodeError error = DecodeError::none;
  std::string detail;
  Envelope envelope;
};
Decoded decode_packet(std::span<const std::uint8_t> packet);

// Why a pose is refused.
enum class PoseRefusal : std::uint8_t { none, not_finite, not_unit, too_far };
PoseRefusal validate_pose(const Pose& pose);
const char* to_string(PoseRefusal refusal);

// Quantises to the smallest quantum of 0.1 mm * 2^n that holds every displacement; fills `quantum_m` and
// `displacements`. A coordinate d comes back within quantum / 2 + 2^-23 |d| (the latter is float rounding).
// Displacements must be finite; beyond 32767 * kQuantumMax_m (26 km) they are cut off.
void encode_displacements(std::span<const Vec3f> displacement, Frame& frame);
void decode_displacements(const Frame& frame, std::vector<Vec3f>& displacement);

}  // namespace hairnet::wire
