#include "server/session/session.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "server/room/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::GoodbyeReason;

constexpr std::int64_t kPoseErrorInterval_ns = 1'000'000'000;
constexpr std::size_t kFreeChunkLeast_bytes = 4096;  // a smaller chunk counts as a message

// A peer's text for the log: no control characters, not long.
std::string printable(std::string_view text) {
  std::string out(text.substr(0, 64));
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return out;
}

}  // namespace

Session::Session(SessionId id, std::shared_ptr<Connection> connection, SessionContext& context, std::int64_t now_ns)
    : id_(id),
      connection_(std::move(connection)),
      context_(&context),
      outbox_(std::make_shared<Outbox>(context.limits.control_bytes_max, context.limits.frame_packet_bytes_max,
                                       context.counters)),
      messages_(context.limits.messages_per_s, context.limits.messages_burst, now_ns),
      poses_(context.limits.poses_per_s, context.limits.poses_burst, now_ns),
      opened_ns_(now_ns),
      heard_ns_(now_ns),
      pose_error_next_ns_(now_ns) {
  context_->counters.sessions_opened.add();
}

void Session::on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  context_->counters.packets_received.add();
  context_->counters.histograms.received_packet_bytes.observe(static_cast<double>(packet.size()));
  wire::Decoded decoded = wire::decode_packet(packet);
  if (decoded.error == wire::DecodeError::none) {
    on_message(std::move(decoded.envelope), now_ns);
    return;
  }
  refuse({ErrorReason::malformed, std::string(to_string(decoded.error)) + ": " + decoded.detail}, now_ns);
  if (decoded.error == wire::DecodeError::invalid) {
    // A sound packet with a value out of range: a wrong client, but still in step with us. It costs as a message does.
    context_->counters.packets_invalid.add();
    heard_ns_ = now_ns;
    if (state_ == State::active && messages_.take(1, now_ns)) return;
  } else {
    context_->counters.packets_malformed.add();
  }
  context_->counters.sessions_closed_protocol_error.add();
  drain(GoodbyeReason::protocol_error, decoded.detail, now_ns);
}

void Session::on_broken_stream(std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  context_->counters.packets_oversize.add();
  context_->counters.sessions_closed_protocol_error.add();
  refuse({ErrorReason::malformed, "a packet's size prefix is out of bounds"}, now_ns);
  drain(GoodbyeReason::protocol_error, "a packet's size prefix is out of bounds", now_ns);
}

void Session::on_writable(std::int64_t now_ns) {
  full_since_ns_ = 0;
  flush(now_ns);
}

void Session::on_closed(std::string_view reason, std::int64_t now_ns) {
  close(reason, now_ns);
}

struct Session::Handler {
  Session& session;
  std::int64_t now_ns;

  void operator()(wire::Hello& m) const { session.on_hello(m, now_ns); }
  void operator()(wire::GroomOffer& m) const { session.on_groom_offer(m, now_ns); }
  void operator()(wire::GroomChunk& m) const { session.on_groom_chunk(std::move(m), now_ns); }
  void operator()(wire::AddCharacter& m) const { session.on_add_character(m, now_ns); }
  void operator()(wire::SetLevel& m) const { session.on_set_level(m, now_ns); }
  void operator()(wire::SetMaterial& m) const { session.on_set_material(m, now_ns); }
  void operator()(wire::SetWind& m) const { session.on_set_wind(m, now_ns); }
  void operator()(wire::RemoveCharacter& m) const { session.on_remove_character(m, now_ns); }
  void operator()(wire::PoseBatch& m) const { session.on_pose_batch(m, now_ns); }
  void operator()(wire::Goodbye& m) const { session.on_goodbye(m, now_ns); }
  void operator()(const auto&) const { session.on_unexpected("a message that only servers send", now_ns); }
};

