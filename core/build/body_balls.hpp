#pragma once

#include <vector>
#include <cstdlib>

#include "core/build/hair_clearance.hpp"
#include "core/geometry/mesh_query.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// A ball that stands for a part of the body (section 3.3), before it is fitted to a lattice's nodes.
struct BodyBall {
  Bone bone = Bone::head;
  Vec3 centre = Vec3::Zero();  // head space at rest, inside the mesh, m
  double radius = 0;           // typical distance from the centre to the skin, m
};

// A ball reaches skin between these shares of its radius from its centre.
inline double env2(const char* n, double d) { const char* v = std::getenv(n); return v ? std::atof(v) : d; }
inline const double kRadiusRatioLeast = env2("HN_RL",0.7), kRadiusRatioMost = env2("HN_RM",1.4);

// Where the body is solid, and the balls that fill it. Const once made.
struct BodyShape {
  MeshQuery skin;
  std::vector<BodyBall> balls;
  HairSample hair;                               // what the balls keep off the skin
  std::vector<std::vector<double>> clearance_m;  // of each ball, each point of `hair`: how far it may go in
};

// Places balls inside each bone's part of the body: two in the head, one in the neck and in each shoulder, two in the
// upper trunk, less where the mesh has no such part. Only what hair can reach counts: a whole body's legs get none.
// Deterministic.
BodyShape place_balls(const Groom& groom);

}  // namespace hairnet
