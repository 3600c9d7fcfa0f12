#include "envelope_generated.h"
#include "schema/wire/flat.hpp"
#include "schema/wire/text.hpp"

namespace hairnet::wire {
namespace {

using flatbuffers::FlatBufferBuilder;
using flatbuffers::Offset;

struct Body {
  fb::Body type;
  Offset<void> offset;
};

template <class Table>
Body body(Offset<Table> table) {
  return {fb::BodyTraits<Table>::enum_value, table.Union()};
}

Body write(FlatBufferBuilder& to, const Hello& m) {
  return body(fb::CreateHello(to, m.protocol_version, to.CreateString(fit_text(m.client_name))));
}

Body write(FlatBufferBuilder& to, const GroomOffer& m) {
  const fb::Hash hash = flatten(m.hash);
  return body(fb::CreateGroomOffer(to, &hash, m.byte_count));
}

Body write(FlatBufferBuilder& to, const GroomChunk& m) {
  const fb::Hash hash = flatten(m.hash);
  return body(fb::CreateGroomChunkDirect(to, &hash, m.offset, &m.bytes));
}

Body write(FlatBufferBuilder& to, const AddCharacter& m) {
  const fb::Hash groom = flatten(m.groom);
  return body(fb::CreateAddCharacter(to, &groom, m.character, static_cast<std::uint8_t>(m.level)));
}

Body write(FlatBufferBuilder& to, const SetLevel& m) {
  return body(fb::CreateSetLevel(to, m.character, static_cast<std::uint8_t>(m.level)));
}

Body write(FlatBufferBuilder& to, const RemoveCharacter& m) {
  return body(fb::CreateRemoveCharacter(to, m.character));
}

Body write(FlatBufferBuilder& to, const PoseBatch& m) {
  std::vector<fb::PoseSample> poses;
  poses.reserve(m.poses.size());
  for (const PoseSample& p : m.poses)
    poses.emplace_back(p.capture_time_ns, p.character, p.sequence, flatten(p.pose), p.teleport);
  return body(fb::CreatePoseBatch(to, to.CreateVectorOfStructs(poses)));
}

Body write(FlatBufferBuilder& to, const Welcome& m) {
  return body(fb::CreateWelcome(to, m.session, m.tick, m.groom_bytes_max, m.tick_rate_hz, m.character_count_max,
                                m.protocol_version));
}

Body write(FlatBufferBuilder& to, const GroomNeed& m) {
  const fb::Hash hash = flatten(m.hash);
  return body(fb::CreateGroomNeed(to, &hash, m.offset));
}

Body write(FlatBufferBuilder& to, const GroomStatus& m) {
  const fb::Hash hash = flatten(m.hash);
  return body(fb::CreateGroomStatus(to, &hash, static_cast<std::uint8_t>(m.state)));
}

Body write(FlatBufferBuilder& to, const CharacterAdded& m) {
  const fb::Hash groom = flatten(m.groom);
  return body(fb::CreateCharacterAdded(to, &groom, m.character, static_cast<std::uint8_t>(m.level)));
}

Body write(FlatBufferBuilder& to, const CharacterRemoved& m) {
  return body(fb::CreateCharacterRemoved(to, m.character));
}

Body write(FlatBufferBuilder& to, const LevelRecord& m) {
  const LevelGeometry& g = m.geometry;
  const fb::Hash groom = flatten(m.groom);
  const fb::Vec3 origin = flatten(g.lattice.origin), spacing = flatten(g.lattice.spacing);
  const auto dims = [&](std::size_t axis) { return static_cast<std::uint32_t>(g.lattice.dims[axis]); };
  return body(fb::CreateLevelRecordDirect(to, &groom, &origin, &spacing, dims(0), dims(1), dims(2), &g.active_nodes,
                                          &g.trimmed_nodes, &g.trimmed_begin, &g.trimmed_from, &g.trimmed_weights,
                                          static_cast<std::uint8_t>(m.level)));
}

Offset<flatbuffers::Vector<std::uint8_t>> write_nodes(FlatBufferBuilder& to, const FrameBatch& m,
                                                      std::size_t byte_count) {
  std::uint8_t* at = nullptr;
  to.ForceVectorAlignment(byte_count, 1, 4);
  const Offset<flatbuffers::Vector<std::uint8_t>> nodes = to.CreateUninitializedVector(byte_count, &at);
  for (const Frame& f : m.frames) {
    const std::size_t frame_bytes = f.displacements.size() * sizeof(std::int16_t);
    if (frame_bytes != 0) std::memcpy(at, f.displacements.data(), frame_bytes);
    at += frame_bytes;
  }
  return nodes;
}

Body write(FlatBufferBuilder& to, const FrameBatch& m) {
  std::vector<fb::FrameHeader> headers;
  headers.reserve(m.frames.size());
  std::size_t byte_count = 0;
  for (const Frame& f : m.frames) {
    headers.emplace_back(f.character, static_cast<std::uint32_t>(f.displacements.size() / 3), f.quantum_m,
                         flatten(f.pose), static_cast<std::uint8_t>(f.level), f.discontinuous, f.asleep);
    byte_count += f.displacements.size() * sizeof(std::int16_t);
  }
  const auto frames = to.CreateVectorOfStructs(headers);
  return body(fb::CreateFrameBatch(to, m.tick, m.sample_time_ns, frames, write_nodes(to, m, byte_count)));
}

Body write(FlatBufferBuilder& to, const Error& m) {
  const fb::Hash groom = flatten(m.groom);
  return body(fb::CreateError(to, m.groom == GroomHash{} ? nullptr : &groom, to.CreateString(fit_text(m.detail)),
                              m.character, static_cast<std::uint8_t>(m.reason)));
}

Body write(FlatBufferBuilder& to, const Goodbye& m) {
  return body(fb::CreateGoodbye(to, to.CreateString(fit_text(m.detail)), static_cast<std::uint8_t>(m.reason)));
}

// Bytes of the bulk that a message brings, so that the buffer is allocated once and never beyond the limit.
std::size_t bulk_bytes(const Message& message) {
  if (const auto* chunk = std::get_if<GroomChunk>(&message)) return chunk->bytes.size();
  if (const auto* batch = std::get_if<PoseBatch>(&message)) return batch->poses.size() * sizeof(fb::PoseSample);
  if (const auto* record = std::get_if<LevelRecord>(&message)) {
    const LevelGeometry& g = record->geometry;
    return sizeof(std::uint32_t) * (g.active_nodes.size() + g.trimmed_nodes.size() + g.trimmed_begin.size() +
                                    g.trimmed_from.size() + g.trimmed_weights.size());
  }
  std::size_t bytes = 0;
  if (const auto* batch = std::get_if<FrameBatch>(&message)) {
    for (const Frame& f : batch->frames) bytes += frame_bytes(f);
  }
  return bytes;
}

}  // namespace

std::size_t frame_bytes(const Frame& frame) {
  return sizeof(fb::FrameHeader) + frame.displacements.size() * sizeof(std::int16_t);
}

std::vector<std::uint8_t> encode_packet(const Envelope& envelope) {
  const std::size_t bulk = bulk_bytes(envelope.message);
  if (bulk > kPacketBytesMax) return {};
  FlatBufferBuilder builder(bulk + kPacketOverheadBytesMax);
  const Body written = std::visit([&](const auto& message) { return write(builder, message); }, envelope.message);
  const auto root = fb::CreateEnvelope(builder, envelope.clock_ns, written.type, written.offset);
  std::vector<std::uint8_t> packet = finish(builder, root, fb::EnvelopeIdentifier());
  if (packet.size() > kPacketBytesMax) packet.clear();
  return packet;
}

}  // namespace hairnet::wire
