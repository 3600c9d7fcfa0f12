#include <bit>
#include <cmath>
#include <cstring>

#include "schema/wire/geometry_table.hpp"
#include "schema/wire/message_codec.hpp"

namespace hairnet::wire {

Offset<fb::Welcome> write(FlatBufferBuilder& to, const Welcome& m) {
  const fb::Secret secret = to_flatbuffer(m.secret);
  return fb::CreateWelcome(to, m.session, m.tick, m.groom_bytes_max, m.tick_rate_hz, m.character_count_max,
                           m.protocol_version, to.CreateString(fit_text(m.room)), &secret, m.resumed, m.resume_grace_s,
                           m.pose_delay_ns, m.may_set_wind);
}

Fault read(const fb::Welcome& in, Welcome& out) {
  out.protocol_version = in.protocol_version();
  out.session = in.session();
  out.tick_rate_hz = in.tick_rate_hz();
  out.tick = in.tick();
  out.character_count_max = in.character_count_max();
  out.groom_bytes_max = in.groom_bytes_max();
  if (in.secret()) out.secret = from_flatbuffer(*in.secret());
  out.resumed = in.resumed();
  out.may_set_wind = in.may_set_wind();
  out.resume_grace_s = in.resume_grace_s();
  if (!(out.resume_grace_s >= 0 && out.resume_grace_s <= 1e6f)) return "welcome: grace out of range";
  if (Fault fault = read_time(in.pose_delay_ns(), "welcome's pose delay", out.pose_delay_ns); !fault.empty())
    return fault;
  if (Fault fault = read_text(in.room(), "room", out.room); !fault.empty()) return fault;
  const bool sound = out.tick_rate_hz >= 1 && out.tick_rate_hz <= kTickRateMax_hz;
  return sound ? Fault() : "welcome: tick rate not in [1, " + std::to_string(kTickRateMax_hz) + "] Hz";
}

Offset<fb::GroomNeed> write(FlatBufferBuilder& to, const GroomNeed& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return fb::CreateGroomNeed(to, &hash, m.offset);
}

Fault read(const fb::GroomNeed& in, GroomNeed& out) {
  out = {from_flatbuffer(*in.hash()), in.offset()};
  return {};
}

Offset<fb::GroomStatus> write(FlatBufferBuilder& to, const GroomStatus& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return fb::CreateGroomStatus(to, &hash, static_cast<fb::GroomState>(m.state));
}

Fault read(const fb::GroomStatus& in, GroomStatus& out) {
  out.hash = from_flatbuffer(*in.hash());
  return read_enum(in.state(), "groom state", out.state);
}

Offset<fb::GroomData> write(FlatBufferBuilder& to, const GroomData& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return fb::CreateGroomDataDirect(to, &hash, m.byte_count, m.offset, &m.bytes);
}

Fault read(const fb::GroomData& in, GroomData& out) {
  out.hash = from_flatbuffer(*in.hash());
  out.byte_count = in.byte_count();
  out.offset = in.offset();
  from_flatbuffer(*in.bytes(), out.bytes);
  const bool fits = out.byte_count <= kGroomBytesMax && out.offset <= out.byte_count &&
                    out.bytes.size() <= out.byte_count - out.offset && out.bytes.size() <= kGroomChunkBytesMax;
  return fits ? Fault() : "groom data: not within the groom";
}

Offset<fb::CharacterAdded> write(FlatBufferBuilder& to, const CharacterAdded& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  return fb::CreateCharacterAdded(to, &groom, m.character, static_cast<fb::LevelIndex>(m.level), m.member,
                                  m.generation);
}

Fault read(const fb::CharacterAdded& in, CharacterAdded& out) {
  out.character = in.character();
  out.groom = from_flatbuffer(*in.groom());
  out.member = in.member();
  out.generation = in.generation();
  return read_enum(in.level(), "level", out.level);
}

Offset<fb::CharacterRemoved> write(FlatBufferBuilder& to, const CharacterRemoved& m) {
  return fb::CreateCharacterRemoved(to, m.character);
}

Fault read(const fb::CharacterRemoved& in, CharacterRemoved& out) {
  out.character = in.character();
  return {};
}

Offset<fb::MemberJoined> write(FlatBufferBuilder& to, const MemberJoined& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  const Offset<flatbuffers::Vector<std::uint8_t>> tag = write_tag(to, m.tag);
  const fb::Appearance appearance = to_flatbuffer(m.appearance.value_or(Appearance{}));
  return fb::CreateMemberJoined(to, &groom, m.session, m.character, m.member, tag, m.appearance ? &appearance : nullptr,
                                m.generation);
}

Fault read(const fb::MemberJoined& in, MemberJoined& out) {
  out.member = in.member();
  out.session = in.session();
  out.character = in.character();
  out.groom = from_flatbuffer(*in.groom());
  if (in.appearance()) out.appearance = from_flatbuffer(*in.appearance());
  out.generation = in.generation();
  return read_tag(in.tag(), out.tag);
}

Offset<fb::MemberChanged> write(FlatBufferBuilder& to, const MemberChanged& m) {
  const Offset<flatbuffers::Vector<std::uint8_t>> tag = write_tag(to, m.tag);
  const fb::Appearance appearance = to_flatbuffer(m.appearance.value_or(Appearance{}));
  return fb::CreateMemberChanged(to, tag, m.appearance ? &appearance : nullptr, m.member);
}

Fault read(const fb::MemberChanged& in, MemberChanged& out) {
  out.member = in.member();
  if (in.appearance()) out.appearance = from_flatbuffer(*in.appearance());
  return read_tag(in.tag(), out.tag);
}

Offset<fb::RoomWind> write(FlatBufferBuilder& to, const RoomWind& m) {
  const fb::Wind wind = to_flatbuffer(m.wind);
  return fb::CreateRoomWind(to, &wind, m.session);
}

Fault read(const fb::RoomWind& in, RoomWind& out) {
  out = {from_flatbuffer(*in.wind()), in.session()};
  const Wind& w = out.wind;
  const bool finite = w.mean_m_per_s.allFinite() && std::isfinite(w.gust_ratio) && std::isfinite(w.gust_period_s) &&
                      std::isfinite(w.turbulence_rms_m_per_s) && std::isfinite(w.turbulence_scale_m);
  return finite ? Fault() : "wind: not finite numbers";
}

Offset<fb::MemberLeft> write(FlatBufferBuilder& to, const MemberLeft& m) {
  return fb::CreateMemberLeft(to, m.member);
}

Fault read(const fb::MemberLeft& in, MemberLeft& out) {
  out.member = in.member();
  return {};
}

Offset<fb::GroomBasis> write(FlatBufferBuilder& to, const GroomBasis& m) {
  const fb::Hash groom = to_flatbuffer(m.groom), basis = to_flatbuffer(m.basis);
  return fb::CreateGroomBasis(to, &groom, &basis);
}

Fault read(const fb::GroomBasis& in, GroomBasis& out) {
  out.groom = from_flatbuffer(*in.groom());
  out.basis = from_flatbuffer(*in.basis());
  return {};
}

Offset<fb::GroomLearnt> write(FlatBufferBuilder& to, const GroomLearnt& m) {
  const fb::Hash groom = to_flatbuffer(m.groom), learnt = to_flatbuffer(m.learnt);
  return fb::CreateGroomLearnt(to, &groom, &learnt);
}

Fault read(const fb::GroomLearnt& in, GroomLearnt& out) {
  out = {from_flatbuffer(*in.groom()), from_flatbuffer(*in.learnt())};
  return {};
}

namespace {

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
  return varint_bytes(f.member - member_before) + 1 + varint_bytes(static_cast<std::uint32_t>(f.content.size())) +
         f.content.size();
}

std::uint8_t* write_frame(const Frame& f, std::uint32_t member_before, std::uint8_t* at) {
  at = write_varint(f.member - member_before, at);
  const auto log2_stride = static_cast<unsigned>(std::countr_zero(unsigned{f.step_stride}));
  *at++ = static_cast<std::uint8_t>(static_cast<unsigned>(f.level) | unsigned{f.discontinuous} << 3 |
                                    unsigned{f.asleep} << 4 | log2_stride << 5 | unsigned{f.evaluated} << 7);
  at = write_varint(static_cast<std::uint32_t>(f.content.size()), at);
  if (!f.content.empty()) std::memcpy(at, f.content.data(), f.content.size());
  return at + f.content.size();
}

}  // namespace

