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
  // Has three numbers of each stiffener, xyz xyz and so on.
  const float* rest;
  // Has the lengths |eps_0|, which only springs have.
  const float* rest_length;
};

struct SkinDistanceFieldView {
  std::size_t bone;
  // `per_cell` is one over the size of a cell, 1/m.
  float origin[3], per_cell;
  // Counts the cells along each axis.
  float cells[3];
  // Count the entries from a node to the next one along y, and along z.
  std::int32_t row, layer;
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
  // Has the numbers xx xy xz yy yz zz of each node.
  const float* drag;
  // Has the position of each node in the box as fractions, xyz (LatticeWind); null in still air.
  const float* wind_fraction;
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

// What a view is made for: the wind's fractions, the incidences of a crowd, and the most bodies and holds of a member.
struct ViewFor {
  bool wind = false, crowd = false;
  std::size_t bodies = 0, holds = 0;
};

// Valid while `level` exists and until `scratch` is used again. Asserts that the level's counts agree and, with
// HAIRNET_VALIDATE, that its indices are in range.
LevelView make_view(const Level& level, const ViewFor& what_for, LevelViewScratch& scratch);

}  // namespace hairnet
