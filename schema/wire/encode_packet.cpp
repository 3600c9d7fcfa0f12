#include <bit>
#include <cstring>

#include "envelope_generated.h"
#include "schema/wire/flatbuffer_convert.hpp"
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
  const fb::Secret secret = to_flatbuffer(m.secret);
  const auto name = to.CreateString(fit_text(m.client_name));
  const auto room = to.CreateString(fit_text(m.room));
  const auto token = to.CreateString(m.token);
  return body(fb::CreateHello(to, m.protocol_version, name, room, token, static_cast<std::uint8_t>(m.role), m.session,
                              m.session == 0 ? nullptr : &secret));
}

Body write(FlatBufferBuilder& to, const GroomOffer& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return body(fb::CreateGroomOffer(to, &hash, m.byte_count));
}

Body write(FlatBufferBuilder& to, const GroomChunk& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return body(fb::CreateGroomChunkDirect(to, &hash, m.offset, &m.bytes));
}

Body write(FlatBufferBuilder& to, const AddCharacter& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  Offset<fb::HairState> state;
  if (m.state)
    state = fb::CreateHairStateDirect(to, &m.state->displacements, &m.state->velocities, m.state->step_m,
                                      static_cast<std::uint8_t>(m.state->level));
  return body(fb::CreateAddCharacter(to, &groom, m.character, static_cast<std::uint8_t>(m.level), state));
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
    poses.emplace_back(p.capture_time_ns, p.character, p.sequence, to_flatbuffer(p.pose), p.teleport);
  return body(fb::CreatePoseBatch(to, to.CreateVectorOfStructs(poses)));
}

Body write(FlatBufferBuilder& to, const Welcome& m) {
  const fb::Secret secret = to_flatbuffer(m.secret);
  return body(fb::CreateWelcome(to, m.session, m.tick, m.groom_bytes_max, m.tick_rate_hz, m.character_count_max,
                                m.protocol_version, to.CreateString(fit_text(m.room)), &secret, m.resumed,
                                m.resume_grace_s, m.pose_delay_ns));
}

Body write(FlatBufferBuilder& to, const GroomNeed& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return body(fb::CreateGroomNeed(to, &hash, m.offset));
}

Body write(FlatBufferBuilder& to, const GroomStatus& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return body(fb::CreateGroomStatus(to, &hash, static_cast<std::uint8_t>(m.state)));
}

Body write(FlatBufferBuilder& to, const CharacterAdded& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  return body(fb::CreateCharacterAdded(to, &groom, m.character, static_cast<std::uint8_t>(m.level), m.member));
}

Body write(FlatBufferBuilder& to, const CharacterRemoved& m) {
  return body(fb::CreateCharacterRemoved(to, m.character));
}

Body write(FlatBufferBuilder& to, const LevelRecord& m) {
  const LevelGeometry& g = m.geometry;
  const fb::Hash groom = to_flatbuffer(m.groom);
  const fb::Vec3 origin = to_flatbuffer(g.lattice.origin), spacing = to_flatbuffer(g.lattice.spacing);
  const auto dims = [&](std::size_t axis) { return static_cast<std::uint32_t>(g.lattice.dims[axis]); };
  return body(fb::CreateLevelRecordDirect(to, &groom, &origin, &spacing, dims(0), dims(1), dims(2), &g.active_nodes,
                                          &g.trimmed_nodes, &g.trimmed_begin, &g.trimmed_from, &g.trimmed_weights,
                                          static_cast<std::uint8_t>(m.level)));
}

std::uint8_t* write_varint(std::uint32_t value, std::uint8_t* at) {
  for (; value >= 0x80; value >>= 7) *at++ = static_cast<std::uint8_t>(value | 0x80);
  *at++ = static_cast<std::uint8_t>(value);
  return at;
}

std::size_t varint_bytes(std::uint32_t value) {
  std::size_t count = 1;
  for (; value >= 0x80; value >>= 7) ++count;
  return count;
}

std::size_t packed_bytes(const Frame& f, std::uint32_t member_before) {
  return varint_bytes(f.member - member_before) + 2 + varint_bytes(static_cast<std::uint32_t>(f.content.size())) +
         f.content.size();
}

std::uint8_t* write_frame(const Frame& f, std::uint32_t member_before, std::uint8_t* at) {
  at = write_varint(f.member - member_before, at);
  *at++ = static_cast<std::uint8_t>(static_cast<unsigned>(f.level) | unsigned{f.discontinuous} << 3 |
                                    unsigned{f.asleep} << 4 | unsigned{f.velocities} << 5 |
                                    static_cast<unsigned>(f.error_class) << 6);
  const auto log2 = [](std::uint8_t stride) { return static_cast<unsigned>(std::countr_zero(unsigned{stride})); };
  *at++ = static_cast<std::uint8_t>(f.order | log2(f.stride) << 2 | log2(f.step_stride) << 4);
  at = write_varint(static_cast<std::uint32_t>(f.content.size()), at);
  if (!f.content.empty()) std::memcpy(at, f.content.data(), f.content.size());
  return at + f.content.size();
}

