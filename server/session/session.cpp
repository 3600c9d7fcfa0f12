#include "server/session/session.hpp"

#include <sodium.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "server/session/rights.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::GoodbyeReason;

}  // namespace

Session::Session(SessionId id, std::shared_ptr<Connection> connection, SessionContext& context, std::int64_t now_ns)
    : identity_(context.limits, now_ns),
      connection_(std::move(connection)),
      context_(&context),
      outbox_(std::make_shared<Outbox>(context.limits.control_bytes_max, context.counters,
                                       connection_->datagram_bytes_max())),
      downloads_(context.grooms, context.limits, context.counters, now_ns),
      opened_ns_(now_ns),
      sent_ns_(now_ns),
      silence_(now_ns),
      pose_error_next_ns_(now_ns) {
  HAIRNET_ASSERT(id != 0);
  HAIRNET_ASSERT(connection_);
  identity_.id = id;
  // The secret needs a cryptographic source: whoever guesses it could take the session over.
  randombytes_buf(identity_.secret.data(), identity_.secret.size());
  context_->counters.sessions_opened.add();
  ++context_->awaiting_hello_count;
}

void Session::set_state(State state) {
  if (state_ == State::awaiting_hello) --context_->awaiting_hello_count;
  // No session goes back to its beginning: a resume makes a new Session, which takes the identity over.
  HAIRNET_ASSERT(state != State::awaiting_hello);
  state_ = state;
}

// Asserts what is true between two calls from outside.
void Session::check_invariants() const {
  HAIRNET_ASSERT(joined_ == (state_ == State::active || state_ == State::detached));
  HAIRNET_ASSERT(joined_ || identity_.characters.empty());
  if (state_ == State::detached) HAIRNET_ASSERT(!connection_);
  if (state_ == State::active || state_ == State::awaiting_hello || state_ == State::draining)
    HAIRNET_ASSERT(connection_);
  HAIRNET_ASSERT(context_->character_count >= identity_.characters.size());
  HAIRNET_ASSERT(!joined_ || context_->session_count > 0);
}

void Session::on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  receive(packet, now_ns);
}

void Session::on_datagram(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  // A client sends poses only after its welcome. A datagram that comes before, or after the end of the session, counts
  // as lost.
  if (state_ != State::active) return context_->counters.datagrams_dropped.add();
  reads_datagram_ = true;
  receive(packet, now_ns);
  reads_datagram_ = false;
}

void Session::receive(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  context_->counters.packets_received.add();
  context_->counters.histograms.received_packet_bytes.observe(static_cast<double>(packet.size()));
  // Only a packet that brings the server from enough memory to none ends its session. When memory was full before, the
  // refusals of single messages are enough.
  const bool was_full = context_->is_memory_full();
  wire::DecodedPacket decoded = wire::decode_packet(packet);
  if (decoded.error != wire::DecodeError::none) {
    refuse_packet(decoded, now_ns);
  } else if (!reads_datagram_ || std::holds_alternative<wire::PoseBatch>(decoded.envelope.message)) {
    on_message(std::move(decoded.envelope), now_ns);
  } else if (take_message(now_ns)) {
    // Messages rely on their order, which datagrams do not have. A stray one is charged and refused, and the session
    // goes on.
    refuse_unexpected("a datagram has poses and hands only", now_ns);
  }
  // Memory was left before this packet, so this packet has used it up.
  if (!was_full && context_->is_memory_full()) end_for_memory(now_ns);
}

void Session::refuse_packet(const wire::DecodedPacket& decoded, std::int64_t now_ns) {
  refuse({ErrorReason::malformed, std::string(to_string(decoded.error)) + ": " + decoded.detail}, now_ns);
  if (decoded.error == wire::DecodeError::invalid) {
    // The packet is well formed, but a value is out of range. The next packet can still be read, so the session goes
    // on; the packet counts against the message rate.
    context_->counters.packets_refused_invalid.add();
    silence_.on_heard(now_ns);
    if (state_ == State::active) {
      take_message(now_ns);
      return;
    }
  } else {
    context_->counters.packets_refused_malformed.add();
  }
  context_->counters.sessions_closed_by_server_protocol_error.add();
  drain(GoodbyeReason::protocol_error, decoded.detail, now_ns);
}

