#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/groom/material_scale.hpp"
#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"
#include "core/result.hpp"
#include "core/solver/wind.hpp"
#include "schema/codec/frame_codec.hpp"

// What client and server say to each other, as plain structs. PROTOCOL.md states bytes, states, limits and reasons.
namespace hairnet::wire {

inline constexpr std::uint16_t kProtocolVersion = 3;
inline constexpr std::size_t kPacketBytesMax = 4u << 20;      // size prefix included
inline constexpr std::size_t kPacketBytesMin = 16;            // prefix, root, identifier, an empty table
inline constexpr std::size_t kPacketOverheadBytesMax = 4096;  // of any packet, beside poses, frames, geometry or chunk
inline constexpr std::size_t kGroomChunkBytesMax = 256u << 10;
inline constexpr std::size_t kPosesPerBatchMax = 4096;
inline constexpr std::size_t kMembersPerMessageMax = 4096;      // of Observe, ReportImportance, RequestKeyframes
inline constexpr std::size_t kHairStateIntegersMax = 3u << 18;  // of the largest lattice
inline constexpr std::size_t kRoomNameBytesMax = 64;
inline constexpr std::size_t kTokenBytesMax = 4096;
inline constexpr std::uint32_t kStrideMax = 4;  // 1, 2 or 4 ticks
inline constexpr float kObserveRadiusMax_m = 20'000;
inline constexpr float kHairStateStepMax_m = 1e-3f;
inline constexpr float kScreenHeightMax = 100;                      // a head's height over the screen's
inline constexpr std::size_t kTextBytesMax = 1024;                  // any string
inline constexpr double kPositionMax_m = 10'000;                    // any coordinate of a pose, absolute
inline constexpr std::int64_t kTimeMax_ns = std::int64_t{1} << 61;  // any time, absolute: sums cannot overflow
inline constexpr std::uint32_t kTickRateMax_hz = 1000;
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
  pose_invalid,
  material_invalid,
  wind_invalid,
  not_allowed,
  token_invalid,
  room_invalid,
  observe_invalid,
  state_invalid,
  groom_unavailable
};
inline constexpr ErrorReason kErrorReasonLast = ErrorReason::groom_unavailable;
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
  over_rate,
  token_refused,
  room_refused,
  session_taken_over
};
inline constexpr GoodbyeReason kGoodbyeReasonLast = GoodbyeReason::session_taken_over;

// A secret of the session, known only to its client, that lets the client resume the session on a new connection.
using SessionSecret = std::array<std::uint8_t, 16>;

// A message that a client sends again over a new connection: the newest of the session, or of each character.
enum class Resent : std::uint8_t { per_session, per_character };

enum class Role : std::uint8_t { participant, observer };  // an observer has no characters of its own