void Session::on_message(wire::Envelope envelope, std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  heard_ns_ = now_ns;
  const auto* chunk = std::get_if<wire::GroomChunk>(&envelope.message);
  if (!(chunk && chunk->bytes.size() >= kFreeChunkLeast_bytes) && !messages_.take(1, now_ns)) {
    context_->counters.messages_over_rate.add();
    context_->counters.sessions_closed_over_rate.add();
    drain(GoodbyeReason::over_rate, "too many messages a second", now_ns);
    return;
  }
  if (!clock_.observe(envelope.clock_ns, now_ns)) {
    context_->counters.packets_invalid.add();
    refuse({ErrorReason::malformed, "envelope clock out of range"}, now_ns);
    return;
  }
  const bool expected = std::holds_alternative<wire::Hello>(envelope.message) ||
                        std::holds_alternative<wire::Goodbye>(envelope.message) || state_ == State::active;
  if (!expected) {
    on_unexpected("the first message must be hello", now_ns);
    context_->counters.sessions_closed_protocol_error.add();
    drain(GoodbyeReason::protocol_error, "the first message must be hello", now_ns);
    return;
  }
  std::visit(Handler{*this, now_ns}, envelope.message);
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
  state_ = State::active;
  joined_ = true;
  name_ = printable(hello.client_name);
  context_->counters.sessions_welcomed.add();
  context_->commands.put(OpenSession{id_, outbox_});
  spdlog::info("event=session_opened session={} client={} peer={} transport={}", id_, log_text(name_),
               connection_->peer(), connection_->transport());
  wire::Welcome welcome;
  welcome.session = id_;
  welcome.tick_rate_hz = context_->tick_rate_hz;
  welcome.tick = context_->tick.load(std::memory_order_relaxed);
  welcome.character_count_max = static_cast<std::uint32_t>(context_->limits.characters_per_session_max);
  welcome.groom_bytes_max = context_->groom_bytes_max;
  send(welcome, now_ns);
}

void Session::on_groom_offer(const wire::GroomOffer& offer, std::int64_t now_ns) {
  if (const Refused refused = context_->grooms.offer(id_, offer, now_ns)) {
    context_->counters.grooms_refused.add();
    refuse(refused, now_ns, 0, offer.hash);
  }
}

void Session::on_groom_chunk(wire::GroomChunk chunk, std::int64_t now_ns) {
  const wire::GroomHash hash = chunk.hash;
  const bool was_free = chunk.bytes.size() >= kFreeChunkLeast_bytes;
  if (const Refused refused = context_->grooms.chunk(id_, std::move(chunk), now_ns)) {
    context_->counters.chunks_refused.add();
    refuse(refused, now_ns, 0, hash);
    if (was_free) messages_.take(1, now_ns);  // only wanted bytes are free
  }
}

void Session::on_add_character(const wire::AddCharacter& add, std::int64_t now_ns) {
  const SessionLimits& limits = context_->limits;
  Refused refused;
  if (add.character == 0)
    refused = {ErrorReason::malformed, "character 0 names none; numbers start at 1"};
  else if (characters_.contains(add.character))
    refused = {ErrorReason::character_exists, "character " + std::to_string(add.character) + " exists"};
  else if (characters_.size() >= limits.characters_per_session_max)
    refused = {ErrorReason::limit_exceeded,
               "at most " + std::to_string(limits.characters_per_session_max) + " characters a session"};
  else if (context_->character_count >= limits.character_count_max)
    refused = {ErrorReason::limit_exceeded,
               "the server holds its " + std::to_string(limits.character_count_max) + " characters"};
  else
    refused = context_->grooms.hold(id_, add.groom);
  if (!refused) {
    Command command = AddCharacter{character_key(id_, add.character), add.groom, add.level};
    if (!context_->commands.try_put(command)) {
      context_->counters.commands_dropped.add();
      refused = {ErrorReason::limit_exceeded, "the server is busy; try again"};
    }
  }
  if (refused) {
    context_->counters.characters_refused.add();
    refuse(refused, now_ns, add.character, add.groom);
    return;
  }
  characters_.emplace(add.character, add.groom);
  ++context_->character_count;
  context_->counters.characters_added.add();
}

