#include "client/link/link_core.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assert.hpp"
#include "schema/wire/frame_datagram.hpp"

namespace hairnet::link {
namespace {

using wire::GoodbyeReason;

// Groom bytes are sent in chunks of this size. It is small, because a pose may have to wait until a whole chunk is
// sent.
constexpr std::size_t kChunkBytes = 16u << 10;
static_assert(kChunkBytes <= wire::kGroomChunkBytesMax);
// This many poses, with the two earlier poses of each character (SentPoses), fit kDatagramBytesMax.
constexpr std::size_t kPosesPerDatagram = 3;
// More poses at once come from a crowd: they would take too many datagrams, and travel in the channel instead.
constexpr std::size_t kPosesInDatagramsMax = 32;
constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();
// Bases that frames of sleeping characters wait for are asked for again at this interval.
constexpr std::int64_t kAskAgain_ns = 1'000'000'000;
// A pose that was captured before the welcome is still sent up to this age. The server refuses poses of more than one
// second, so half of that is left for the way.
constexpr std::int64_t kPoseAgeMax_ns = 500'000'000;
// After a goodbye the server has this long to close the connection. It is less than the 600 ms that a Link's destructor
// waits.
constexpr std::int64_t kGoodbyeWait_ns = 400'000'000;
// A session that lasted this long counts as successful: the backoff starts again at its shortest wait.
constexpr std::int64_t kStable_ns = 5'000'000'000;
// After a resume the server announces all members. A member that is not announced in this time has left.
constexpr std::int64_t kMembersResendWait_ns = 1'000'000'000;
// After this many redirects in a row without a welcome, the servers contradict each other (PROTOCOL.md, Fleets).
constexpr std::uint8_t kRedirectsMax = 4;
// A client that is redirected before its first welcome asks for this long, which is more than a dead server's lease (9
// s by default, lease_s in server/app/config.hpp).
constexpr std::int64_t kRoomPatience_ns = 30'000'000'000;

std::int64_t to_ns(double seconds) {
  return std::llround(seconds * 1e9);
}

// True when the error refuses a whole groom, so that its bytes are no longer needed. An error about one chunk (one that
// the server had not asked for) does not end the upload.
bool ends_upload(const wire::Error& error) {
  return error.reason != wire::ErrorReason::groom_unavailable &&
         error.reason != wire::ErrorReason::unexpected_message && error.character == 0 &&
         error.groom != wire::GroomHash{};
}

}  // namespace

bool is_final(GoodbyeReason reason) {
  return reason == GoodbyeReason::client_leaves || reason == GoodbyeReason::protocol_error ||
         reason == GoodbyeReason::version_unsupported || reason == GoodbyeReason::token_refused ||
         reason == GoodbyeReason::session_taken_over || reason == GoodbyeReason::removed;
}

namespace {

// Refuses here what no server accepts, a tag that is too long, with the error that a server would send.
std::optional<wire::Error> refused_here(const wire::ClientMessage& message) {
  const auto refused = [](const auto& m) -> std::optional<wire::Error> {
    if constexpr (requires { m.tag; }) {
      if (std::string error = wire::validate_tag(m.tag); !error.empty())
        return wire::Error{wire::ErrorReason::limit_exceeded, m.character, {}, std::move(error)};
    }
    return std::nullopt;
  };
  return std::visit(refused, message);
}

// Poses and hands may be lost, since newer ones follow. Not so a jump, the empty list that says that hands are gone,
// and an empty batch, which is a sign of life.
bool may_be_lost(const wire::ClientMessage& message) {
  const auto* batch = std::get_if<wire::PoseBatch>(&message);
  if (!batch || (batch->poses.empty() && !batch->hands)) return false;
  if (batch->hands && (batch->hands->hands.empty() || std::ranges::any_of(batch->hands->hands, &Hand::has_jumped)))
    return false;
  return std::ranges::none_of(batch->poses, &wire::PoseSample::teleport);
}

// Whether a server may send this message before its welcome.
bool may_come_first(const wire::Message& message) {
  return std::holds_alternative<wire::Welcome>(message) || std::holds_alternative<wire::Error>(message) ||
         std::holds_alternative<wire::Redirect>(message) || std::holds_alternative<wire::Goodbye>(message);
}

}  // namespace

LinkCore::LinkCore(LinkCoreOptions options)
    : options_(std::move(options)),
      backoff_(options_.trace),
      splitter_(wire::kPacketBytesMax),
      uploads_(kChunkBytes),
      upload_scheduler_(kChunkBytes),
      members_(options_.catalog ? options_.catalog : std::make_shared<FileCatalog>(), options_.decode_share) {
  if (options_.files_wait_for_grooms) members_.wait_for_grooms();
}

// The invariants hold between two calls from outside.
void LinkCore::check_invariants() const {
  switch (state_) {
    case State::idle:
      HAIRNET_ASSERT(!connection_);
      HAIRNET_ASSERT(!welcome_);
      break;
    case State::backing_off:
      HAIRNET_ASSERT(deadline_ns_ != kNever_ns);
      break;
    case State::opening:
    case State::greeting:
      HAIRNET_ASSERT(connection_);
      HAIRNET_ASSERT(deadline_ns_ != kNever_ns);
      break;
    case State::active:
      HAIRNET_ASSERT(connection_ && welcome_);
      HAIRNET_ASSERT(deadline_ns_ == kNever_ns && give_up_ns_ == kNever_ns);
      break;
    case State::leaving:
      HAIRNET_ASSERT(connection_ && welcome_);
      HAIRNET_ASSERT(deadline_ns_ != kNever_ns);
      break;
    case State::needs_connection:
      HAIRNET_ASSERT(deadline_ns_ == kNever_ns);
      break;
    case State::ended:
      HAIRNET_ASSERT(queue_.empty());
      break;
  }
}

void LinkCore::start() {
  if (state_ == State::idle) state_ = State::needs_connection;
}

void LinkCore::offer_groom(const wire::GroomHash& hash, RequestedState::Bytes bytes) {
  HAIRNET_ASSERT(bytes);
  requested_.offer(hash, bytes);
  members_.add_groom(hash);
  if (!active()) return;
  if (const auto offer = uploads_.offer(hash, std::move(bytes))) enqueue(*offer);
}

void LinkCore::send(wire::ClientMessage message) {
  if (std::optional<wire::Error> error = refused_here(message)) return push(std::move(*error));
  if (const auto* removed = std::get_if<wire::RemoveCharacter>(&message)) last_known_.drop(removed->character);
  if (const auto* wanted = std::get_if<wire::SetLevel>(&message); wanted && wanted->level == LevelIndex::rigid)
    last_known_.drop(wanted->character);
  if (const auto* wind = std::get_if<wire::SetWind>(&message)) wind_.set(*wind);
  requested_.store(message);
  enqueue(std::move(message));
}

void LinkCore::request_groom(const wire::GroomHash& hash) {
  if (const auto request = fetch_.request(hash)) enqueue(*request);
}

void LinkCore::push_poses(std::vector<wire::PoseSample> poses) {
  requested_.store(poses);
  if (active())
    queue_.push_poses(std::move(poses));
  else
    queue_.drop_poses(poses);
}

void LinkCore::push_hands(std::vector<Hand> hands, std::int64_t now_ns) {
  HAIRNET_ASSERT(validate(hands).empty());
  if (!active() || (hands.empty() && !has_hands_)) return;
  has_hands_ = !hands.empty();
  queue_.push_hands({++hands_sequence_, now_ns, std::move(hands)});
}

// Without a session the message is not sent: RequestedState stores it and resends it after the next welcome.
void LinkCore::enqueue(wire::ClientMessage message) {
  if (active() && !queue_.push(std::move(message)))
    end(GoodbyeReason::none, "more messages wait to be sent than the server takes");
}

void LinkCore::leave(std::int64_t now_ns) {
  if (state_ == State::leaving || ended()) return;
  if (!active() || !queue_.push(wire::Goodbye{GoodbyeReason::client_leaves, ""}))
    return end(GoodbyeReason::client_leaves, "closed by this client");
  state_ = State::leaving;
  deadline_ns_ = now_ns + kGoodbyeWait_ns;
}

void LinkCore::poll(std::int64_t now_ns) {
  check_invariants();
  if (ended()) return;
  if (now_ns >= give_up_ns_) return end(GoodbyeReason::none, "gave up reconnecting");
  if (active() && welcome_->signs_of_life && silence_.look(now_ns) >= channel::kSilence_ns) {
    ++counters_.servers_silent;
    return on_connection_lost(
        GoodbyeReason::none,
        "the server is silent: nothing came from it for " + std::to_string(wire::kSilence_ms / 1000) + " s", now_ns);
  }
  if (active() && now_ns - sent_ns_ >= channel::kSignOfLife_ns) {
    // An empty batch is a sign of life.
    if (queue_.empty()) enqueue(wire::PoseBatch{});
    sent_ns_ = now_ns;
  }
  if (active()) {
    if (std::optional<wire::ReportImportance> report = importance_.take(now_ns)) enqueue(std::move(*report));
    if (now_ns >= ask_again_ns_) {
      ask_again_ns_ = now_ns + kAskAgain_ns;
      for (const wire::GroomHash& file : members_.wanted_again(now_ns)) request_groom(file);
    }
    // The time for announcements after a resume is over: members that the server has not named have left.
    if (now_ns >= members_due_ns_) {
      members_due_ns_ = kNever_ns;
      tell_left(members_.drop_unconfirmed());
    }
  }
  if (now_ns < deadline_ns_) return;
  switch (state_) {
    case State::backing_off:
      state_ = State::needs_connection;
      deadline_ns_ = kNever_ns;
      break;
    case State::opening:
    case State::greeting:
      on_connection_lost(GoodbyeReason::none, "no welcome from the server within the time-out", now_ns, true);
      break;
    case State::leaving:
      end(GoodbyeReason::client_leaves, "closed by this client");
      break;
    case State::idle:
    case State::needs_connection:
    case State::active:
    case State::ended:
      break;
  }
}

// The repeated requests of ask_again_ns_ have no deadline of their own: packets and signs of life bring a poll() often
// enough.
std::int64_t LinkCore::next_deadline_ns() const {
  if (ended()) return kNever_ns;
  const std::int64_t min_ns = std::min(deadline_ns_, give_up_ns_);
  if (!active()) return min_ns;
  const std::int64_t look_ns = welcome_->signs_of_life ? silence_.next_look_ns() : kNever_ns;
  return std::min({min_ns, look_ns, members_due_ns_, importance_.due_ns(), sent_ns_ + channel::kSignOfLife_ns});
}

bool LinkCore::wants_close() const {
  return connection_ && (ended() || state_ == State::backing_off || state_ == State::needs_connection);
}

void LinkCore::on_opening(std::int64_t now_ns) {
  if (!wants_connection()) return;
  connection_ = true;
  state_ = State::opening;
  deadline_ns_ = now_ns + to_ns(options_.connect_timeout_s);
  splitter_ = channel::PacketSplitter(wire::kPacketBytesMax);
}

void LinkCore::on_open(std::int64_t, bool has_datagrams) {
  if (state_ != State::opening) return;
  state_ = State::greeting;
  has_datagrams_ = has_datagrams;
  sent_poses_.clear();
  wire::Hello hello;
  hello.client_name = options_.client_name;
  hello.room = options_.room;
  hello.token = options_.token;
  hello.role = options_.role;
  hello.redirects = redirects_;
  hello.datagram_layout = wire::kFrameDatagramLayout;
  hello.trace = options_.trace;
  hello.signs_of_life = true;
  // Only the server that has sent the welcome knows the session, which it resumes by its secret.
  if (welcome_ && welcomed_at_ == redirected_to_) {
    hello.session = welcome_->session;
    hello.secret = welcome_->secret;
  }
  queue_.clear();
  if (!queue_.push(std::move(hello))) end(GoodbyeReason::none, "no room for a hello");
}

void LinkCore::on_closed(std::string detail, std::int64_t now_ns) {
  if (!std::exchange(connection_, false)) return;
  if (state_ == State::leaving) return end(GoodbyeReason::client_leaves, "closed by this client");
  if (state_ == State::opening || state_ == State::greeting || state_ == State::active)
    on_connection_lost(GoodbyeReason::none, std::move(detail), now_ns, !active());
}

// Waits, and then asks for another connection; ends the conversation where that is of no use. `is_unanswered` means
// that the server has not answered over this connection.
void LinkCore::on_connection_lost(GoodbyeReason reason, std::string detail, std::int64_t now_ns, bool is_unanswered) {
  HAIRNET_ASSERT(state_ == State::opening || state_ == State::greeting || state_ == State::active);
  // A client that had no welcome yet tries again only after a redirect, and only for kRoomPatience_ns.
  const bool was_active = active(), is_patient = sent_on_ns_ && now_ns - *sent_on_ns_ < kRoomPatience_ns;
  const bool is_refused = is_final(reason) || (!welcome_ && reason == GoodbyeReason::room_refused);
  if (!(welcome_ ? options_.reconnect : is_patient) || is_refused) return end(reason, std::move(detail));
  drop_connection(now_ns);
  if (!was_active) redirected_to_ = next_to_ask();
  // Hello.redirects is at most 1 after a wait (PROTOCOL.md, Fleets).
  redirects_ = std::min<std::uint8_t>(redirects_, 1);
  state_ = State::backing_off;
  // The wait is at most as long as the outage so far (Backoff), which began with the lost session, or with the first
  // redirect where there was none.
  const std::int64_t since_ns = away_since_ns_.value_or(sent_on_ns_.value_or(now_ns));
  // While there are other servers to ask, the client does not wait for one that does not answer.
  const bool asks_on = is_unanswered && redirected_to_;
  const std::int64_t wait_ns = asks_on ? 0 : backoff_.next_ns(now_ns - since_ns);
  deadline_ns_ = now_ns + wait_ns;
  if (welcome_) push(Reconnecting{reason, std::move(detail), 1e-9 * static_cast<double>(wait_ns)});
  check_invariants();
}

// When the last server does not answer, the client asks the caller's server first, then those that the last welcome
// named one after the other, and then begins again.
std::optional<wire::ServerAt> LinkCore::next_to_ask() {
  const std::size_t count = welcome_ ? welcome_->others.size() : 0, turn = asked_++ % (count + 1);
  return turn == 0 ? std::nullopt : std::optional(welcome_->others[turn - 1]);
}

void LinkCore::drop_connection(std::int64_t now_ns) {
  if (active()) {
    // A session of less than kStable_ns continues the outage before it, so that the waits go on growing.
    if (!away_since_ns_ || now_ns - active_since_ns_ >= kStable_ns) away_since_ns_ = now_ns;
    give_up_ns_ = options_.give_up_after_s > 0 ? now_ns + to_ns(options_.give_up_after_s) : kNever_ns;
  }
  last_known_.on_lost();
  // The newest hair of own characters is stored: a new server continues it, and until then the link shows it.
  for (const auto& [number, character] : requested_.characters()) {
    std::optional<HairSnapshot> hair = members_.hair_of(number);
    if (!hair) continue;
    requested_.remember(number, hair->state);
    last_known_.keep(number, std::move(*hair));
  }
  members_.forget_frames();
  members_due_ns_ = kNever_ns;
  queue_.clear();
  uploads_.clear();
}

void LinkCore::end(GoodbyeReason reason, std::string detail) {
  if (ended()) return;
  state_ = State::ended;
  queue_.clear();
  uploads_.clear();
  end_detail_ = detail;
  events_.push_last({reason, std::move(detail)});
}

void LinkCore::push(Event event) {
  if (!events_.push(std::move(event))) end(GoodbyeReason::none, "this client does not poll its events");
}

std::vector<std::uint8_t> LinkCore::take_packet(std::int64_t now_ns) {
  if (!connection_ || ended() || goodbye_taken_) return {};
  if (state_ != State::greeting && state_ != State::active && state_ != State::leaving) return {};
  // A chunk of a groom is sent when nothing else waits, or when other messages have had three quarters of the bytes
  // (BulkScheduler).
  const bool is_chunk = active() && uploads_.is_waiting() && (queue_.empty() || upload_scheduler_.is_due());
  const bool as_datagrams = has_datagrams_ && queue_.next_pose_count() <= kPosesInDatagramsMax;
  std::optional<wire::ClientMessage> message =
      is_chunk ? uploads_.next_chunk() : queue_.pop(as_datagrams ? kPosesPerDatagram : wire::kPosesPerBatchMax);
  if (!message) return {};
  goodbye_taken_ = std::holds_alternative<wire::Goodbye>(*message);
  taken_may_be_lost_ = may_be_lost(*message);
  const auto* batch = std::get_if<wire::PoseBatch>(&*message);
  const bool is_datagram = taken_may_be_lost_ && has_datagrams_ && batch->poses.size() <= kPosesPerDatagram;
  if (const auto* removed = std::get_if<wire::RemoveCharacter>(&*message)) sent_poses_.forget(removed->character);
  sent_ns_ = now_ns;
  std::vector<std::uint8_t> packet =
      is_datagram ? encode_datagram(*message, now_ns) : wire::encode_client_packet(now_ns, *message);
  if (is_chunk)
    upload_scheduler_.sent_bulk();
  else
    upload_scheduler_.sent_urgent(packet.size(), uploads_.is_waiting());
  counters_.bytes_sent += packet.size();
  check_invariants();
  return packet;
}

// A datagram has at most kDatagramBytesMax. Where the message is larger, the repeated poses are left out first. If that
// is not enough, the hands go back into the queue, and the repeated poses return. A message of hands alone that is too
// large is sent over the channel.
std::vector<std::uint8_t> LinkCore::encode_datagram(wire::ClientMessage& message, std::int64_t now_ns) {
  auto& batch = std::get<wire::PoseBatch>(message);
  sent_poses_.repeat_in(batch);
  std::vector<std::uint8_t> packet = wire::encode_client_packet(now_ns, message);
  if (packet.size() <= wire::kDatagramBytesMax || !batch.hands) return packet;
  std::vector<wire::EarlierPose> earlier = std::exchange(batch.earlier, {});
  packet = wire::encode_client_packet(now_ns, message);
  if (packet.size() <= wire::kDatagramBytesMax || batch.poses.empty()) return packet;
  queue_.put_back(*std::exchange(batch.hands, std::nullopt));
  batch.earlier = std::move(earlier);
  return wire::encode_client_packet(now_ns, message);
}

void LinkCore::on_bytes(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  if (!connection_ || ended()) return;
  silence_.on_heard(now_ns);
  const bool valid =
      splitter_.feed(bytes, [this, now_ns](std::span<const std::uint8_t> packet) { on_packet(packet, now_ns); });
  const bool listens = state_ == State::greeting || state_ == State::active;
  if (!valid && listens)
    on_connection_lost(GoodbyeReason::protocol_error, "the server sent a packet of impossible size", now_ns);
}

void LinkCore::on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  if (state_ != State::greeting && state_ != State::active) return;
  silence_.on_heard(now_ns);
  counters_.bytes_received += packet.size();
  wire::DecodedPacket decoded =
      wire::is_frame_datagram(packet) ? wire::decode_frame_datagram(packet) : wire::decode_server_packet(packet);
  if (decoded.error != wire::DecodeError::none)
    return on_connection_lost(GoodbyeReason::protocol_error, "the server sent a bad packet: " + decoded.detail, now_ns);
  wire::Message& message = decoded.envelope.message;
  // Before the welcome, frames and hands may come in datagrams that have overtaken it: they are ignored.
  if (const auto* early = std::get_if<wire::FrameBatch>(&message);
      early && state_ == State::greeting && !early->generations.empty()) {
    counters_.frames_unknown += early->frames.size();
    return;
  }
  if (state_ == State::greeting && std::holds_alternative<wire::RoomHands>(message)) return;
  // A new session may belong to another server with another clock.
  if (const auto* welcome = std::get_if<wire::Welcome>(&message); welcome && !welcome->resumed)
    clock_ = channel::ClockEstimate();
  clock_.observe(decoded.envelope.clock_ns, now_ns);
  if (std::holds_alternative<wire::FrameBatch>(message)) counters_.frame_bytes_received += packet.size();
  if (state_ == State::greeting && !may_come_first(message))
    return on_connection_lost(GoodbyeReason::protocol_error, "the server sent another message before its welcome",
                              now_ns);
  // The server's messages arrive here: the decoder refuses what only clients say.
  const auto take = [this, now_ns](auto& m) {
    if constexpr (requires { on(m, now_ns); }) on(m, now_ns);
  };
  std::visit(take, message);
}

