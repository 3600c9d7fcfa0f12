#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/levels/level.hpp"

namespace hairnet {

// A level for the kernels: plain pointers into it, because code that is compiled for several instruction sets must not
// call code that other files compile for one.
struct StiffenerView {
  std::size_t count;
  const std::uint32_t* begin;
  const std::uint16_t* nodes;
  const float *weights, *stiffness, *damping;
  const float* rest;         // xyz xyz …
  const float* rest_length;  // |eps_0|, springs only
};

struct SkinDistanceFieldView {
  std::size_t bone;
  float origin[3], per_cell;
  float cells[3];           // along each axis
  std::int32_t row, layer;  // entries from a node to the next along y, and z
  const float *distance, *limit;
};

struct ContactPointsView {
  std::size_t count;
  const std::uint32_t* begin;
  const std::uint16_t* nodes;
  const float *weights, *rest, *potential;
};

// The stiffeners that act on each node: springs, then attachments, in one numbering.
struct IncidenceView {
  const std::uint32_t* begin;
  const std::uint16_t* stiffeners;
  const float* weights;
};

struct LevelView {
  std::size_t node_count;
  float displacement_max_m;
  const float *rest, *mass, *ether_stiffness, *ether_damping;
  const float* drag;           // xx xy xz yy yz zz of each node
  const float* wind_fraction;  // position in the box as fractions, xyz of each node (LatticeWind); null in still air
  StiffenerView springs, attachments;
  // Only a view that was made for a crowd has incidences.
  IncidenceView incidences;
  const SkinDistanceFieldView* skin;
  std::size_t skin_count;
  ContactPointsView contacts;
  // The most bodies of any member in this step, and the holds, of which a crowd has none.
  std::size_t body_count, hold_count;
};

// The buffers that a view points to. They grow to the largest level seen and are never freed.
struct LevelViewScratch {
  std::vector<float> rest_length, wind_fraction;
  std::vector<SkinDistanceFieldView> skin;
  std::vector<std::uint32_t> incidence_begin;
  std::vector<std::uint16_t> incidence_stiffeners;
  std::vector<float> incidence_weights;
};

struct ViewFor {
  bool wind = false, crowd = false;
  std::size_t bodies = 0, holds = 0;
};

// Valid while `level` exists and until `scratch` is used again. Asserts that the level's counts agree and, with
// HAIRNET_VALIDATE, that its indices are in range.
LevelView make_view(const Level& level, const ViewFor& what_for, LevelViewScratch& scratch);

}  // namespace hairnet
