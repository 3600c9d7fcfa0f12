#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/groom/groom_hash.hpp"
#include "core/groom/material_scale.hpp"
#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"
#include "core/solver/wind.hpp"
#include "core/touch/hand.hpp"
#include "core/touch/touch_rule.hpp"
#include "core/world/grab.hpp"
#include "schema/enums.hpp"
#include "schema/limits.hpp"
#include "schema/wire/message.hpp"

// The messages of a client to the server, as plain structs. The table of messages in PROTOCOL.md has what each means.
namespace hairnet::wire {

using hairnet::GroomHash;

// A secret of the session, known only to its client, that lets the client resume the session on a new connection.
using SessionSecret = std::array<std::uint8_t, 16>;

// A message that a client sends again over a new connection: the newest of the session, or of each character.
enum class Resent : std::uint8_t { per_session, per_character };

struct Hello {
  std::uint16_t protocol_version = kProtocolVersion;
  std::string client_name;
  // Empty means the lobby.
  std::string room = {};
  // Empty means none.
  std::string token = {};
  Role role = Role::participant;
  // The session to continue; zero means a new one.
  std::uint64_t session = 0;
  // The secret of that session, from its Welcome.
  SessionSecret secret{};
  // The number in union Body of the last message that the client knows: the server sends none beyond it.
  std::uint8_t message_max = std::variant_size_v<Message>;
  // How many redirects the client has followed since its last Welcome.
  std::uint8_t redirects = 0;
  // The newest layout of frame datagrams that the client knows (kFrameDatagramLayout); zero means that it wants packets
  // alone.
  std::uint8_t datagram_layout = 0;
  // A number that names the client in the logs of all servers that it goes to; zero means none.
  std::uint64_t trace = 0;
  // The client promises that the server hears something at least every kSilence_ms.
  bool signs_of_life = false;
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
// The finest lattice as its owner last had it, in the axes of the head: displacement = step * integer, velocity of the
// node in the world = 32 step/s * integer, 3 an active node.
inline constexpr float kVelocityStepsPer_s = 32;
struct HairState {
  float step_m = 0;
  // Both are of equal size; velocities may be empty: at rest.
  std::vector<std::int16_t> displacements, velocities;
};
// A colour of the sRGB space.
struct Srgb {
  std::uint8_t red = 0, green = 0, blue = 0;
  friend bool operator==(const Srgb&, const Srgb&) = default;
};
// How a character is drawn.
struct Appearance {
  Srgb hair_root, hair_tip, skin;
  // The value 255 means 1.
  std::uint8_t roughness = 0;
  friend bool operator==(const Appearance&, const Appearance&) = default;
};
struct AddCharacter {
  std::uint32_t character = 0;
  GroomHash groom{};
  // The finest level that the character may have.
  LevelIndex level = LevelIndex::high;
  // The state in which the hair starts; none means at rest.
  std::optional<HairState> state = {};
  // Any bytes, at most kTagBytesMax, for applications.
  std::string tag = {};
  // None means the receiver's default.
  std::optional<Appearance> appearance = {};
};
// Replaces tag and appearance of AddCharacter.
struct SetAppearance {
  static constexpr Resent kResent = Resent::per_character;
  std::uint32_t character = 0;
  std::string tag = {};
  std::optional<Appearance> appearance = {};
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
  // Rises by any amount with each newer pose of the character.
  std::uint32_t sequence = 0;
  // The client's monotonic clock, the one in its envelopes.
  std::int64_t capture_time_ns = 0;
  bool teleport = false;
  Pose pose;
};
// Whether sequence `a` is newer than `b`: they wrap.
[[nodiscard]] constexpr bool is_newer_sequence(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::int32_t>(a - b) > 0;
}
// A pose that was sent before, as it differs from the first one of its character in the batch (earlier_pose.hpp).
struct EarlierPose {
  struct Bone {
    std::array<std::int16_t, 3> turn{}, move{};
  };
  // By how much the capture time is earlier than that of the character's first pose in the batch, ns.
  std::uint32_t captured_before_ns = 0, character = 0;
  // By how much the sequence is less than that of the same first pose; at least 1.
  std::uint16_t sequence_before = 0;
  std::array<Bone, kBoneCount> bones{};
};
// All hands of a person. Those that are not in the newest sample are gone.
struct HandsSample {
  // Rises by any amount with each newer sample of the session.
  std::uint32_t sequence = 0;
  // The client's monotonic clock, the one in its envelopes.
  std::int64_t capture_time_ns = 0;
  // The hands, whose numbers are rounded as codec::rounded_to_wire does.
  std::vector<Hand> hands = {};
};
struct PoseBatch {
  std::vector<PoseSample> poses;
  // Poses are sent again since datagrams get lost. Those of each character are in order.
  std::vector<EarlierPose> earlier = {};
  std::optional<HandsSample> hands = {};
};
// Sets who may touch a character's hair. The owner always may, unless the audience is `nobody`.
struct SetTouch {
  static constexpr Resent kResent = Resent::per_character;
  std::uint32_t character = 0;
  TouchAudience audience = TouchAudience::oneself;
  // The owners of members, as MemberJoined names them; only in audience `chosen`.
  std::vector<std::uint64_t> chosen = {};
};
// A hand takes hold of the hair of a member; answered by Held.
struct TakeHold {
  std::uint32_t member = 0;
  // The number of one of the shapes of the session's hands.
  std::uint8_t hand = 0;
  // The place about which hair is taken, in own axes of that shape (append_bodies in core/touch/hand.hpp), m.
  Vec3f place = Vec3f::Zero();
  float radius_m = 0;
};
struct LetGo {
  std::uint32_t member = 0;
  std::uint8_t hand = 0;
  Release release = Release::drop;
};
// A shape in the room, over which hair falls.
struct Prop {
  std::uint8_t number = 0;
  TouchShape shape;
  // The transform from the prop's own axes to the world, rounded to float.
  RigidTransform place;
  // The prop appears at this place and has not moved there, so it sweeps no hair along.
  bool has_jumped = false;
};
// Adds, moves and removes props of the session's room; others stay.
struct SetProps {
  std::vector<Prop> props;
  std::vector<std::uint8_t> removed = {};
};
// The decoder does not check these values: the session validates them, as it does poses.
struct SetMaterial {
  static constexpr Resent kResent = Resent::per_character;
  std::uint32_t character = 0;
  MaterialScale scale;
};
// Sets the wind of the session's room. Whether a client sends it again depends on the wind that the room has by then.
struct SetWind {
  Wind wind;
};
// Chooses which other members a session receives frames of, and at which detail. It always receives its own characters.
struct Observe {
  static constexpr Resent kResent = Resent::per_session;
  ObserveMode mode = ObserveMode::all;
  // How many members the session gets in mode `nearest`.
  std::uint32_t count = 0;
  // How far members may be away in mode `radius`.
  float radius_m = 0;
  // Nearest and radius are measured from this place in the world; none means the nearest own head.
  std::optional<Vec3f> from;
  // The members that the session gets in mode `list`.
  std::vector<std::uint32_t> members;
  // The fewest ticks from one frame of a member to the next: 1, 2 or 4.
  std::uint32_t stride = 1;
  // The error of hair, about as an RMS, that is wanted where a head fills the screen. Where a head is smaller, the
  // error may be as much larger. 0 means the least error that there is.
  float error_m = 0.001f;
  // The most bytes of frames a second that the session wants; 0 means any number. The server sends coarser hair, then
  // frames at fewer ticks, until they fit or nothing is left to leave out.
  std::uint32_t bytes_per_s = 0;
};
// How large a client sees a member, and whether at all. It may send this at any time; members that it does not name
// keep their values.
struct MemberImportance {
  std::uint32_t member = 0;
  // The height of the head over the screen's.
  float screen_height = 0;
  bool in_view = true;
};
struct ReportImportance {
  std::vector<MemberImportance> members;
};
// Asks for a groom that the client lacks; answered by GroomData.
struct GroomRequest {
  GroomHash hash{};
  std::uint64_t offset = 0;
};
// The client has the file of GroomLearnt, so frames of such hair need no coefficients.
struct EvaluateLearnt {
  GroomHash groom{};
  GroomHash learnt{};
};
// What a moderator does in its room. `session` names the person or, if that is 0, `subject` does.
struct Moderate {
  ModerateAction action = ModerateAction::remove;
  // The owner of a member, as MemberJoined names it.
  std::uint64_t session = 0;
  // The person as the server's log names them, such as "sub:alice".
  std::string subject;
  // The duration of the ban after a removal; zero means none.
  std::uint32_t seconds = 0;
  // The reason, for people and the log.
  std::string reason = {};
};

// Both ends send it.
struct Goodbye {
  GoodbyeReason reason = GoodbyeReason::none;
  std::string detail;
};

using ClientMessage = std::variant<Hello, GroomOffer, GroomChunk, AddCharacter, SetLevel, RemoveCharacter, PoseBatch,
                                   SetMaterial, SetWind, SetAppearance, Observe, ReportImportance, GroomRequest,
                                   EvaluateLearnt, Moderate, SetTouch, TakeHold, LetGo, SetProps, Goodbye>;

// Empty when valid (ranges, finite numbers); else one line. The number of integers of a hair state is checked later,
// against the level.
std::string validate(const Observe& observe);
std::string validate(const HairState& state);
std::string validate(const TakeHold& hold);
std::string validate(const Prop& prop);
std::string validate_tag(std::string_view tag);

}  // namespace hairnet::wire
