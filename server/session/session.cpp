#include "server/session/session.hpp"

#include <sodium.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "schema/channel/token.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::GoodbyeReason;

constexpr std::int64_t kPoseErrorInterval_ns = 1'000'000'000;
constexpr std::size_t kIntegersPerWeight = 64;       // of a hair state: about as many bytes as a pose
constexpr std::size_t kFreeChunkLeast_bytes = 4096;  // a smaller chunk counts as a message

}  // namespace

Session::Session(SessionId id, std::shared_ptr<Connection> connection, SessionContext& context, std::int64_t now_ns)
    : connection_(std::move(connection)),
      context_(&context),
      outbox_(std::make_shared<Outbox>(context.limits.control_bytes_max, context.counters)),
      messages_(context.limits.messages_per_s, context.limits.messages_burst, now_ns),
      poses_(context.limits.poses_per_s, context.limits.poses_burst, now_ns),
      downloads_(context.grooms, context.limits, context.counters),
      opened_ns_(now_ns),
      heard_ns_(now_ns),
      pose_error_next_ns_(now_ns) {
  identity_.id = id;
  randombytes_buf(identity_.secret.data(), identity_.secret.size());
  context_->counters.sessions_opened.add();
}

void Session::on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  context_->counters.packets_received.add();
  context_->counters.histograms.received_packet_bytes.observe(static_cast<double>(packet.size()));
  wire::DecodedPacket decoded = wire::decode_packet(packet);
  if (decoded.error == wire::DecodeError::none) {
    on_message(std::move(decoded.envelope), now_ns);
    return;
  }
  refuse({ErrorReason::malformed, std::string(to_string(decoded.error)) + ": " + decoded.detail}, now_ns);
  if (decoded.error == wire::DecodeError::invalid) {
    // The packet is well formed, but a value is out of range. The stream is still in sync, so the session goes on; the
    // packet counts against the message rate.
    context_->counters.packets_refused_invalid.add();
    heard_ns_ = now_ns;
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
  if (state_ != State::active || context_->limits.resume_grace_ns == 0) return close(reason, now_ns);
  spdlog::info("event=session_detached session={} detail={}", id(), log_text(reason));
  context_->counters.sessions_detached.add();
  state_ = State::detached;
  detached_since_ns_ = now_ns;
  connection_ = nullptr;
  downloads_.clear();
  context_->commands.put(DetachSession{id()});
}

struct Session::Handler {
  Session& session;
  std::int64_t now_ns;

  void operator()(wire::Hello& m) const { session.on_hello(m, now_ns); }
  void operator()(wire::GroomOffer& m) const { session.on_groom_offer(m, now_ns); }
  void operator()(wire::GroomChunk& m) const { session.on_groom_chunk(std::move(m), now_ns); }
  void operator()(wire::AddCharacter& m) const { session.on_add_character(std::move(m), now_ns); }
  void operator()(wire::SetLevel& m) const { session.on_set_level(m, now_ns); }
  void operator()(wire::SetMaterial& m) const { session.on_set_material(m, now_ns); }
  void operator()(wire::SetWind& m) const { session.on_set_wind(m, now_ns); }
  void operator()(wire::RemoveCharacter& m) const { session.on_remove_character(m, now_ns); }
  void operator()(wire::PoseBatch& m) const { session.on_pose_batch(m, now_ns); }
  void operator()(wire::Observe& m) const { session.on_observe(std::move(m), now_ns); }
  void operator()(wire::ReportImportance& m) const { session.on_report_importance(std::move(m), now_ns); }
  void operator()(wire::RequestKeyframes& m) const { session.on_request_keyframes(std::move(m), now_ns); }
  void operator()(wire::GroomRequest& m) const { session.on_groom_request(m, now_ns); }
  void operator()(wire::Goodbye& m) const { session.on_goodbye(m, now_ns); }
  void operator()(const auto&) const { session.on_unexpected("a message that only servers send", now_ns); }
};

