#include <cmath>
#include <cstring>

#include "schema/wire/geometry_table.hpp"
#include "schema/wire/message_codec.hpp"
#include "schema/wire/packed_frame.hpp"

namespace hairnet::wire {

namespace {

Offset<fb::ServerAt> write(FlatBufferBuilder& to, const ServerAt& m) {
  return fb::CreateServerAt(to, to.CreateString(fit_text(m.host)), m.port);
}

std::string read(const fb::ServerAt& in, ServerAt& out) {
  out.port = in.port();
  if (std::string error = read_text(in.host(), "a server's host", out.host); !error.empty()) return error;
  // A client connects to this host with its token. Only characters of names and addresses pass, so a host cannot
  // smuggle a path, a user or a scheme into a URL.
  const bool is_host = !out.host.empty() && std::ranges::all_of(out.host, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '-' || c == ':' || c == '_';
  });
  return is_host && out.port != 0 ? std::string() : "no address of a server";
}

}  // namespace

Offset<fb::Welcome> write(FlatBufferBuilder& to, const Welcome& m) {
  const fb::Secret secret = to_flatbuffer(m.secret);
  std::vector<Offset<fb::ServerAt>> others;
  for (const ServerAt& other : m.others) others.push_back(write(to, other));
  const auto listed = others.empty() ? 0 : to.CreateVector(others);
  return fb::CreateWelcome(to, m.session, m.tick, m.groom_bytes_max, m.tick_rate_hz, m.character_count_max,
                           m.protocol_version, to.CreateString(fit_text(m.room)), &secret, m.resumed, m.resume_grace_s,
                           m.pose_delay_ns, m.may_set_wind, listed, m.signs_of_life, m.may_touch, m.may_set_props);
}

std::string read(const fb::Welcome& in, Welcome& out) {
  out.protocol_version = in.protocol_version();
  out.session = in.session();
  out.tick_rate_hz = in.tick_rate_hz();
  out.tick = in.tick();
  out.character_count_max = in.character_count_max();
  out.groom_bytes_max = in.groom_bytes_max();
  if (in.secret()) out.secret = from_flatbuffer(*in.secret());
  out.resumed = in.resumed();
  out.may_set_wind = in.may_set_wind();
  out.signs_of_life = in.signs_of_life();
  out.may_touch = in.may_touch();
  out.may_set_props = in.may_set_props();
  out.resume_grace_s = in.resume_grace_s();
  if (in.others()) {
    // The client keeps the list for its reconnects, so a server must not fill its memory with names.
    if (in.others()->size() > kServersMax) return "welcome: more than " + std::to_string(kServersMax) + " servers";
    for (const fb::ServerAt* other : *in.others()) {
      if (std::string error = read(*other, out.others.emplace_back()); !error.empty()) return error;
    }
  }
  // The negation also refuses what is not a number.
  if (!(out.resume_grace_s >= 0 && out.resume_grace_s <= 1e6f)) return "welcome: grace out of range";
  if (std::string error = read_time(in.pose_delay_ns(), "welcome's pose delay", out.pose_delay_ns); !error.empty())
    return error;
  if (std::string error = read_text(in.room(), "room", out.room); !error.empty()) return error;
  // A client divides by the tick rate.
  const bool valid = out.tick_rate_hz >= 1 && out.tick_rate_hz <= kTickRateMax_hz;
  return valid ? std::string() : "welcome: tick rate not in [1, " + std::to_string(kTickRateMax_hz) + "] Hz";
}

Offset<fb::GroomNeed> write(FlatBufferBuilder& to, const GroomNeed& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return fb::CreateGroomNeed(to, &hash, m.offset);
}

std::string read(const fb::GroomNeed& in, GroomNeed& out) {
  out = {from_flatbuffer(*in.hash()), in.offset()};
  return {};
}

Offset<fb::GroomStatus> write(FlatBufferBuilder& to, const GroomStatus& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return fb::CreateGroomStatus(to, &hash, static_cast<fb::GroomState>(m.state));
}

std::string read(const fb::GroomStatus& in, GroomStatus& out) {
  out.hash = from_flatbuffer(*in.hash());
  return read_enum(in.state(), "groom state", out.state);
}

Offset<fb::GroomData> write(FlatBufferBuilder& to, const GroomData& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return fb::CreateGroomDataDirect(to, &hash, m.byte_count, m.offset, &m.bytes);
}

std::string read(const fb::GroomData& in, GroomData& out) {
  out.hash = from_flatbuffer(*in.hash());
  out.byte_count = in.byte_count();
  out.offset = in.offset();
  from_flatbuffer(*in.bytes(), out.bytes);
  // The offset is compared before the subtraction, which would wrap otherwise.
  const bool fits = out.byte_count <= kGroomBytesMax && out.offset <= out.byte_count &&
                    out.bytes.size() <= out.byte_count - out.offset && out.bytes.size() <= kGroomChunkBytesMax;
  return fits ? std::string() : "groom data: not within the groom";
}

Offset<fb::CharacterAdded> write(FlatBufferBuilder& to, const CharacterAdded& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  return fb::CreateCharacterAdded(to, &groom, m.character, static_cast<fb::LevelIndex>(m.level), m.member,
                                  m.generation);
}

std::string read(const fb::CharacterAdded& in, CharacterAdded& out) {
  out.character = in.character();
  out.groom = from_flatbuffer(*in.groom());
  out.member = in.member();
  out.generation = in.generation();
  return read_enum(in.level(), "level", out.level);
}

