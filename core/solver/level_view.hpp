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
  // Three numbers for each stiffener, xyz xyz and so on.
  const float* rest;
  // The lengths |eps_0|; null for attachments.
  const float* rest_length;
};

struct SkinDistanceFieldView {
  std::size_t bone;
  // `per_cell` is one over the size of a cell, 1/m.
  float origin[3], per_cell;
  // The number of cells along each axis.
  float cells[3];
  // How many entries of `distance` lie between a node and its neighbour along y, and along z.
  std::int32_t row, layer;
  // The distance of each node of the grid (SkinDistanceField), and of each contact point the limit against this skin
  // (ContactPoints).
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
  // The numbers xx xy xz yy yz zz of each node's drag matrix.
  const float* drag;
  // The position of each node in the box as fractions, xyz (LatticeWind); null in still air.
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