void Session::on_message(wire::Envelope envelope, std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  heard_ns_ = now_ns;
  const auto* chunk = std::get_if<wire::GroomChunk>(&envelope.message);
  if (!(chunk && chunk->bytes.size() >= kFreeChunkLeast_bytes) && !take_message(now_ns)) return;
  if (!clock_.observe(envelope.clock_ns, now_ns)) {
    context_->counters.packets_refused_invalid.add();
    refuse({ErrorReason::malformed, "envelope clock out of range"}, now_ns);
    return;
  }
  const bool expected = std::holds_alternative<wire::Hello>(envelope.message) ||
                        std::holds_alternative<wire::Goodbye>(envelope.message) || state_ == State::active;
  if (!expected) {
    on_unexpected("the first message must be hello", now_ns);
    context_->counters.sessions_closed_by_server_protocol_error.add();
    drain(GoodbyeReason::protocol_error, "the first message must be hello", now_ns);
    return;
  }
  std::visit(Handler{*this, now_ns}, envelope.message);
}

bool Session::take_message(std::int64_t now_ns) {
  if (messages_.take(1, now_ns)) return true;
  context_->counters.messages_refused_over_rate.add();
  context_->counters.sessions_closed_by_server_over_rate.add();
  drain(GoodbyeReason::over_rate, "too many messages a second", now_ns);
  return false;
}

void Session::on_hello(const wire::Hello& hello, std::int64_t now_ns) {
  if (state_ != State::awaiting_hello) return on_unexpected("a second hello", now_ns);
  if (hello.protocol_version != wire::kProtocolVersion) {
    context_->counters.sessions_refused_version.add();
    const std::string detail = "this server speaks version " + std::to_string(wire::kProtocolVersion) + ", not " +
                               std::to_string(hello.protocol_version);
    refuse({ErrorReason::version_unsupported, detail}, now_ns);
    drain(GoodbyeReason::version_unsupported, detail, now_ns);
    return;
  }
  if (!try_resume(hello, now_ns) && join(hello, now_ns)) welcome(false, now_ns);
}

bool Session::try_resume(const wire::Hello& hello, std::int64_t now_ns) {
  if (hello.session == 0 || !context_->directory) return false;
  auto identity =
      hello.session <= std::numeric_limits<SessionId>::max()
          ? context_->directory->take_over(*this, static_cast<SessionId>(hello.session), hello.secret, now_ns)
          : std::nullopt;
  if (!identity) {
    context_->counters.sessions_not_resumed.add();
    return false;
  }
  identity_ = std::move(*identity);
  state_ = State::active;
  joined_ = true;
  context_->counters.sessions_resumed.add();
  spdlog::info("event=session_resumed session={} peer={}", id(), connection_->peer());
  welcome(true, now_ns);
  context_->grooms.resend_states(id(), now_ns);
  return true;
}

bool Session::join(const wire::Hello& hello, std::int64_t now_ns) {
  SessionCounters& counters = context_->counters;
  const SessionLimits& limits = context_->limits;
  identity_.name = hello.client_name;
  identity_.room = hello.room;
  identity_.role = hello.role;
  identity_.character_count_max = hello.role == wire::Role::observer ? 0 : limits.characters_per_session_max;
  if (context_->session_count >= limits.session_count_max) {
    counters.sessions_refused_full.add();
    drain(GoodbyeReason::server_full,
          "the server is full: at most " + std::to_string(limits.session_count_max) + " clients", now_ns);
    return false;
  }
  Refused refused;
  const RoomCensus::Count room = context_->rooms.count(hello.room);
  if (!wire::is_room_name(hello.room))
    refused = {ErrorReason::room_invalid, "a room's name is at most 64 of a-z A-Z 0-9 . _ -"};
  else if (room.sessions == 0 && context_->rooms.room_count() >= limits.room_count_max)
    refused = {ErrorReason::limit_exceeded,
               "the server is full: at most " + std::to_string(limits.room_count_max) + " rooms"};
  else if (room.sessions >= limits.sessions_per_room_max)
    refused = {ErrorReason::limit_exceeded,
               "the room is full: at most " + std::to_string(limits.sessions_per_room_max) + " clients"};
  if (refused) {
    counters.sessions_refused_room.add();
    end(refused, GoodbyeReason::room_refused, now_ns);
    return false;
  }
  if (!check_token(hello, now_ns)) return false;
  state_ = State::active;
  joined_ = true;
  ++context_->session_count;
  context_->rooms.enter(identity_.room);
  context_->grooms.open(id(), identity_.strand_count_max, now_ns);
  counters.sessions_welcomed.add();
  spdlog::info("event=session_opened session={} client={} room={} peer={} transport={}", id(), log_text(identity_.name),
               log_text(identity_.room), connection_->peer(), connection_->transport());
  return true;
}

