#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "client/link/conversation.hpp"
#include "client/room/arrivals.hpp"
#include "client/room/groom_queue.hpp"
#include "client/room/member.hpp"
#include "client/room/room_touch.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/result.hpp"
#include "core/world/grab.hpp"

namespace hairnet::room {

enum class State : std::uint8_t { connecting, connected, reconnecting, closed };

// What a room reports to its caller, in order.
struct StateChanged {
  State state = State::connecting;
  // One line with the reason; empty when connected.
  std::string detail;
  // The wait before the next attempt to connect, s; 0 in the other states.
  double wait_s = 0;
  // The room is closed, and the same request would be refused again.
  bool is_refused = false;
};
// `number` is the number that the member had at the time of the event. An own character leaves and joins with another
// number when its room moves to another server.
struct Joined {
  std::uint32_t number = 0;
  std::shared_ptr<const Member> member;
};
struct Left {
  std::uint32_t number = 0;
  std::shared_ptr<const Member> member;
};
// The owner has changed its tag or its appearance.
struct Changed {
  std::uint32_t number = 0;
  std::shared_ptr<const Member> member;
};
struct WindChanged {
  Wind wind;
  // The session that has set the wind (wire::RoomWind).
  std::uint64_t session = 0;
};
// A hand of this client holds this many points of the member's hair. The event answers take_hold(), and comes with 0
// points when the hand no longer holds any.
struct HeldChanged {
  std::uint32_t member = 0;
  std::uint8_t hand = 0;
  std::uint32_t point_count = 0;
};
struct PropsChanged {};
// Another audience may touch the hair of the member of that number.
struct TouchChanged {
  std::uint32_t number = 0;
};
// The server refused something, or a hairstyle cannot be shown.
struct Error {
  // One line for people.
  std::string detail;
  // None means that the server refused a groom; another Error then has the reason.
  wire::ErrorReason reason = wire::ErrorReason::none;
  // The own character that the error is about; zero: none.
  std::uint32_t character = 0;
  // The groom that the error is about; zero: none.
  wire::GroomHash groom{};
};
using Event =
    std::variant<StateChanged, Joined, Left, Changed, WindChanged, HeldChanged, PropsChanged, TouchChanged, Error>;
// One line for people.
std::string describe(const Event& event);

// How an own character is added.
struct CharacterOptions {
  // The finest level that the character may have.
  LevelIndex level = LevelIndex::high;
  // Any bytes, at most wire::kTagBytesMax; by convention the person's name.
  std::string tag;
  std::optional<wire::Appearance> appearance;
};
// The bones of an own character now, world.
struct OwnPose {
  std::uint32_t own = 0;
  Pose pose;
  // The pose does not continue the one before: the hair does not swing after the jump.
  bool teleport = false;
};

// Receives frames as they are taken, for traces and statistics. It must not call the room.
class FrameObserver {
 public:
  virtual ~FrameObserver() = default;
  // Times are of the conversation's clock.
  virtual void on_batch(const link::FrameBatch& batch, std::int64_t sampled_ns, std::int64_t now_ns) = 0;
  // `member`: whose frame it is.
  virtual void on_frame(const link::FrameBatch& batch, const link::Frame& frame, const Member& member) = 0;
};

// All members of a room, played out smoothly: fetches the grooms of others by itself, and keeps own characters over
// lost connections and changes of the server. It has no sockets, clock or thread; make all calls from one thread.
class Room {
 public:
  // `observe`: which others it shows, and at which detail. Asserts that there is a conversation.
  explicit Room(std::unique_ptr<link::Conversation> conversation, const wire::Observe& observe = {});