void LinkCore::on(wire::Welcome& welcome, std::int64_t now_ns) {
  if (state_ != State::greeting)
    return on_connection_lost(GoodbyeReason::protocol_error, "the server sent a second welcome", now_ns);
  state_ = State::active;
  deadline_ns_ = give_up_ns_ = kNever_ns;
  active_since_ns_ = now_ns;
  const bool again = welcome_.has_value();
  const bool resumed = again && welcome.resumed;
  HAIRNET_ASSERT(connection_);
  // dispatch() divides by the rate; the decoder has checked it.
  HAIRNET_ASSERT(welcome.tick_rate_hz > 0);
  welcome_ = welcome;
  welcomed_at_ = redirected_to_;
  redirects_ = 0;
  sent_on_ns_.reset();
  asked_ = 0;
  counters_.reconnects += again;
  counters_.resumes += resumed;
  push(Connected{welcome, again});
  // A resumed session has the same members, except for those that have left meanwhile. A new session begins without
  // any.
  if (resumed) {
    members_.mark_all_unconfirmed();
    members_due_ns_ = now_ns + kMembersResendWait_ns;
  } else {
    if (again) requested_.forget_sessions();
    tell_left(members_.drop_all());
    for (const wire::GroomHash& file : members_.bases().clear()) fetch_.refuse(file);
    for (const wire::GroomHash& file : members_.learnt().clear()) fetch_.refuse(file);
  }
  resend_all(resumed, now_ns);
  if (const wire::SetWind* wind = wind_.on_welcome(welcome.may_set_wind || !again)) enqueue(*wind);
}

