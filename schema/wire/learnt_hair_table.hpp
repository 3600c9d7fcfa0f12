#pragma once

#include <string>

#include "core/learnt/learnt_hair.hpp"
#include "learnt_generated.h"

namespace hairnet::wire {

// Writes the hair without its LearntWind, which write_wind() writes.
flatbuffers::Offset<fb::LearntHair> write_learnt(flatbuffers::FlatBufferBuilder& to, const LearntHair& hair);
flatbuffers::Offset<fb::LearntWind> write_wind(flatbuffers::FlatBufferBuilder& to, const LearntWind& wind);
// `wind` is null for hair that knows nothing of wind. Returns an empty string, or one line about the error.
std::string read_learnt(const fb::LearntHair& in, const fb::LearntWind* wind, LearntHair& out);

}  // namespace hairnet::wire
