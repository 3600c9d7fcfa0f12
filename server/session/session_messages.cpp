#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "core/assert.hpp"
#include "schema/lobby.hpp"
#include "server/session/entry.hpp"
#include "server/session/message_price.hpp"
#include "server/session/moderation.hpp"
#include "server/session/pose_filter.hpp"
#include "server/session/rights.hpp"
#include "server/session/room_route.hpp"
#include "server/session/session.hpp"
#include "server/telemetry/log_hash.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::GoodbyeReason;

// At most one error about poses and hands is sent to a client in this time.
constexpr std::int64_t kPoseErrorInterval_ns = 1'000'000'000;
// Both are shares of SessionLimits::messages_burst, the size of the bucket that prices are taken from
// (message_price.hpp). Only plain messages may use the last quarter of the bucket, so a costly message is refused
// before the client is sent away. No message costs more than half of the bucket, so every message can be paid for from
// a full one.
constexpr double kPlainReserve = 0.25, kPriceMax = 0.5;
// This many integers of a hair state, or bytes of a tag, weigh as much as a pose in the command queue, since they take
// about as many bytes. The queue bounds the sum of the weights.
constexpr std::size_t kIntegersPerWeight = 64;
constexpr std::size_t kTagBytesPerWeight = 128;
// A chunk of a groom with at least this many bytes costs no message: the rate of uploaded bytes bounds such chunks. A
// smaller chunk costs one, or a client could send a groom byte by byte for nothing.
constexpr std::size_t kFreeChunkLeast_bytes = 4096;

// The weight of each message in the command queue (exchange/command.hpp).
std::size_t weight_of(const wire::AddCharacter& add) {
  return 1 + add.tag.size() / kTagBytesPerWeight +
         (add.state ? (add.state->displacements.size() + add.state->velocities.size()) / kIntegersPerWeight : 0);
}
std::size_t weight_of(const wire::SetAppearance& set) {
  return 1 + set.tag.size() / kTagBytesPerWeight;
}
std::size_t weight_of(const wire::SetTouch& set) {
  return 1 + set.chosen.size();
}
std::size_t weight_of(const wire::SetProps& set) {
  return 1 + set.props.size();
}
std::size_t weight_of(const wire::HandsSample& sample) {
  std::size_t shapes = 0;
  for (const Hand& hand : sample.hands) shapes += hand.shapes.size();
  return 1 + shapes;
}
std::size_t weight_of(const auto& request) {
  if constexpr (requires { request.members; }) return 1 + request.members.size();
  return 1;
}

// The character and the groom that a message names, or zeros. An error that answers the message repeats them, so that
// the client knows what was refused.
std::uint32_t character_of(const auto& message) {
  if constexpr (requires { message.character; }) return message.character;
  return 0;
}
wire::GroomHash groom_of(const auto& message) {
  if constexpr (requires { message.groom; }) return message.groom;
  if constexpr (requires { message.hash; }) return message.hash;
  return {};
}

// Returns the addresses of other servers, kServersMax at most, in the order of ids, beginning with the id that follows
// this server's. Each server so names different ones first, and the clients of a dead server spread over the rest.
std::vector<wire::ServerAt> others_than_this(const Directory& fleet) {
  std::vector<ServerStatus> servers = fleet.servers();
  const auto after = std::ranges::upper_bound(servers, fleet.server_id(), {}, &ServerStatus::id);
  std::ranges::rotate(servers, after);
  std::vector<wire::ServerAt> others;
  for (const ServerStatus& server : servers) {
    if (others.size() == wire::kServersMax) break;
    if (server.id != fleet.server_id() && !server.draining && server.address.port != 0)
      others.push_back({server.address.host, server.address.port});
  }
  return others;
}

}  // namespace

// What a session does with each message. There is one operator() for each message, which returns the reason of a
// refusal; the overload for `auto` takes the messages that only servers send. A handler exists during one call of the
// session.
struct Session::MessageHandler {
  Session& session;
  std::int64_t now_ns;
  SessionContext& context = *session.context_;
  SessionCounters& counters = context.counters;
  SessionIdentity& identity = session.identity_;