void LinkCore::resend_all(bool resumed, std::int64_t now_ns) {
  RequestedState::Resend resend = requested_.take_resend(resumed);
  for (auto& [hash, bytes] : resend.offers) {
    if (const auto offer = uploads_.offer(hash, std::move(bytes))) enqueue(*offer);
  }
  for (wire::ClientMessage& message : resend.messages) enqueue(std::move(message));
  for (const wire::GroomRequest& request : fetch_.request_again()) enqueue(request);
  std::erase_if(resend.poses, [now_ns](const auto& pose) { return now_ns - pose.capture_time_ns > kPoseAgeMax_ns; });
  queue_.push_poses(std::move(resend.poses));
  if (resumed)
    importance_.resend_all();
  else
    importance_.forget_all();
}

void LinkCore::tell_left(const std::vector<std::uint32_t>& members) {
  for (const std::uint32_t member : members) {
    importance_.forget(member);
    push(wire::MemberLeft{member});
  }
}

void LinkCore::on(wire::GroomNeed& need, std::int64_t) {
  // The result is not used: a groom that was dropped meanwhile is no longer known.
  uploads_.need(need);
}

void LinkCore::on(wire::GroomStatus& status, std::int64_t) {
  // Keeps our bytes until the groom is ready or refused: the server may be taking the bytes from another client, which
  // may leave or may send wrong ones.
  if (status.state == wire::GroomState::ready || status.state == wire::GroomState::refused) uploads_.drop(status.hash);
  if (status.state == wire::GroomState::ready) {
    requested_.on_ready(status.hash);
    last_known_.on_ready(status.hash);
  } else if (status.state == wire::GroomState::refused) {
    requested_.on_refused(status.hash);
    last_known_.drop_of(status.hash);
  }
  push(status);
}

