#include "tests/load/wire_peer.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::load {

void WirePeer::open(std::int64_t now_ns) {
  wire::Hello hello;
  hello.client_name = client_name_;
  say(std::move(hello), now_ns);
}

bool WirePeer::on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns, PeerEvents& events) {
  const wire::Decoded decoded = wire::decode_packet(packet);
  if (decoded.error != wire::DecodeError::none) return false;
  clock_.observe(decoded.envelope.clock_ns, now_ns);
  const wire::Message& message = decoded.envelope.message;
  if (const auto* batch = std::get_if<wire::FrameBatch>(&message))
    report(*batch, decoded.envelope.clock_ns, now_ns, events);
  else if (const auto* welcome = std::get_if<wire::Welcome>(&message))
    events.on_welcome(*welcome, now_ns);
  else if (const auto* need = std::get_if<wire::GroomNeed>(&message))
    send_groom(*need, now_ns);
  else if (const auto* status = std::get_if<wire::GroomStatus>(&message))
    events.on_groom_state(status->hash, status->state);
  else if (const auto* added = std::get_if<wire::CharacterAdded>(&message))
    events.on_added(added->character);
  else if (const auto* error = std::get_if<wire::Error>(&message))
    events.on_refusal(wire::to_string(error->reason), error->character);
  else if (const auto* goodbye = std::get_if<wire::Goodbye>(&message))
    events.on_goodbye(wire::to_string(goodbye->reason));
  return true;
}

void WirePeer::report(const wire::FrameBatch& batch, std::int64_t clock_ns, std::int64_t now_ns,
                      PeerEvents& events) const {
  FrameSeen seen;
  seen.tick = batch.tick;
  seen.sample_time_local_ns = clock_.to_local(batch.sample_time_ns);
  for (const wire::Frame& frame : batch.frames) {
    seen.character = frame.character;
    seen.level = frame.level;
    seen.discontinuous = frame.discontinuous;
    seen.asleep = frame.asleep;
    seen.node_bytes = frame.displacements.size() * sizeof(std::int16_t);
    seen.pose = &frame.pose;
    seen.step_m = frame.quantum_m;
    seen.displacements = frame.displacements;
    events.on_frame(seen, clock_ns - batch.sample_time_ns, now_ns);
  }
}

void WirePeer::offer(const EncodedGroom& groom, std::int64_t now_ns) {
  offered_[groom.hash] = groom.bytes;
  say(wire::GroomOffer{groom.hash, groom.bytes->size()}, now_ns);
}

void WirePeer::send_groom(const wire::GroomNeed& need, std::int64_t now_ns) {
  const auto known = offered_.find(need.hash);
  if (known == offered_.end()) return;
  const std::vector<std::uint8_t>& bytes = *known->second;
  for (std::size_t at = need.offset; at < bytes.size(); at += wire::kGroomChunkBytesMax) {
    const std::size_t count = std::min(wire::kGroomChunkBytesMax, bytes.size() - at);
    const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    say(wire::GroomChunk{need.hash, at, {from, from + static_cast<std::ptrdiff_t>(count)}}, now_ns);
  }
}

void WirePeer::add_character(std::uint32_t character, const wire::GroomHash& groom, LevelIndex level,
                             std::int64_t now_ns) {
  say(wire::AddCharacter{character, groom, level}, now_ns);
}

void WirePeer::remove_character(std::uint32_t character, std::int64_t now_ns) {
  say(wire::RemoveCharacter{character}, now_ns);
}

void WirePeer::push_poses(std::vector<wire::PoseSample> poses, std::int64_t now_ns) {
  say(wire::PoseBatch{std::move(poses)}, now_ns);
}

void WirePeer::say_goodbye(std::int64_t now_ns) {
  say(wire::Goodbye{wire::GoodbyeReason::client_leaves, ""}, now_ns);
}

void WirePeer::say(wire::Message message, std::int64_t now_ns) {
  packets_.push_back(wire::encode_packet({now_ns, std::move(message)}));
}

std::vector<std::uint8_t> WirePeer::take_packet() {
  if (packets_.empty()) return {};
  std::vector<std::uint8_t> packet = std::move(packets_.front());
  packets_.pop_front();
  return packet;
}

}  // namespace hairnet::load