// The transport reads nothing more after this call: after a wrong size prefix nobody knows where the next packet
// begins.
void Session::on_broken_stream(std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  context_->counters.packets_refused_oversize.add();
  context_->counters.sessions_closed_by_server_protocol_error.add();
  refuse({ErrorReason::malformed, "a packet's size prefix is out of bounds"}, now_ns);
  drain(GoodbyeReason::protocol_error, "a packet's size prefix is out of bounds", now_ns);
}

void Session::on_writable(std::int64_t now_ns) {
  full_since_ns_ = 0;
  flush(now_ns);
}

void Session::on_closed(std::string_view reason, std::int64_t now_ns) {
  // A session that has not joined has nothing to resume, and one that drains has said goodbye.
  if (state_ != State::active || context_->limits.resume_grace_ns == 0) return close(reason, now_ns);
  spdlog::info("event=session_detached session={} detail={}", id(), log_text(reason));
  context_->counters.sessions_detached.add();
  set_state(State::detached);
  detached_since_ns_ = now_ns;
  // The outbox stays with the tick until DetachSession is taken. What is pushed meanwhile is lost, and a resume sends
  // states again.
  connection_ = nullptr;
  downloads_.clear();
  // put() and not try_put(): the tick must hear of each end, and the number of sessions bounds these commands.
  context_->commands.put(DetachSession{id()});
  check_invariants();
}

void Session::on_download_stopped(DownloadStream stream, std::int64_t now_ns) {
  downloads_.on_stopped(stream);
  // Another download may have its turn now.
  flush(now_ns);
}

bool Session::take_message(std::int64_t now_ns, double price) {
  // A client that exceeds the rate is sent away and not slowed down: to slow it down, the server would have to keep its
  // messages.
  if (identity_.messages.take(price, now_ns)) return true;
  context_->counters.messages_refused_over_rate.add();
  context_->counters.sessions_closed_by_server_over_rate.add();
  drain(GoodbyeReason::over_rate, "too many messages a second", now_ns);
  return false;
}

SessionIdentity Session::release_identity(std::int64_t now_ns) {
  HAIRNET_ASSERT(joined_);
  if (connection_) {
    context_->counters.sessions_closed_by_server_taken_over.add();
    // The goodbye tells the old connection's client not to resume. Otherwise the two clients would take the session
    // from each other again and again.
    connection_->send(wire::encode_packet({now_ns, wire::Goodbye{GoodbyeReason::session_taken_over, ""}}));
    connection_->close(to_string(GoodbyeReason::session_taken_over));
  }
  // The counts of room, subject and token holder are not touched: the successor stands for the same session in them.
  joined_ = false;
  set_state(State::closed);
  context_->counters.sessions_closed.add();
  return std::move(identity_);
}

void Session::remove(std::uint32_t character) {
  HAIRNET_ASSERT(identity_.characters.contains(character));
  HAIRNET_ASSERT(context_->character_count > 0);
  identity_.characters.erase(character);
  --context_->character_count;
  context_->rooms.remove_character(identity_.room);
  context_->subjects.remove_character(identity_.subject.name);
  context_->token_holders.remove_character(identity_.subject.token_holder);
  context_->counters.characters_removed.add();
  // A removal cannot be refused: the number of characters bounds the commands. AddCharacter has paid for it.
  context_->commands.put(FromClient{id(), wire::RemoveCharacter{character}});
}

void Session::update_touch_right() {
  const bool may_touch = may_touch_others(identity_) && !is_muted(identity_, *context_);
  if (std::exchange(identity_.touches_others, may_touch) != may_touch)
    context_->commands.put(SetTouchRight{id(), may_touch});
}