bool Session::check_token(const wire::Hello& hello, std::int64_t now_ns) {
  if (!context_->token_key) return true;
  const auto claims = channel::verify(hello.token, *context_->token_key, context_->unix_time_s(), hello.room);
  Refused refused;
  if (!claims)
    refused = {ErrorReason::token_invalid, std::string(channel::to_string(claims.error()))};
  else if (claims->role == channel::TokenRole::observer && hello.role == wire::Role::participant)
    refused = {ErrorReason::token_invalid, "the token lets its bearer observe only"};
  if (refused) {
    context_->counters.sessions_refused_token.add();
    end(refused, GoodbyeReason::token_refused, now_ns);
    return false;
  }
  if (claims->characters_max)
    identity_.character_count_max = std::min<std::size_t>(identity_.character_count_max, *claims->characters_max);
  if (claims->strands_max) identity_.strand_count_max = *claims->strands_max;
  return true;
}

void Session::end(const Refused& refused, GoodbyeReason reason, std::int64_t now_ns) {
  refuse(refused, now_ns);
  drain(reason, refused.detail, now_ns);
}

// The answer comes before anything that the tick says to the session.
void Session::welcome(bool resumed, std::int64_t now_ns) {
  wire::Welcome welcome;
  welcome.session = id();
  welcome.tick_rate_hz = context_->tick_rate_hz;
  welcome.tick = context_->tick.load(std::memory_order_relaxed);
  welcome.character_count_max = static_cast<std::uint32_t>(identity_.character_count_max);
  welcome.groom_bytes_max = context_->groom_bytes_max;
  welcome.room = identity_.room;
  welcome.secret = identity_.secret;
  welcome.resumed = resumed;
  welcome.resume_grace_s = static_cast<float>(static_cast<double>(context_->limits.resume_grace_ns) * 1e-9);
  welcome.pose_delay_ns = context_->pose_delay_ns;
  send(welcome, now_ns);
  context_->commands.put(OpenSession{id(), outbox_, identity_.room, resumed});
}

SessionIdentity Session::release_identity(std::int64_t now_ns) {
  if (connection_) {
    context_->counters.sessions_closed_by_server_taken_over.add();
    connection_->send(wire::encode_packet({now_ns, wire::Goodbye{GoodbyeReason::session_taken_over, ""}}));
    connection_->close(to_string(GoodbyeReason::session_taken_over));
  }
  joined_ = false;
  state_ = State::closed;
  context_->counters.sessions_closed.add();
  return std::move(identity_);
}

Refused Session::put(Command command, std::size_t weight) {
  if (context_->commands.try_put(command, weight)) return {};
  context_->counters.commands_dropped.add();
  return {ErrorReason::limit_exceeded, "the server is busy; try again"};
}

void Session::on_groom_offer(const wire::GroomOffer& offer, std::int64_t now_ns) {
  if (const Refused refused = context_->grooms.offer(id(), offer, now_ns)) {
    context_->counters.requests_refused_groom.add();
    refuse(refused, now_ns, 0, offer.hash);
  }
}

void Session::on_groom_chunk(wire::GroomChunk chunk, std::int64_t now_ns) {
  const wire::GroomHash hash = chunk.hash;
  const bool was_free = chunk.bytes.size() >= kFreeChunkLeast_bytes;
  const ChunkAnswer answer = context_->grooms.chunk(id(), std::move(chunk), now_ns);
  if (was_free && !answer.was_wanted && !take_message(now_ns)) return;  // only wanted bytes are free
  if (!answer) return;
  context_->counters.requests_refused_chunk.add();
  refuse(answer, now_ns, 0, hash);
}

