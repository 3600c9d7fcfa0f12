#include <cmath>

#include "core/ffd/lattice.hpp"
#include "envelope_generated.h"
#include "schema/wire/flatbuffer_convert.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/text.hpp"

// Each `read` copies a verified table out and returns what is wrong with its values: empty, or one line. Counts are
// checked before memory is taken for them, and none lets the same bytes be copied twice.
namespace hairnet::wire {
namespace {

using Fault = std::string;

Fault read_text(const flatbuffers::String* from, const char* name, std::string& to) {
  const std::string_view text = view(from);
  if (!is_text(text))
    return std::string(name) + ": not UTF-8 of at most " + std::to_string(kTextBytesMax) +
           " bytes free of control characters";
  to = text;
  return {};
}

// An enum whose last value is `last`.
template <class Enum>
Fault read_enum(std::uint8_t from, Enum first, Enum last, const char* name, Enum& to) {
  if (from < static_cast<std::uint8_t>(first) || from > static_cast<std::uint8_t>(last))
    return std::string(name) + ' ' + std::to_string(from) + " does not exist";
  to = static_cast<Enum>(from);
  return {};
}

Fault read_level(std::uint8_t from, LevelIndex& to) {
  return read_enum(from, LevelIndex::high, LevelIndex::rigid, "level", to);
}

Fault read_time(std::int64_t from_ns, const char* name, std::int64_t& to_ns) {
  if (from_ns < -kTimeMax_ns || from_ns > kTimeMax_ns) return std::string(name) + ": out of range";
  to_ns = from_ns;
  return {};
}

Fault read(const fb::Hello& in, Hello& out) {
  out.protocol_version = in.protocol_version();
  const std::string_view token = view(in.token());
  if (token.size() > kTokenBytesMax) return "token: longer than " + std::to_string(kTokenBytesMax) + " bytes";
  out.token = token;
  out.session = in.session();
  if (in.secret()) out.secret = from_flatbuffer(*in.secret());
  Fault fault = read_text(in.client_name(), "client name", out.client_name);
  if (fault.empty()) fault = read_text(in.room(), "room", out.room);
  return fault.empty() ? read_enum(in.role(), Role::participant, Role::observer, "role", out.role) : fault;
}

Fault read(const fb::GroomOffer& in, GroomOffer& out) {
  out = {from_flatbuffer(*in.hash()), in.byte_count()};
  return out.byte_count == 0 ? "groom offer: no bytes" : Fault();
}

Fault read(const fb::GroomChunk& in, GroomChunk& out) {
  const std::size_t byte_count = in.bytes()->size();
  if (byte_count == 0 || byte_count > kGroomChunkBytesMax)
    return "groom chunk: " + std::to_string(byte_count) + " bytes, not in [1, " + std::to_string(kGroomChunkBytesMax) +
           ']';
  out.hash = from_flatbuffer(*in.hash());
  out.offset = in.offset();
  from_flatbuffer(*in.bytes(), out.bytes);
  return {};
}

Fault read_state(const fb::HairState& in, HairState& out) {
  const std::size_t count = in.displacements()->size();
  if (count > kHairStateIntegersMax)
    return "hair state: more than " + std::to_string(kHairStateIntegersMax) + " integers";
  if (in.velocities()->size() != 0 && in.velocities()->size() != count) return "hair state: counts differ";
  out.step_m = in.step_m();
  from_flatbuffer(*in.displacements(), out.displacements);
  from_flatbuffer(*in.velocities(), out.velocities);
  return read_enum(in.level(), LevelIndex::high, LevelIndex::ether, "level of a hair state", out.level);
}

Fault read(const fb::AddCharacter& in, AddCharacter& out) {
  out.character = in.character();
  out.groom = from_flatbuffer(*in.groom());
  if (in.state()) {
    if (Fault fault = read_state(*in.state(), out.state.emplace()); !fault.empty()) return fault;
  }
  return read_level(in.level(), out.level);
}

Fault read(const fb::Observe& in, Observe& out) {
  if (in.members()->size() > kMembersPerMessageMax)
    return "observe: more than " + std::to_string(kMembersPerMessageMax) + " members";
  out.count = in.count();
  out.radius_m = in.radius_m();
  if (in.from()) out.from = from_flatbuffer(*in.from());
  from_flatbuffer(*in.members(), out.members);
  out.stride = in.stride();
  out.velocities = in.velocities();
  Fault fault = read_enum(in.mode(), ObserveMode::all, ObserveMode::list, "observe mode", out.mode);
  return fault.empty() ? read_enum(in.error_class(), codec::ErrorClass::quarter_mm, codec::ErrorClass::one_mm,
                                   "error class", out.error_class)
                       : fault;
}

Fault read(const fb::ReportImportance& in, ReportImportance& out) {
  const auto& members = *in.members();
  if (members.size() > kMembersPerMessageMax)
    return "importance: more than " + std::to_string(kMembersPerMessageMax) + " members";
  if (!is_aligned(members)) return "importance: members not aligned";
  out.members.reserve(members.size());
  for (const fb::MemberImportance* m : members) {
    if (!(m->screen_height() >= 0 && m->screen_height() <= kScreenHeightMax))
      return "importance: screen height not in [0, 100]";
    out.members.push_back({m->member(), m->screen_height(), m->in_view()});
  }
  return {};
}

Fault read(const fb::RequestKeyframes& in, RequestKeyframes& out) {
  if (in.members()->size() > kMembersPerMessageMax)
    return "keyframes: more than " + std::to_string(kMembersPerMessageMax) + " members";
  from_flatbuffer(*in.members(), out.members);
  return {};
}

Fault read(const fb::GroomRequest& in, GroomRequest& out) {
  out = {from_flatbuffer(*in.hash()), in.offset()};
  return {};
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

Fault read(const fb::MemberJoined& in, MemberJoined& out) {
  out = {in.member(), in.session(), in.character(), from_flatbuffer(*in.groom())};
  return {};
}

Fault read(const fb::MemberLeft& in, MemberLeft& out) {
  out.member = in.member();
  return {};
}

Fault read(const fb::SetLevel& in, SetLevel& out) {
  out.character = in.character();
  return read_level(in.level(), out.level);
}

Fault read(const fb::RemoveCharacter& in, RemoveCharacter& out) {
  out.character = in.character();
  return {};
}

Fault read(const fb::PoseBatch& in, PoseBatch& out) {
  const auto& poses = *in.poses();
  if (poses.size() > kPosesPerBatchMax)
    return "pose batch: " + std::to_string(poses.size()) + " poses, more than " + std::to_string(kPosesPerBatchMax);
  if (!is_aligned(poses)) return "pose batch: poses not aligned";
  out.poses.reserve(poses.size());
  for (const fb::PoseSample* p : poses) {
    PoseSample& sample = out.poses.emplace_back();
    sample.character = p->character();
    sample.sequence = p->sequence();
    sample.teleport = p->teleport();
    sample.pose = from_flatbuffer(p->bones());
    if (Fault fault = read_time(p->capture_time_ns(), "pose's capture time", sample.capture_time_ns); !fault.empty())
      return fault;
  }
  return {};
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
  out.resume_grace_s = in.resume_grace_s();
  if (!(out.resume_grace_s >= 0 && out.resume_grace_s <= 1e6f)) return "welcome: grace out of range";
  if (Fault fault = read_time(in.pose_delay_ns(), "welcome's pose delay", out.pose_delay_ns); !fault.empty())
    return fault;
  if (Fault fault = read_text(in.room(), "room", out.room); !fault.empty()) return fault;
  const bool sound = out.tick_rate_hz >= 1 && out.tick_rate_hz <= kTickRateMax_hz;
  return sound ? Fault() : "welcome: tick rate not in [1, " + std::to_string(kTickRateMax_hz) + "] Hz";
}

Fault read(const fb::GroomNeed& in, GroomNeed& out) {
  out = {from_flatbuffer(*in.hash()), in.offset()};
  return {};
}

Fault read(const fb::GroomStatus& in, GroomStatus& out) {
  out.hash = from_flatbuffer(*in.hash());
  return read_enum(in.state(), GroomState::queued, GroomState::refused, "groom state", out.state);
}

Fault read(const fb::CharacterAdded& in, CharacterAdded& out) {
  out.character = in.character();
  out.groom = from_flatbuffer(*in.groom());
  out.member = in.member();
  return read_level(in.level(), out.level);
}

Fault read(const fb::CharacterRemoved& in, CharacterRemoved& out) {
  out.character = in.character();
  return {};
}

Fault read_lattice(const fb::LevelRecord& in, Lattice& out) {
  out.origin = from_flatbuffer(*in.origin());
  out.spacing = from_flatbuffer(*in.spacing());
  const std::array<std::uint32_t, 3> dims{in.node_count_x(), in.node_count_y(), in.node_count_z()};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (dims[axis] > kLatticeNodesPerAxisMax)
      return "level record: " + std::to_string(dims[axis]) + " nodes on an axis, more than " +
             std::to_string(kLatticeNodesPerAxisMax);
    out.dims[axis] = static_cast<int>(dims[axis]);
  }
  const float farthest_m = std::max(out.origin.cwiseAbs().maxCoeff(), out.spacing.cwiseAbs().maxCoeff());
  return out.origin.allFinite() && out.spacing.allFinite() && farthest_m <= kLatticeCoordinateMax_m
             ? Fault()
             : "level record: lattice not finite or too large";
}

Fault read(const fb::LevelRecord& in, LevelRecord& out) {
  out.groom = from_flatbuffer(*in.groom());
  if (Fault fault = read_enum(in.level(), LevelIndex::high, LevelIndex::ether, "level of a level record", out.level);
      !fault.empty())
    return fault;
  LevelGeometry& g = out.geometry;
  if (Fault fault = read_lattice(in, g.lattice); !fault.empty()) return fault;
  from_flatbuffer(*in.active_nodes(), g.active_nodes);
  from_flatbuffer(*in.trimmed_nodes(), g.trimmed_nodes);
  from_flatbuffer(*in.trimmed_begin(), g.trimmed_begin);
  from_flatbuffer(*in.trimmed_from(), g.trimmed_from);
  from_flatbuffer(*in.trimmed_weights(), g.trimmed_weights);
  const Fault fault = validate(g);
  return fault.empty() ? fault : "level record: " + fault;
}

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
  std::uint8_t head = 0, reference = 0;
  if (!in.take_varint(step) || !in.take(head) || !in.take(reference) || !in.take_varint(byte_count) ||
      !in.take(byte_count, out.content))
    return "frame batch: ends within a frame";
  if (step == 0 || step > 0xffffffffu - member_before) return "frame batch: members do not ascend";
  out.member = member_before + step;
  if (Fault fault = read_level(head & 7, out.level); !fault.empty()) return fault;
  out.discontinuous = (head & 8) != 0;
  out.asleep = (head & 16) != 0;
  out.velocities = (head & 32) != 0;
  if ((head >> 6) >= codec::kErrorClassCount) return "frame: no such error class";
  out.error_class = static_cast<codec::ErrorClass>(head >> 6);
  out.order = reference & 3;
  const unsigned stride = reference >> 2 & 3u, step_stride = reference >> 4 & 3u;
  if (stride == 3 || step_stride == 3 || reference >> 6 != 0) return "frame: no such stride";
  out.stride = static_cast<std::uint8_t>(1u << stride);
  out.step_stride = static_cast<std::uint8_t>(1u << step_stride);
  return {};
}

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
  out.storage = std::move(storage);
  return {};
}