  // Takes what has arrived, and moves every member to this moment of the conversation's clock.
  void advance();
  // The events since the last call. A caller that never takes them loses the oldest of more than 10 000.
  [[nodiscard]] std::vector<Event> take_events();
  // All members by their number, as they were at the last advance().
  [[nodiscard]] const std::map<std::uint32_t, std::shared_ptr<const Member>>& members() const { return shown_; }
  // The member of an own character; null: the server has not added it yet.
  [[nodiscard]] std::shared_ptr<const Member> member_of(std::uint32_t own) const;
  // Returns zero if there is no such character.
  [[nodiscard]] wire::GroomHash groom_of(std::uint32_t own) const;
  [[nodiscard]] State state() const { return state_; }
  // Returns this client's session; zero before the first welcome.
  [[nodiscard]] std::uint64_t session() const { return session_; }
  // The room's wind; still air before it is known.
  [[nodiscard]] const Wind& wind() const { return wind_; }
  [[nodiscard]] bool may_set_wind() const { return may_set_wind_; }
  // The room's own shapes, by number.
  [[nodiscard]] const std::map<std::uint8_t, wire::Prop>& props() const { return touch_.props(); }
  // The server let this client set them when it joined.
  [[nodiscard]] bool may_set_props() const { return may_set_props_; }
  // Returns the hands of other people near members, at the sample time of the shown hair. Each person that has any is
  // there once.
  [[nodiscard]] const std::vector<wire::RoomHands::Person>& hands() const { return touch_.hands(); }
  // Whether this client's hands may touch its hair, as far as the client knows.
  [[nodiscard]] bool may_touch(const Member& member) const;
  [[nodiscard]] link::LinkCounters counters() const { return conversation_->counters(); }
  // How many inputs push() and the other calls refused since the start.
  [[nodiscard]] std::uint64_t inputs_dropped() const { return inputs_dropped_; }

  // Adds an own character with the hair of a groom file, and returns its number, from 1. It is visible after its first
  // pose. The error is one line about the file or an option. `decoded`: what the file has; null: it is decoded.
  Result<std::uint32_t> add_character(link::RequestedState::Bytes groom_file, CharacterOptions options = {},
                                      std::shared_ptr<const Groom> decoded = nullptr);
  // The same for a groom in memory, which must pass validate(). `learnt`: hair that was learnt of it; null: none.
  Result<std::uint32_t> add_character(const std::shared_ptr<const Groom>& groom, CharacterOptions options = {},
                                      const LearntHair* learnt = nullptr);
  // The same with a groom that is already in the room.
  Result<std::uint32_t> add_character_like(const Member& member, CharacterOptions options = {});
  // The next seven do nothing for a number that is not there. An error is one line, and changes nothing.
  void remove_character(std::uint32_t own);
  void set_level(std::uint32_t own, LevelIndex level);
  Result<void> set_material(std::uint32_t own, const MaterialScale& scale);
  // Replaces both; its hair continues. Others learn of it at most four times a second.
  Result<void> set_appearance(std::uint32_t own, std::string tag, std::optional<wire::Appearance> appearance);
  // The bones of own characters now; best 60 to 90 times a second, all in one call. The error names the first pose that
  // is not valid; the others are sent.
  Result<void> push(std::span<const OwnPose> poses);
  Result<void> push(std::uint32_t own, const Pose& pose, bool teleport = false);
  // Sets who may touch the hair of an own character; at first only its owner may. `chosen` are the sessions of
  // TouchAudience::chosen, at most kTouchChosenMax (64). A reconnect that gives this client another session empties the
  // list, which a TouchChanged tells.
  Result<void> set_touch(std::uint32_t own, TouchAudience audience, std::vector<std::uint64_t> chosen = {});
  // All hands of this person now, best together with the poses; an empty list: the hands are gone. They also count as
  // gone half a second after the last call.
  Result<void> push_hands(std::span<const Hand> hands);
  // Takes hold of the hair of a member within `radius_m` (at most kGrabRadiusMax_m) of `place`. `hand` is the number of
  // a shape of a hand, and `place` is in the shape's own axes (append_bodies), m. HeldChanged answers. The hold lasts
  // until let_go(), and ends when the hair is pulled out, the shape is gone or the connection is lost. take_hold(),
  // let_go() and set_props() are refused while the room is not connected.
  Result<void> take_hold(std::uint32_t member, std::uint8_t hand, const Vec3f& place, float radius_m);
  // Does nothing for a member that is not there.
  Result<void> let_go(std::uint32_t member, std::uint8_t hand, Release release);
  // Adds, moves and removes props of the room; PropsChanged follows, or an Error.
  Result<void> set_props(std::vector<wire::Prop> props, std::vector<std::uint8_t> removed = {});
  // Sets the whole room's wind, until another client sets one or this one leaves.
  Result<void> set_wind(const Wind& wind);
  // Removes or mutes a person, or locks the room, if this client's token says `moderate`; otherwise an Error follows.
  void moderate(const wire::Moderate& action) { conversation_->send(action); }

  // How large members are on this screen, for the server's choice of detail and the order of downloads. Heights that
  // are not finite are dropped and counted; others are clamped to what a message may say.
  void report_importance(std::vector<wire::MemberImportance> members);
  // The groom of this member is requested before all others; none: the largest heads come first. `only_this`: no other
  // groom is requested.
  void fetch_first(std::optional<std::uint32_t> member, bool only_this = false);
  // `observer` must outlive the room; null: no observer.
  void set_frame_observer(FrameObserver* observer) { observer_ = observer; }
  // Says goodbye, and removes all members. The room stays empty afterwards.
  void close();