  // Handles one message of an active session, or its Hello: takes the price, runs operator(), and answers a refusal
  // with an Error.
  void handle(auto& message) {
    Refused refused = charge(message);
    if (!refused) refused = (*this)(message);
    if (!refused) return;
    if (Counter* counter = refused_counter(message)) counter->add();
    session.refuse(refused, now_ns, character_of(message), groom_of(message));
  }
  // Refuses a message if there is no memory for it, or if the client cannot pay its price. on_message() has taken the
  // price of a plain message already, so this takes the rest.
  Refused charge(const auto& message) {
    if (needs_memory(message) && context.is_memory_full()) {
      counters.messages_refused_memory.add();
      return {ErrorReason::limit_exceeded, kMemoryFull};
    }
    const double burst = context.limits.messages_burst;
    const double rest = std::min(price_of(message, context.rooms, identity.room) - 1, kPriceMax * burst);
    if (rest <= 0 || identity.messages.take(rest, now_ns, kPlainReserve * burst)) return {};
    counters.messages_refused_work.add();
    return {ErrorReason::limit_exceeded, "more work than a client may ask for in a second; try again later"};
  }
  static bool needs_memory(const wire::GroomOffer&) { return true; }
  static bool needs_memory(const wire::GroomRequest&) { return true; }
  static bool needs_memory(const wire::AddCharacter&) { return true; }
  static bool needs_memory(const wire::SetAppearance& set) { return !set.tag.empty(); }
  static bool needs_memory(const wire::SetTouch& set) { return !set.chosen.empty(); }
  static bool needs_memory(const wire::TakeHold&) { return true; }
  static bool needs_memory(const wire::SetProps& set) { return !set.props.empty(); }
  static bool needs_memory(const auto&) { return false; }
  // The counter of refused messages of this kind. Null: only a full command queue refuses such messages, and put()
  // counts that.
  Counter* refused_counter(const wire::GroomOffer&) { return &counters.requests_refused_groom; }
  Counter* refused_counter(const wire::GroomChunk&) { return &counters.requests_refused_chunk; }
  Counter* refused_counter(const wire::GroomRequest&) { return &counters.requests_refused_download; }
  Counter* refused_counter(const wire::AddCharacter&) { return &counters.requests_refused_character; }
  Counter* refused_counter(const wire::RemoveCharacter&) { return &counters.requests_refused_character; }
  Counter* refused_counter(const wire::SetLevel&) { return &counters.requests_refused_level; }
  Counter* refused_counter(const wire::SetAppearance&) { return &counters.requests_refused_appearance; }
  Counter* refused_counter(const wire::SetMaterial&) { return &counters.requests_refused_material; }
  Counter* refused_counter(const wire::SetWind&) { return &counters.requests_refused_wind; }
  Counter* refused_counter(const wire::SetTouch&) { return &counters.requests_refused_touch; }
  Counter* refused_counter(const wire::TakeHold&) { return &counters.requests_refused_hold; }
  Counter* refused_counter(const wire::LetGo&) { return &counters.requests_refused_hold; }
  Counter* refused_counter(const wire::SetProps&) { return &counters.requests_refused_props; }
  Counter* refused_counter(const wire::Moderate&) { return &counters.requests_refused_moderate; }
  Counter* refused_counter(const wire::Observe&) { return &counters.requests_refused_observe; }
  Counter* refused_counter(const auto&) { return nullptr; }

  Refused operator()(const auto&) {
    session.refuse_unexpected("a message that only servers send", now_ns);
    return {};
  }

  Refused operator()(wire::Goodbye& goodbye) {
    spdlog::info("event=client_goodbye session={} detail={}", session.id(), log_text(goodbye.detail));
    session.close(to_string(GoodbyeReason::client_leaves), now_ns);
    return {};
  }