Fault read(const fb::Error& in, Error& out) {
  out.character = in.character();
  if (in.groom()) out.groom = from_flatbuffer(*in.groom());
  if (Fault fault = read_enum(in.reason(), ErrorReason::malformed, kErrorReasonLast, "error reason", out.reason);
      !fault.empty())
    return fault;
  return read_text(in.detail(), "error detail", out.detail);
}

Fault read(const fb::Goodbye& in, Goodbye& out) {
  if (Fault fault =
          read_enum(in.reason(), GoodbyeReason::client_leaves, kGoodbyeReasonLast, "goodbye reason", out.reason);
      !fault.empty())
    return fault;
  return read_text(in.detail(), "goodbye detail", out.detail);
}

Fault read(const fb::SetMaterial& in, SetMaterial& out) {
  out = {in.character(), from_flatbuffer(*in.scale())};
  return {};
}

Fault read(const fb::SetWind& in, SetWind& out) {
  out.wind = from_flatbuffer(*in.wind());
  return {};
}

Fault read_body(const fb::Envelope& in, Message& out) {
  switch (in.body_type()) {
    case fb::Body::Hello:
      return read(*in.body_as_Hello(), out.emplace<Hello>());
    case fb::Body::GroomOffer:
      return read(*in.body_as_GroomOffer(), out.emplace<GroomOffer>());
    case fb::Body::GroomChunk:
      return read(*in.body_as_GroomChunk(), out.emplace<GroomChunk>());
    case fb::Body::AddCharacter:
      return read(*in.body_as_AddCharacter(), out.emplace<AddCharacter>());
    case fb::Body::SetLevel:
      return read(*in.body_as_SetLevel(), out.emplace<SetLevel>());
    case fb::Body::RemoveCharacter:
      return read(*in.body_as_RemoveCharacter(), out.emplace<RemoveCharacter>());
    case fb::Body::PoseBatch:
      return read(*in.body_as_PoseBatch(), out.emplace<PoseBatch>());
    case fb::Body::Welcome:
      return read(*in.body_as_Welcome(), out.emplace<Welcome>());
    case fb::Body::GroomNeed:
      return read(*in.body_as_GroomNeed(), out.emplace<GroomNeed>());
    case fb::Body::GroomStatus:
      return read(*in.body_as_GroomStatus(), out.emplace<GroomStatus>());
    case fb::Body::CharacterAdded:
      return read(*in.body_as_CharacterAdded(), out.emplace<CharacterAdded>());
    case fb::Body::CharacterRemoved:
      return read(*in.body_as_CharacterRemoved(), out.emplace<CharacterRemoved>());
    case fb::Body::LevelRecord:
      return read(*in.body_as_LevelRecord(), out.emplace<LevelRecord>());
    case fb::Body::FrameBatch:
      return read(*in.body_as_FrameBatch(), out.emplace<FrameBatch>());
    case fb::Body::Error:
      return read(*in.body_as_Error(), out.emplace<Error>());
    case fb::Body::Goodbye:
      return read(*in.body_as_Goodbye(), out.emplace<Goodbye>());
    case fb::Body::SetMaterial:
      return read(*in.body_as_SetMaterial(), out.emplace<SetMaterial>());
    case fb::Body::SetWind:
      return read(*in.body_as_SetWind(), out.emplace<SetWind>());
    case fb::Body::Observe:
      return read(*in.body_as_Observe(), out.emplace<Observe>());
    case fb::Body::ReportImportance:
      return read(*in.body_as_ReportImportance(), out.emplace<ReportImportance>());
    case fb::Body::RequestKeyframes:
      return read(*in.body_as_RequestKeyframes(), out.emplace<RequestKeyframes>());
    case fb::Body::GroomRequest:
      return read(*in.body_as_GroomRequest(), out.emplace<GroomRequest>());
    case fb::Body::GroomData:
      return read(*in.body_as_GroomData(), out.emplace<GroomData>());
    case fb::Body::MemberJoined:
      return read(*in.body_as_MemberJoined(), out.emplace<MemberJoined>());
    case fb::Body::MemberLeft:
      return read(*in.body_as_MemberLeft(), out.emplace<MemberLeft>());
    case fb::Body::NONE:
      break;
  }
  return "no message of a kind that this version knows";
}

DecodedPacket refused(DecodeError error, std::string detail) {
  return {error, std::move(detail), {}};
}

}  // namespace

DecodedPacket decode_packet(std::span<const std::uint8_t> packet) {
  if (packet.size() > kPacketBytesMax)
    return refused(DecodeError::too_large,
                   std::to_string(packet.size()) + " bytes, more than " + std::to_string(kPacketBytesMax));
  const AlignedBytes aligned(packet);
  const auto* root = verified_root<fb::Envelope>(aligned.bytes(), fb::EnvelopeIdentifier());
  if (!root) return refused(DecodeError::malformed, "not a whole and sound packet of this protocol");
  DecodedPacket decoded;
  Fault fault = read_time(root->clock_ns(), "envelope's clock", decoded.envelope.clock_ns);
  if (fault.empty()) fault = read_body(*root, decoded.envelope.message);
  return fault.empty() ? std::move(decoded) : refused(DecodeError::invalid, std::move(fault));
}

}  // namespace hairnet::wire