void LinkCore::on(wire::CharacterAdded& added, std::int64_t now_ns) {
  if (!requested_.has_asked_for(added.character))
    return on_connection_lost(GoodbyeReason::protocol_error, "the server added a character nobody requested", now_ns);
  requested_.on_added(added.character);
  if (members_.add_own(added)) push(added);
}

void LinkCore::on(wire::CharacterRemoved& removed, std::int64_t) {
  requested_.on_removed(removed.character);
  members_.remove_own(removed.character);
  push(removed);
}

void LinkCore::on(wire::MemberJoined& joined, std::int64_t) {
  if (const auto former = members_.drop_previous_number(joined.session, joined.character, joined.member))
    tell_left({*former});
  switch (members_.join(joined)) {
    case Members::Joined::same:
      break;
    case Members::Joined::changed:  // during the outage
      push(wire::MemberChanged{joined.member, std::move(joined.tag), joined.appearance});
      break;
    case Members::Joined::is_new:
      push(std::move(joined));
      break;
  }
}

void LinkCore::on(wire::MemberChanged& changed, std::int64_t) {
  if (members_.change(changed)) push(std::move(changed));
}

void LinkCore::on(wire::RoomWind& wind, std::int64_t) {
  push(wind);
  if (const wire::SetWind* ours = wind_.on_announced(wind, welcome_->session)) enqueue(*ours);
}

