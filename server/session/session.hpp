#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "schema/channel/bulk_scheduler.hpp"
#include "schema/channel/silence.hpp"
#include "schema/channel/token.hpp"
#include "server/exchange/command.hpp"
#include "server/exchange/groom_service.hpp"
#include "server/fleet/directory.hpp"
#include "server/session/connection.hpp"
#include "server/session/counts_by_name.hpp"
#include "server/session/downloads.hpp"
#include "server/session/outbox.hpp"
#include "server/session/peer_clock.hpp"
#include "server/session/props_of_rooms.hpp"
#include "server/session/revoked_tokens.hpp"
#include "server/session/room_rules.hpp"
#include "server/session/session_counters.hpp"
#include "server/session/session_directory.hpp"
#include "server/session/session_limits.hpp"

namespace hairnet::server {

// The wind of a room in a fleet, which moves with the room, and the session that has set it; 0: a client of the server
// that had the room before has set it.
struct KeptWind {
  Wind wind;
  SessionId session = 0;
};

// What all sessions share. The references and pointers must outlive all sessions. I/O thread, except that the tick
// thread writes `tick`.
struct SessionContext {
  SessionLimits limits;
  SessionCounters& counters;
  CommandQueue& commands;
  GroomService& grooms;
  // tick_rate_hz, groom_bytes_max and pose_delay_ns are what Welcome tells clients. app/server sets them from the
  // settings.
  std::uint32_t tick_rate_hz = 30;
  std::uint64_t groom_bytes_max = 0;
  // The newest tick that has begun.
  const std::atomic<std::uint64_t>& tick;
  std::int64_t pose_delay_ns = 0;
  // An empty room, with its mutes, lock and props, exists this long.
  std::int64_t room_grace_ns = 0;
  // Tokens are verified with this key; without it no token is needed.
  std::optional<channel::TokenKey> token_key = {};
  // The wall clock, in seconds since 1970, for the ends of tokens and of bans that move with a room.
  std::function<std::int64_t()> unix_time_s = [] { return std::int64_t{0}; };
  // The registry sets this to itself; null only in tests of a single session.
  SessionDirectory* directory = nullptr;
  // The directory of the fleet, which says which server owns which room. Null: this server has all rooms.
  Directory* fleet = nullptr;
  // The number of sessions that have joined a room and not left it, detached ones included.
  std::size_t session_count = 0;
  // The number of characters of all sessions.
  std::size_t character_count = 0;
  // Numbers of sessions and characters, by SessionIdentity's room, subject.name and subject.token_holder. Detached
  // sessions count, so that a client cannot evade a limit by losing its connection.
  CountsByName rooms = {}, subjects = {}, token_holders = {};
  RevokedTokens revoked_tokens = {};
  // True when the server has no memory for what needs more; such messages are then refused.
  std::function<bool()> is_memory_full = [] { return false; };
  // The bans, mutes and locks of rooms, which moderators set.
  RoomRules rules = {};
  // The number of sessions in the state awaiting_hello.
  std::size_t awaiting_hello_count = 0;
  // The rooms of a fleet that their last session has left since the last SessionRegistry::release_empty_rooms().
  std::set<std::string> rooms_left = {};
  // By room, in a fleet: the wind that a client has set.
  std::map<std::string, KeptWind> winds = {};
  // The props of rooms as clients have set them, for the first session of a room and for the next server of a room.
  PropsOfRooms props = {};
  // The rooms of a fleet whose rules, wind, props or members (of a locked room) have changed. RoomKeeper stores their
  // new state in the directory.
  std::set<std::string> rooms_changed = {};
  // The room that takes no new clients and characters, because this server has no time for more; empty: none.
  std::string overloaded_room = {};
};

// Texts that several files send to clients as `detail`.
inline constexpr const char* kMemoryFull = "the server has no memory left for this; try again later";
inline constexpr const char* kRoomOverloaded = "the room is full: its server has no time for more";
inline constexpr const char* kTokenRevoked = "the operator of the server has revoked the token; ask for a new one";

// One client's conversation: awaiting_hello -> active -> draining -> closed. When its connection breaks, an active
// session is detached until another session takes over its identity or the grace time ends. I/O thread; the tick thread
// meets only its outbox. It knows no socket: a test drives it with a fake Connection
// (tests/unit/server/session_test.cpp). Invariant: `joined_` holds exactly in the states active and detached, and only
// a joined session has characters.
class Session final : public PacketSink {
 public:
  enum class State : std::uint8_t { awaiting_hello, active, detached, draining, closed };

  Session(SessionId id, std::shared_ptr<Connection> connection, SessionContext& context, std::int64_t now_ns);

  // These functions implement PacketSink (server/session/connection.hpp): the connection calls them on the I/O thread.
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns) override;
  void on_datagram(std::span<const std::uint8_t> packet, std::int64_t now_ns) override;
  void on_broken_stream(std::int64_t now_ns) override;
  void on_writable(std::int64_t now_ns) override;
  void on_streams_writable(std::int64_t now_ns) override { flush(now_ns); }
  void on_download_stopped(DownloadStream stream, std::int64_t now_ns) override;
  void on_closed(std::string_view reason, std::int64_t now_ns) override;
  // Handles one decoded message. It takes the message's price first, so that a flood costs decoding only.
  void on_message(wire::Envelope envelope, std::int64_t now_ns);

  // Queues a message, and flushes. A detached or closed session ignores it: a resume sends states again.
  void send(const wire::Message& message, std::int64_t now_ns);
  // Sends as much of the outbox and of the downloads as the connection accepts.
  void flush(std::int64_t now_ns);
  // Ends a session that times out or consumes too slowly, gives up a stalled download, and sends a sign of life.
  void poll(std::int64_t now_ns);
  // Removes the characters, queues the goodbye, sends the queue and closes.
  void drain(wire::GoodbyeReason reason, std::string detail, std::int64_t now_ns);