  Refused operator()(wire::Hello& hello) {
    if (session.state_ != State::awaiting_hello || session.waiting_hello_) {
      session.refuse_unexpected("a second hello", now_ns);
    } else if (hello.protocol_version != wire::kProtocolVersion) {
      counters.sessions_refused_version.add();
      const std::string detail = "this server speaks version " + std::to_string(wire::kProtocolVersion) + ", not " +
                                 std::to_string(hello.protocol_version);
      session.refuse({ErrorReason::version_unsupported, detail}, now_ns);
      session.drain(GoodbyeReason::version_unsupported, detail, now_ns);
    } else {
      // What the client can read is set before the tick gets the outbox.
      session.outbox_->set_message_max(hello.message_max);
      session.outbox_->set_datagram_layout(hello.datagram_layout);
      identity.trace = hello.trace;
      session.gives_signs_of_life_ = hello.signs_of_life;
      enter(hello);
    }
    return {};
  }
  // Decides where the client belongs, and follows the outcome: there is one follow() for each alternative of
  // EntryOutcome (entry.hpp).
  void enter(const wire::Hello& hello) {
    EntryOutcome outcome = decide_entry(hello, identity, context, *session.connection_, now_ns);
    std::visit([&](auto& what) { follow(what, hello); }, outcome);
  }
  // The session stays in awaiting_hello, and retry_hello() decides again.
  void follow(WaitsForRoom&, const wire::Hello& hello) { session.waiting_hello_ = hello; }
  void follow(BelongsElsewhere& elsewhere, const wire::Hello&) { session.send_away(elsewhere.to, now_ns); }
  void follow(KeptOut& out, const wire::Hello&) {
    if (out.error) session.refuse(out.error, now_ns);
    session.drain(out.reason, std::move(out.detail), now_ns);
  }
  // The session of the new connection becomes the former one: it takes over its identity, with its number, characters
  // and buckets.
  void follow(Resumes& back, const wire::Hello& hello) {
    identity = context.directory->take_over(*back.former, session, now_ns);
    HAIRNET_ASSERT(identity.id == hello.session);
    identity.resumed_ns = now_ns;
    identity.trace = hello.trace;
    use_claims(std::move(back.claims));
    session.set_state(State::active);
    session.joined_ = true;
    counters.sessions_resumed.add();
    spdlog::info("event=session_resumed session={} trace={:016x} subject={} peer={}", session.id(), identity.trace,
                 log_text(identity.subject.name), session.connection_->peer());
    welcome(true);
    context.grooms.resend_states(session.id(), now_ns);
  }
  // A new session joins its room, and from now on counts for the limits of room, subject and token holder.
  void follow(Joins& joins, const wire::Hello&) {
    session.set_state(State::active);
    session.joined_ = true;
    ++context.session_count;
    context.rooms.enter(identity.room);
    context.rules.open_room(identity.room);
    context.props.open_room(identity.room);
    session.note_member_change();
    context.subjects.enter(identity.subject.name);
    context.token_holders.enter(identity.subject.token_holder);
    use_claims(std::move(joins.claims));
    counters.sessions_welcomed.add();
    spdlog::info(
        "event=session_opened session={} trace={:016x} subject={} token={} client={} room={} peer={} transport={}",
        session.id(), identity.trace, log_text(identity.subject.name),
        log_text(identity.claims ? identity.claims->id : ""), log_text(identity.name), log_text(identity.room),
        session.connection_->peer(), session.connection_->transport());
    welcome(false);
  }
  // Ends a detached session of the same token holder, so that its characters leave room for new ones. False: there is
  // none.
  bool end_detached() const {
    return context.directory && context.directory->end_detached(identity.subject.token_holder, now_ns);
  }
  // Replaces the claims by those of the newest token, and with them the limits of characters and strands. An observer
  // may have no characters. Sessions of an exempt address do not share one part of the uploads and builds.
  void use_claims(std::optional<channel::TokenClaims> claims) {
    constexpr std::uint64_t kNoMax = std::numeric_limits<std::uint64_t>::max();
    identity.claims = std::move(claims);
    const std::size_t of_token = character_count_max_of_token();
    identity.character_count_max =
        identity.role == wire::Role::observer ? 0 : std::min(context.limits.characters_per_session_max, of_token);
    const bool shares = identity.subject.kind != Subject::Kind::exempt;
    context.grooms.open(session.id(),
                        {shares ? context.subjects.count(identity.subject.name).number : 0,
                         context.token_holders.count(identity.subject.token_holder).number,
                         identity.claims ? identity.claims->strands_max.value_or(kNoMax) : kNoMax},
                        now_ns);
  }
  // The token's limit of characters, for all sessions of its holder together; without one, the largest number.
  [[nodiscard]] std::size_t character_count_max_of_token() const {
    constexpr std::size_t kNoMax = std::numeric_limits<std::size_t>::max();
    return identity.claims && identity.claims->characters_max ? *identity.claims->characters_max : kNoMax;
  }
  // Welcome is queued before the command, so it precedes all messages of the tick.
  void welcome(bool resumed) {
    HAIRNET_ASSERT(session.joined_);
    HAIRNET_ASSERT(wire::is_room_name(identity.room));
    wire::Welcome welcome;
    welcome.session = session.id();
    welcome.tick_rate_hz = context.tick_rate_hz;
    welcome.tick = context.tick.load(std::memory_order_relaxed);
    welcome.character_count_max = static_cast<std::uint32_t>(identity.character_count_max);
    welcome.groom_bytes_max = context.groom_bytes_max;
    welcome.room = identity.room;
    welcome.secret = identity.secret;
    welcome.resumed = resumed;
    welcome.resume_grace_s = static_cast<float>(static_cast<double>(context.limits.resume_grace_ns) * 1e-9);
    welcome.pose_delay_ns = context.pose_delay_ns;
    const bool is_heard = !is_muted(identity, context);
    welcome.may_set_wind = is_heard && may_set_wind(identity, context);
    welcome.may_touch = is_heard && may_touch_others(identity);
    welcome.may_set_props = is_heard && may_set_props(identity, context);
    welcome.signs_of_life = true;
    if (context.fleet) welcome.others = others_than_this(*context.fleet);
    session.connection_->mark_joined();
    session.send(welcome, now_ns);
    Command open = OpenSession{
        session.id(), session.outbox_, identity.room,   context.subjects.count(identity.subject.name).number,
        resumed,      wind_of_room(),  props_for_tick()};
    // decide_entry() has checked that the command fits, but other commands may have come since. put() takes it in any
    // case, because the client has its Welcome already.
    if (!context.commands.try_put(open, entry_weight(context, identity.room))) context.commands.put(std::move(open));
    session.update_touch_right();
  }