void Session::on_add_character(wire::AddCharacter add, std::int64_t now_ns) {
  const SessionLimits& limits = context_->limits;
  Refused refused;
  if (add.character == 0)
    refused = {ErrorReason::malformed, "character 0 names none; numbers start at 1"};
  else if (identity_.role == wire::Role::observer)
    refused = {ErrorReason::not_allowed, "an observer has no characters"};
  else if (identity_.characters.contains(add.character))
    refused = {ErrorReason::character_exists, "character " + std::to_string(add.character) + " exists"};
  else if (identity_.characters.size() >= identity_.character_count_max)
    refused = {ErrorReason::limit_exceeded,
               "at most " + std::to_string(identity_.character_count_max) + " characters a session"};
  else if (context_->rooms.count(identity_.room).characters >= limits.characters_per_room_max)
    refused = {ErrorReason::limit_exceeded,
               "the room is full: at most " + std::to_string(limits.characters_per_room_max) + " characters"};
  else if (context_->character_count >= limits.character_count_max)
    refused = {ErrorReason::limit_exceeded,
               "the server is full: at most " + std::to_string(limits.character_count_max) + " characters"};
  else
    refused = context_->grooms.retain(id(), add.groom);
  if (!refused && add.state) {
    if (std::string fault = wire::validate(*add.state); !fault.empty()) {
      // The character is added without the state: its hair starts at rest.
      context_->counters.requests_refused_hair_state.add();
      refuse({ErrorReason::state_invalid, std::move(fault)}, now_ns, add.character, add.groom);
      add.state.reset();
    }
  }
  const std::size_t weight =
      1 + (add.state ? (add.state->displacements.size() + add.state->velocities.size()) / kIntegersPerWeight : 0);
  if (!refused)
    refused = put(AddCharacter{character_key(id(), add.character), add.groom, add.level, std::move(add.state)}, weight);
  if (refused) {
    context_->counters.requests_refused_character.add();
    refuse(refused, now_ns, add.character, add.groom);
    return;
  }
  identity_.characters.emplace(add.character, add.groom);
  ++context_->character_count;
  context_->rooms.add_character(identity_.room);
  context_->counters.characters_added.add();
}

void Session::on_set_level(const wire::SetLevel& set, std::int64_t now_ns) {
  Refused refused;
  if (!identity_.characters.contains(set.character)) {
    refused = {ErrorReason::character_unknown, "set_level of character " + std::to_string(set.character)};
  } else {
    refused = put(SetLevel{character_key(id(), set.character), set.level});
  }
  if (refused) {
    context_->counters.requests_refused_level.add();
    refuse(refused, now_ns, set.character);
  }
}

void Session::on_set_material(const wire::SetMaterial& set, std::int64_t now_ns) {
  Refused refused;
  if (!identity_.characters.contains(set.character)) {
    refused = {ErrorReason::character_unknown, "set_material of character " + std::to_string(set.character)};
  } else if (std::string fault = validate(set.scale); !fault.empty()) {
    refused = {ErrorReason::material_invalid, std::move(fault)};
  } else {
    refused = put(SetMaterial{character_key(id(), set.character), set.scale});
  }
  if (refused) {
    context_->counters.requests_refused_material.add();
    refuse(refused, now_ns, set.character);
  }
}

void Session::on_set_wind(const wire::SetWind& set, std::int64_t now_ns) {
  Refused refused;
  if (!context_->limits.wind_from_clients) {
    refused = {ErrorReason::not_allowed, "this server's wind is not for clients to set"};
  } else if (std::string fault = validate(set.wind); !fault.empty()) {
    refused = {ErrorReason::wind_invalid, std::move(fault)};
  } else {
    refused = put(SetWind{id(), set.wind});
  }
  if (refused) {
    context_->counters.requests_refused_wind.add();
    refuse(refused, now_ns);
  }
}

void Session::on_remove_character(const wire::RemoveCharacter& remove, std::int64_t now_ns) {
  if (!identity_.characters.contains(remove.character)) {
    context_->counters.requests_refused_character.add();
    refuse({ErrorReason::character_unknown, "remove of character " + std::to_string(remove.character)}, now_ns,
           remove.character);
    return;
  }
  this->remove(remove.character);
}

void Session::remove(std::uint32_t character) {
  identity_.characters.erase(character);
  --context_->character_count;
  context_->rooms.remove_character(identity_.room);
  context_->counters.characters_removed.add();
  context_->commands.put(RemoveCharacter{character_key(id(), character)});
}

void Session::revoke_groom(const wire::GroomHash& groom) {
  std::vector<std::uint32_t> lost;
  for (const auto& [character, its] : identity_.characters) {
    if (its == groom) lost.push_back(character);
  }
  std::ranges::sort(lost);
  for (const std::uint32_t character : lost) remove(character);
}