void LinkCore::on(wire::MemberLeft& left, std::int64_t) {
  importance_.forget(left.member);
  if (members_.leave(left.member)) push(left);
}

void LinkCore::on(wire::GroomBasis& announced, std::int64_t) {
  members_.bases().announce(announced.groom, announced.basis);
}

void LinkCore::on(wire::GroomLearnt& announced, std::int64_t) {
  if (options_.evaluate_learnt) members_.announce(announced);
}

void LinkCore::on(wire::GroomData& data, std::int64_t now_ns) {
  std::optional<GroomFetched> fetched = fetch_.take(data);
  if (!fetched) return;
  // Bases, networks and grooms come in the same messages, and the hash tells which of them a file is.
  if (const auto grooms = members_.bases().grooms_of(fetched->hash); !grooms.empty())
    return take(*fetched, grooms, now_ns);
  const std::vector<wire::GroomHash> grooms = members_.learnt().grooms_of(fetched->hash);
  if (grooms.empty()) {
    if (fetched->bytes) members_.add_groom(fetched->hash);
    return push(std::move(*fetched));
  }
  const std::string error = members_.learnt().take(*fetched);
  if (!error.empty())
    push(wire::Error{wire::ErrorReason::groom_invalid, 0, grooms[0], "its learnt hair cannot be used: " + error});
}

