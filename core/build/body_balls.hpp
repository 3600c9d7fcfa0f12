#pragma once

#include <vector>

#include "core/geometry/mesh_query.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// A ball that stands for a part of the body (section 3.3), before it is fitted to a lattice's nodes.
struct BodyBall {
  Bone bone = Bone::head;
  Vec3 centre = Vec3::Zero();  // head space at rest, inside the mesh, m
  double radius = 0;           // typical distance from the centre to the skin, m
};

// Where the body is solid, and the balls that fill it. Const once made.
struct BodyShape {
  MeshQuery skin;
  std::vector<BodyBall> balls;
};

// Places balls inside each bone's part of the body: two in the head, one in the neck and in each shoulder, two in the
// upper trunk, less where the mesh has no such part. Only what hair can reach counts: a whole body's legs get none.
// Deterministic.
BodyShape place_balls(const Groom& groom);

}  // namespace hairnet