 private:
  // An own character, as this client wants it.
  struct Own {
    wire::GroomHash groom{};
    std::string tag;
    std::optional<wire::Appearance> appearance;
    TouchAudience touch = TouchAudience::oneself;
    std::vector<std::uint64_t> touch_chosen;
    // The number of poses that were pushed.
    std::uint32_t sequence = 0;
    // Null until the server has added the character for the first time. Then the object stays, even while the character
    // is not in the room.
    std::shared_ptr<Member> member;
    // The pose that was pushed last.
    std::optional<Pose> pose;
    // The character is in the room, so `member` is in members_.
    bool is_here = false;
  };
  // A groom that someone in the room has, or the reason why it cannot be shown.
  struct KnownGroom {
    // Null when the groom is not here.
    std::shared_ptr<const Groom> groom;
    // The bytes of the groom's file; null when they are not here.
    link::RequestedState::Bytes file;
    // One line that says why the groom cannot be shown; empty without an error.
    std::string error;
    // The server could not send the groom yet: the download is requested again at this time.
    std::optional<std::int64_t> ask_again_ns;
  };

  void take(const link::Connected& connected);
  void take(const link::Reconnecting& lost);
  void take(const link::Disconnected& end);
  void take(const wire::MemberJoined& joined);
  void take(const wire::MemberChanged& changed);
  void take(const wire::MemberLeft& left) { drop(left.member); }
  void take(const wire::CharacterAdded& added);
  void take(const wire::CharacterRemoved& removed);
  void take(const wire::RoomWind& wind);
  void take(const wire::RoomProps& announced);
  void take(const wire::MemberTouch& announced);
  void take(const wire::Held& held);
  void take(const wire::RoomHands& announced);
  void take(const wire::GroomStatus& status);
  void take(const link::GroomFetched& fetched);
  void take(const link::FrameBatch& batch);
  void take(const wire::Error& error);
  // Requests an own character whose groom is known, and returns its number.
  std::uint32_t add(const wire::GroomHash& groom, CharacterOptions&& options);
  // Drops all props and touch rules, which the server announces again after a welcome.
  void forget_touch();
  void set_touch(Member& member, TouchAudience audience, std::vector<std::uint64_t> chosen);
  // The member enters the room.
  void meet(const std::shared_ptr<Member>& member);
  // The member of that number leaves the room; nothing happens without such a member.
  void drop(std::uint32_t number);
  [[nodiscard]] bool is_used(const wire::GroomHash& groom) const;
  // Drops the groom when no member and no own character has it.
  void forget_unused(const wire::GroomHash& groom);
  // Passes the groom, or its error, to all members that have it.
  void give_groom(const wire::GroomHash& hash);
  // Requests the next groom where one is due.
  void fetch(std::int64_t now_ns);
  // Plays out the member's hair for this time.
  void sample(Member& member, std::int64_t now_ns);
  void play_hands(std::int64_t now_ns);
  // Queues an event for the caller.
  void tell(Event event);
  void set_state(State state, std::string detail, double wait_s = 0, bool is_refused = false);
  // Counts a refused input, and returns its error.
  Refusal dropped(std::string error);

  std::unique_ptr<link::Conversation> conversation_;
  // The room shows characters of other clients. Without them, their grooms are not fetched.
  bool observes_others_;
  State state_ = State::connecting;
  std::uint64_t session_ = 0;
  Wind wind_;
  bool may_set_wind_ = true, may_touch_ = true, may_set_props_ = false;
  // The props of the room, and the hands of others.
  RoomTouch touch_;
  std::map<std::uint32_t, std::shared_ptr<Member>> members_;
  // The same members as members_, for readers that must not change them.
  std::map<std::uint32_t, std::shared_ptr<const Member>> shown_;
  std::map<std::uint32_t, Own> own_;
  // The number of the next own character.
  std::uint32_t next_own_ = 1;
  // The grooms that members or own characters use.
  std::map<wire::GroomHash, KnownGroom> grooms_;
  GroomQueue queue_;
  // The arguments of the last fetch_first().
  std::optional<std::uint32_t> first_;
  bool fetches_only_first_ = false;
  Arrivals arrivals_;
  FrameObserver* observer_ = nullptr;
  std::deque<Event> events_;
  std::uint64_t inputs_dropped_ = 0;
};

}  // namespace hairnet::room