Body write(FlatBufferBuilder& to, const FrameBatch& m) {
  std::size_t byte_count = 0;
  std::uint32_t member = 0;
  for (const Frame& f : m.frames) {
    byte_count += packed_bytes(f, member);
    member = f.member;
  }
  std::uint8_t* at = nullptr;
  to.ForceVectorAlignment(byte_count, 1, 4);
  const Offset<flatbuffers::Vector<std::uint8_t>> frames = to.CreateUninitializedVector(byte_count, &at);
  member = 0;
  for (const Frame& f : m.frames) {
    at = write_frame(f, member, at);
    member = f.member;
  }
  return body(fb::CreateFrameBatch(to, m.tick, m.sample_time_ns, frames));
}

Body write(FlatBufferBuilder& to, const Error& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  return body(fb::CreateError(to, m.groom == GroomHash{} ? nullptr : &groom, to.CreateString(fit_text(m.detail)),
                              m.character, static_cast<std::uint8_t>(m.reason)));
}

Body write(FlatBufferBuilder& to, const Goodbye& m) {
  return body(fb::CreateGoodbye(to, to.CreateString(fit_text(m.detail)), static_cast<std::uint8_t>(m.reason)));
}

Body write(FlatBufferBuilder& to, const SetMaterial& m) {
  const fb::MaterialScale scale = to_flatbuffer(m.scale);
  return body(fb::CreateSetMaterial(to, &scale, m.character));
}

Body write(FlatBufferBuilder& to, const SetWind& m) {
  const fb::Wind wind = to_flatbuffer(m.wind);
  return body(fb::CreateSetWind(to, &wind));
}

Body write(FlatBufferBuilder& to, const Observe& m) {
  const fb::Vec3 from = m.from ? to_flatbuffer(*m.from) : fb::Vec3();
  return body(fb::CreateObserveDirect(to, &m.members, m.from ? &from : nullptr, m.count, m.radius_m, m.stride,
                                      static_cast<std::uint8_t>(m.mode), static_cast<std::uint8_t>(m.error_class),
                                      m.velocities));
}

Body write(FlatBufferBuilder& to, const ReportImportance& m) {
  std::vector<fb::MemberImportance> members;
  members.reserve(m.members.size());
  for (const MemberImportance& i : m.members) members.emplace_back(i.member, i.screen_height, i.in_view);
  return body(fb::CreateReportImportance(to, to.CreateVectorOfStructs(members)));
}

Body write(FlatBufferBuilder& to, const RequestKeyframes& m) {
  return body(fb::CreateRequestKeyframesDirect(to, &m.members));
}

Body write(FlatBufferBuilder& to, const GroomRequest& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return body(fb::CreateGroomRequest(to, &hash, m.offset));
}

Body write(FlatBufferBuilder& to, const GroomData& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return body(fb::CreateGroomDataDirect(to, &hash, m.byte_count, m.offset, &m.bytes));
}

Body write(FlatBufferBuilder& to, const MemberJoined& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  return body(fb::CreateMemberJoined(to, &groom, m.session, m.character, m.member));
}

Body write(FlatBufferBuilder& to, const MemberLeft& m) {
  return body(fb::CreateMemberLeft(to, m.member));
}

// Bytes of the bulk that a message brings, so that the buffer is allocated once and never beyond the limit.
std::size_t bulk_bytes(const Message& message) {
  if (const auto* chunk = std::get_if<GroomChunk>(&message)) return chunk->bytes.size();
  if (const auto* data = std::get_if<GroomData>(&message)) return data->bytes.size();
  if (const auto* hello = std::get_if<Hello>(&message)) return hello->token.size();
  if (const auto* add = std::get_if<AddCharacter>(&message))
    return add->state ? 2 * (add->state->displacements.size() + add->state->velocities.size()) : 0;
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
  return packed_bytes(frame, 0);
}

void set_clock(std::span<std::uint8_t> packet, std::int64_t clock_ns) {
  auto* root = flatbuffers::GetMutableRoot<flatbuffers::Table>(packet.data() + sizeof(flatbuffers::uoffset_t));
  [[maybe_unused]] const bool is_set = root->SetField<std::int64_t>(fb::Envelope::VT_CLOCK_NS, clock_ns, clock_ns);
}

std::vector<std::uint8_t> encode_packet(const Envelope& envelope) {
  const std::size_t bulk = bulk_bytes(envelope.message);
  if (bulk > kPacketBytesMax) return {};
  FlatBufferBuilder builder(bulk + kPacketOverheadBytesMax);
  const Body written = std::visit([&](const auto& message) { return write(builder, message); }, envelope.message);
  builder.ForceDefaults(envelope.clock_ns == 0);  // the clock is there to be set later
  const auto root = fb::CreateEnvelope(builder, envelope.clock_ns, written.type, written.offset);
  std::vector<std::uint8_t> packet = finish(builder, root, fb::EnvelopeIdentifier());
  if (packet.size() > kPacketBytesMax) packet.clear();
  return packet;
}

}  // namespace hairnet::wire