std::size_t frame_bytes(const Frame& frame) {
  return packed_bytes(frame, 0);
}

Offset<fb::FrameBatch> write(FlatBufferBuilder& to, const FrameBatch& m) {
  std::size_t byte_count = 0;
  std::uint32_t member = 0;
  for (const Frame& f : m.frames) {
    byte_count += packed_bytes(f, member);
    member = f.member;
  }
  std::uint8_t* at = nullptr;
  to.ForceVectorAlignment(byte_count, 1, 4);
  const Offset<flatbuffers::Vector<std::uint8_t>> frames = to.CreateUninitializedVector(byte_count, &at);
  const std::uint8_t* const end = at + byte_count;
  member = 0;
  for (const Frame& f : m.frames) {
    at = write_frame(f, member, at);
    member = f.member;
  }
  HAIRNET_ASSERT(at == end);
  HAIRNET_ASSERT(m.generations.empty() || m.generations.size() == m.frames.size());
  Offset<flatbuffers::Vector<std::uint8_t>> generations;
  if (!m.generations.empty()) generations = to.CreateVector(m.generations);
  return fb::CreateFrameBatch(to, m.tick, m.sample_time_ns, frames, generations);
}

namespace {

// Takes what is packed off the front of a span; false at its end or when it is not sound.
class Unpacker {
 public:
  explicit Unpacker(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  bool take(std::uint8_t& value) {
    if (bytes_.empty()) return false;
    value = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return true;
  }
  bool take_varint(std::uint32_t& value) {
    std::uint64_t sum = 0;
    for (unsigned shift = 0; shift < 35; shift += 7) {
      std::uint8_t byte = 0;
      if (!take(byte)) return false;
      sum |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte & 0x80) continue;
      value = static_cast<std::uint32_t>(sum);
      return sum <= 0xffffffffu;
    }
    return false;
  }
  bool take(std::size_t count, std::span<const std::uint8_t>& out) {
    if (count > bytes_.size()) return false;
    out = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return true;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

Fault read_frame(Unpacker& in, std::uint32_t member_before, Frame& out) {
  std::uint32_t step = 0, byte_count = 0;
  std::uint8_t head = 0;
  if (!in.take_varint(step) || !in.take(head) || !in.take_varint(byte_count) || !in.take(byte_count, out.content))
    return "frame batch: ends within a frame";
  if (step == 0 || step > 0xffffffffu - member_before) return "frame batch: members do not ascend";
  out.member = member_before + step;
  HAIRNET_ASSERT(out.member > member_before);
  if (Fault fault = read_enum(static_cast<fb::LevelIndex>(head & 7), "level", out.level); !fault.empty()) return fault;
  out.discontinuous = (head & 8) != 0;
  out.asleep = (head & 16) != 0;
  const unsigned log2_stride = head >> 5 & 3;
  if (log2_stride > 2) return "frame: no such stride";
  out.evaluated = (head & 128) != 0;
  if (out.evaluated && out.level != LevelIndex::learnt) return "frame: evaluated on another level than learnt";
  out.step_stride = static_cast<std::uint8_t>(1u << log2_stride);
  return {};
}

}  // namespace

Fault read(const fb::FrameBatch& in, FrameBatch& out) {
  out.tick = in.tick();
  if (Fault fault = read_time(in.sample_time_ns(), "frames' sample time", out.sample_time_ns); !fault.empty())
    return fault;
  auto storage = std::make_shared<std::vector<std::uint8_t>>();
  from_flatbuffer(*in.frames(), *storage);
  Unpacker packed(*storage);
  std::uint32_t member = 0;
  while (!packed.empty()) {
    if (Fault fault = read_frame(packed, member, out.frames.emplace_back()); !fault.empty()) return fault;
    member = out.frames.back().member;
  }
  if (in.generations()) {
    if (in.generations()->size() != out.frames.size()) return "frame batch: not a generation for each frame";
    from_flatbuffer(*in.generations(), out.generations);
  }
  out.storage = std::move(storage);
  return {};
}

Offset<fb::Error> write(FlatBufferBuilder& to, const Error& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  return fb::CreateError(to, m.groom == GroomHash{} ? nullptr : &groom, to.CreateString(fit_text(m.detail)),
                         m.character, static_cast<fb::ErrorReason>(m.reason));
}

Fault read(const fb::Error& in, Error& out) {
  out.character = in.character();
  if (in.groom()) out.groom = from_flatbuffer(*in.groom());
  if (Fault fault = read_enum(in.reason(), "error reason", out.reason, ErrorReason::malformed); !fault.empty())
    return fault;
  return read_text(in.detail(), "error detail", out.detail);
}

}  // namespace hairnet::wire
