#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/link/backoff.hpp"
#include "client/link/event_queue.hpp"
#include "client/link/events.hpp"
#include "client/link/file_catalog.hpp"
#include "client/link/groom_fetch.hpp"
#include "client/link/importance_reporter.hpp"
#include "client/link/last_known_hair.hpp"
#include "client/link/members.hpp"
#include "client/link/requested_state.hpp"
#include "client/link/requested_wind.hpp"
#include "client/link/send_queue.hpp"
#include "client/link/sent_poses.hpp"
#include "client/link/upload_queue.hpp"
#include "schema/channel/bulk_scheduler.hpp"
#include "schema/channel/clock_estimate.hpp"
#include "schema/channel/packet_splitter.hpp"
#include "schema/channel/silence.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Who connects, and when the link gives up.
struct LinkCoreOptions {
  std::string client_name = "hairnet-link";
  // Empty means the lobby, and no token.
  std::string room, token;
  wire::Role role = wire::Role::participant;
  // The longest time from an attempt to the server's welcome, s. A Link with TransportChoice::automatic adds the 3 s of
  // kWebTransportWait, which an attempt at WebTransport may take first.
  double connect_timeout_s = 5;
  // Whether the core connects again when a connection breaks after the first welcome. Before the first welcome, only a
  // redirect is a reason to try again.
  bool reconnect = true;
  // Trying to reconnect ends this many seconds after the connection broke; zero means never.
  double give_up_after_s = 0;
  // The logs of all servers that the client meets name this number. It also seeds the waits between attempts, which
  // must differ between clients that lose their server together. Zero means that a Link draws a number.
  std::uint64_t trace = 0;
  // The fraction of members whose frames are decoded; frames of other members are only counted. Load tests with
  // thousands of clients lower it.
  double decode_share = 1;
  // Learnt hair is computed from poses alone: networks are downloaded, and frames of it are smaller.
  bool evaluate_learnt = true;
  // Bases and learnt hair are downloaded only for grooms that have arrived: hair that cannot be drawn needs none.
  bool files_wait_for_grooms = false;
  // Cores of one thread share it; null means that the core makes its own.
  std::shared_ptr<FileCatalog> catalog = {};
};

// What has happened since the start.
struct LinkCounters {
  std::uint64_t bytes_sent = 0, bytes_received = 0;
  // The bytes of whole packets that contain frames.
  std::uint64_t frame_bytes_received = 0;
  // Frames that were dropped because the caller did not poll in time.
  std::uint64_t frames_dropped = 0;
  // Poses that were dropped because the connection was too slow, or because there was no session.
  std::uint64_t poses_dropped = 0;
  std::uint64_t frames_received = 0;
  // Frames whose bytes are wrong.
  std::uint64_t frames_undecodable = 0;
  // Frames of a member that is not known (yet), and frames that are not newer than the member's last one.
  std::uint64_t frames_unknown = 0;
  // Frames without coefficients whose hair this client has evaluated.
  std::uint64_t frames_evaluated = 0;
  // Frames without coefficients that came while the learnt hair was not here.
  std::uint64_t frames_lacking_learnt = 0;
  // Welcomes after the first one.
  std::uint64_t reconnects = 0;
  // Reconnects to a server that still had the session.
  std::uint64_t resumes = 0;
  // Connections that were given up because nothing came for channel::kSilence_ns, 10 s.
  std::uint64_t servers_silent = 0;
  // Redirects that were followed, to the server that holds the room.
  std::uint64_t redirects = 0;
  // How often a further redirect came after kRedirectsMax (4) redirects in a row, so that the client asked the first
  // server again.
  std::uint64_t redirect_loops = 0;
  GroomFetch::Progress downloads;
};

// A frame as received, before any copy.
struct ReceivedFrame {
  std::uint64_t tick = 0;
  // The time at which the poses of the frame were sampled, on the server's clock.
  std::int64_t sample_time_ns = 0;
  const wire::Frame& frame;
  const Members::DecodedFrame& decoded;
};

// Receives frames directly instead of as events, for programs that drive many cores. on_bytes() and on_packet() call
// it; it must not call the core.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void on_frame(const ReceivedFrame& frame) = 0;
};

