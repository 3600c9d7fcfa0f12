#pragma once

#include <array>
#include <vector>

#include "core/build/hair_sample.hpp"
#include "core/geometry/mesh_query.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// A piece of the skin that hair may come to.
struct SkinPoint {
  Vec3 point, normal;  // head space at rest, m; the normal points out
  std::array<double, kBoneCount> bone_weights;
  double weight;  // how near it lies to hair: 1 under it, 0 from half the length of a long strand on
};

// The outer skin near the hair as points spread evenly by area. Skin that faces other skin (mouth, eyelids, arms
// against the chest) does not count.
std::vector<SkinPoint> reachable_skin(const Groom& groom, const HairSample& hair, const MeshQuery& skin);

}  // namespace hairnet