  // The props are needed only if this session is the first in the room; later the tick has them.
  [[nodiscard]] std::vector<wire::Prop> props_for_tick() const {
    return context.rooms.count(identity.room).sessions == 1 ? context.props.of_room(identity.room)
                                                            : std::vector<wire::Prop>();
  }
  // The wind that moved here with the room, or that a client has set here. Only a server in a fleet stores it.
  [[nodiscard]] std::optional<Wind> wind_of_room() const {
    const auto found = context.winds.find(identity.room);
    return found == context.winds.end() ? std::nullopt : std::optional(found->second.wind);
  }

  Refused operator()(wire::GroomOffer& offer) {
    // A participant may upload grooms, unless its token says otherwise; a token may also let an observer upload.
    const bool by_role = identity.role == wire::Role::participant;
    if (!(identity.claims ? identity.claims->upload.value_or(by_role) : by_role))
      return {ErrorReason::not_allowed, "this session may not upload grooms"};
    if (Refused refused = context.grooms.offer(session.id(), offer, now_ns)) return refused;
    spdlog::info("event=groom_offered session={} subject={} groom={}", session.id(), log_text(identity.subject.name),
                 log_hash(offer.hash));
    return {};
  }
  Refused operator()(wire::GroomChunk& chunk) {
    const bool was_free = is_free(chunk);
    ChunkAnswer answer = context.grooms.chunk(session.id(), std::move(chunk), now_ns);
    // A large chunk is free only if it was asked for. Otherwise it costs as much as a plain message, or a client could
    // send unwanted bytes at any rate.
    if (was_free && !answer.was_wanted && !session.take_message(now_ns)) return {};
    return answer;
  }
  static bool is_free(const wire::GroomChunk& chunk) { return chunk.bytes.size() >= kFreeChunkLeast_bytes; }
  Refused operator()(wire::GroomRequest& request) {
    if (Refused refused = session.downloads_.add(request)) return refused;
    session.flush(now_ns);
    return {};
  }