// A client's whole conversation with a server, without socket, clock and thread: bytes and times in, packets and events
// out. Its owner calls it as follows, from one thread, with times of one monotonic clock that never go back:
//
//   start()                     once; then after whatever happens:
//   poll(now)                   time-outs; due again at next_deadline_ns() at the latest
//   wants_connection()          open one: on_opening(), then on_open() or on_closed()
//   take_packet(now)            while it gives packets and the connection takes them: send them
//   wants_half_close()          when all taken is sent: send the end, read on
//   wants_close()               close at once: on_closed()
//
// What arrives goes into on_bytes() (a stream) or on_packet() (a message each), the end into on_closed().
//
// A server that does not hold the room redirects the client to the server that does: the core asks for a connection to
// that server, and goes on there with a new session and the hair as it was. When that server does not answer, the core
// asks the first server again. Before its first welcome it does so for half a minute (kRoomPatience_ns), because the
// lease of a server that has died must end before another server holds its room.
//
// When the connection breaks, the core asks for a new one after a wait, then sends the caller's requests again. The
// caller may call it in every state: requests are stored and sent after the reconnect, but poses and hands are dropped.
class LinkCore {
 public:
  explicit LinkCore(LinkCoreOptions options);
  LinkCore(const LinkCore&) = delete;
  LinkCore& operator=(const LinkCore&) = delete;

  // The caller's side.

  // Lets the core want its first connection. Further calls do nothing.
  void start();
  // `bytes` is the groom's file and `hash` its hash; stored while they may be sent again. Asserts that `bytes` is not
  // null.
  void offer_groom(const wire::GroomHash& hash, RequestedState::Bytes bytes);
  // Sends a request. Poses, importance and grooms have calls of their own. Requests that must outlive the connection
  // are also stored: characters, levels, and the newest of every message that has a kResent. A tag that is too long is
  // refused at once, with an Error event.
  void send(wire::ClientMessage message);
  // Queues poses of own characters. Without a session they are dropped, but the newest one of each character is stored:
  // a new server gets it after its welcome.
  void push_poses(std::vector<wire::PoseSample> poses);
  // Sends all hands of this client at `now_ns`; an empty list means that they are gone. Without a session they are
  // dropped. Asserts that they are valid.
  void push_hands(std::vector<Hand> hands, std::int64_t now_ns);
  // Sends at most four reports a second, of relevant changes only.
  void report_importance(std::span<const wire::MemberImportance> members) { importance_.report(members); }
  // Requests the groom of another client: GroomFetched follows, or an Error (groom_unavailable).
  void request_groom(const wire::GroomHash& hash);
  // Passes frames to `sink`, which must outlive the core, and no longer makes events of them. Null: frames are events.
  void set_frame_sink(FrameSink* sink) { sink_ = sink; }
  // Says goodbye; ended() follows.
  void leave(std::int64_t now_ns);
  // Returns the events since the last call, in order. The last one of a conversation is Disconnected.
  std::vector<Event> take_events() { return events_.take_all(); }
  [[nodiscard]] bool active() const { return state_ == State::active; }
  [[nodiscard]] bool ended() const { return state_ == State::ended; }
  // One line that says why the conversation has ended; empty before ended().
  [[nodiscard]] const std::string& end_detail() const { return end_detail_; }
  // Returns the last welcome.
  [[nodiscard]] const std::optional<wire::Welcome>& welcome() const { return welcome_; }
  // Converts a time of the server's clock to ours. Returns it unchanged while no server's clock is known.
  [[nodiscard]] std::int64_t to_local_ns(std::int64_t server_time_ns) const;
  [[nodiscard]] LinkCounters counters() const;
  // Returns the skin of the groom's body. Null: the groom's basis, whose file has it, is not here.
  [[nodiscard]] std::shared_ptr<const Skin> skin_of(const wire::GroomHash& groom) const;

  // The connection's side.

