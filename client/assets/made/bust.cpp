#include <algorithm>
#include <cmath>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"
#include "client/assets/made/made.hpp"
#include "client/assets/made/surface_nets.hpp"

namespace hairnet {
namespace {

// Planes from `from` to `to`, `fine` apart within [fine_from, fine_to], with spacings that grow smoothly to `coarse`
// outside. Spacings may not change at once: cells of very different size beside each other make thin triangles.
std::vector<double> graded_planes(double from, double to, double fine_from, double fine_to, double fine,
                                  double coarse) {
  std::vector<double> planes{from};
  while (planes.back() < to) {
    const double x = planes.back();
    const double away = std::max({fine_from - x, x - fine_to, 0.0});
    planes.push_back(x + std::min(coarse, fine + 0.2 * away));
  }
  return planes;
}

// The planes are closer over the face, whose features are the smallest. The planes across are mirrored about x = 0, and
// none lies in that plane itself.
made::GridPlanes bust_planes() {
  const std::vector<double> right = graded_planes(0.0016, 0.24, 0, 0.045, 0.0046, 0.0140);
  std::vector<double> across(right.rbegin(), right.rend());
  for (double& x : across) {
    x = -x;
  }
  across.insert(across.end(), right.begin(), right.end());
  return {across, graded_planes(-0.40, 0.17, -0.040, 0.060, 0.0038, 0.0150),
          graded_planes(-0.16, 0.15, -0.03, 0.14, 0.0060, 0.0140)};
}

using BoneWeights = std::array<float, kBoneCount>;

// The bones' shares at a point of the skin. Head and neck separate along a plane that slants from the nape down to the
// throat; the shoulders fade into the trunk towards the breastbone and down the ribs. The first two numbers of each
// smootherstep() are the places, in head space, m, between which a share goes from 0 to 1. They are far apart, because
// a sharp border between bones would fold the skin when the head turns.
BoneWeights weights_at(const Vec3& p) {
  const double head = made::smootherstep(-0.022, 0.022, p.y() + 0.44 * p.z() + 0.052);
  const double trunk = 1 - made::smootherstep(-0.165, -0.095, p.y() + 0.25 * p.z() - 0.35 * std::abs(p.x()));
  const double outward = made::smootherstep(0.035, 0.125, std::abs(p.x()));
  const double upper = made::smootherstep(-0.31, -0.22, p.y() + 0.8 * std::max(0.0, std::abs(p.x()) - 0.10));
  const double below_head = 1 - head;
  const double shoulder = below_head * trunk * outward * upper;
  const double left = p.x() > 0 ? shoulder : 0, right = p.x() > 0 ? 0 : shoulder;
  return {static_cast<float>(head), static_cast<float>(below_head * (1 - trunk)), static_cast<float>(left),
          static_cast<float>(right), static_cast<float>(below_head * trunk - shoulder)};
}

}  // namespace

Body make_bust() {
  Body body;
  body.mesh = made::polygonise(bust_planes(), made::bust_distance);
  body.bone_weights.reserve(body.mesh.vertices.size());
  for (Vec3f& vertex : body.mesh.vertices) {
    // A vertex of a surface net lies inside its cell and not exactly on the surface.
    const Vec3 p = made::onto_skin(vertex.cast<double>());
    vertex = p.cast<float>();
    body.bone_weights.push_back(weights_at(p));
  }
  // The joints are the pivots of the bones in the order of `Bone`. They lie inside the bust, where an adult's lie.
  body.joints = {Vec3f(0, 0, 0), Vec3f(0, -0.125f, -0.030f), Vec3f(0.025f, -0.180f, 0.010f),
                 Vec3f(-0.025f, -0.180f, 0.010f), Vec3f(0, -0.300f, -0.045f)};
  return body;
}

}  // namespace hairnet