void Session::on_pose_batch(const wire::PoseBatch& batch, std::int64_t now_ns) {
  SessionCounters& counters = context_->counters;
  counters.poses_received.add(batch.poses.size());
  if (!poses_.take(static_cast<double>(batch.poses.size()), now_ns)) {
    counters.poses_dropped_over_rate.add(batch.poses.size());
    return;
  }
  PutPoses batch_put;
  batch_put.arrived_ns = now_ns;
  batch_put.poses.reserve(batch.poses.size());
  for (const wire::PoseSample& sample : batch.poses) {
    if (const Refused refused = check_pose(sample)) {
      if (now_ns >= pose_error_next_ns_) {
        pose_error_next_ns_ = now_ns + kPoseErrorInterval_ns;
        refuse(refused, now_ns, sample.character);
      }
      continue;
    }
    batch_put.poses.push_back(
        {character_key(id(), sample.character),
         {sample.sequence, *clock_.to_server(sample.capture_time_ns), sample.teleport, sample.pose}});
  }
  const std::size_t count = batch_put.poses.size();
  Command command = std::move(batch_put);
  if (count > 0 && !context_->commands.try_put(command, 1 + count)) counters.poses_dropped_busy.add(count);
}

Refused Session::check_pose(const wire::PoseSample& sample) {
  SessionCounters& counters = context_->counters;
  if (!identity_.characters.contains(sample.character)) {
    counters.poses_rejected_character.add();
    return {ErrorReason::character_unknown, "pose of character " + std::to_string(sample.character)};
  }
  const wire::PoseRefusal refusal = wire::validate_pose(sample.pose);
  switch (refusal) {
    case wire::PoseRefusal::none:
      break;
    case wire::PoseRefusal::not_finite:
      counters.poses_rejected_not_finite.add();
      break;
    case wire::PoseRefusal::not_unit:
      counters.poses_rejected_not_unit.add();
      break;
    case wire::PoseRefusal::too_far:
      counters.poses_rejected_too_far.add();
      break;
  }
  if (refusal != wire::PoseRefusal::none) return {ErrorReason::pose_invalid, wire::to_string(refusal)};
  if (!clock_.to_server(sample.capture_time_ns)) {
    counters.poses_rejected_time.add();
    return {ErrorReason::pose_invalid, "capture time is far from the envelope's clock"};
  }
  return {};
}

void Session::on_observe(wire::Observe observe, std::int64_t now_ns) {
  const std::size_t weight = 1 + observe.members.size();
  Refused refused;
  if (std::string fault = wire::validate(observe); !fault.empty())
    refused = {ErrorReason::observe_invalid, std::move(fault)};
  else
    refused = put(SetObserve{id(), std::move(observe)}, weight);
  if (!refused) return;
  context_->counters.requests_refused_observe.add();
  refuse(refused, now_ns);
}

void Session::on_report_importance(wire::ReportImportance report, std::int64_t now_ns) {
  const std::size_t weight = 1 + report.members.size();
  if (const Refused refused = put(SetImportance{id(), std::move(report.members)}, weight)) refuse(refused, now_ns);
}

void Session::on_request_keyframes(wire::RequestKeyframes request, std::int64_t now_ns) {
  context_->counters.keyframes_requested.add();
  const std::size_t weight = 1 + request.members.size();
  if (const Refused refused = put(MakeKeyframes{id(), std::move(request.members)}, weight)) refuse(refused, now_ns);
}

void Session::on_groom_request(const wire::GroomRequest& request, std::int64_t now_ns) {
  if (const Refused refused = downloads_.add(request)) return refuse(refused, now_ns, 0, request.hash);
  flush(now_ns);
}

void Session::on_goodbye(const wire::Goodbye& goodbye, std::int64_t now_ns) {
  spdlog::info("event=client_goodbye session={} detail={}", id(), log_text(goodbye.detail));
  close(to_string(GoodbyeReason::client_leaves), now_ns);
}

void Session::on_unexpected(std::string_view detail, std::int64_t now_ns) {
  context_->counters.messages_refused_unexpected.add();
  refuse({ErrorReason::unexpected_message, std::string(detail)}, now_ns);
}

void Session::refuse(const Refused& refused, std::int64_t now_ns, std::uint32_t character,
                     const wire::GroomHash& groom) {
  spdlog::debug("event=request_refused session={} reason={} detail={}", id(), to_string(refused.reason),
                log_text(refused.detail));
  send(wire::Error{refused.reason, character, groom, refused.detail}, now_ns);
}