  Refused operator()(wire::AddCharacter& add) {
    if (Refused refused = check(add)) return refused;
    if (Refused refused = context.grooms.retain(session.id(), add.groom, now_ns)) return refused;
    if (add.state) {
      if (std::string error = wire::validate(*add.state); !error.empty()) {
        // The character is added without the state: its hair starts at rest.
        counters.requests_refused_hair_state.add();
        session.refuse({ErrorReason::state_invalid, std::move(error)}, now_ns, add.character, add.groom);
        add.state.reset();
      }
    }
    const std::uint32_t character = add.character;
    const wire::GroomHash groom = add.groom;
    // The queue may be full. Then nothing is counted, and the groom stays retained until the session releases it.
    if (Refused refused = put(std::move(add))) return refused;
    identity.characters.emplace(character, OwnCharacter{groom});
    ++context.character_count;
    context.rooms.add_character(identity.room);
    context.subjects.add_character(identity.subject.name);
    context.token_holders.add_character(identity.subject.token_holder);
    counters.characters_added.add();
    return {};
  }
  // Checks the limits of the session, the token, the subject, the room and the server, in this order. May end detached
  // sessions of the token holder.
  [[nodiscard]] Refused check(const wire::AddCharacter& add) const {
    const SessionLimits& limits = context.limits;
    if (add.character == 0) return {ErrorReason::malformed, "character 0 names none; numbers start at 1"};
    if (identity.role == wire::Role::observer) return {ErrorReason::not_allowed, "an observer has no characters"};
    if (identity.characters.contains(add.character))
      return {ErrorReason::character_exists, "character " + std::to_string(add.character) + " exists"};
    if (identity.characters.size() >= identity.character_count_max)
      return {ErrorReason::limit_exceeded,
              "at most " + std::to_string(identity.character_count_max) + " characters a session"};
    // The client may have lost a connection: its detached sessions count, and the oldest ends first.
    while (context.token_holders.count(identity.subject.token_holder).characters >= character_count_max_of_token()) {
      if (!end_detached())
        return {ErrorReason::limit_exceeded,
                "at most " + std::to_string(character_count_max_of_token()) +
                    " characters of one token; those of a lost connection count for a while"};
    }
    if (identity.subject.kind != Subject::Kind::exempt &&
        context.subjects.count(identity.subject.name).characters >= limits.characters_per_subject_max)
      return {ErrorReason::limit_exceeded,
              "at most " + std::to_string(limits.characters_per_subject_max) + " characters of one user or address"};
    if (context.rooms.count(identity.room).characters >= limits.characters_per_room_max)
      return {ErrorReason::limit_exceeded,
              "the room is full: at most " + std::to_string(limits.characters_per_room_max) + " characters"};
    if (identity.room == context.overloaded_room) return {ErrorReason::limit_exceeded, kRoomOverloaded};
    if (context.character_count >= limits.character_count_max)
      return {ErrorReason::limit_exceeded,
              "the server is full: at most " + std::to_string(limits.character_count_max) + " characters"};
    return {};
  }
  Refused operator()(wire::RemoveCharacter& remove) {
    if (Refused refused = check_own(remove.character, "remove")) return refused;
    session.remove(remove.character);
    return {};
  }
  Refused operator()(wire::SetLevel& set) {
    if (Refused refused = check_own(set.character, "set_level")) return refused;
    return put(set);
  }
  Refused operator()(wire::SetAppearance& set) {
    if (Refused refused = check_own(set.character, "set_appearance")) return refused;
    return put(std::move(set));
  }
  Refused operator()(wire::SetMaterial& set) {
    if (Refused refused = check_own(set.character, "set_material")) return refused;
    if (std::string error = validate(set.scale); !error.empty())
      return {ErrorReason::material_invalid, std::move(error)};
    return put(set);
  }
  Refused operator()(wire::SetWind& set) {
    if (Refused refused = check_right(may_set_wind(identity, context), "set the wind")) return refused;
    if (std::string error = validate(set.wind); !error.empty()) return {ErrorReason::wind_invalid, std::move(error)};
    if (Refused refused = put(set)) return refused;
    // In a fleet the wind moves with the room, so RoomKeeper must store the new one.
    if (context.fleet) {
      context.winds[identity.room] = {set.wind, session.id()};
      context.rooms_changed.insert(identity.room);
    }
    return {};
  }
  // Refuses what the session may not do, or may not do while it is muted.
  [[nodiscard]] Refused check_right(bool has_right, const std::string& what) const {
    if (!has_right) return {ErrorReason::not_allowed, "this session may not " + what};
    if (is_muted(identity, context)) return {ErrorReason::not_allowed, "a moderator does not let this user " + what};
    return {};
  }
  Refused operator()(wire::SetTouch& set) {
    if (Refused refused = check_own(set.character, "set_touch")) return refused;
    return put(std::move(set));
  }
  // The tick checks whether the session may touch the member: only the tick knows whose the member is.
  Refused operator()(wire::TakeHold& hold) {
    if (std::string error = wire::validate(hold); !error.empty()) return {ErrorReason::touch_invalid, std::move(error)};
    return put(hold);
  }
  Refused operator()(wire::LetGo& let_go) {
    if (let_go.hand >= kHandShapesMax)
      return {ErrorReason::touch_invalid,
              "let_go: a hand has the number of a shape, which is below " + std::to_string(kHandShapesMax)};
    return put(let_go);
  }
  Refused operator()(wire::SetProps& set) {
    if (Refused refused = check_right(may_set_props(identity, context), "set props")) return refused;
    for (const wire::Prop& prop : set.props) {
      if (std::string error = wire::validate(prop); !error.empty())
        return {ErrorReason::touch_invalid, std::move(error)};
    }
    if (Refused refused = put(set)) return refused;
    context.props.set(identity.room, set, context.limits.room_count_max);
    if (context.fleet) context.rooms_changed.insert(identity.room);
    return {};
  }
  Refused operator()(wire::Moderate& request) { return moderate(request, identity, context, now_ns); }
  Refused operator()(wire::Observe& observe) {
    if (std::string error = wire::validate(observe); !error.empty())
      return {ErrorReason::observe_invalid, std::move(error)};
    return put(std::move(observe));
  }
  Refused operator()(wire::ReportImportance& report) { return put(std::move(report)); }
  Refused operator()(wire::EvaluateLearnt& evaluate) { return put(evaluate); }
  // Queues a request for the tick; refused when the queue is full.
  template <class Request>
  Refused put(Request request) {
    const std::size_t weight = weight_of(request);
    Command command = FromClient{session.id(), std::move(request)};
    if (context.commands.try_put(command, weight)) return {};
    counters.commands_dropped.add();
    return {ErrorReason::limit_exceeded, "the server is busy; try again"};
  }
  // Refuses a character that the session does not have.
  [[nodiscard]] Refused check_own(std::uint32_t character, std::string_view what) const {
    if (identity.characters.contains(character)) return {};
    return {ErrorReason::character_unknown, std::string(what) + " of character " + std::to_string(character)};
  }

