#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/fleet/lease_fence.hpp"
#include "server/fleet/server_status.hpp"

namespace hairnet::server {

// What the directory knows about a room: the answer of Directory::where().
struct Placement {
  enum class Kind : std::uint8_t {
    // This server owns the room, and its lease is valid.
    here,
    // Another server owns it: `server_id`, `address`.
    elsewhere,
    // No server owns it: the one that placement chooses may claim it.
    unowned,
    // A claim or a look-up is under way: ask again.
    pending,
    // The directory cannot answer; `reason` is one line.
    unavailable,
  };
  Kind kind = Kind::unavailable;
  std::uint64_t server_id = 0;
  ServerAddress address = {};
  // The number of the owner's claim, when it is known: the greater one is the newer owner.
  std::int64_t claim = 0;
  std::string reason = {};
};

// Something that the directory did by itself, or the end of a claim.
struct FleetEvent {
  enum class Kind : std::uint8_t {
    // This server owns the room now, with the number `claim`; after a lost lease it may do so again.
    room_claimed,
    // The claim has failed for `reason`; `owner` is another server, or 0.
    claim_failed,
    // This server owned the room and does not any more.
    room_lost,
    // The fence has closed and frames stop; the rooms may still come back.
    lease_paused,
    // The fence is open again, and no other server has had the rooms.
    lease_resumed,
    // This server has given the room up: a client that asks is sent to its next owner.
    room_handed_over,
    // Another server drains, and its rooms need `grooms`; the event may come again.
    grooms_passed_on,
  };
  Kind kind = Kind::room_claimed;
  // The room of a room's event; empty in the others.
  std::string room = {};
  std::int64_t claim = 0;
  std::uint64_t owner = 0;
  std::string reason = {};
  // The text that an earlier owner has stored with Directory::keep(); empty: none. Only room_claimed has it.
  std::string kept = {};
  // The grooms of grooms_passed_on, the most important ones first; empty in the other events.
  std::vector<ContentHash> grooms = {};
};

// Which server owns which room. I/O thread, except for fence(). Nothing blocks: answers come with later polls. The
// interface is all that sessions and the server know of a fleet, so that a server on its own runs the same code.
class Directory {
 public:
  virtual ~Directory() = default;

  [[nodiscard]] virtual Placement where(std::string_view room, std::int64_t now_ns) const = 0;
  // Whether this server owns the room and its lease is valid, so that frames of the room may be sent now.
  [[nodiscard]] virtual bool holds(std::string_view room, std::int64_t now_ns) const = 0;
  // The fence is open while this server may act as the owner of its rooms. Threads other than the I/O thread, which
  // know that a room belongs to this server, check only the fence before they send frames. Any thread.
  [[nodiscard]] const LeaseFence& fence() const { return fence_; }

  // Begins to claim the room for this server; the outcome is the event room_claimed or claim_failed. Returns false when
  // the claim is refused at once: a name that is not valid, a server that drains, too many rooms.
  virtual bool claim(std::string_view room, std::int64_t now_ns) = 0;
  // Gives a room of this server back to the directory, or gives up a claim that is under way. While the release is
  // under way, `where` answers `pending`.
  virtual void release(std::string_view room, std::int64_t now_ns) = 0;
  // Releases a room of this server in favour of the server with the id `to`. After the release, `where` answers with
  // that server for some seconds, unless another server claims the room. The event room_handed_over tells when these
  // answers begin.
  virtual void hand_over(std::string_view room, std::uint64_t to, std::int64_t now_ns) = 0;
  // Stores a text with a room of this server, in place of the text before; an empty one stores nothing. The room's next
  // owner gets it with room_claimed (FleetEvent::kept). Call it at most once a second for a room, and before its
  // release.
  virtual void keep(std::string_view room, std::string text, std::int64_t now_ns) = 0;
  // A client waits for a room whose owner has gone, or is about to go. The directory then replaces a watch that stays
  // silent sooner than usual, because a watch over a dead connection would never report the change.
  virtual void look_again(std::int64_t) {}
  // Sets the load that the directory publishes to the other servers.
  virtual void tell(const ServerLoad& load) = 0;
  // From now on this server claims no more rooms, and the directory tells the other servers so at once. The server
  // keeps the rooms that it has.
  virtual void drain(std::int64_t now_ns) = 0;
  // Sets the grooms that the next owners of this server's rooms will need, the most important ones first. The directory
  // publishes the first kPassedGroomsMax of them. Call it before drain().
  virtual void pass_on(std::vector<ContentHash>) {}
  // Gives all rooms back and leaves the fleet. The fence closes at once.
  virtual void stop(std::int64_t now_ns) = 0;
  // Nothing of this server is left in the directory.
  [[nodiscard]] virtual bool is_stopped() const = 0;

  // Rooms that the settings call big: each should have a server of its own.
  void set_big_rooms(std::set<std::string, std::less<>> rooms) { big_rooms_ = std::move(rooms); }
  [[nodiscard]] bool is_big(std::string_view room) const { return big_rooms_.contains(room); }

  virtual void poll(std::int64_t now_ns) = 0;
  // The events since the last call, in order.
  virtual std::vector<FleetEvent> take_events() = 0;
  // The directory calls it when there is an event, or when a room has another owner, so that the caller need not wait
  // for its next regular poll. May be empty.
  std::function<void()> on_news;

  [[nodiscard]] virtual std::uint64_t server_id() const = 0;
  // Whether the store of the directory, such as etcd, answers requests.
  [[nodiscard]] virtual bool is_reachable() const = 0;
  // Servers are sorted by id and include this one. Rooms are sorted by name: those of all servers, and those that this
  // one owns.
  [[nodiscard]] virtual std::vector<ServerStatus> servers() const = 0;
  [[nodiscard]] virtual std::vector<RoomOwner> rooms() const = 0;
  [[nodiscard]] virtual std::vector<std::string> own_rooms() const = 0;

 protected:
  // Implementations open and close the fence; see fence().
  LeaseFence fence_;

 private:
  std::set<std::string, std::less<>> big_rooms_;
};

}  // namespace hairnet::server
