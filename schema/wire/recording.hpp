#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "core/gravity.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/result.hpp"
#include "core/world/simulation_inputs.hpp"
#include "schema/wire/messages.hpp"

// A recording of a server: the inputs of its World, tick by tick. Stepping them again gives the same bits. Poses are
// stored as floats: give the World poses that went through rounded_to_wire.
namespace hairnet::wire {

// The numbers of rooms are below this, as the World has no more environments (kEnvironmentCountMax).
inline constexpr std::uint32_t kRecordedRoomCountMax = 65'536;

struct RecordingHeader {
  std::uint32_t tick_rate_hz = 30;
  std::int32_t substep_count = 1;
  // Iterations of conjugate gradient a substep; zero means each level's own (iterations_for).
  std::int32_t iterations = 0;
  std::array<double, 3> gravity{0, -kGravity_m_per_s2, 0};
  // The wind in rooms for which no tick has set another.
  Wind wind;
};
// The file of a groom. It comes before the first tick that uses it.
struct RecordedGroom {
  std::vector<std::uint8_t> bytes;
};
// The learnt hair of a groom. It comes after its groom, and belongs to all levels that characters get from the next
// tick on.
struct RecordedLearnt {
  GroomHash groom{};
  std::shared_ptr<const LearntHair> hair;
};
using RecordedAdd = SimulationInputs::Add;
using RecordedLevel = SimulationInputs::Level;
using RecordedMaterial = SimulationInputs::Material;
using RecordedStride = SimulationInputs::Stride;
using RecordedSuspension = SimulationInputs::Suspension;
using RecordedState = SimulationInputs::State;
using RecordedWind = SimulationInputs::RoomWind;
using RecordedPose = SimulationInputs::BonePose;
struct RecordedTick : SimulationInputs {
  std::uint64_t tick = 0;
  std::int64_t sample_time_ns = 0;
  // World::hash() after the step.
  std::uint64_t state_hash = 0;
};
using RecordEntry = std::variant<RecordingHeader, RecordedGroom, RecordedLearnt, RecordedTick>;

// The entry as bytes, which begin with their size. Keys of characters are unique in the recording: session id << 32 |
// the client's number.
std::vector<std::uint8_t> encode_record_entry(const RecordEntry& entry);
// Takes one entry off the front of `bytes`, which then begins behind it. When the last entry is incomplete, as after a
// crash, the error says so.
Result<RecordEntry> take_record_entry(std::span<const std::uint8_t>& bytes);

}  // namespace hairnet::wire