// Takes the basis of these grooms, and reports the frames that have waited for it.
void LinkCore::take(const GroomFetched& basis, const std::vector<wire::GroomHash>& grooms, std::int64_t now_ns) {
  const std::string error = members_.bases().take(basis);
  if (!error.empty())
    return push(wire::Error{wire::ErrorReason::groom_invalid, 0, grooms[0], "its basis cannot be used: " + error});
  for (const wire::GroomHash& groom : grooms) {
    for (const auto& [frame, tick, sample_time_ns, decoded] : members_.decode_waiting(groom)) {
      counters_.frames_undecodable += decoded.outcome == Members::Outcome::undecodable;
      if (sink_ || !decoded.pose) continue;
      FrameBatch events{tick, sample_time_ns, now_ns, {}};
      dispatch({tick, sample_time_ns, frame, decoded}, events, now_ns);
      // The caller has had this frame before, without its hair (Frame::repeated).
      events.frames[0].repeated = true;
      push(std::move(events));
    }
  }
}

// Decodes all frames of the batch first, then steps the networks of learnt hair side by side, then reports the frames.
void LinkCore::on(wire::FrameBatch& batch, std::int64_t now_ns) {
  FrameBatch events{batch.tick, batch.sample_time_ns, now_ns, {}};
  if (!sink_) events.frames.reserve(batch.frames.size());
  decoded_.clear();
  for (std::size_t i = 0; i < batch.frames.size(); ++i) {
    const wire::Frame& frame = batch.frames[i];
    // Only frames of a datagram have generations: their numbers may belong to other members by now.
    const auto generation = batch.generations.empty() ? std::nullopt : std::optional(batch.generations[i]);
    const Members::DecodedFrame& decoded =
        decoded_.emplace_back(members_.decode_frame(frame, generation, batch.tick, batch.sample_time_ns, now_ns));
    ++counters_.frames_received;
    counters_.frames_unknown += decoded.outcome == Members::Outcome::unknown;
    counters_.frames_undecodable += decoded.outcome == Members::Outcome::undecodable;
    counters_.frames_lacking_learnt += decoded.lacks_learnt;
    counters_.frames_evaluated += frame.evaluated && decoded.basis && !decoded.lacks_learnt;
    if (decoded.wants_basis) request_groom(*decoded.wants_basis);
    if (decoded.wants_learnt) request_groom(*decoded.wants_learnt);
    if (decoded.evaluates) enqueue(*decoded.evaluates);
  }
  members_.evaluate();
  for (std::size_t i = 0; i < decoded_.size(); ++i) {
    if (decoded_[i].outcome != Members::Outcome::unknown)
      dispatch({batch.tick, batch.sample_time_ns, batch.frames[i], decoded_[i]}, events, now_ns);
  }
  decoded_.clear();
  if (!events.frames.empty()) push(std::move(events));
}

