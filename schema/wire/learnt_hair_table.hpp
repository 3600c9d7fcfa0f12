#pragma once

#include <string>

#include "core/learnt/learnt_hair.hpp"
#include "learnt_generated.h"

namespace hairnet::wire {

flatbuffers::Offset<fb::LearntHair> write_learnt(flatbuffers::FlatBufferBuilder& to, const LearntHair& hair);
// Returns an empty string, or one line about the fault.
std::string read_learnt(const fb::LearntHair& in, LearntHair& out);

}  // namespace hairnet::wire
