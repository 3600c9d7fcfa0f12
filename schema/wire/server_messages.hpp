#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "schema/wire/client_messages.hpp"

// What the server says to a client, as plain structs. PROTOCOL.md says what each means.
namespace hairnet::wire {

struct ServerAt {    // where clients reach a server
  std::string host;  // a name, or an address without brackets
  std::uint16_t port = 0;
  friend bool operator==(const ServerAt&, const ServerAt&) = default;
};
struct Welcome {
  std::uint16_t protocol_version = kProtocolVersion;
  std::uint64_t session = 0;
  std::uint32_t tick_rate_hz = 30;
  std::uint64_t tick = 0;
  std::uint32_t character_count_max = 0;
  std::uint64_t groom_bytes_max = 0;
  std::string room = {};
  SessionSecret secret{};
  bool resumed = false;               // the session that Hello named goes on, with its characters and grooms
  float resume_grace_s = 0;           // how long a session outlives its connection
  std::int64_t pose_delay_ns = 0;     // a tick samples poses this far before its own time
  bool may_set_wind = true;           // the session; a moderator may forbid it later
  std::vector<ServerAt> others = {};  // of the fleet, to ask when this one does not answer any more
  bool signs_of_life = false;         // the client hears something of it in less than kSilence_ms, all the time
};
struct GroomNeed {
  GroomHash hash{};
  std::uint64_t offset = 0;  // send from here on; byte_count of the offer: all there
};
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
  std::uint32_t member = 0;     // its number in frames
  std::uint8_t generation = 0;  // counts the characters that have had this member number
};
struct MemberJoined {  // to all others in the room
  std::uint32_t member = 0;
  std::uint64_t session = 0;    // the owner's
  std::uint32_t character = 0;  // the owner's number for it
  GroomHash groom{};
  std::string tag = {};                       // the owner's, as in AddCharacter
  std::optional<Appearance> appearance = {};  // the owner's; none: the receiver's default
  std::uint8_t generation = 0;                // counts the characters that have had this member number
};
struct MemberChanged {  // its tag, its appearance or both; to all others in the room
  std::uint32_t member = 0;
  std::string tag = {};
  std::optional<Appearance> appearance = {};
};
struct RoomWind {  // the wind in which the room's hair moves, when a session joins and when it changes
  static constexpr std::uint64_t kOfEarlierServer =
      ~std::uint64_t{0};  // a session of the room's server before this one
  Wind wind;
  std::uint64_t session = 0;  // who has set it; 0: the server's setting
};
struct MemberLeft {
  std::uint32_t member = 0;
};
struct CharacterRemoved {
  std::uint32_t character = 0;
};
struct GroomBasis {  // comes before the groom's first frame with coefficients
  GroomHash groom{};
  GroomHash basis{};  // of the file, which GroomRequest asks for
};
struct GroomLearnt {  // the client may evaluate the groom's hair itself while it is on the learnt level
  GroomHash groom{};
  GroomHash learnt{};  // of the file, which GroomRequest asks for
};
// An encoded frame. `content` is a prefix of what codec::encode_frame gives: a pose, and coefficients of the groom's
// basis. It refers to no other frame.
struct Frame {
  std::uint32_t member = 0;
  LevelIndex level = LevelIndex::rigid;  // that the server steps; rigid: no coefficients, hair is at rest
  bool discontinuous = false;            // teleport or reset: do not interpolate from the last frame
  bool asleep = false;                   // nothing will change, and no frame come, before the character wakes
  bool evaluated = false;                // only a pose: the client evaluates the learnt hair (EvaluateLearnt)
  std::uint8_t step_stride = 1;          // ticks from one step of the character to the next
  std::span<const std::uint8_t> content;
};
struct FrameBatch {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;  // server clock: when the poses were sampled (tick time - pose delay)
  std::vector<Frame> frames;        // members ascend
  std::shared_ptr<const std::vector<std::uint8_t>> storage = {};  // what the contents of a decoded batch lie in
  // Of the member of each frame, in a packet that may overtake its MemberJoined or CharacterAdded; else empty.
  std::vector<std::uint8_t> generations = {};
};
struct Redirect {                   // to the server that holds the room: the client connects there, with a new session
  std::optional<ServerAt> to = {};  // none: nobody holds it for the moment; ask again where you asked first
};
struct Error {
  ErrorReason reason = ErrorReason::none;
  std::uint32_t character = 0;  // 0 = none
  GroomHash groom{};            // zero = none
  std::string detail;
};

using ServerMessage =
    std::variant<Welcome, GroomNeed, GroomStatus, GroomData, CharacterAdded, CharacterRemoved, MemberJoined,
                 MemberChanged, MemberLeft, RoomWind, GroomBasis, GroomLearnt, FrameBatch, Redirect, Error, Goodbye>;

}  // namespace hairnet::wire
