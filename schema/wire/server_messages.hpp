#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "schema/wire/client_messages.hpp"

// The messages of the server to a client, as plain structs. The table of messages in PROTOCOL.md has what each means.
namespace hairnet::wire {

// Where clients reach a server.
struct ServerAt {
  // A name, or an address without brackets.
  std::string host;
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
  // Whether the session that Hello named goes on, with its characters and grooms.
  bool resumed = false;
  // A session outlives its connection by this time.
  float resume_grace_s = 0;
  // A tick samples poses this far before its own time.
  std::int64_t pose_delay_ns = 0;
  // The session may set the wind; a moderator may forbid it later.
  bool may_set_wind = true;
  // Other servers of the fleet, which the client asks when this one does not answer any more.
  std::vector<ServerAt> others = {};
  // Promises that the client hears something from the server at least every kSilence_ms.
  bool signs_of_life = false;
  // The session may touch the hair of others who allow it, and set the room's props; a moderator may forbid it later.
  bool may_touch = true;
  bool may_set_props = false;
};
struct GroomNeed {
  GroomHash hash{};
  // The client sends from here on; byte_count of the offer means that all are there.
  std::uint64_t offset = 0;
};
struct GroomStatus {
  GroomHash hash{};
  GroomState state = GroomState::queued;
};
// The groom's bytes from `offset` on; pieces come in order.
struct GroomData {
  GroomHash hash{};
  // The size of the whole groom.
  std::uint64_t byte_count = 0;
  std::uint64_t offset = 0;
  std::vector<std::uint8_t> bytes;
};
// Answers AddCharacter. The server sends it to the owner.
struct CharacterAdded {
  std::uint32_t character = 0;
  GroomHash groom{};
  LevelIndex level = LevelIndex::rigid;
  // The number by which frames name the character.
  std::uint32_t member = 0;
  // How many characters have had this member number so far, modulo 256.
  std::uint8_t generation = 0;
};
// A character has joined the room. The server sends it to all others in the room.
struct MemberJoined {
  std::uint32_t member = 0;
  // The owner's session.
  std::uint64_t session = 0;
  // The owner's number for the character.
  std::uint32_t character = 0;
  GroomHash groom{};
  // The tag that the owner gave in AddCharacter or SetAppearance.
  std::string tag = {};
  // The appearance that the owner gave; none means the receiver's default.
  std::optional<Appearance> appearance = {};
  // How many characters have had this member number so far, modulo 256.
  std::uint8_t generation = 0;
};
// The tag or the appearance of a member, or both, have changed. The server sends it to all others in the room.
struct MemberChanged {
  std::uint32_t member = 0;
  std::string tag = {};
  std::optional<Appearance> appearance = {};
};
// The wind in which the room's hair moves. It comes when a session joins, and when the wind changes.
struct RoomWind {
  // A session of the room's server before this one has set the wind.
  static constexpr std::uint64_t kOfEarlierServer = ~std::uint64_t{0};
  Wind wind;
  // The session that has set the wind; zero means the server's setting.
  std::uint64_t session = 0;
};
// The room's props: all of them when a session joins, and later those that change.
struct RoomProps {
  std::vector<Prop> props;
  std::vector<std::uint8_t> removed = {};
  // Whether the message has all props of the room: any other prop does not exist.
  bool all = false;
};
// Who may touch a member's hair. It comes after the member's MemberJoined or CharacterAdded, unless the audience is the
// default, and when the rule changes.
struct MemberTouch {
  std::uint32_t member = 0;
  TouchAudience audience = TouchAudience::oneself;
  // The chosen sessions, in audience `chosen`.
  std::vector<std::uint64_t> chosen = {};
};
// How many points of a member's hair a hand of the session holds. It answers TakeHold. It also comes with 0 when a hold
// ends otherwise than by LetGo.
struct Held {
  std::uint32_t member = 0;
  std::uint8_t hand = 0;
  std::uint32_t point_count = 0;
};
// The hands of others that are near the members whose frames the session gets.
struct RoomHands {
  struct Person {
    std::uint64_t session = 0;
    // None means that the person's hands are gone.
    std::vector<Hand> hands;
  };
  std::uint64_t tick = 0;
  // The time at which the hands were sampled, as in FrameBatch.
  std::int64_t sample_time_ns = 0;
  std::vector<Person> people;
};
// A RoomHands that is encoded once for all sessions that get it: each person's hands are bytes of codec::encode_hands.
struct EncodedRoomHands {
  struct Person {
    std::uint64_t session = 0;
    // The bytes belong to the caller.
    std::span<const std::uint8_t> bytes;
  };
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;
  std::vector<Person> people;
};
struct MemberLeft {
  std::uint32_t member = 0;
};
struct CharacterRemoved {
  std::uint32_t character = 0;
};
// The basis of a groom's coefficients. It comes before the groom's first frame with coefficients.
struct GroomBasis {
  GroomHash groom{};
  // The hash of the file, which GroomRequest asks for.
  GroomHash basis{};
};
// The client may evaluate the groom's hair itself while it is on the learnt level.
struct GroomLearnt {
  GroomHash groom{};
  // The hash of the file, which GroomRequest asks for.
  GroomHash learnt{};
};
// An encoded frame. `content` is a prefix of what codec::encode_frame gives: a pose, and coefficients of the groom's
// basis. It refers to no other frame.
struct Frame {
  std::uint32_t member = 0;
  // The level that the server steps; rigid means no coefficients: hair is at rest.
  LevelIndex level = LevelIndex::rigid;
  // A teleport or a reset: do not interpolate from the last frame.
  bool discontinuous = false;
  // Nothing will change, and no frame come, before the character wakes.
  bool asleep = false;
  // The frame has only a pose, and the client evaluates the learnt hair (EvaluateLearnt).
  bool evaluated = false;
  // The ticks from one step of the character to the next.
  std::uint8_t step_stride = 1;
  // The encoded bytes. The batch's storage, or the sender, owns them.
  std::span<const std::uint8_t> content;
};
struct FrameBatch {
  std::uint64_t tick = 0;
  // The time at which the tick sampled its poses, by the server's clock: the tick's time less Welcome::pose_delay_ns.
  std::int64_t sample_time_ns = 0;
  // The frames, whose members ascend.
  std::vector<Frame> frames;
  // The memory in which the contents of a decoded batch lie.
  std::shared_ptr<const std::vector<std::uint8_t>> storage = {};
  // The generation of each frame's member, in a packet that may overtake the member's MemberJoined or CharacterAdded;
  // else empty.
  std::vector<std::uint8_t> generations = {};
};
// Names the server that holds the room. The client connects there, with a new session.
struct Redirect {
  // None means that no server holds the room for the moment; the client asks again where it asked first.
  std::optional<ServerAt> to = {};
};
struct Error {
  ErrorReason reason = ErrorReason::none;
  // The character that the error concerns; zero means none.
  std::uint32_t character = 0;
  // The groom that the error concerns; zero means none.
  GroomHash groom{};
  std::string detail;
};

using ServerMessage = std::variant<Welcome, GroomNeed, GroomStatus, GroomData, CharacterAdded, CharacterRemoved,
                                   MemberJoined, MemberChanged, MemberLeft, RoomWind, GroomBasis, GroomLearnt,
                                   RoomProps, MemberTouch, Held, RoomHands, FrameBatch, Redirect, Error, Goodbye>;

}  // namespace hairnet::wire