void Session::revoke_groom(const wire::GroomHash& groom) {
  std::vector<std::uint32_t> lost;
  for (const auto& [character, its] : identity_.characters) {
    if (its.groom == groom) lost.push_back(character);
  }
  // The map is unordered; the order of removals must not differ between two runs of a seed.
  std::ranges::sort(lost);
  for (const std::uint32_t character : lost) remove(character);
}

void Session::refuse_unexpected(std::string_view detail, std::int64_t now_ns) {
  context_->counters.messages_refused_unexpected.add();
  refuse({ErrorReason::unexpected_message, std::string(detail)}, now_ns);
}

void Session::refuse(const Refused& refused, std::int64_t now_ns, std::uint32_t character,
                     const wire::GroomHash& groom) {
  spdlog::debug("event=request_refused session={} reason={} detail={}", id(), to_string(refused.reason),
                log_text(refused.detail));
  HAIRNET_ASSERT(refused.reason != ErrorReason::none);
  send(wire::Error{refused.reason, character, groom, refused.detail}, now_ns);
}

void Session::send(const wire::Message& message, std::int64_t now_ns) {
  // A session that is resumed later gets states again.
  if (state_ == State::closed || !connection_) return;
  outbox_->push(message, now_ns);
  flush(now_ns);
}

void Session::flush(std::int64_t now_ns) {
  if (state_ == State::closed || !connection_) return;
  // The tick thread reads this estimate to choose the detail of frames; it may not ask the connection, which belongs to
  // the I/O thread.
  outbox_->set_bytes_per_s(connection_->bytes_per_s());
  // Another server may have the room by now. Frames that were made before the fence closed must not follow: the client
  // would see two servers' hair.
  if (joined_ && context_->fleet && !context_->fleet->holds(identity_.room, now_ns)) outbox_->withdraw_frames();
  // Downloads with streams of their own go first, and take nothing from the ordered stream.
  send_on_streams(now_ns);
  std::vector<std::uint8_t> packet;
  bool may_be_lost = false;
  // The connection's queue is bounded and small. What it does not take stays in the outbox, where newer frames replace
  // older ones.
  while (connection_->writable()) {
    if (!outbox_->take(packet, may_be_lost, now_ns)) {
      // A piece goes through the outbox, so that it stands in order behind messages that have been pushed meanwhile.
      if (send_download(now_ns)) continue;
      // The goodbye has left, since it is the last packet of a draining outbox.
      if (state_ == State::draining) close("drained", now_ns);
      return;
    }
    note_sent(packet, now_ns);
    if (may_be_lost)
      connection_->send_datagram(std::move(packet));
    else
      connection_->send(std::move(packet));
    // Downloads get a quarter of the bytes even while something else always waits (BulkScheduler). Otherwise a busy
    // room would keep a client from ever getting hair to draw.
    if (download_scheduler_.is_due() && send_download(now_ns)) download_scheduler_.sent_bulk();
  }
  outbox_->mark_blocked();
  if (full_since_ns_ == 0) full_since_ns_ = now_ns;
  // Frames need not wait until lost packets of the ordered stream have been sent again.
  while (connection_->takes_datagrams() && outbox_->take_unreliable(packet, now_ns)) {
    note_sent(packet, now_ns);
    connection_->send_datagram(std::move(packet));
  }
}

void Session::note_sent(const std::vector<std::uint8_t>& packet, std::int64_t now_ns) {
  sent_ns_ = now_ns;
  context_->counters.packets_sent.add();
  context_->counters.histograms.sent_packet_bytes.observe(static_cast<double>(packet.size()));
  context_->counters.bytes_sent.add(packet.size());
  download_scheduler_.sent_urgent(packet.size(), downloads_.is_waiting());
}

bool Session::send_download(std::int64_t now_ns) {
  if (state_ != State::active || connection_->has_download_streams()) return false;
  const std::optional<wire::Message> next = downloads_.next(id(), now_ns);
  if (next) outbox_->push(*next, now_ns);
  return next.has_value();
}

