#pragma once

#include <cstdint>
#include <string>

#include "core/world/simulation_inputs.hpp"
#include "recording_generated.h"

// What a recorded tick says of touch. For the sources of this folder alone.
namespace hairnet::wire {

// The vectors of a recorded tick about touch. A vector is null where it would be empty, so ticks without touch have the
// bytes that they had before there was touch.
struct RecordedTouch {
  template <class T>
  using Vector = flatbuffers::Offset<flatbuffers::Vector<T>>;
  Vector<std::uint32_t> owners, chosen;
  Vector<const fb::RecordedRule*> rules;
  Vector<const fb::RecordedRoomBodies*> room_bodies;
  Vector<const fb::RecordedBody*> bodies;
  Vector<const fb::RecordedRelease*> releases;
  Vector<const fb::RecordedGrab*> grabs;
};
RecordedTouch write_touch(flatbuffers::FlatBufferBuilder& to, const SimulationInputs& inputs);

// `out` has the characters that the tick adds. Returns an empty string, or one line about the error.
std::string read_touch(const fb::RecordedTick& in, SimulationInputs& out);

// Returns an empty string when a World can have that room, else one line.
std::string check_room(std::uint32_t room);

}  // namespace hairnet::wire