void Session::send(const wire::Message& message, std::int64_t now_ns) {
  if (state_ == State::closed || !connection_) return;  // a resumed session gets it again
  outbox_->push(message, now_ns);
  flush(now_ns);
}

void Session::flush(std::int64_t now_ns) {
  if (state_ == State::closed || !connection_) return;
  std::vector<std::uint8_t> packet;
  while (connection_->writable()) {
    if (!outbox_->take(packet, now_ns)) {
      if (send_download(now_ns)) continue;
      if (state_ == State::draining) close("drained", now_ns);
      return;
    }
    context_->counters.packets_sent.add();
    context_->counters.histograms.sent_packet_bytes.observe(static_cast<double>(packet.size()));
    context_->counters.bytes_sent.add(packet.size());
    download_share_.sent_urgent(packet.size(), downloads_.is_waiting());
    connection_->send(std::move(packet));
    if (download_share_.is_due() && send_download(now_ns)) download_share_.sent_bulk();
  }
  outbox_->mark_blocked();
  if (full_since_ns_ == 0) full_since_ns_ = now_ns;
}

bool Session::send_download(std::int64_t now_ns) {
  if (state_ != State::active) return false;
  const std::optional<wire::Message> next = downloads_.next(id());
  if (next) outbox_->push(*next, now_ns);
  return next.has_value();
}

void Session::on_groom_read(const wire::GroomHash& groom, std::shared_ptr<const std::vector<std::uint8_t>> bytes,
                            std::int64_t now_ns) {
  if (downloads_.on_read(groom, std::move(bytes))) flush(now_ns);
}

void Session::poll(std::int64_t now_ns) {
  const SessionLimits& limits = context_->limits;
  SessionCounters& counters = context_->counters;
  if (state_ == State::closed) return;
  if (state_ == State::detached) {
    if (now_ns - detached_since_ns_ <= limits.resume_grace_ns) return;
    counters.sessions_closed_by_server_grace_over.add();
    return close("not resumed", now_ns);
  }
  if (state_ == State::draining) {
    if (now_ns - drain_since_ns_ > limits.drain_timeout_ns) close("drain time-out", now_ns);
    return;
  }
  if (outbox_->overflowed() || (full_since_ns_ != 0 && now_ns - full_since_ns_ > limits.slow_consumer_ns)) {
    counters.sessions_closed_by_server_slow.add();
    drain(GoodbyeReason::slow_consumer, "messages are not taken fast enough", now_ns);
  } else if (state_ == State::awaiting_hello && now_ns - opened_ns_ > limits.handshake_timeout_ns) {
    counters.sessions_closed_by_server_handshake_timeout.add();
    drain(GoodbyeReason::handshake_timeout, "no hello came", now_ns);
  } else if (now_ns - heard_ns_ > limits.idle_timeout_ns) {
    counters.sessions_closed_by_server_idle.add();
    drain(GoodbyeReason::idle_timeout, "nothing was heard", now_ns);
  }
}

void Session::drain(GoodbyeReason reason, std::string detail, std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  spdlog::info("event=session_draining session={} reason={} detail={}", id(), to_string(reason), log_text(detail));
  if (!connection_) return close(to_string(reason), now_ns);
  state_ = State::draining;
  drain_since_ns_ = now_ns;
  leave(now_ns);
  outbox_->push_goodbye({reason, std::move(detail)}, now_ns);
  flush(now_ns);
}

void Session::leave(std::int64_t now_ns) {
  if (!joined_) return;
  joined_ = false;
  --context_->session_count;
  context_->character_count -= identity_.characters.size();
  context_->counters.characters_removed.add(identity_.characters.size());
  context_->rooms.leave(identity_.room, identity_.characters.size());
  identity_.characters.clear();
  downloads_.clear();
  context_->commands.put(CloseSession{id()});
  context_->grooms.release(id(), now_ns);
}

void Session::close(std::string_view reason, std::int64_t now_ns) {
  if (state_ == State::closed) return;
  state_ = State::closed;
  leave(now_ns);
  if (connection_) connection_->close(reason);
  context_->counters.sessions_closed.add();
  spdlog::info("event=session_closed session={} detail={}", id(), log_text(reason));
}

}  // namespace hairnet::server
