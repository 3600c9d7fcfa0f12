#pragma once

#include <array>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"
#include "core/pose/pose.hpp"

namespace hairnet {

// The skull and body that a groom was made on, in head space at rest.
struct Body {
  // The surface, m. It is empty only in an unfinished groom.
  TriangleMesh mesh;
  // The weights of the bones at each vertex: each is at least 0, and they sum to 1.
  std::vector<std::array<float, kBoneCount>> bone_weights;
  // The pivot of each bone, in the order of Bone, head space at rest, m.
  std::array<Vec3f, kBoneCount> joints{Vec3f(0, 0, 0), Vec3f(0, -0.10f, -0.02f), Vec3f(0.03f, -0.16f, -0.01f),
                                       Vec3f(-0.03f, -0.16f, -0.01f), Vec3f(0, -0.25f, -0.04f)};
  // Whether no mesh was given, so that the skull is an ellipsoid fitted to the roots.
  bool fitted_from_roots = false;

  [[nodiscard]] Vec3 joint(Bone bone) const { return joints[static_cast<std::size_t>(bone)].cast<double>(); }
};

// Computes smooth bone weights from the vertices' positions about the joints, for a mesh without weights.
void generate_bone_weights(Body& body);

// Linear blend skinning: world positions of the vertices. `out` has one entry per vertex.
void skin_vertices(const Body& body, const Pose& pose, std::vector<Vec3f>& out);

}  // namespace hairnet