Offset<fb::CharacterRemoved> write(FlatBufferBuilder& to, const CharacterRemoved& m) {
  return fb::CreateCharacterRemoved(to, m.character);
}

std::string read(const fb::CharacterRemoved& in, CharacterRemoved& out) {
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

std::string read(const fb::MemberJoined& in, MemberJoined& out) {
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

std::string read(const fb::MemberChanged& in, MemberChanged& out) {
  out.member = in.member();
  if (in.appearance()) out.appearance = from_flatbuffer(*in.appearance());
  return read_tag(in.tag(), out.tag);
}

Offset<fb::RoomWind> write(FlatBufferBuilder& to, const RoomWind& m) {
  const fb::Wind wind = to_flatbuffer(m.wind);
  return fb::CreateRoomWind(to, &wind, m.session, m.wind.carried);
}

std::string read(const fb::RoomWind& in, RoomWind& out) {
  out = {from_flatbuffer(*in.wind(), in.carried()), in.session()};
  const Wind& w = out.wind;
  // Ranges are not checked: the server has checked them when the wind was set.
  const bool finite = w.mean_m_per_s.allFinite() && std::isfinite(w.gust_ratio) && std::isfinite(w.gust_period_s) &&
                      std::isfinite(w.turbulence_rms_m_per_s) && std::isfinite(w.turbulence_scale_m);
  return finite ? std::string() : "wind: not finite numbers";
}

Offset<fb::MemberLeft> write(FlatBufferBuilder& to, const MemberLeft& m) {
  return fb::CreateMemberLeft(to, m.member);
}

std::string read(const fb::MemberLeft& in, MemberLeft& out) {
  out.member = in.member();
  return {};
}

Offset<fb::Redirect> write(FlatBufferBuilder& to, const Redirect& m) {
  return fb::CreateRedirect(to, m.to ? write(to, *m.to) : Offset<fb::ServerAt>());
}

std::string read(const fb::Redirect& in, Redirect& out) {
  // Absent means that no server holds the room at the moment.
  return in.to() ? read(*in.to(), out.to.emplace()) : std::string();
}

Offset<fb::GroomBasis> write(FlatBufferBuilder& to, const GroomBasis& m) {
  const fb::Hash groom = to_flatbuffer(m.groom), basis = to_flatbuffer(m.basis);
  return fb::CreateGroomBasis(to, &groom, &basis);
}

std::string read(const fb::GroomBasis& in, GroomBasis& out) {
  out.groom = from_flatbuffer(*in.groom());
  out.basis = from_flatbuffer(*in.basis());
  return {};
}

Offset<fb::GroomLearnt> write(FlatBufferBuilder& to, const GroomLearnt& m) {
  const fb::Hash groom = to_flatbuffer(m.groom), learnt = to_flatbuffer(m.learnt);
  return fb::CreateGroomLearnt(to, &groom, &learnt);
}

std::string read(const fb::GroomLearnt& in, GroomLearnt& out) {
  out = {from_flatbuffer(*in.groom()), from_flatbuffer(*in.learnt())};
  return {};
}

std::size_t frame_bytes(const Frame& frame) {
  return packed_bytes(frame, 0);
}

Offset<fb::FrameBatch> write(FlatBufferBuilder& to, const FrameBatch& m) {
  std::size_t byte_count = 0;
  // The size is summed first: the vector in the buffer has its final length from the beginning.
  std::uint32_t member = 0;
  for (const Frame& f : m.frames) {
    byte_count += packed_bytes(f, member);
    member = f.member;
  }
  std::uint8_t* at = nullptr;
  to.ForceVectorAlignment(byte_count, 1, 4);
  // The frames are written straight into the buffer. Collecting them first would copy every byte of every batch once
  // more.
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

std::string read(const fb::FrameBatch& in, FrameBatch& out) {
  out.tick = in.tick();
  if (std::string error = read_time(in.sample_time_ns(), "frames' sample time", out.sample_time_ns); !error.empty())
    return error;
  // The batch owns this copy of the frames' bytes, and the spans of its frames point into it: no frame has memory of
  // its own.
  auto storage = std::make_shared<std::vector<std::uint8_t>>();
  from_flatbuffer(*in.frames(), *storage);
  Unpacker packed(*storage);
  std::uint32_t member = 0;
  while (!packed.empty()) {
    if (std::string error = read_frame(packed, member, out.frames.emplace_back()); !error.empty()) return error;
    member = out.frames.back().member;
  }
  // Only batches in datagrams have generations; in the channel no frame can come late.
  if (in.generations()) {
    if (in.generations()->size() != out.frames.size()) return "frame batch: not a generation for each frame";
    from_flatbuffer(*in.generations(), out.generations);
  }
  out.storage = std::move(storage);
  return {};
}

Offset<fb::Error> write(FlatBufferBuilder& to, const Error& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  // The hash of zeros stands for no groom: it saves its 32 bytes.
  return fb::CreateError(to, m.groom == GroomHash{} ? nullptr : &groom, to.CreateString(fit_text(m.detail)),
                         m.character, static_cast<fb::ErrorReason>(m.reason));
}

std::string read(const fb::Error& in, Error& out) {
  out.character = in.character();
  if (in.groom()) out.groom = from_flatbuffer(*in.groom());
  if (std::string error = read_enum(in.reason(), "error reason", out.reason, ErrorReason::malformed); !error.empty())
    return error;
  return read_text(in.detail(), "error detail", out.detail);
}

}  // namespace hairnet::wire
