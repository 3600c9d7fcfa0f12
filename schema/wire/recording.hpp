#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "core/learnt/learnt_hair.hpp"
#include "core/result.hpp"
#include "schema/wire/messages.hpp"

// A recording of a server: the inputs of its World, tick by tick. Stepping them again gives the same bits. Poses are
// stored as floats: give the World poses that went through rounded_to_wire.
namespace hairnet::wire {

// Rooms are numbered below this: the World has no more environments.
inline constexpr std::uint32_t kRecordedRoomCountMax = 65'536;

struct RecordingHeader {
  std::uint32_t tick_rate_hz = 30;
  std::int32_t substep_count = 1;
  std::int32_t iterations = 0;  // 0: each level's own
  std::array<double, 3> gravity{0, -9.81, 0};
  Wind wind;  // of rooms that no tick has given another
};
struct RecordedGroom {
  std::vector<std::uint8_t> bytes;
};  // before the first tick that uses it
struct RecordedLearnt {
  GroomHash groom{};
  std::shared_ptr<const LearntHair> hair;
};  // after its groom; of levels that characters are given from the next tick on
struct RecordedAdd {
  std::uint64_t character = 0;
  GroomHash groom{};
  std::uint32_t room = 0;  // whose wind it stands in
  bool levels_ready = false;
  LevelIndex level = LevelIndex::rigid;
  Pose pose;
};
struct RecordedLevel {
  std::uint64_t character = 0;
  LevelIndex level = LevelIndex::rigid;
};  // from this tick on
struct RecordedMaterial {
  std::uint64_t character = 0;
  MaterialScale scale;
};  // from this tick on
struct RecordedStride {
  std::uint64_t character = 0;
  std::uint8_t stride = 1;
};  // from this tick on
struct RecordedSuspension {
  std::uint64_t character = 0;
  bool suspended = false;
};  // from this tick on
struct RecordedState {
  std::uint64_t character = 0;
  std::vector<Vec3f> displacements, velocities;  // head space, m and m/s, of the level it is on
};
struct RecordedWind {
  std::uint32_t room = 0;
  Wind wind;
};  // from this tick on
struct RecordedPose {
  std::uint64_t character = 0;
  bool teleport = false;
  Pose pose;
};
struct RecordedTick {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;
  std::vector<std::uint64_t> removed;  // applied first, in order; then as they follow here; then the step
  std::vector<RecordedAdd> added;
  std::vector<RecordedLevel> levels;
  std::vector<RecordedMaterial> materials;
  std::vector<RecordedStride> strides;
  std::vector<RecordedSuspension> suspensions;
  std::vector<RecordedState> states;
  std::vector<RecordedWind> winds;
  std::vector<RecordedPose> poses;
  std::uint64_t state_hash = 0;  // World::hash after the step
};
using RecordEntry = std::variant<RecordingHeader, RecordedGroom, RecordedLearnt, RecordedTick>;

// `character` is unique for the recording: session id << 32 | the client's number.
std::vector<std::uint8_t> encode_record_entry(const RecordEntry& entry);  // size-prefixed
// Takes one entry off the front of `bytes`, which then begins behind it. For an incomplete last entry the error says
// so.
Result<RecordEntry> take_record_entry(std::span<const std::uint8_t>& bytes);

}  // namespace hairnet::wire