  Refused operator()(wire::PoseBatch& batch) {
    PoseFilter filter{identity, session.clock_, counters};
    filter.add_missing(batch);
    const std::size_t poses = batch.poses.size(), hands = batch.hands ? 1 : 0;
    counters.poses_received.add(poses);
    counters.hands_received.add(hands);
    // The bucket of poses is charged for each sample, not for each packet. A batch passes as a whole or not at all.
    if (const auto samples = static_cast<double>(poses + hands); !identity.poses.take(samples, now_ns)) {
      counters.poses_dropped_over_rate.add(poses);
      counters.hands_dropped_over_rate.add(hands);
      session.take_message(now_ns, kDroppedPosePrice * samples);
      return {};
    }
    if (batch.hands) put_hands(filter, std::move(*batch.hands));
    put_poses(filter, std::move(batch.poses));
    return {};
  }
  // Passes the hands on to the tick. A full queue drops them, because newer hands follow soon.
  void put_hands(PoseFilter& filter, wire::HandsSample sample) {
    if (const Refused refused = filter.check(sample)) return refuse_sample(refused);
    const std::size_t weight = weight_of(sample);
    Command command = PutHands{session.id(), now_ns, std::move(sample)};
    if (!context.commands.try_put(command, weight)) counters.hands_dropped_busy.add();
  }
  // Passes on the poses that PoseFilter accepts, in one command. A full queue drops them, because newer poses follow
  // soon.
  void put_poses(PoseFilter& filter, std::vector<wire::PoseSample> poses) {
    const std::size_t received = poses.size();
    PutPoses passed{session.id(), now_ns, std::move(poses)};
    std::size_t kept = 0;
    for (wire::PoseSample& sample : passed.poses) {
      if (const Refused refused = filter.check(sample)) {
        // A datagram may come before its character's AddCharacter, or after its end.
        if (session.reads_datagram_ && refused.reason == ErrorReason::character_unknown) continue;
        refuse_sample(refused, sample.character);
      } else if (!filter.is_too_close(sample)) {
        // Poses that pass move to the front of the same array; `kept` is never beyond the pose that is read.
        passed.poses[kept++] = sample;
      }
    }
    HAIRNET_ASSERT(kept <= received);
    passed.poses.resize(kept);
    Command command = std::move(passed);
    if (kept > 0 && !context.commands.try_put(command, 1 + kept)) counters.poses_dropped_busy.add(kept);
  }
  // Answers a refused pose or hands sample, but at most once in kPoseErrorInterval_ns.
  void refuse_sample(const Refused& refused, std::uint32_t character = 0) {
    if (now_ns < session.pose_error_next_ns_) return;
    session.pose_error_next_ns_ = now_ns + kPoseErrorInterval_ns;
    session.refuse(refused, now_ns, character);
  }
};

