#include "core/groom/body.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"
#include "core/smoothstep.hpp"

namespace hairnet {

void generate_bone_weights(Body& body) {
  const Vec3 head_joint = body.joint(Bone::head), neck_joint = body.joint(Bone::neck);
  // The limits keep the slopes below finite for joints that coincide.
  const double neck_m = std::max(head_joint.y() - neck_joint.y(), 0.02);
  const double shoulder_y = 0.5 * (body.joint(Bone::left_shoulder).y() + body.joint(Bone::right_shoulder).y());
  const double shoulder_m =
      std::max(0.5 * (body.joint(Bone::left_shoulder).x() - body.joint(Bone::right_shoulder).x()), 0.01);

  HAIRNET_ASSERT(neck_m > 0);
  HAIRNET_ASSERT(shoulder_m > 0);
  body.bone_weights.clear();
  body.bone_weights.reserve(body.mesh.vertices.size());
  for (const Vec3f& vertex : body.mesh.vertices) {
    const Vec3 p = vertex.cast<double>();
    // The head ends at a plane that slants from the nape down to the throat, the neck where the shoulders rise.
    const double slanted = p.y() - head_joint.y() + 0.45 * (p.z() - head_joint.z()) + 0.5 * neck_m;
    const double head = smoothstep(-0.25 * neck_m, 0.25 * neck_m, slanted);
    const double trunk =
        (1 - head) * (1 - smoothstep(-0.35 * neck_m, 0.35 * neck_m, p.y() - neck_joint.y() - 0.35 * std::abs(p.x())));
    // Shoulders fade into the trunk towards the breastbone and down the ribs.
    const double shoulder = trunk * smoothstep(shoulder_m, shoulder_m + 0.10, std::abs(p.x())) *
                            smoothstep(shoulder_y - 0.16, shoulder_y - 0.06, p.y());
    const double left = p.x() > 0 ? shoulder : 0;
    body.bone_weights.push_back({static_cast<float>(head), static_cast<float>(1 - head - trunk),
                                 static_cast<float>(left), static_cast<float>(shoulder - left),
                                 static_cast<float>(trunk - shoulder)});
  }
  HAIRNET_ASSERT(body.bone_weights.size() == body.mesh.vertices.size());
}

void skin_vertices(const Body& body, const Pose& pose, std::vector<Vec3f>& out) {
  HAIRNET_ASSERT(body.bone_weights.size() == body.mesh.vertices.size());
  HAIRNET_VALIDATE(is_valid(pose));
  std::array<Eigen::Matrix<double, 3, 4>, kBoneCount> bones;
  for (std::size_t b = 0; b < kBoneCount; ++b)
    bones[b] << pose.bones[b].rotation.toRotationMatrix(), pose.bones[b].position;
  out.resize(body.mesh.vertices.size());
  for (std::size_t v = 0; v < out.size(); ++v) {
    Eigen::Matrix<double, 3, 4> blend = Eigen::Matrix<double, 3, 4>::Zero();
    for (std::size_t b = 0; b < kBoneCount; ++b) blend += static_cast<double>(body.bone_weights[v][b]) * bones[b];
    // Linear blend skinning averages the matrices and not the rotations.
    out[v] = (blend * body.mesh.vertices[v].cast<double>().homogeneous()).cast<float>();
  }
}

}  // namespace hairnet
