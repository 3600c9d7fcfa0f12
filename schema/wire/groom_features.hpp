#pragma once

#include <string>

#include "core/groom/groom.hpp"
#include "groom_generated.h"

// The parts of a groom file that are neither strands nor body. For groom_file.cpp alone.
namespace hairnet::wire {

struct FlatFeatures {
  template <class T>
  using Vector = flatbuffers::Offset<flatbuffers::Vector<T>>;
  Vector<std::uint16_t> root_blend_counts;
  Vector<float> root_blend_points;
  Vector<const fb::Clump*> clumps;
  Vector<const fb::Thread*> threads;
  Vector<const fb::HairCard*> cards;
  Vector<const fb::Cloth*> cloths;
  Vector<std::uint8_t> cloth_triangle_planes;
  Vector<float> cloth_root_distances;
  Vector<const fb::Knot*> knots;
  Vector<std::uint8_t> knot_point_planes;
};

// Features that a groom lacks are absent from the buffer.
FlatFeatures write_features(flatbuffers::FlatBufferBuilder& to, const Groom& groom);
void add_features(const FlatFeatures& features, fb::GroomBuilder& table);

// Empty when the counts agree; else one line. `out` has its strands already.
std::string read_features(const fb::Groom& in, Groom& out);

}  // namespace hairnet::wire