void Session::on_message(wire::Envelope envelope, std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  silence_.on_heard(now_ns);
  const auto* chunk = std::get_if<wire::GroomChunk>(&envelope.message);
  // The price of a plain message is taken before anything else happens to the message, so that a flood of messages
  // costs little.
  if (!(chunk && MessageHandler::is_free(*chunk)) && !take_message(now_ns)) return;
  if (!clock_.observe(envelope.clock_ns, now_ns)) {
    context_->counters.packets_refused_invalid.add();
    refuse({ErrorReason::malformed, "envelope clock out of range"}, now_ns);
    return;
  }
  const bool expected = std::holds_alternative<wire::Hello>(envelope.message) ||
                        std::holds_alternative<wire::Goodbye>(envelope.message) || state_ == State::active;
  if (!expected) {
    refuse_unexpected("the first message must be hello", now_ns);
    context_->counters.sessions_closed_by_server_protocol_error.add();
    drain(GoodbyeReason::protocol_error, "the first message must be hello", now_ns);
    return;
  }
  MessageHandler handler{*this, now_ns};
  std::visit([&](auto& message) { handler.handle(message); }, envelope.message);
  check_invariants();
}

void Session::retry_hello(std::int64_t now_ns) {
  if (!waiting_hello_ || state_ != State::awaiting_hello) return;
  const std::string room(wire::room_of(waiting_hello_->room));
  const RoomRoute route = route_to_room(*context_->fleet, room, waiting_hello_->redirects, now_ns);
  // enter() asks again, with the token and all limits: they may have changed while the hello waited.
  if (route.kind == RoomRoute::Kind::wait) return;
  const wire::Hello hello = *std::exchange(waiting_hello_, std::nullopt);
  MessageHandler{*this, now_ns}.enter(hello);
  check_invariants();
}

}  // namespace hairnet::server
