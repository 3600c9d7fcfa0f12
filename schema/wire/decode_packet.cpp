#include <cmath>

#include "core/ffd/lattice.hpp"
#include "envelope_generated.h"
#include "schema/wire/flat.hpp"
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
  return read_text(in.client_name(), "client name", out.client_name);
}

Fault read(const fb::GroomOffer& in, GroomOffer& out) {
  out = {copy_out(*in.hash()), in.byte_count()};
  return out.byte_count == 0 ? "groom offer: no bytes" : Fault();
}

Fault read(const fb::GroomChunk& in, GroomChunk& out) {
  const std::size_t byte_count = in.bytes()->size();
  if (byte_count == 0 || byte_count > kGroomChunkBytesMax)
    return "groom chunk: " + std::to_string(byte_count) + " bytes, not in [1, " + std::to_string(kGroomChunkBytesMax) +
           ']';
  out.hash = copy_out(*in.hash());
  out.offset = in.offset();
  copy_out(*in.bytes(), out.bytes);
  return {};
}

Fault read(const fb::AddCharacter& in, AddCharacter& out) {
  out.character = in.character();
  out.groom = copy_out(*in.groom());
  return read_level(in.level(), out.level);
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
    sample.pose = copy_out(p->bones());
    if (Fault fault = read_time(p->capture_time_ns(), "pose's capture time", sample.capture_time_ns); !fault.empty())
      return fault;
  }
  return {};
}

Fault read(const fb::Welcome& in, Welcome& out) {
  out = {in.protocol_version(),    in.session(),        in.tick_rate_hz(), in.tick(),
         in.character_count_max(), in.groom_bytes_max()};
  const bool sound = out.tick_rate_hz >= 1 && out.tick_rate_hz <= kTickRateMax_hz;
  return sound ? Fault() : "welcome: tick rate not in [1, " + std::to_string(kTickRateMax_hz) + "] Hz";
}

Fault read(const fb::GroomNeed& in, GroomNeed& out) {
  out = {copy_out(*in.hash()), in.offset()};
  return {};
}

Fault read(const fb::GroomStatus& in, GroomStatus& out) {
  out.hash = copy_out(*in.hash());
  return read_enum(in.state(), GroomState::queued, GroomState::refused, "groom state", out.state);
}

Fault read(const fb::CharacterAdded& in, CharacterAdded& out) {
  out.character = in.character();
  out.groom = copy_out(*in.groom());
  return read_level(in.level(), out.level);
}

Fault read(const fb::CharacterRemoved& in, CharacterRemoved& out) {
  out.character = in.character();
  return {};
}

Fault read_lattice(const fb::LevelRecord& in, Lattice& out) {
  out.origin = copy_out(*in.origin());
  out.spacing = copy_out(*in.spacing());
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
  out.groom = copy_out(*in.groom());
  if (Fault fault = read_enum(in.level(), LevelIndex::high, LevelIndex::ether, "level of a level record", out.level);
      !fault.empty())
    return fault;
  LevelGeometry& g = out.geometry;
  if (Fault fault = read_lattice(in, g.lattice); !fault.empty()) return fault;
  copy_out(*in.active_nodes(), g.active_nodes);
  copy_out(*in.trimmed_nodes(), g.trimmed_nodes);
  copy_out(*in.trimmed_begin(), g.trimmed_begin);
  copy_out(*in.trimmed_from(), g.trimmed_from);
  copy_out(*in.trimmed_weights(), g.trimmed_weights);
  const Fault fault = validate(g);
  return fault.empty() ? fault : "level record: " + fault;
}

// `nodes` holds at least the bytes the header announces.
Fault read_frame(const fb::FrameHeader& in, const std::uint8_t* nodes, Frame& out) {
  if (Fault fault = read_level(in.level(), out.level); !fault.empty()) return fault;
  out.character = in.character();
  out.discontinuous = in.discontinuous();
  out.asleep = in.asleep();
  out.quantum_m = in.quantum_m();
  out.pose = copy_out(in.bones());
  if (const PoseRefusal refusal = validate_pose(out.pose); refusal != PoseRefusal::none)
    return std::string("frame's pose: ") + to_string(refusal);
  const std::size_t node_count = in.node_count();
  const float quantum_least_m = node_count == 0 ? 0 : kQuantumMin_m;
  if (!(out.quantum_m >= quantum_least_m && out.quantum_m <= kQuantumMax_m)) return "frame: quantum out of range";
  if (node_count == 0) return {};
  if (out.level == LevelIndex::rigid) return "frame: rigid, yet with nodes";
  out.displacements.resize(3 * node_count);
  std::memcpy(out.displacements.data(), nodes, node_count * kNodeBytes);
  return {};
}

Fault read(const fb::FrameBatch& in, FrameBatch& out) {
  out.tick = in.tick();
  if (Fault fault = read_time(in.sample_time_ns(), "frames' sample time", out.sample_time_ns); !fault.empty())
    return fault;
  const auto& frames = *in.frames();
  if (!is_aligned(frames)) return "frame batch: frames not aligned";
  std::uint64_t byte_count = 0;
  for (const fb::FrameHeader* f : frames) byte_count += std::uint64_t{f->node_count()} * kNodeBytes;
  if (byte_count != in.nodes()->size()) return "frame batch: node counts and node bytes disagree";
  out.frames.reserve(frames.size());
  const std::uint8_t* nodes = in.nodes()->Data();
  for (const fb::FrameHeader* f : frames) {
    if (Fault fault = read_frame(*f, nodes, out.frames.emplace_back()); !fault.empty()) return fault;
    nodes += f->node_count() * kNodeBytes;
  }
  return {};
}

Fault read(const fb::Error& in, Error& out) {
  out.character = in.character();
  if (in.groom()) out.groom = copy_out(*in.groom());
  if (Fault fault =
          read_enum(in.reason(), ErrorReason::malformed, ErrorReason::pose_invalid, "error reason", out.reason);
      !fault.empty())
    return fault;
  return read_text(in.detail(), "error detail", out.detail);
}

Fault read(const fb::Goodbye& in, Goodbye& out) {
  if (Fault fault =
          read_enum(in.reason(), GoodbyeReason::client_leaves, GoodbyeReason::over_rate, "goodbye reason", out.reason);
      !fault.empty())
    return fault;
  return read_text(in.detail(), "goodbye detail", out.detail);
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
    case fb::Body::NONE:
      break;
  }
  return "no message of a kind that this version knows";
}

Decoded refused(DecodeError error, std::string detail) {
  return {error, std::move(detail), {}};
}

}  // namespace

Decoded decode_packet(std::span<const std::uint8_t> packet) {
  if (packet.size() > kPacketBytesMax)
    return refused(DecodeError::too_large,
                   std::to_string(packet.size()) + " bytes, more than " + std::to_string(kPacketBytesMax));
  const AlignedBytes aligned(packet);
  const auto* root = verified_root<fb::Envelope>(aligned.bytes(), fb::EnvelopeIdentifier());
  if (!root) return refused(DecodeError::malformed, "not a whole and sound packet of this protocol");
  Decoded decoded;
  Fault fault = read_time(root->clock_ns(), "envelope's clock", decoded.envelope.clock_ns);
  if (fault.empty()) fault = read_body(*root, decoded.envelope.message);
  return fault.empty() ? std::move(decoded) : refused(DecodeError::invalid, std::move(fault));
}

}  // namespace hairnet::wire