void Session::send_on_streams(std::int64_t now_ns) {
  if (state_ != State::active || !connection_->has_download_streams()) return;
  while (auto next = downloads_.next_on_stream(*connection_, id(), now_ns)) {
    if (const auto* refusal = std::get_if<wire::Error>(&*next)) {
      outbox_->push(*refusal, now_ns);
      continue;
    }
    auto& piece = std::get<Downloads::Piece>(*next);
    std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, std::move(piece.data)});
    note_sent(packet, now_ns);
    connection_->send_download(piece.stream, std::move(packet), piece.is_last);
  }
}

void Session::on_groom_read(const wire::GroomHash& groom, std::shared_ptr<const std::vector<std::uint8_t>> bytes,
                            std::int64_t now_ns) {
  if (downloads_.on_read(groom, std::move(bytes))) flush(now_ns);
}

void Session::poll(std::int64_t now_ns) {
  const SessionLimits& limits = context_->limits;
  SessionCounters& counters = context_->counters;
  check_invariants();
  if (state_ == State::closed) return;
  if (state_ == State::detached) {
    if (now_ns - detached_since_ns_ > limits.resume_grace_ns) end_detached(now_ns);
    return;
  }
  if (state_ == State::draining) {
    if (now_ns - drain_since_ns_ > limits.drain_timeout_ns) close("drain time-out", now_ns);
    return;
  }
  // A client counts as too slow only while its connection is full: a client that has read everything is not slow,
  // however long it took.
  const bool is_stuck = full_since_ns_ != 0 && (now_ns - full_since_ns_ > limits.slow_consumer_ns ||
                                                outbox_->is_overdue(now_ns, limits.slow_consumer_ns));
  if (outbox_->overflowed() || is_stuck) {
    counters.sessions_closed_by_server_slow.add();
    drain(GoodbyeReason::slow_consumer, "messages are not taken fast enough", now_ns);
  } else if (state_ == State::awaiting_hello && now_ns - opened_ns_ > limits.handshake_timeout_ns) {
    // The client has said hello in time; it is the directory that has not answered.
    if (waiting_hello_) {
      counters.sessions_refused_fleet.add();
      drain(GoodbyeReason::server_full, "nobody can tell which server has the room; try again", now_ns);
      return;
    }
    counters.sessions_closed_by_server_handshake_timeout.add();
    drain(GoodbyeReason::handshake_timeout, "no hello came", now_ns);
  } else if (silence_.look(now_ns) > (gives_signs_of_life_ ? channel::kSilence_ns : limits.idle_timeout_ns)) {
    // A client that promised signs of life is lost much sooner, because its silence means something. An older client
    // may be silent while it has nothing to send.
    counters.sessions_closed_by_server_idle.add();
    drain(GoodbyeReason::idle_timeout, "nothing was heard", now_ns);
  } else if (const auto stalled = downloads_.give_up_stalled(*connection_, now_ns)) {
    send(*stalled, now_ns);
  } else if (state_ == State::active && now_ns - sent_ns_ >= channel::kSignOfLife_ns && outbox_->packet_count() == 0) {
    // An empty batch of frames is the server's sign of life: every client knows this message.
    send(wire::FrameBatch{context_->tick.load(std::memory_order_relaxed), now_ns, {}}, now_ns);
  }
}

void Session::end_detached(std::int64_t now_ns) {
  HAIRNET_ASSERT(state_ == State::detached);
  context_->counters.sessions_closed_by_server_grace_over.add();
  close("not resumed", now_ns);
}

void Session::end_for_memory(std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  context_->counters.sessions_closed_by_server_memory.add();
  drain(GoodbyeReason::server_full, kMemoryFull, now_ns);
}

void Session::check_token(std::int64_t unix_s, std::int64_t now_ns) {
  // A resume changes the claims, so a client with a new token reconnects before the old one expires.
  if (!joined_ || !identity_.claims) return;
  const bool is_revoked = context_->revoked_tokens.contains(*identity_.claims);
  if (!is_revoked && unix_s < identity_.claims->expires_s) return;
  SessionCounters& counters = context_->counters;
  (is_revoked ? counters.sessions_closed_by_server_token_revoked : counters.sessions_closed_by_server_token_expired)
      .add();
  const char* detail =
      is_revoked ? kTokenRevoked : "the token has expired; ask the operator of the server for a new one";
  refuse({ErrorReason::token_invalid, detail}, now_ns);
  drain(GoodbyeReason::token_refused, detail, now_ns);
}