  // Does what is due at this time: time-outs, signs of life, reports of importance and repeated requests.
  void poll(std::int64_t now_ns);
  // The time at which poll() must be called again, if nothing else happens before.
  [[nodiscard]] std::int64_t next_deadline_ns() const;
  // Whether the owner must open a connection now.
  [[nodiscard]] bool wants_connection() const { return state_ == State::needs_connection && !connection_; }
  // Returns the server to connect to, as another server has named it; none: the server that the caller knows.
  [[nodiscard]] const std::optional<wire::ServerAt>& redirected_to() const { return redirected_to_; }
  // The goodbye was taken, so no further packet comes: the owner ends its side of the stream and reads on.
  [[nodiscard]] bool wants_half_close() const { return connection_ && state_ == State::leaving && goodbye_taken_; }
  // Whether the core is done with the open connection, which the owner must then close.
  [[nodiscard]] bool wants_close() const;
  // Gives up a connection that works, for a better one: wants_close() and then wants_connection() become true, and the
  // session goes on over the next connection. Returns false, and does nothing, without a session or where the options
  // say not to reconnect.
  bool replace_connection(std::string error, std::int64_t now_ns);
  // The owner begins to open the connection that wants_connection() asked for; the time-out runs from now.
  void on_opening(std::int64_t now_ns);
  // `has_datagrams`: packets for which taken_may_be_lost() is true travel as datagrams.
  void on_open(std::int64_t now_ns, bool has_datagrams = false);
  // Takes bytes of a stream, in order; packets may be split anywhere.
  void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t now_ns);
  // `packet` is exactly one packet, size prefix included, or a frame datagram.
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  // `detail`: one line that says why it could not be opened or how it ended.
  void on_closed(std::string detail, std::int64_t now_ns);
  // The next packet to send, stamped with the time; empty when there is none.
  std::vector<std::uint8_t> take_packet(std::int64_t now_ns);
  // Whether the packet that was taken last may get lost or overtake others, because newer packets replace it.
  [[nodiscard]] bool taken_may_be_lost() const { return taken_may_be_lost_; }

 private:
  // idle: before start(). backing_off: waits until deadline_ns_ before the next attempt. needs_connection:
  // wants_connection() is true. opening: until on_open(). greeting: the hello is sent, or about to be. active: there is
  // a session. leaving: the goodbye is queued. ended: Disconnected was pushed, and nothing follows.
  enum class State : std::uint8_t { idle, backing_off, needs_connection, opening, greeting, active, leaving, ended };

  void on(wire::Welcome& welcome, std::int64_t now_ns);
  void on(wire::GroomNeed& need, std::int64_t now_ns);
  void on(wire::GroomStatus& status, std::int64_t now_ns);
  void on(wire::CharacterAdded& added, std::int64_t now_ns);
  void on(wire::CharacterRemoved& removed, std::int64_t now_ns);
  void on(wire::MemberJoined& joined, std::int64_t now_ns);
  void on(wire::MemberChanged& changed, std::int64_t now_ns);
  void on(wire::MemberLeft& left, std::int64_t now_ns);
  void on(wire::RoomWind& wind, std::int64_t now_ns);
  void on(wire::RoomProps& props, std::int64_t) { push(std::move(props)); }
  void on(wire::MemberTouch& touch, std::int64_t) { push(std::move(touch)); }
  void on(wire::Held& held, std::int64_t) { push(held); }
  void on(wire::RoomHands& hands, std::int64_t) { push(std::move(hands)); }
  void on(wire::GroomBasis& announced, std::int64_t now_ns);
  void on(wire::GroomLearnt& announced, std::int64_t now_ns);
  void on(wire::GroomData& data, std::int64_t now_ns);
  void on(wire::FrameBatch& batch, std::int64_t now_ns);
  // `grooms` are the grooms whose basis this file is.
  void take(const GroomFetched& basis, const std::vector<wire::GroomHash>& grooms, std::int64_t now_ns);
  void on(wire::Redirect& redirect, std::int64_t now_ns);
  void on(wire::Error& error, std::int64_t now_ns);
  void on(wire::Goodbye& goodbye, std::int64_t now_ns);

  void enqueue(wire::ClientMessage message);
  void resend_all(bool resumed, std::int64_t now_ns);
  // `events` collects the frames of one batch.
  void dispatch(const ReceivedFrame& received, FrameBatch& events, std::int64_t now_ns);
  std::vector<std::uint8_t> encode_datagram(wire::ClientMessage& message, std::int64_t now_ns);
  void show_last_known(Frame& frame, std::int64_t now_ns);
  void tell_left(const std::vector<std::uint32_t>& members);
  void push(Event event);
  // Waits, and then asks for another connection, or ends where that is of no use. `is_unanswered`: the server has not
  // answered over this connection.
  void on_connection_lost(wire::GoodbyeReason reason, std::string detail, std::int64_t now_ns,
                          bool is_unanswered = false);
  // The server to try next; none: the server that the caller knows.
  std::optional<wire::ServerAt> next_to_ask();
  void reconnect_to(std::string error, std::int64_t now_ns);
  // Ends what belongs to the connection; keeps the hair of the caller's characters.
  void drop_connection(std::int64_t now_ns);
  void end(wire::GoodbyeReason reason, std::string detail);
  void check_invariants() const;

  const LinkCoreOptions options_;
  State state_ = State::idle;
  // True from on_opening() to on_closed().
  bool connection_ = false;
  bool has_datagrams_ = false;
  // goodbye_taken_: take_packet() has returned the goodbye, after which it returns nothing. taken_may_be_lost_: see
  // taken_may_be_lost().
  bool goodbye_taken_ = false, taken_may_be_lost_ = false;
  // The present state ends at this time at the latest; the maximum means no limit.
  std::int64_t deadline_ns_ = std::numeric_limits<std::int64_t>::max();
  // While reconnecting, the core gives up at this time.
  std::int64_t give_up_ns_ = std::numeric_limits<std::int64_t>::max();
  // After a resume, members that the server has not announced by then have left.
  std::int64_t members_due_ns_ = std::numeric_limits<std::int64_t>::max();
  // At this time poll() asks again for bases that frames of sleeping characters wait for.
  std::int64_t ask_again_ns_ = 0;
  // The time of the last welcome.
  std::int64_t active_since_ns_ = 0;
  // The start of the current or the last outage. It sets the length of the waits between attempts (Backoff).
  std::optional<std::int64_t> away_since_ns_;
  // The time when a packet, or a sign of life, went out last.
  std::int64_t sent_ns_ = 0;
  // For how long nothing has come from the server.
  channel::Silence silence_{0};
  // The random waits between attempts to connect.
  Backoff backoff_;
  // Cuts the bytes of the present connection into packets.
  channel::PacketSplitter splitter_;
  // Converts the server's clock to ours.
  channel::ClockEstimate clock_;
  // What the caller has requested, to be sent again over a new connection.
  RequestedState requested_;
  // The same for the wind, which other clients may set too.
  RequestedWind wind_;
  // uploads_ has the groom bytes that the server wants; upload_scheduler_ decides when a chunk goes before other
  // messages.
  UploadQueue uploads_;
  channel::BulkScheduler upload_scheduler_;
  // All other messages that wait to be sent.
  SendQueue queue_;
  // The poses that were sent as datagrams last, which the next datagrams repeat.
  SentPoses sent_poses_;
  // The number of calls that sent hands; a receiver drops hands with an older number.
  std::uint32_t hands_sequence_ = 0;
  // The hands that were sent last were not an empty list.
  bool has_hands_ = false;
  Members members_;
  // The decoded frames of the batch that on() handles now.
  std::vector<Members::DecodedFrame> decoded_;
  // The hair of own characters from before an outage, shown until the new server sends its own.
  LastKnownHair last_known_;
  ImportanceReporter importance_;
  // The downloads that are under way.
  GroomFetch fetch_;
  FrameSink* sink_ = nullptr;
  EventQueue events_;
  LinkCounters counters_;
  std::optional<wire::Welcome> welcome_;
  // redirected_to_ is the server to connect to, welcomed_at_ the one that sent the last welcome. None means the server
  // that the caller knows.
  std::optional<wire::ServerAt> redirected_to_, welcomed_at_;
  // How many servers next_to_ask() has named since the last welcome.
  std::size_t asked_ = 0;
  // Redirects in a row since the last welcome.
  std::uint8_t redirects_ = 0;
  // The time of the first redirect since the last welcome; kRoomPatience_ns runs from here.
  std::optional<std::int64_t> sent_on_ns_;
  // The line of end_detail().
  std::string end_detail_;
};

}  // namespace hairnet::link