void Session::on_set_level(const wire::SetLevel& set, std::int64_t now_ns) {
  Refused refused;
  Command command = SetLevel{character_key(id_, set.character), set.level};
  if (!characters_.contains(set.character)) {
    refused = {ErrorReason::character_unknown, "set_level of character " + std::to_string(set.character)};
  } else if (!context_->commands.try_put(command)) {
    context_->counters.commands_dropped.add();
    refused = {ErrorReason::limit_exceeded, "the server is busy; try again"};
  }
  if (refused) {
    context_->counters.levels_refused.add();
    refuse(refused, now_ns, set.character);
  }
}

void Session::on_set_material(const wire::SetMaterial& set, std::int64_t now_ns) {
  Refused refused;
  Command command = SetMaterial{character_key(id_, set.character), set.scale};
  if (!characters_.contains(set.character)) {
    refused = {ErrorReason::character_unknown, "set_material of character " + std::to_string(set.character)};
  } else if (std::string fault = validate(set.scale); !fault.empty()) {
    refused = {ErrorReason::material_invalid, std::move(fault)};
  } else if (!context_->commands.try_put(command)) {
    context_->counters.commands_dropped.add();
    refused = {ErrorReason::limit_exceeded, "the server is busy; try again"};
  }
  if (refused) {
    context_->counters.materials_refused.add();
    refuse(refused, now_ns, set.character);
  }
}

void Session::on_set_wind(const wire::SetWind& set, std::int64_t now_ns) {
  Refused refused;
  Command command = SetWind{set.wind};
  if (!context_->limits.wind_from_clients) {
    refused = {ErrorReason::not_allowed, "this server's wind is not for clients to set"};
  } else if (std::string fault = validate(set.wind); !fault.empty()) {
    refused = {ErrorReason::wind_invalid, std::move(fault)};
  } else if (!context_->commands.try_put(command)) {
    context_->counters.commands_dropped.add();
    refused = {ErrorReason::limit_exceeded, "the server is busy; try again"};
  }
  if (refused) {
    context_->counters.winds_refused.add();
    refuse(refused, now_ns);
  }
}

void Session::on_remove_character(const wire::RemoveCharacter& remove, std::int64_t now_ns) {
  if (characters_.erase(remove.character) == 0) {
    context_->counters.characters_refused.add();
    refuse({ErrorReason::character_unknown, "remove of character " + std::to_string(remove.character)}, now_ns,
           remove.character);
    return;
  }
  --context_->character_count;
  context_->counters.characters_removed.add();
  context_->commands.put(RemoveCharacter{character_key(id_, remove.character)});
}

void Session::on_pose_batch(const wire::PoseBatch& batch, std::int64_t now_ns) {
  SessionCounters& counters = context_->counters;
  counters.poses_received.add(batch.poses.size());
  if (!poses_.take(static_cast<double>(batch.poses.size()), now_ns)) {
    counters.poses_over_rate.add(batch.poses.size());
    return;
  }
  PutPoses put;
  put.arrived_ns = now_ns;
  put.poses.reserve(batch.poses.size());
  for (const wire::PoseSample& sample : batch.poses) {
    if (const Refused refused = check_pose(sample)) {
      if (now_ns >= pose_error_next_ns_) {
        pose_error_next_ns_ = now_ns + kPoseErrorInterval_ns;
        refuse(refused, now_ns, sample.character);
      }
      continue;
    }
    put.poses.push_back({character_key(id_, sample.character),
                         {sample.sequence, *clock_.to_server(sample.capture_time_ns), sample.teleport, sample.pose}});
  }
  const std::size_t count = put.poses.size();
  Command command = std::move(put);
  if (count > 0 && !context_->commands.try_put(command, 1 + count)) counters.poses_dropped_busy.add(count);
}

