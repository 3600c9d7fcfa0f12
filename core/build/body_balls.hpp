#pragma once

#include <vector>

#include "core/build/hair_sample.hpp"
#include "core/build/skin_profile.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// A ball that stands for a part of the body (section 3.3), before it is fitted to a lattice's nodes.
struct BodyBall {
  BodyBall(const MeshQuery& skin, Bone of, const Vec3& centre, double radius);

  Bone bone;
  Vec3 centre;          // head space at rest, inside the mesh, m; exact in float
  double radius;        // typical distance from the centre to the skin, m
  SkinProfile profile;  // the skin in every direction
};

// Where the body is solid, the balls that fill it and the hair that they keep out. Const once made.
struct BodyShape {
  MeshQuery skin;
  std::vector<BodyBall> balls;
  HairSample hair;
};

// As many balls, up to kBallCountMost, as lessen the error against the skin that hair can reach: about one for a skull,
// six to ten with shoulders. Ordered by bone. Deterministic.
inline constexpr std::size_t kBallCountMost = 10;
BodyShape place_balls(const Groom& groom);

}  // namespace hairnet
