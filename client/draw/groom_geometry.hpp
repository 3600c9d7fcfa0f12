#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet::draw {

inline constexpr float kCopies = 3;  // a strand and its follow hairs, as a rule

// A groom at rest in head space, as data for the shaders: made once, for all its characters (client/shaders).
// Directions are IEEE halves; transmittances and fractions are of 255.
using Half4 = std::array<std::uint16_t, 4>;
using Byte4 = std::array<std::uint8_t, 4>;

struct StrandVertex {
  Byte4 sides, ends;  // transmittance from +x -x +y -y; +z -z, fraction of the strand's length, 0
  float strand;       // its index in the order of drawing
};
// The points of the drawn strands, in the order of drawing, for StrandDeformPass.
struct StrandPoints {
  std::vector<std::array<float, 4>> rest;  // m; delta
  // length from the root, m; number in its strand, 0 where FFD alone places the point
  std::vector<std::array<float, 2>> arc;
  std::vector<std::uint32_t> end{0};  // the first n strands have the points below end[n]; strand count + 1 entries
};
// The points of the strands to draw. Strands are in the order of drawing.
struct SimplifiedStrands {
  float tolerance_m = 0;                 // no omitted point is further from the line
  std::vector<std::uint32_t> triangles;  // two for each segment
  std::vector<std::uint32_t> end;        // the first n strands have the indices below end[n]; strand count + 1 entries
};
struct CardVertex {
  std::array<float, 4> rest;
  Half4 direction;
  Byte4 sides, ends;          // like those of strands; fraction along; 0 left, 255 right
  std::array<float, 4> side;  // unit, left to right; number of the card
};
struct FabricVertex {
  std::array<float, 4> rest;
  Half4 direction;  // cloth: normal; thread: tangent; d delta / ds
  Byte4 sides, ends;
  std::array<float, 4> albedo;  // linear RGB; opacity
  float cord;                   // half of a thread's width, m, negative on its left; 0: cloth
};
struct BodyVertex {
  std::array<float, 3> rest;
  Half4 normal;       // share of scalp at the vertex
  Byte4 sides, ends;  // +z -z, share of the fifth bone, 0
  Byte4 shares;       // the first four bones'
};
template <class Vertex>
struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> triangles;
};

struct GroomGeometry {
  StrandPoints strand_points;
  // Every point is here twice: for the left and the right of its ribbon.
  std::vector<StrandVertex> strand_vertices;
  // The first has all points, and the last few.
  std::vector<SimplifiedStrands> simplified_strands;
  // Counts drawn strands, including the copies of clumps.
  std::size_t strand_count = 0;
  // Is the width at the root when all strands and two follow hairs each are drawn.
  float strand_width_m = 0;
  Mesh<CardVertex> cards;
  Mesh<FabricVertex> fabric;
  Mesh<BodyVertex> body;
  // A ball of this radius about the head joint contains body and hair at rest.
  float radius_m = 0;
};

// The radius of a ball about a head's place that contains hair and body however they swing, m. `radius_m`: of
// GroomGeometry.
inline constexpr float kBallShare = 1.3f, kBallMargin_m = 0.1f;
inline float ball_radius_m(float radius_m) {
  return kBallShare * radius_m + kBallMargin_m;
}

// `groom` must pass validate().
GroomGeometry make_groom_geometry(const Groom& groom);

// The body and about 500 strands of a groom, wider, to show until the geometry of the whole groom is made; nothing when
// that takes no longer than a moment. Strands are alone in it, as all other parts point into points that it leaves out.
std::optional<Groom> coarse_groom(const Groom& groom);

}  // namespace hairnet::draw