Refused Session::check_pose(const wire::PoseSample& sample) {
  SessionCounters& counters = context_->counters;
  if (!characters_.contains(sample.character)) {
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

void Session::on_goodbye(const wire::Goodbye& goodbye, std::int64_t now_ns) {
  spdlog::info("event=client_leaves session={} why={}", id_, log_text(goodbye.detail));
  close(to_string(GoodbyeReason::client_leaves), now_ns);
}

void Session::on_unexpected(std::string_view detail, std::int64_t now_ns) {
  context_->counters.messages_unexpected.add();
  refuse({ErrorReason::unexpected_message, std::string(detail)}, now_ns);
}

void Session::refuse(const Refused& refused, std::int64_t now_ns, std::uint32_t character,
                     const wire::GroomHash& groom) {
  spdlog::debug("event=refused session={} reason={} why={}", id_, to_string(refused.reason), log_text(refused.detail));
  send(wire::Error{refused.reason, character, groom, refused.detail}, now_ns);
}

void Session::send(const wire::Message& message, std::int64_t now_ns) {
  if (state_ == State::closed) return;
  outbox_->push(message, now_ns);
  flush(now_ns);
}

void Session::flush(std::int64_t now_ns) {
  if (state_ == State::closed) return;
  std::vector<std::uint8_t> packet;
  while (connection_->writable()) {
    if (!outbox_->take(packet, now_ns)) {
      if (state_ == State::draining) close("drained", now_ns);
      return;
    }
    context_->counters.packets_sent.add();
    context_->counters.histograms.sent_packet_bytes.observe(static_cast<double>(packet.size()));
    context_->counters.bytes_sent.add(packet.size());
    connection_->send(std::move(packet));
  }
  if (full_since_ns_ == 0) full_since_ns_ = now_ns;
}

void Session::poll(std::int64_t now_ns) {
  const SessionLimits& limits = context_->limits;
  SessionCounters& counters = context_->counters;
  if (state_ == State::closed) return;
  if (state_ == State::draining) {
    if (now_ns - drain_since_ns_ > limits.drain_timeout_ns) close("drain time-out", now_ns);
    return;
  }
  if (outbox_->overflowed() || (full_since_ns_ != 0 && now_ns - full_since_ns_ > limits.slow_consumer_ns)) {
    counters.sessions_closed_slow.add();
    drain(GoodbyeReason::slow_consumer, "messages are not taken fast enough", now_ns);
  } else if (state_ == State::awaiting_hello && now_ns - opened_ns_ > limits.handshake_timeout_ns) {
    counters.sessions_closed_handshake_timeout.add();
    drain(GoodbyeReason::handshake_timeout, "no hello came", now_ns);
  } else if (now_ns - heard_ns_ > limits.idle_timeout_ns) {
    counters.sessions_closed_idle.add();
    drain(GoodbyeReason::idle_timeout, "nothing was heard", now_ns);
  }
}

void Session::drain(GoodbyeReason reason, std::string detail, std::int64_t now_ns) {
  if (state_ == State::draining || state_ == State::closed) return;
  spdlog::info("event=session_ends session={} reason={} why={}", id_, to_string(reason), log_text(detail));
  state_ = State::draining;
  drain_since_ns_ = now_ns;
  leave(now_ns);
  outbox_->push_goodbye({reason, std::move(detail)}, now_ns);
  flush(now_ns);
}

void Session::leave(std::int64_t now_ns) {
  if (!joined_) return;
  joined_ = false;
  context_->character_count -= characters_.size();
  characters_.clear();
  context_->commands.put(CloseSession{id_});
  context_->grooms.release(id_, now_ns);
}

void Session::close(std::string_view reason, std::int64_t now_ns) {
  if (state_ == State::closed) return;
  state_ = State::closed;
  leave(now_ns);
  connection_->close(reason);
  context_->counters.sessions_closed.add();
  spdlog::info("event=session_closed session={} reason={}", id_, log_text(reason));
}

}  // namespace hairnet::server