// Passes a frame to the sink, or else adds it to `events`.
void LinkCore::dispatch(const ReceivedFrame& received, FrameBatch& events, std::int64_t now_ns) {
  const auto& [tick, sample_time_ns, frame, decoded] = received;
  HAIRNET_ASSERT(welcome_);
  HAIRNET_ASSERT((decoded.pose != nullptr) == (decoded.outcome == Members::Outcome::decoded));
  // The last known hair is dropped when the server simulates the character, or has simulated it all the time.
  if (decoded.character != 0 && (decoded.basis || welcome_->resumed)) last_known_.drop(decoded.character);
  if (decoded.character != 0 && decoded.basis) requested_.forget_state(decoded.character);
  if (sink_) {
    sink_->on_frame(received);
  } else if (decoded.pose) {
    Frame& out = events.frames.emplace_back();
    out.member = frame.member;
    out.character = decoded.character;
    out.level = frame.level;
    out.discontinuous = decoded.discontinuous;
    out.asleep = frame.asleep;
    out.step_stride = frame.step_stride;
    out.step_s = static_cast<float>(frame.step_stride) / static_cast<float>(welcome_->tick_rate_hz);
    out.pose = *decoded.pose;
    out.coefficients.assign(decoded.coefficients.begin(), decoded.coefficients.end());
    out.basis = decoded.basis;
    if (out.character != 0) show_last_known(out, now_ns);
  }
}