// Client to server.
struct Hello {
  std::uint16_t protocol_version = kProtocolVersion;
  std::string client_name;
  std::string room = {};   // empty: the lobby
  std::string token = {};  // empty: none
  Role role = Role::participant;
  std::uint64_t session = 0;  // to be continued; 0: a new one
  SessionSecret secret{};     // of that session
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
// A lattice as its owner last had it: displacement = step * integer, velocity = 32 step/s * integer, 3 an active node.
struct HairState {
  LevelIndex level = LevelIndex::high;
  float step_m = 0;
  std::vector<std::int16_t> displacements, velocities;  // as many; velocities may be empty: at rest
};
struct AddCharacter {
  std::uint32_t character = 0;
  GroomHash groom{};
  LevelIndex level = LevelIndex::high;  // the finest that it is given
  std::optional<HairState> state = {};  // what it goes on from; none: its design
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
// The decoder does not check these values: the session validates them, as it does poses.
struct SetMaterial {
  static constexpr Resent kResent = Resent::per_character;
  std::uint32_t character = 0;
  MaterialScale scale;
};
struct SetWind {  // of the session's room
  static constexpr Resent kResent = Resent::per_session;
  Wind wind;
};
// Which other members a session receives frames of, and at which detail. It always receives its own characters.
enum class ObserveMode : std::uint8_t { all, nearest, radius, list };
struct Observe {
  static constexpr Resent kResent = Resent::per_session;
  ObserveMode mode = ObserveMode::all;
  std::uint32_t count = 0;             // nearest: so many
  float radius_m = 0;                  // radius: heads within it
  std::optional<Vec3f> from;           // what nearest and radius are measured from, world; none: its own nearest head
  std::vector<std::uint32_t> members;  // list
  codec::ErrorClass error_class = codec::ErrorClass::half_mm;
  std::uint32_t stride = 1;  // ticks between frames, at least: 1, 2, 4
  bool velocities = false;   // of nodes, beside their displacements
};
// How large and whether a client sees members. It may send this at any time; members it does not name keep their
// values.
struct MemberImportance {
  std::uint32_t member = 0;
  float screen_height = 0;  // of the head, over the screen's
  bool in_view = true;
};
struct ReportImportance {
  std::vector<MemberImportance> members;
};
struct RequestKeyframes {
  std::vector<std::uint32_t> members;  // the next frame of these refers to none before; empty: of all
};
struct GroomRequest {  // another's groom, which the client lacks; answered by GroomData
  GroomHash hash{};
  std::uint64_t offset = 0;
};

// Server to client.
struct Welcome {
  std::uint16_t protocol_version = kProtocolVersion;
  std::uint64_t session = 0;
  std::uint32_t tick_rate_hz = 30;
  std::uint64_t tick = 0;
  std::uint32_t character_count_max = 0;
  std::uint64_t groom_bytes_max = 0;
  std::string room = {};
  SessionSecret secret{};
  bool resumed = false;            // the session that Hello named goes on, with its characters and grooms
  float resume_grace_s = 0;        // how long a session outlives its connection
  std::int64_t pose_delay_ns = 0;  // a tick samples poses this far before its own time
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
struct GroomData {  // the groom's bytes from `offset` on; pieces come in order
  GroomHash hash{};
  std::uint64_t byte_count = 0;  // of the whole
  std::uint64_t offset = 0;
  std::vector<std::uint8_t> bytes;
};
struct CharacterAdded {  // to its owner
  std::uint32_t character = 0;
  GroomHash groom{};
  LevelIndex level = LevelIndex::rigid;
  std::uint32_t member = 0;  // its number in frames
};
struct MemberJoined {  // to all others in the room
  std::uint32_t member = 0;
  std::uint64_t session = 0;    // the owner's
  std::uint32_t character = 0;  // the owner's number for it
  GroomHash groom{};
};
struct MemberLeft {
  std::uint32_t member = 0;
};
struct CharacterRemoved {
  std::uint32_t character = 0;
};
struct LevelRecord {
  GroomHash groom{};
  LevelIndex level = LevelIndex::high;
  LevelGeometry geometry;
};
// An encoded frame. `content` comes from codec::encode_frame. It is predicted from the last `order` frames of the
// member that were sent to this session, `stride` ticks apart.
struct Frame {
  std::uint32_t member = 0;
  LevelIndex level = LevelIndex::rigid;
  codec::ErrorClass error_class = codec::ErrorClass::half_mm;
  bool discontinuous = false;    // teleport, reset or level switch: do not interpolate from the last frame
  bool asleep = false;           // nothing will change, and no frame come, before the character wakes
  bool velocities = false;       // the content has them
  std::uint8_t order = 0;        // 0 to 3
  std::uint8_t stride = 1;       // 1, 2 or 4; of no meaning at order 0
  std::uint8_t step_stride = 1;  // ticks from one step of the character to the next
  std::span<const std::uint8_t> content;
};
struct FrameBatch {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;  // server clock: when the poses were sampled (tick time - pose delay)
  std::vector<Frame> frames;        // members ascend
  std::shared_ptr<const std::vector<std::uint8_t>> storage = {};  // what the contents of a decoded batch lie in
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

using Message = std::variant<Hello, GroomOffer, GroomChunk, AddCharacter, SetLevel, RemoveCharacter, PoseBatch, Welcome,
                             GroomNeed, GroomStatus, CharacterAdded, CharacterRemoved, LevelRecord, FrameBatch, Error,
                             Goodbye, SetMaterial, SetWind, Observe, ReportImportance, RequestKeyframes, GroomRequest,
                             GroomData, MemberJoined, MemberLeft>;

// What a client sends, in the order of Message.
using ClientMessage =
    std::variant<Hello, GroomOffer, GroomChunk, AddCharacter, SetLevel, RemoveCharacter, PoseBatch, Goodbye,
                 SetMaterial, SetWind, Observe, ReportImportance, RequestKeyframes, GroomRequest>;

// The unit on every transport: a message and its sender's monotonic clock.
struct Envelope {
  std::int64_t clock_ns = 0;
  Message message;
};

enum class DecodeError : std::uint8_t { none, too_large, malformed, invalid };
const char* to_string(DecodeError error);
const char* to_string(ErrorReason reason);
const char* to_string(GoodbyeReason reason);

// One size-prefixed packet, ready to send. The message must keep to the limits of PROTOCOL.md. Strings are made valid:
// forbidden characters become '?' and long strings are cut. Empty when the packet would exceed kPacketBytesMax.
std::vector<std::uint8_t> encode_packet(const Envelope& envelope);

// Overwrites the clock of a packet made by encode_packet, for packets that waited in a queue.
void set_clock(std::span<std::uint8_t> packet, std::int64_t clock_ns);

// Bytes that a frame takes in a batch, at most. Batches whose frames sum to at most kPacketBytesMax -
// kPacketOverheadBytesMax can be sent.
std::size_t frame_bytes(const Frame& frame);

// `packet` is exactly one packet, size prefix included. It is verified, validated (ranges, counts, finite numbers, unit
// rotations, consistent geometry) and copied out. Values of poses, materials and winds are not checked here, so that
// one bad value does not refuse the whole packet: see validate_pose and validate.
struct DecodedPacket {
  DecodeError error = DecodeError::none;
  std::string detail;
  Envelope envelope;
};
DecodedPacket decode_packet(std::span<const std::uint8_t> packet);

// Empty when sound (ranges, finite numbers); else one line. A hair state's count is its level's to judge.
std::string validate(const Observe& observe);
std::string validate(const HairState& state);
// A room's name: 1 to kRoomNameBytesMax bytes of letters, digits and . _ - of ASCII, or empty for the lobby.
bool is_room_name(std::string_view name);

// Why a pose is refused.
enum class PoseRefusal : std::uint8_t { none, not_finite, not_unit, too_far };
PoseRefusal validate_pose(const Pose& pose);
const char* to_string(PoseRefusal refusal);

}  // namespace hairnet::wire
