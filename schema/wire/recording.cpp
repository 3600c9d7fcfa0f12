#include "schema/wire/recording.hpp"

#include <algorithm>
#include <cmath>

#include "core/world/world.hpp"
#include "recording_generated.h"
#include "schema/wire/flatbuffer_convert.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_hair_table.hpp"
#include "schema/wire/recorded_touch.hpp"

namespace hairnet::wire {
namespace {

// The only version that a reader takes, since a replay is useful only where it gives the same bits.
constexpr std::uint16_t kRecordingVersion = 7;
// These limits keep a damaged header from making a World that computes for hours, or asserts.
constexpr std::int32_t kSubstepCountMax = 64;
constexpr std::int32_t kIterationsMax = 10'000;
constexpr double kAccelerationMax = 1000;  // m/s^2
// The largest entry is a groom with its envelope. A size prefix that says more is damaged.
constexpr std::size_t kEntryBytesMax = kGroomBytesMax + 4096;

using flatbuffers::FlatBufferBuilder;
using flatbuffers::Offset;

// The body of an entry: its kind, and where the builder has written it.
struct Body {
  fb::RecordBody type;
  Offset<void> offset;
};

template <class Table>
Body body(Offset<Table> table) {
  return {fb::RecordBodyTraits<Table>::enum_value, table.Union()};
}

Body write(FlatBufferBuilder& to, const RecordingHeader& e) {
  const Wind& w = e.wind;
  // Gravity and the mean wind are doubles in the World: floats would change the bits of a replay.
  const fb::Vec3d gravity(e.gravity[0], e.gravity[1], e.gravity[2]);
  const fb::Vec3d mean(w.mean_m_per_s.x(), w.mean_m_per_s.y(), w.mean_m_per_s.z());
  return body(fb::CreateRecordedHeader(to, kRecordingVersion, e.tick_rate_hz, e.substep_count, e.iterations, &gravity,
                                       &mean, w.gust_ratio, w.gust_period_s, w.turbulence_rms_m_per_s,
                                       w.turbulence_scale_m, w.seed, w.carried));
}

Body write(FlatBufferBuilder& to, const RecordedGroom& e) {
  return body(fb::CreateRecordedGroomDirect(to, &e.bytes));
}

Body write(FlatBufferBuilder& to, const RecordedLearnt& e) {
  HAIRNET_ASSERT(e.hair);
  const auto hair = write_learnt(to, *e.hair);
  const auto wind = write_wind(to, e.hair->wind);
  const fb::Hash groom = to_flatbuffer(e.groom);
  return body(fb::CreateRecordedLearnt(to, &groom, hair, wind));
}

// Vec3f is three floats without gaps, so the vectors are copied as one block.
Offset<flatbuffers::Vector<float>> write_vectors(FlatBufferBuilder& to, const std::vector<Vec3f>& vectors) {
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  return to.CreateVector(vectors.empty() ? nullptr : vectors.front().data(), 3 * vectors.size());
}

Body write(FlatBufferBuilder& to, const RecordedTick& e) {
  std::vector<fb::RecordedAdd> added;
  for (const RecordedAdd& a : e.added)
    added.emplace_back(a.character, to_flatbuffer(a.groom), to_flatbuffer(a.pose), a.room,
                       static_cast<fb::LevelIndex>(a.level), a.levels_ready);
  std::vector<fb::RecordedLevel> levels;
  for (const RecordedLevel& l : e.levels) levels.emplace_back(l.character, static_cast<fb::LevelIndex>(l.level));
  std::vector<fb::RecordedMaterial> materials;
  for (const RecordedMaterial& m : e.materials) materials.emplace_back(m.character, to_flatbuffer(m.scale));
  std::vector<fb::RecordedWind> winds;
  // The flag has a list of its own, since the fields of a FlatBuffers struct can never change.
  std::vector<std::uint8_t> winds_carried;
  for (const RecordedWind& w : e.winds) {
    winds.emplace_back(to_flatbuffer(w.wind), w.room);
    winds_carried.push_back(w.wind.carried);
  }
  std::vector<fb::RecordedStride> strides;
  for (const RecordedStride& s : e.strides) strides.emplace_back(s.character, s.stride);
  std::vector<fb::RecordedSuspension> suspensions;
  for (const RecordedSuspension& h : e.suspensions) suspensions.emplace_back(h.character, h.suspended);
  // Structs cannot hold vectors, so the nodes of all states lie in two common vectors, and each state says how many are
  // its own.
  std::vector<fb::RecordedState> states;
  std::vector<Vec3f> displacements, velocities;
  for (const RecordedState& s : e.states) {
    HAIRNET_ASSERT(s.displacements.size() == s.velocities.size());
    states.emplace_back(s.character, static_cast<std::uint32_t>(s.displacements.size()));
    displacements.insert(displacements.end(), s.displacements.begin(), s.displacements.end());
    velocities.insert(velocities.end(), s.velocities.begin(), s.velocities.end());
  }
  std::vector<fb::RecordedPose> poses;
  poses.reserve(e.poses.size());
  for (const RecordedPose& p : e.poses) poses.emplace_back(p.character, to_flatbuffer(p.pose), p.teleport);
  const auto removed_at = to.CreateVector(e.removed);
  const auto added_at = to.CreateVectorOfStructs(added);
  const auto levels_at = to.CreateVectorOfStructs(levels);
  const auto poses_at = to.CreateVectorOfStructs(poses);
  const auto materials_at = to.CreateVectorOfStructs(materials);
  const auto winds_at = to.CreateVectorOfStructs(winds);
  const auto strides_at = to.CreateVectorOfStructs(strides);
  const auto suspensions_at = to.CreateVectorOfStructs(suspensions);
  const auto states_at = to.CreateVectorOfStructs(states);
  const auto displacements_at = write_vectors(to, displacements);
  const auto velocities_at = write_vectors(to, velocities);
  // Most ticks have no new wind, and no list.
  const auto carried_at = winds_carried.empty() ? 0 : to.CreateVector(winds_carried);
  const RecordedTouch touch = write_touch(to, e);
  return body(fb::CreateRecordedTick(to, e.tick, e.sample_time_ns, e.state_hash, removed_at, added_at, levels_at,
                                     poses_at, materials_at, winds_at, strides_at, suspensions_at, states_at,
                                     displacements_at, velocities_at, carried_at, touch.owners, touch.rules,
                                     touch.chosen, touch.room_bodies, touch.bodies, touch.releases, touch.grabs));
}

// Copies gravity. False when a component is not finite or too large.
bool copy_vector(const fb::Vec3d& from, std::array<double, 3>& to) {
  // The negated comparison also refuses what is not a number.
  to = {from.x(), from.y(), from.z()};
  for (const double x : to) {
    if (!(std::abs(x) <= kAccelerationMax)) return false;
  }
  return true;
}

std::string read(const fb::RecordedHeader& in, RecordingHeader& out) {
  // The version is judged first, as the other fields may mean something else in another one.
  if (in.version() != kRecordingVersion)
    return "recording of version " + std::to_string(in.version()) + ", not " + std::to_string(kRecordingVersion);
  out.tick_rate_hz = in.tick_rate_hz();
  out.substep_count = in.substep_count();
  out.iterations = in.iterations();
  if (out.tick_rate_hz < 1 || out.tick_rate_hz > kTickRateMax_hz) return "header: tick rate out of range";
  if (out.substep_count < 1 || out.substep_count > kSubstepCountMax) return "header: substeps out of range";
  if (out.iterations < 0 || out.iterations > kIterationsMax) return "header: iterations out of range";
  if (!copy_vector(*in.gravity(), out.gravity)) return "header: gravity not finite or too strong";
  out.wind = {{in.wind()->x(), in.wind()->y(), in.wind()->z()},
              in.gust_ratio(),
              in.gust_period_s(),
              in.turbulence_rms_m_per_s(),
              in.turbulence_scale_m(),
              in.wind_seed(),
              in.wind_carried()};
  const std::string error = validate(out.wind);
  return error.empty() ? error : "header: " + error;
}

std::string read(const fb::RecordedGroom& in, RecordedGroom& out) {
  // The file is decoded by the replay, which knows the limits for grooms.
  from_flatbuffer(*in.bytes(), out.bytes);
  return {};
}

std::string read(const fb::RecordedLearnt& in, RecordedLearnt& out) {
  out.groom = from_flatbuffer(*in.groom());
  auto hair = std::make_shared<LearntHair>();
  std::string error = read_learnt(*in.hair(), in.wind(), *hair);
  out.hair = std::move(hair);
  return error;
}

std::string read_pose(const fb::Bones& from, Pose& to) {
  to = from_flatbuffer(from);
  // The World asserts what is validated here: a damaged recording must end the replay by an error.
  const PoseRefusal refusal = validate_pose(to);
  return refusal == PoseRefusal::none ? std::string() : std::string("pose: ") + to_string(refusal);
}

std::string read(const fb::RecordedAdd& in, RecordedAdd& out) {
  out.character = in.character();
  out.groom = from_flatbuffer(in.groom());
  out.room = in.room();
  out.levels_ready = in.levels_ready();
  std::string error = read_enum(in.level(), "level", out.level);
  if (error.empty()) error = check_room(out.room);
  return error.empty() ? read_pose(in.bones(), out.pose) : error;
}

std::string read(const fb::RecordedLevel& in, RecordedLevel& out) {
  out.character = in.character();
  return read_enum(in.level(), "level", out.level);
}

std::string read(const fb::RecordedMaterial& in, RecordedMaterial& out) {
  out = {in.character(), from_flatbuffer(in.scale())};
  return validate(out.scale);
}

std::string read(const fb::RecordedStride& in, RecordedStride& out) {
  out = {in.character(), in.stride()};
  return is_stride(out.stride) ? std::string() : "stride is not 1, 2 or 4";
}

std::string read(const fb::RecordedSuspension& in, RecordedSuspension& out) {
  out = {in.character(), in.suspended()};
  return {};
}

std::string read(const fb::RecordedWind& in, RecordedWind& out) {
  out = {in.room(), from_flatbuffer(in.wind(), false)};
  std::string error = check_room(out.room);
  return error.empty() ? validate(out.wind) : error;
}

std::string read_vectors(const flatbuffers::Vector<float>& in, std::vector<Vec3f>& out) {
  if (in.size() % 3 != 0) return "state: not 3 numbers a node";
  from_flatbuffer(in, out);
  const bool finite = std::all_of(out.begin(), out.end(), [](const Vec3f& v) { return v.allFinite(); });
  return finite ? std::string() : "state: not finite";
}

std::string read_states(const fb::RecordedTick& in, std::vector<RecordedState>& out) {
  const auto& states = *in.states();
  if (!is_aligned(states)) return "states not aligned";
  std::vector<Vec3f> displacements, velocities;
  std::string error = read_vectors(*in.state_displacements(), displacements);
  if (error.empty()) error = read_vectors(*in.state_velocities(), velocities);
  if (!error.empty()) return error;
  std::uint64_t node_count = 0;
  for (const fb::RecordedState* state : states) node_count += state->node_count();
  // The counts are summed in 64 bits, so a forged sum cannot wrap to the right number.
  if (node_count != displacements.size() || node_count != velocities.size()) return "states: counts differ";
  std::ptrdiff_t first = 0;
  for (const fb::RecordedState* state : states) {
    const std::ptrdiff_t last = first + static_cast<std::ptrdiff_t>(state->node_count());
    out.push_back({state->character(),
                   {displacements.begin() + first, displacements.begin() + last},
                   {velocities.begin() + first, velocities.begin() + last}});
    first = last;
  }
  HAIRNET_ASSERT(static_cast<std::size_t>(first) == displacements.size());
  return {};
}

std::string read(const fb::RecordedPose& in, RecordedPose& out) {
  out.character = in.character();
  out.teleport = in.teleport();
  return read_pose(in.bones(), out.pose);
}

template <class Struct, class Plain>
std::string read_all(const flatbuffers::Vector<const Struct*>& in, std::vector<Plain>& out) {
  if (!is_aligned(in)) return "entries not aligned";
  // The verifier has checked that so many entries lie in the buffer, so a forged count takes no memory.
  out.reserve(in.size());
  for (const Struct* entry : in) {
    if (std::string error = read(*entry, out.emplace_back()); !error.empty()) return error;
  }
  return {};
}

std::string read(const fb::RecordedTick& in, RecordedTick& out) {
  out.tick = in.tick();
  out.sample_time_ns = in.sample_time_ns();
  out.state_hash = in.state_hash();
  // Whether characters exist is not checked here, where only one tick is known.
  from_flatbuffer(*in.removed(), out.removed);
  std::string error = read_all(*in.added(), out.added);
  if (error.empty()) error = read_all(*in.levels(), out.levels);
  if (error.empty()) error = read_all(*in.materials(), out.materials);
  if (error.empty()) error = read_all(*in.strides(), out.strides);
  if (error.empty()) error = read_all(*in.suspensions(), out.suspensions);
  if (error.empty()) error = read_all(*in.winds(), out.winds);
  if (error.empty() && in.winds_carried()) {
    if (in.winds_carried()->size() != out.winds.size()) error = "winds and what is carried differ in number";
    for (std::size_t i = 0; error.empty() && i < out.winds.size(); ++i)
      out.winds[i].wind.carried = in.winds_carried()->Get(static_cast<flatbuffers::uoffset_t>(i)) != 0;
  }
  if (error.empty()) error = read_states(in, out.states);
  if (error.empty()) error = read_all(*in.poses(), out.poses);
  if (error.empty()) error = read_touch(in, out);
  // The tick in front tells a person where in the recording to look.
  return error.empty() ? error : "tick " + std::to_string(out.tick) + ": " + error;
}

std::string read_body(const fb::RecordEntry& in, RecordEntry& out) {
  switch (in.body_type()) {
    case fb::RecordBody::RecordedHeader:
      return read(*in.body_as_RecordedHeader(), out.emplace<RecordingHeader>());
    case fb::RecordBody::RecordedGroom:
      return read(*in.body_as_RecordedGroom(), out.emplace<RecordedGroom>());
    case fb::RecordBody::RecordedLearnt:
      return read(*in.body_as_RecordedLearnt(), out.emplace<RecordedLearnt>());
    case fb::RecordBody::RecordedTick:
      return read(*in.body_as_RecordedTick(), out.emplace<RecordedTick>());
    case fb::RecordBody::NONE:
      break;
  }
  return "an entry of a kind that this version does not know";
}

}  // namespace

std::vector<std::uint8_t> encode_record_entry(const RecordEntry& entry) {
  const auto* groom = std::get_if<RecordedGroom>(&entry);
  // A groom is the only large entry; the builder would double its memory several times to reach it.
  FlatBufferBuilder builder(4096 + (groom ? groom->bytes.size() : 0));
  const Body written = std::visit([&](const auto& e) { return write(builder, e); }, entry);
  return finish(builder, fb::CreateRecordEntry(builder, written.type, written.offset), fb::RecordEntryIdentifier());
}

Result<RecordEntry> take_record_entry(std::span<const std::uint8_t>& bytes) {
  constexpr std::size_t prefix_bytes = sizeof(std::uint32_t);
  std::uint32_t counted = 0;
  if (bytes.size() >= prefix_bytes) std::memcpy(&counted, bytes.data(), prefix_bytes);
  const std::size_t entry_bytes = prefix_bytes + counted;
  // The size is judged before the rest is waited for: a file that is no recording shows by its first bytes.
  if (entry_bytes > kEntryBytesMax)
    return Refusal("not a recording, or a damaged one: an entry of " + std::to_string(entry_bytes) + " bytes");
  // A server that dies leaves a last entry that is not whole. The error names it, so that a reader can keep all ticks
  // before.
  if (bytes.size() < prefix_bytes || bytes.size() < entry_bytes)
    return Refusal("incomplete last entry: the recording ends " + std::to_string(bytes.size()) + " bytes into it");
  const AlignedBytes aligned(bytes.first(entry_bytes));
  const auto* root = verified_root<fb::RecordEntry>(aligned.bytes(), fb::RecordEntryIdentifier());
  if (!root) return Refusal("not a recording, or a damaged one: an entry is not valid");
  RecordEntry entry;
  if (std::string error = read_body(*root, entry); !error.empty()) return Refusal(std::move(error));
  // Each entry takes some bytes, so the caller's loop ends.
  HAIRNET_ASSERT(entry_bytes >= kPacketBytesMin);
  bytes = bytes.subspan(entry_bytes);
  return entry;
}

}  // namespace hairnet::wire