  // Tries again to let a client in whose hello waits for the directory (waits_for_room).
  void retry_hello(std::int64_t now_ns);
  // Sends the client to the server that holds its room; an address without a host sends it back to the server that it
  // asked first. Ends the session.
  void send_away(const ServerAddress& to, std::int64_t now_ns);

  // Ends a session that nobody has resumed. Asserts that it is detached.
  void end_detached(std::int64_t now_ns);
  // The session ends because the server has no memory left, with a goodbye, unless it is ending already.
  void end_for_memory(std::int64_t now_ns);
  // Ends the session when its token has expired or is revoked. `unix_s`: seconds since 1970.
  void check_token(std::int64_t unix_s, std::int64_t now_ns);

  // The file that GroomService::fetch was asked for; null when it could not be read.
  void on_groom_read(const wire::GroomHash& groom, std::shared_ptr<const std::vector<std::uint8_t>> bytes,
                     std::int64_t now_ns);
  // Tells the tick whether the session may touch hair of others, where a mute or a new token has changed that.
  void update_touch_right();
  // The session may not use the groom any more: removes the characters that use it.
  void revoke_groom(const wire::GroomHash& groom);

  // Gives the identity to the session of a new connection. This session ends without leaving the room.
  SessionIdentity release_identity(std::int64_t now_ns);

  [[nodiscard]] SessionId id() const { return identity_.id; }
  [[nodiscard]] const SessionIdentity& identity() const { return identity_; }
  // True while the room knows the session: active or detached. CountsByName count such sessions.
  [[nodiscard]] bool is_joined() const { return joined_; }
  // True while its hello waits for the fleet's directory to decide about the room.
  [[nodiscard]] bool waits_for_room() const { return waiting_hello_.has_value(); }
  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] std::int64_t opened_ns() const { return opened_ns_; }
  [[nodiscard]] std::int64_t detached_since_ns() const { return detached_since_ns_; }
  [[nodiscard]] Outbox& outbox() { return *outbox_; }
  [[nodiscard]] const Outbox& outbox() const { return *outbox_; }

 private:
  // Defined in session_messages.cpp: what the session does with each message.
  struct MessageHandler;

  // Decodes one packet and handles its message; refuses a packet that cannot be decoded.
  void receive(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  void refuse_packet(const wire::DecodedPacket& decoded, std::int64_t now_ns);
  // Sends an Error, which names the character and the groom of the refused message.
  void refuse(const Refused& refused, std::int64_t now_ns, std::uint32_t character = 0,
              const wire::GroomHash& groom = {});
  void refuse_unexpected(std::string_view detail, std::int64_t now_ns);
  void check_invariants() const;
  void set_state(State state);
  // Takes the price from the bucket of messages. Returns false when it does not have as much: the session ends with
  // over_rate.
  bool take_message(std::int64_t now_ns, double price = 1);
  // Removes one of its characters, here and in the tick. Asserts that the character exists.
  void remove(std::uint32_t character);
  // Notes that the connection has accepted a packet: counts it, and the next sign of life waits from now on.
  void note_sent(const std::vector<std::uint8_t>& packet, std::int64_t now_ns);
  // Queues the next piece of a groom among the messages; false when there is none.
  bool send_download(std::int64_t now_ns);
  // Sends pieces of grooms on streams of their own, where the connection has such streams.
  void send_on_streams(std::int64_t now_ns);
  // The directory of a fleet stores the members of a locked room, so that they may return to the room at its next
  // server.
  void note_member_change();
  // Ends the wind that this session has set for its room, and any wind of an empty room.
  void forget_wind(bool is_room_empty);
  // Leaves the room, and releases its characters and grooms. Does nothing when the session has not joined.
  void leave(std::int64_t now_ns);
  void close(std::string_view reason, std::int64_t now_ns);

  SessionIdentity identity_;
  // Null while the session is detached.
  std::shared_ptr<Connection> connection_;
  SessionContext* context_;
  std::shared_ptr<Outbox> outbox_;
  State state_ = State::awaiting_hello;
  PeerClock clock_;
  Downloads downloads_;
  // Decides when a piece of a download may go between other packets, where the connection has no streams for downloads.
  channel::BulkScheduler download_scheduler_{Downloads::kPiece_bytes};
  // The connection was opened, and the last packet was sent, at these times.
  std::int64_t opened_ns_, sent_ns_;
  // Measures for how long nothing has come from the client.
  channel::Silence silence_;
  // The connection has accepted nothing since this time; 0: it accepts.
  std::int64_t full_since_ns_ = 0;
  // The times of the change to these two states.
  std::int64_t drain_since_ns_ = 0, detached_since_ns_ = 0;
  // No error about poses and hands is sent before this time. There is at most one in a second: a client with a wrong
  // clock would get thousands.
  std::int64_t pose_error_next_ns_;
  // The hello that waits for the directory of the fleet.
  std::optional<wire::Hello> waiting_hello_;
  // The room knows the session: the counts of room, subject and token holder include it.
  bool joined_ = false;
  // The client has promised to send something at least every channel::kSignOfLife_ns.
  bool gives_signs_of_life_ = false;
  // The client follows its room to another server, so the wind that it has set must not end here.
  bool goes_on_elsewhere_ = false;
  // The packet that is being read is a datagram. Its order among the other packets is unknown, so only poses and hands
  // may come in it.
  bool reads_datagram_ = false;
};

}  // namespace hairnet::server
