#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/groom/groom.hpp"

namespace hairnet::draw {

// The lines that are drawn for each strand of a head of 350 to 600 pixels: the strand itself and two follow hairs.
inline constexpr float kCopies = 3;

// A groom at rest in head space, as data for the shaders, made once for all its characters: the GPU deforms it, so
// nothing of it is uploaded for a picture (client/shaders). Directions are IEEE halves; transmittances and fractions
// are of 255. The structs are uploaded as they lie in memory.
using Half4 = std::array<std::uint16_t, 4>;
using Byte4 = std::array<std::uint8_t, 4>;

// A vertex of a strand's ribbon. It has no position: the shader reads its point from the texture that StrandDeformPass
// writes, at its own number divided by two.
struct StrandVertex {
  // These are the transmittances from +x -x +y -y, and from +z -z, then the fraction of the strand's length, and 0.
  Byte4 sides, ends;
  // The index of the strand in the order of drawing.
  float strand;
};
// The points of the drawn strands in the order of drawing, for StrandDeformPass. So the first n strands are also the
// first points, and fewer strands need no other buffers.
struct StrandPoints {
  // Each entry is a position at rest, m, and the delta of the root blend (eq. 7).
  std::vector<std::array<float, 4>> rest;
  // These are the length from the root, m, and the number of the point in its strand; the number is 0 where FFD alone
  // places the point.
  std::vector<std::array<float, 2>> arc;
  // The first n strands have the points below end[n]; the list has one entry more than there are strands.
  std::vector<std::uint32_t> end{0};
};
// The points of the strands to draw at one tolerance: indices into the same vertices, so that all tolerances share
// them. Strands are in the order of drawing.
struct SimplifiedStrands {
  // No omitted point is further from the line, m.
  float tolerance_m = 0;
  // Two triangles join each pair of points that stay.
  std::vector<std::uint32_t> triangles;
  // The first n strands have the indices below end[n]; the list has one entry more than there are strands.
  std::vector<std::uint32_t> end;
};
// A point of a HairCard's edge, on its left or on its right. Points come in pairs.
struct CardVertex {
  std::array<float, 4> rest;
  Half4 direction;
  // The first six are as those of strands; then the fraction along the card, and 0 on the left or 255 on the right.
  Byte4 sides, ends;
  // A unit vector from the left to the right point of the pair, then the number of the card, for its random numbers.
  std::array<float, 4> side;
};
// A point of a thread, which the shader widens by `cord`, or of cloth, which has its own width.
struct FabricVertex {
  std::array<float, 4> rest;
  // The normal of cloth or the tangent of a thread, then the derivative of delta by the length, 1/m.
  Half4 direction;
  Byte4 sides, ends;
  // Linear RGB, then the opacity.
  std::array<float, 4> albedo;
  // Half of a thread's width, m, negative on its left; 0 for cloth.
  float cord;
};
// The body is skinned by bones instead of FFD; its five shares sum to 1.
struct BodyVertex {
  std::array<float, 3> rest;
  // The normal, then the share of scalp at the vertex (Scalp::at).
  Half4 normal;
  // The first six are as those of strands; then the share of the fifth bone, and 0.
  Byte4 sides, ends;
  // The shares of the first four bones.
  Byte4 shares;
};
template <class Vertex>
struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> triangles;
};

struct GroomGeometry {
  StrandPoints strand_points;
  // Every point is here twice: for the left and the right of its ribbon, which the vertex shader turns to the camera.
  std::vector<StrandVertex> strand_vertices;
  // The first list has all points, and the last the fewest.
  std::vector<SimplifiedStrands> simplified_strands;
  // The number of drawn strands, including the copies of clumps.
  std::size_t strand_count = 0;
  // The width at the root when all strands and two follow hairs each are drawn.
  float strand_width_m = 0;
  Mesh<CardVertex> cards;
  Mesh<FabricVertex> fabric;
  Mesh<BodyVertex> body;
  // A ball of this radius about the head joint contains body and hair at rest.
  float radius_m = 0;
};

// The radius of a ball about a head's place that contains hair and body however they swing, m. `radius_m` is that of
// GroomGeometry. The ball decides what is outside the picture: a ball that is too small makes hair vanish at the edge.
inline constexpr float kBallShare = 1.3f, kBallMargin_m = 0.1f;
inline float ball_radius_m(float radius_m) {
  return kBallShare * radius_m + kBallMargin_m;
}

// Makes the geometry of a groom, which must pass validate(). It takes a moment: light is traced through the hair, and
// each strand is simplified for all tolerances.
GroomGeometry make_groom_geometry(const Groom& groom);

// The body and about 500 strands of a groom, wider, to show until the geometry of the whole groom is made; none when
// that takes no longer than a moment. It has strands alone: threads, cards and cloths refer to points that it leaves
// out.
std::optional<Groom> coarse_groom(const Groom& groom);

}  // namespace hairnet::draw
