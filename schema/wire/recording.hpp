#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "core/learnt/learnt_hair.hpp"
#include "core/result.hpp"
#include "core/world/simulation_inputs.hpp"
#include "schema/wire/messages.hpp"

// A recording of a server: the inputs of its World, tick by tick. Stepping them again gives the same bits. Poses are
// stored as floats: give the World poses that went through rounded_to_wire.
namespace hairnet::wire {

// Rooms are numbered below this: the World has no more environments.
inline constexpr std::uint32_t kRecordedRoomCountMax = 65'536;

struct RecordingHeader {
  std::uint32_t tick_rate_hz = 30;
  std::int32_t substep_count = 1;
  // Zero means each level's own.
  std::int32_t iterations = 0;
  std::array<double, 3> gravity{0, -9.81, 0};
  // Blows in rooms that no tick has given another.
  Wind wind;
};
// Comes before the first tick that uses it.
struct RecordedGroom {
  std::vector<std::uint8_t> bytes;
};
// Comes after its groom. Levels that characters are given from the next tick on have it.
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
  // Is World::hash after the step.
  std::uint64_t state_hash = 0;
};
using RecordEntry = std::variant<RecordingHeader, RecordedGroom, RecordedLearnt, RecordedTick>;

// `character` is unique for the recording: session id << 32 | the client's number.
// The result begins with its size.
std::vector<std::uint8_t> encode_record_entry(const RecordEntry& entry);
// Takes one entry off the front of `bytes`, which then begins behind it. For an incomplete last entry the error says
// so.
Result<RecordEntry> take_record_entry(std::span<const std::uint8_t>& bytes);

}  // namespace hairnet::wire