// Gives an own character's frame the last known hair, if the frame has none.
void LinkCore::show_last_known(Frame& frame, std::int64_t now_ns) {
  if (frame.basis) return;
  if (const HairSnapshot* hair = last_known_.of(frame.character, frame.level, now_ns)) {
    frame.last_known = true;
    frame.coefficients = hair->coefficients;
    frame.basis = hair->basis;
  }
}

void LinkCore::on(wire::Error& error, std::int64_t) {
  // An error that names a groom may answer a request for a groom, a request for its basis or network, or an upload.
  const bool may_be_fetch =
      error.reason == wire::ErrorReason::groom_unavailable || error.reason == wire::ErrorReason::limit_exceeded;
  const bool ends_fetch = may_be_fetch && fetch_.refuse(error.groom);
  // The named file is a basis or learnt hair, which the server makes of a groom.
  const bool is_made =
      !members_.bases().grooms_of(error.groom).empty() || !members_.learnt().grooms_of(error.groom).empty();
  // This is no error for the caller: frames that need the basis or the network ask for the file again.
  if (may_be_fetch && is_made) return;
  if (!ends_fetch && ends_upload(error)) {
    uploads_.drop(error.groom);
    requested_.on_refused(error.groom);
  }
  // An error that answers a repeated message, whose first copy had arrived, is not reported.
  if (!requested_.on_error(error)) return push(std::move(error));
  if (error.reason != wire::ErrorReason::character_unknown) return;
  // We sent the removal twice; the answer to the first one was lost with its connection. The member may be gone
  // already, because the server did not announce it after the resume.
  members_.remove_own(error.character);
  push(wire::CharacterRemoved{error.character});
}

void LinkCore::on(wire::Redirect& redirect, std::int64_t now_ns) {
  if (active()) wind_.on_sent_on();
  if (!sent_on_ns_) sent_on_ns_ = now_ns;
  // No server holds the room now, or servers send the client in a circle. The client waits, and asks its first server
  // again.
  if (!redirect.to || redirects_ == kRedirectsMax) {
    if (redirect.to) ++counters_.redirect_loops;
    const char* const error =
        !redirect.to ? "the server does not hold the room any more" : "the servers do not agree on who holds the room";
    redirects_ = 0;
    on_connection_lost(GoodbyeReason::none, error, now_ns);
    redirected_to_.reset();
    return;
  }
  ++redirects_;
  ++counters_.redirects;
  reconnect_to("the room is held by " + redirect.to->host + ", port " + std::to_string(redirect.to->port), now_ns);
  redirected_to_ = std::move(redirect.to);
}

// Asks for another connection at once, without the wait of a broken one.
void LinkCore::reconnect_to(std::string error, std::int64_t now_ns) {
  drop_connection(now_ns);
  if (welcome_) push(Reconnecting{GoodbyeReason::none, std::move(error), 0});
  if (ended()) return;
  state_ = State::needs_connection;
  deadline_ns_ = kNever_ns;
  check_invariants();
}

bool LinkCore::replace_connection(std::string error, std::int64_t now_ns) {
  if (!active() || !options_.reconnect) return false;
  reconnect_to(std::move(error), now_ns);
  return !ended();
}

void LinkCore::on(wire::Goodbye& goodbye, std::int64_t now_ns) {
  if (active() && goodbye.reason == GoodbyeReason::server_draining) wind_.on_sent_on();
  on_connection_lost(goodbye.reason, "the server says goodbye: " + goodbye.detail, now_ns);
}

std::shared_ptr<const Skin> LinkCore::skin_of(const wire::GroomHash& groom) const {
  const std::shared_ptr<const KnownBasis> basis = members_.bases().of(groom);
  return basis ? std::shared_ptr<const Skin>(basis, &basis->hair.skin) : nullptr;
}

std::int64_t LinkCore::to_local_ns(std::int64_t server_time_ns) const {
  return clock_.known() ? clock_.to_local(server_time_ns) : server_time_ns;
}

LinkCounters LinkCore::counters() const {
  LinkCounters counters = counters_;
  counters.frames_dropped = events_.frames_dropped();
  counters.poses_dropped = queue_.poses_dropped();
  counters.downloads = fetch_.progress();
  return counters;
}

}  // namespace hairnet::link