void Session::drain(GoodbyeReason reason, std::string detail, std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  spdlog::info("event=session_draining session={} reason={} detail={}", id(), to_string(reason), log_text(detail));
  if (!connection_) return close(to_string(reason), now_ns);
  set_state(State::draining);
  drain_since_ns_ = now_ns;
  goes_on_elsewhere_ |= reason == GoodbyeReason::server_draining;
  // The session leaves the room now, and not when the last packet has been sent: a slow client must not stay visible to
  // others.
  leave(now_ns);
  outbox_->push_goodbye({reason, std::move(detail)}, now_ns);
  flush(now_ns);
}

void Session::send_away(const ServerAddress& to, std::int64_t now_ns) {
  context_->counters.sessions_redirected.add();
  wire::Redirect redirect;
  if (!to.host.empty()) redirect.to = {to.host, to.port};
  outbox_->push(redirect, now_ns);
  spdlog::info("event=session_redirected session={} trace={:016x} to={} port={}", id(), identity_.trace,
               log_text(to.host), to.port);
  goes_on_elsewhere_ = true;
  const std::string where = to.host.empty() ? "another server" : to.host + ", port " + std::to_string(to.port);
  drain(GoodbyeReason::server_full, "the room is held by " + where, now_ns);
}

void Session::note_member_change() {
  if (context_->fleet && context_->rules.is_locked(identity_.room)) context_->rooms_changed.insert(identity_.room);
}

// A wind lasts as long as the session that has set it is in the room, and ends when the last session leaves.
void Session::forget_wind(bool is_room_empty) {
  const auto found = context_->winds.find(identity_.room);
  if (found == context_->winds.end() || (found->second.session != id() && !is_room_empty)) return;
  context_->winds.erase(found);
  context_->rooms_changed.insert(identity_.room);
}

void Session::leave(std::int64_t now_ns) {
  if (!joined_) return;
  joined_ = false;
  HAIRNET_ASSERT(context_->session_count > 0);
  HAIRNET_ASSERT(context_->character_count >= identity_.characters.size());
  --context_->session_count;
  context_->character_count -= identity_.characters.size();
  context_->counters.characters_removed.add(identity_.characters.size());
  context_->rooms.leave(identity_.room, identity_.characters.size());
  note_member_change();
  const bool is_empty = context_->rooms.count(identity_.room).sessions == 0;
  // A session that goes on elsewhere with its room will still want its wind there.
  if (!goes_on_elsewhere_) forget_wind(is_empty);
  if (is_empty) {
    context_->rules.close_room(identity_.room, now_ns + context_->room_grace_ns);
    // In a fleet the release of the room ends what it has; on a server alone its grace time does.
    if (context_->fleet)
      context_->rooms_left.insert(identity_.room);
    else
      context_->props.close_room(identity_.room, now_ns + context_->room_grace_ns);
  }
  context_->subjects.leave(identity_.subject.name, identity_.characters.size());
  context_->token_holders.leave(identity_.subject.token_holder, identity_.characters.size());
  identity_.characters.clear();
  downloads_.clear();
  // The tick removes the characters by this one command; the counts above have left them out already.
  context_->commands.put(CloseSession{id(), goes_on_elsewhere_});
  // Grooms come last: ForgetGroom follows CloseSession in the queue, so no character loses its groom while it lives.
  context_->grooms.release(id(), now_ns);
}

void Session::close(std::string_view reason, std::int64_t now_ns) {
  if (state_ == State::closed) return;
  set_state(State::closed);
  leave(now_ns);
  if (connection_) connection_->close(reason);
  check_invariants();
  context_->counters.sessions_closed.add();
  spdlog::info("event=session_closed session={} detail={}", id(), log_text(reason));
}

}  // namespace hairnet::server
